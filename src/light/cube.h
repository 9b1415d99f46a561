// Directions and the faces of a cube around the eye, in Vulkan's order (Vulkan 1.3 specification, "Cube map face
// selection"), and a cube of radiance that is looked up filtered.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace lodestone {

inline constexpr uint32_t cube_faces = 6;

// Of any length. place: on the face, -1 .. 1, across and down.
glm::vec3 cube_direction(uint32_t face, const glm::vec2& place);

struct CubePlace {
    uint32_t face;
    glm::vec2 place;  // -1 .. 1, across and down
};
// Where a direction, of any length above 0, meets the cube.
CubePlace cube_place(const glm::vec3& direction);

// The middle of a texel of a face with `side` texels a side, -1 .. 1.
inline glm::vec2 texel_place(uint32_t x, uint32_t y, uint32_t side) {
    return (2.0f * glm::vec2(x, y) + 1.0f) / static_cast<float>(side) - 1.0f;
}

// Radiance on a cube, with coarser levels that hold means of four texels. Faces go on beyond their edges with what the
// faces beside them hold, so nothing jumps there.
class RadianceCube {
public:
    // texels: face after face, rows top to bottom. side: a power of two.
    RadianceCube(uint32_t side, std::vector<glm::vec3> texels);
    uint32_t side() const { return side_; }
    size_t levels() const { return levels_.size(); }
    const glm::vec3& at(size_t level, uint32_t face, uint32_t x, uint32_t y) const;
    // Bilinear within levels, linear between them. level: 0 and more.
    glm::vec3 looked_up(const glm::vec3& direction, float level) const;

private:
    struct Level {
        uint32_t side;
        std::vector<glm::vec3> texels;                          // with a rim of one texel around each face
        glm::vec3& at(uint32_t face, uint32_t x, uint32_t y) {  // from the rim on
            return texels[(size_t{face} * (side + 2) + y) * (side + 2) + x];
        }
        const glm::vec3& at(uint32_t face, uint32_t x, uint32_t y) const {
            return texels[(size_t{face} * (side + 2) + y) * (side + 2) + x];
        }
    };
    static void fill_rims(Level& level);
    static Level halved(const Level& finer);
    static glm::vec3 bilinear(const Level& level, const CubePlace& place);

    uint32_t side_;
    std::vector<Level> levels_;
};

}  // namespace lodestone
