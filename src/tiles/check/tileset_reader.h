// Reads a tileset's JSON, those it refers to included, for checks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone::tiles {

struct ReadTile {
    uint32_t parent = ~0u;           // ~0 of the first
    std::vector<uint32_t> children;  // the root of a tileset that it refers to among them
    double geometric_error = 0;      // in its own frame
    // From lengths in its frame to the root's: the largest factor of each transform on the way, as the specification
    // has it for geometric errors.
    double scale = 1;
    glm::dmat4 box{1};              // columns: half axes, and the centre; in the tile's own frame
    bool has_box = false;           // its volume is a box
    glm::dmat4 transform{1};        // from the tile's frame to its parent's
    std::filesystem::path content;  // of a glb; empty where it has none
    bool refers = false;            // its content is a tileset
    uint32_t level = 0;             // as its extras say
    uint64_t closing_triangles = 0;
    double source_error = 0;
    std::optional<bool> open;  // of a root: whether the surface ends somewhere, where its tileset says so
    std::string place;         // for messages: file and uri
};

// Tiles of one surface: all below one that has a content, in one frame.
struct ReadTileset {
    std::vector<ReadTile> tiles;  // parents before children; the first is the root
    std::vector<uint32_t> parts;  // roots of surfaces: tiles with content whose parent has none, or another frame
    uint32_t files = 0;           // tilesets read
    uint64_t json_bytes = 0;
    double geometric_error = 0;  // of the whole
    std::string generator;
};

// path: of a tileset.json, or the folder that holds one. Fault::format names file and place: what is no JSON, lacks
// what 3D Tiles 1.1 asks for, holds numbers that are none, refers to files that are not there, outside its folder or
// to itself.
Result<ReadTileset> read_tileset(const std::filesystem::path& path);

}  // namespace lodestone::tiles
