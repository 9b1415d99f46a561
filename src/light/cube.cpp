#include "light/cube.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"

namespace lodestone {

glm::vec3 cube_direction(uint32_t face, const glm::vec2& place) {
    const float a = place.x, b = place.y;
    switch (face) {
        case 0:
            return {1, -b, -a};
        case 1:
            return {-1, -b, a};
        case 2:
            return {a, 1, b};
        case 3:
            return {a, -1, -b};
        case 4:
            return {a, -b, 1};
        default:
            return {-a, -b, -1};
    }
}

CubePlace cube_place(const glm::vec3& d) {
    const glm::vec3 size = glm::abs(d);
    if (size.z >= size.x && size.z >= size.y)
        return {d.z < 0 ? 5u : 4u, glm::vec2(d.z < 0 ? -d.x : d.x, -d.y) / size.z};
    if (size.y >= size.x) return {d.y < 0 ? 3u : 2u, glm::vec2(d.x, d.y < 0 ? -d.z : d.z) / size.y};
    return {d.x < 0 ? 1u : 0u, glm::vec2(d.x < 0 ? d.z : -d.z, -d.y) / size.x};
}

RadianceCube::RadianceCube(uint32_t side, std::vector<glm::vec3> texels) : side_(side) {
    LODE_CHECK(std::has_single_bit(side) && texels.size() == size_t{cube_faces} * side * side, side, texels.size());
    Level finest{side, std::vector<glm::vec3>(size_t{cube_faces} * (side + 2) * (side + 2))};
    for (uint32_t face = 0; face < cube_faces; ++face) {
        for (uint32_t y = 0; y < side; ++y) {
            for (uint32_t x = 0; x < side; ++x)
                finest.at(face, x + 1, y + 1) = texels[(size_t{face} * side + y) * side + x];
        }
    }
    fill_rims(finest);
    levels_.push_back(std::move(finest));
    while (levels_.back().side > 1) levels_.push_back(halved(levels_.back()));
}

const glm::vec3& RadianceCube::at(size_t level, uint32_t face, uint32_t x, uint32_t y) const {
    return levels_[level].at(face, x + 1, y + 1);
}

// A texel beyond an edge is the texel of the face beside that lies in its direction.
void RadianceCube::fill_rims(Level& level) {
    const uint32_t last = level.side + 1;
    const auto fill = [&](uint32_t face, uint32_t x, uint32_t y) {
        const glm::vec2 at = (2.0f * glm::vec2(x, y) - 1.0f) / static_cast<float>(level.side) - 1.0f;
        const CubePlace other = cube_place(cube_direction(face, at));
        const glm::vec2 texel = (other.place * 0.5f + 0.5f) * static_cast<float>(level.side);
        const auto number = [&](float n) {
            return std::min(static_cast<uint32_t>(std::max(n, 0.0f)), level.side - 1) + 1;
        };
        level.at(face, x, y) = level.at(other.face, number(texel.x), number(texel.y));
    };
    for (uint32_t face = 0; face < cube_faces; ++face) {
        for (uint32_t k = 0; k <= last; ++k) {
            fill(face, k, 0);
            fill(face, k, last);
            fill(face, 0, k);
            fill(face, last, k);
        }
    }
}

RadianceCube::Level RadianceCube::halved(const Level& finer) {
    const uint32_t side = finer.side / 2;
    Level level{side, std::vector<glm::vec3>(size_t{cube_faces} * (side + 2) * (side + 2))};
    for (uint32_t face = 0; face < cube_faces; ++face) {
        for (uint32_t y = 1; y <= side; ++y) {
            for (uint32_t x = 1; x <= side; ++x) {
                level.at(face, x, y) =
                    0.25f * (finer.at(face, 2 * x - 1, 2 * y - 1) + finer.at(face, 2 * x, 2 * y - 1) +
                             finer.at(face, 2 * x - 1, 2 * y) + finer.at(face, 2 * x, 2 * y));
            }
        }
    }
    fill_rims(level);
    return level;
}

glm::vec3 RadianceCube::bilinear(const Level& level, const CubePlace& place) {
    const auto side = static_cast<float>(level.side);
    const glm::vec2 at = glm::clamp((place.place * 0.5f + 0.5f) * side + 0.5f, 0.0f, side + 0.999f);
    const auto x = static_cast<uint32_t>(at.x), y = static_cast<uint32_t>(at.y);
    const glm::vec2 f = at - glm::vec2(x, y);
    return glm::mix(glm::mix(level.at(place.face, x, y), level.at(place.face, x + 1, y), f.x),
                    glm::mix(level.at(place.face, x, y + 1), level.at(place.face, x + 1, y + 1), f.x), f.y);
}

glm::vec3 RadianceCube::looked_up(const glm::vec3& direction, float level) const {
    const CubePlace place = cube_place(direction);
    const auto finer = std::min(static_cast<size_t>(level), levels_.size() - 1);
    const float f = level - static_cast<float>(finer);
    const glm::vec3 fine = bilinear(levels_[finer], place);
    if (f <= 0 || finer + 1 == levels_.size()) return fine;
    return glm::mix(fine, bilinear(levels_[finer + 1], place), f);
}

}  // namespace lodestone
