#include "light/prefilter.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <numbers>

#include "base/check.h"
#include "base/threads.h"
#include "light/cube.h"
#include "light/lobe.h"
#include "light/reflected_shares.h"
#include "shaders/shared/materials.h"

namespace lodestone {

namespace {

constexpr uint32_t roughness_levels = 8;  // of a cube
constexpr uint32_t lobe_points = 128;
constexpr uint32_t across = 64, down = 32;  // of the shares
constexpr float brightest = 65000;          // of half floats

// Calls body(face, x, y, number) for every texel of a cube.
template <class Body>
void for_each_texel(uint32_t side, Body&& body) {
    parallel_for(size_t{cube_faces} * side, 4, [&](size_t begin, size_t end) {
        for (size_t row = begin; row < end; ++row) {
            for (uint32_t x = 0; x < side; ++x) {
                body(static_cast<uint32_t>(row / side), x, static_cast<uint32_t>(row % side), row * side + x);
            }
        }
    });
}

RadianceCube seen_cube(const Radiance& radiance, uint32_t points, uint32_t side) {
    std::vector<glm::vec3> texels(size_t{cube_faces} * side * side);
    for_each_texel(side, [&](uint32_t face, uint32_t x, uint32_t y, size_t number) {
        glm::vec3 sum(0);
        for (uint32_t p = 0; p < points * points; ++p) {
            const glm::vec2 place = texel_place(x * points + p % points, y * points + p / points, side * points);
            sum += radiance(glm::normalize(cube_direction(face, place)));
        }
        texels[number] = glm::clamp(sum / static_cast<float>(points * points), 0.0f, brightest);
    });
    return {side, std::move(texels)};
}

// A direction that a lobe about (0, 0, 1) sends light from.
struct LobeDirection {
    glm::vec3 towards;
    float weight, level;  // what is not shadowed; of the cube, as coarse as its neighbours are far
};

// Of a lobe seen straight on: Karis takes all of them for that.
std::vector<LobeDirection> lobe_of(float roughness, uint32_t side) {
    const float alpha = alpha_of(roughness), a2 = alpha * alpha;
    const float texel =
        4 * std::numbers::pi_v<float> / (static_cast<float>(cube_faces) * static_cast<float>(side * side));
    std::vector<LobeDirection> lobe;
    for (uint32_t i = 0; i < lobe_points; ++i) {
        const glm::vec3 half = half_vector(even_point(i, lobe_points), alpha);
        const glm::vec3 towards = 2 * half.z * half - glm::vec3(0, 0, 1);
        if (towards.z <= 0) continue;
        const float d = half.z * half.z * (a2 - 1) + 1;
        const float density = a2 / (std::numbers::pi_v<float> * d * d) / 4;
        const float apart = 1 / (static_cast<float>(lobe_points) * density);
        const float shadowed = std::sqrt(towards.z * towards.z * (1 - a2) + a2);
        lobe.push_back(
            {towards, 2 * towards.z / (towards.z + shadowed), std::max(0.0f, 0.5f * std::log2(apart / texel))});
    }
    return lobe;
}

glm::vec3 mirrored(const RadianceCube& cube, const std::vector<LobeDirection>& lobe, const glm::vec3& normal) {
    const glm::vec3 other = std::abs(normal.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    const glm::vec3 first = glm::normalize(glm::cross(other, normal)), second = glm::cross(normal, first);
    glm::vec3 sum(0);
    float weights = 0;
    for (const LobeDirection& l : lobe) {
        const glm::vec3 towards = l.towards.x * first + l.towards.y * second + l.towards.z * normal;
        sum += l.weight * cube.looked_up(towards, l.level);
        weights += l.weight;
    }
    return sum / weights;
}

std::vector<std::vector<uint64_t>> mirrored_levels(const RadianceCube& cube) {
    std::vector<std::vector<uint64_t>> levels;
    for (uint32_t k = 0; k < roughness_levels; ++k) {
        const uint32_t side = cube.side() >> k;
        const float share = static_cast<float>(k) / (roughness_levels - 1);
        const auto lobe = lobe_of(std::pow(share, static_cast<float>(LODE_LEVELS_BY_ROUGHNESS)), cube.side());
        std::vector<uint64_t>& level = levels.emplace_back(size_t{cube_faces} * side * side);
        for_each_texel(side, [&](uint32_t face, uint32_t x, uint32_t y, size_t number) {
            const glm::vec3 towards = glm::normalize(cube_direction(face, texel_place(x, y, side)));
            const glm::vec3 light = k == 0 ? cube.at(0, face, x, y) : mirrored(cube, lobe, towards);
            level[number] = glm::packHalf4x16(glm::vec4(light, 1));
        });
    }
    return levels;
}

// Real spherical harmonics up to the second degree, as Environment::matte takes them, and their factors.
std::array<float, 9> harmonics(const glm::vec3& n) {
    return {1, n.y, n.z, n.x, n.x * n.y, n.y * n.z, 3 * n.z * n.z - 1, n.x * n.z, n.x * n.x - n.y * n.y};
}
constexpr std::array<float, 9> harmonic_factors = {0.282095f, 0.488603f, 0.488603f, 0.488603f, 1.092548f,
                                                   1.092548f, 0.315392f, 1.092548f, 0.546274f};
// What a cosine leaves of each, over pi.
constexpr std::array<float, 9> cosine_shares = {1, 2.f / 3, 2.f / 3, 2.f / 3, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f};

std::array<glm::vec4, 9> matte_of(const RadianceCube& cube) {
    const size_t level = std::min<size_t>(3, cube.levels() - 1);
    const uint32_t side = cube.side() >> level;
    std::array<glm::dvec3, 9> sums{};
    double whole = 0;
    for (uint32_t i = 0; i < cube_faces * side * side; ++i) {
        const uint32_t face = i / (side * side), x = i % side, y = i / side % side;
        const glm::vec3 direction = cube_direction(face, texel_place(x, y, side));
        const double angle = std::pow(static_cast<double>(glm::dot(direction, direction)), -1.5);
        const auto basis = harmonics(glm::normalize(direction));
        for (size_t k = 0; k < basis.size(); ++k)
            sums[k] += angle * static_cast<double>(basis[k]) * glm::dvec3(cube.at(level, face, x, y));
        whole += angle;
    }
    std::array<glm::vec4, 9> matte{};
    for (size_t k = 0; k < matte.size(); ++k) {
        const double factor = static_cast<double>(harmonic_factors[k] * harmonic_factors[k] * cosine_shares[k]);
        matte[k] = glm::vec4(sums[k] * (4 * std::numbers::pi / whole * factor), 0);
    }
    return matte;
}

}  // namespace

Environment make_environment(const Radiance& radiance, uint32_t points, uint32_t side) {
    LODE_CHECK(points > 0 && side >> (roughness_levels - 1) > 0, points, side);
    const RadianceCube cube = seen_cube(radiance, points, side);
    Environment made;
    made.side = side;
    made.levels = mirrored_levels(cube);
    made.matte = matte_of(cube);
    made.shares_across = across;
    made.shares_down = down;
    made.shares.resize(size_t{across} * down);
    parallel_for(made.shares.size(), 64, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const size_t row = i / across, column = i % across;
            made.shares[i] = glm::packHalf4x16(
                reflected_shares(static_cast<float>(column) / (across - 1), static_cast<float>(row) / (down - 1)));
        }
    });
    return made;
}

}  // namespace lodestone
