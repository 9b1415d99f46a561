// Materials as glTF has them, for all that write it.
#pragma once

#include <glm/mat3x2.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/json.h"
#include "base/looks/material.h"

namespace lodestone {

// What a document gets for its materials. Images are its own to add, in the order of the mesh.
struct MaterialJson {
    Json materials = Json::array();    // one per material
    Json textures = Json::array();     // one per image and wrap; may be empty, which a document must not have
    Json samplers = Json::array();     // likewise
    std::set<std::string> extensions;  // used; a reader may do without
};

// The texture coordinates that a document has.
struct WrittenTexcoords {
    // Times (u, v, 1) of a coordinate of the document it is that of the mesh; nothing where the document has none.
    std::optional<glm::dmat3x2> first;
    bool second = false;  // whether it has the second set, as it is in the mesh
};

// Textures on a set that the document has not are left out, and those that unwritable_textures() names.
MaterialJson material_json(std::span<const Material> table, const WrittenTexcoords& texcoords);

// A line for each texture whose place is not a scale, a turn and an offset: glTF cannot say it.
std::vector<std::string> unwritable_textures(std::span<const Material> table);

// Adds the textures, the samplers and the materials to a document.
void add_to_document(Json& document, MaterialJson made);

}  // namespace lodestone
