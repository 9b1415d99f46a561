// What textures of the source say of its surface, for the atlas to hold in their place: by chart and place, not by
// texture coordinates. Factors of materials are not in it: they stay in the material.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "mesh/textures/tangent_frame.h"
#include "mesh/textures/texture_lookup.h"
#include "mesh/tri_mesh.h"
#include "vgi/asset/leaves/leaves.h"

namespace lodestone::vgi {

// An atlas keeps one set of texture coordinates at most: textures on two sets are baked, whatever options say.
inline bool must_bake_textures(const TriMesh& mesh) { return use_second_set(mesh.material_table); }

class BakedLooks {
public:
    // The mesh must outlive this; normals: per wedge.
    BakedLooks(const TriMesh& mesh, std::span<const glm::vec3> normals);

    // Whether any material has a texture of the kind.
    AtlasAttributes attributes() const;
    // Of textures, as far as a triangle uses them, parts of texels included: those of its material's finest.
    double texels(uint32_t triangle) const;

    // What is at a place of a triangle of the source. place: weights of its corners 1 and 2. share: what a sample
    // stands for, as a share of twice the triangle's area. Sets colour, surface, emission and normal where textures say
    // something of them.
    void put(uint32_t triangle, const glm::dvec2& place, double share, TexelAttributes& is) const;

private:
    // By what textures of a set are looked up.
    struct Place {
        glm::dvec2 uv{0};
        double uv_per_sample = 0;  // area in the plane of texture coordinates that a sample stands for
    };
    using Places = std::array<Place, 2>;
    struct LookedUp {
        const MippedImage* image;
        const Texture* texture;
    };
    const Material& material_of(uint32_t triangle) const;
    std::optional<LookedUp> texture_of(const Texture& texture, Texels texels) const;
    static glm::vec4 at(const LookedUp& from, const Places& places);
    // Of a map, at weights of a triangle's corners.
    TangentFrame frame_at(uint32_t triangle, const std::array<double, 3>& weights, const Texture& map,
                          const glm::dvec3& normal) const;

    const TriMesh& mesh_;
    const std::span<const glm::vec3> normals_;
    // Per material: most texels that a texture of it has for texture coordinates 0 .. 1, of the first set and the
    // second.
    std::vector<std::array<double, 2>> finest_;
    std::vector<std::optional<MippedImage>> colours_, numbers_;  // per image, where some texture means it so
};

// Samples of borders that are one place of the surface get the mean of what the charts there have, in linear light
// where that is a colour, so that nothing jumps where charts meet on a seam of the source's texture. So do normals of
// maps, but not on edges of the surface. Samples of different materials stay what they are.
void agree_on_borders(Atlas& atlas);

}  // namespace lodestone::vgi
