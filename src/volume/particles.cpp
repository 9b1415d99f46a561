#include "volume/particles.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/random.h"
#include "volume/grids/placed_grid.h"

namespace lodestone::volume {

namespace {

// Uniform in the unit ball.
glm::vec3 in_ball(Random& random) {
    const double z = random.uniform(-1, 1), angle = random.uniform(0, 6.283185307179586);
    const double length = std::cbrt(random.unit()), side = std::sqrt(1 - z * z) * length;
    return {side * std::cos(angle), side * std::sin(angle), z * length};
}

glm::vec3 path(const Emitter& e, double age) {
    const auto t = static_cast<float>(age);
    return e.position + e.velocity * t + e.acceleration * (0.5f * t * t);
}

float radius_at(const Emitter& e, double share) {
    return static_cast<float>(std::lerp(double{e.radius_from}, double{e.radius_to}, share));
}

Particle particle_of(const Emitter& e, uint32_t number, double time) {
    // Births are spread evenly over a lifetime; every life is another particle.
    const double born = e.lifetime * (number + 0.5) / e.particles;
    const double lives = std::floor((time - born) / e.lifetime);
    const double age = std::clamp(time - born - lives * e.lifetime, 0.0, double{e.lifetime});
    Random random(mix64(e.seed ^ mix64(uint64_t{number} << 40 ^ static_cast<uint64_t>(static_cast<int64_t>(lives)))));
    Particle p;
    const glm::vec3 place = e.spread * in_ball(random), drift = e.velocity_spread * in_ball(random);
    p.centre = path(e, age) + place + drift * static_cast<float>(age);
    const double share = age / e.lifetime;
    p.age = static_cast<float>(share);
    p.radius = radius_at(e, share);
    p.displacement = e.displacement;
    glm::vec3 axis = in_ball(random);
    axis = glm::length(axis) > 1e-3f ? glm::normalize(axis) : glm::vec3(0, 1, 0);
    const double turn = random.uniform(0, 6.283185307179586) + random.uniform(-1, 1) * double{e.turning} * age;
    p.to_noise = glm::angleAxis(static_cast<float>(std::fmod(turn, 6.283185307179586)), axis);
    const double near_end = std::min(share, 1 - share);
    p.density = e.fade > 0 ? static_cast<float>(std::min(near_end / double{e.fade}, 1.0)) : 1;
    return p;
}

// Corner k of the box, in voxel space, beyond which the grid is 0.
glm::vec3 corner_of(const DensityGrid& grid, int k) {
    const glm::vec3 low = glm::vec3(grid.first) - 1.0f, high = glm::vec3(grid.last) + 1.0f;
    return {(k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y, (k & 4) != 0 ? high.z : low.z};
}

// A ball around the grid's box.
Particle particle_of_grid(const Emitter& e) {
    Particle p;
    p.grid = std::make_shared<const PlacedGrid>(PlacedGrid{e.grid, voxel_to_world(e)});
    const auto place = [&](int k) { return glm::vec3(p.grid->voxel_to_world * glm::vec4(corner_of(*e.grid, k), 1)); };
    p.centre = 0.5f * (place(0) + place(7));
    for (int k = 0; k < 8; ++k) p.radius = std::max(p.radius, glm::distance(place(k), p.centre));
    return p;
}

}  // namespace

glm::mat4 voxel_to_world(const Emitter& e) {
    LODE_CHECK(e.grid != nullptr && e.grid_scale > 0, e.grid_scale);
    glm::mat4 placed = glm::mat4_cast(e.grid_turn) * e.grid_scale;
    placed[3] = glm::vec4(e.position, 1);
    return placed * e.grid->voxel_to_object;
}

std::vector<Particle> particles_at(const std::vector<Emitter>& emitters, double time) {
    std::vector<Particle> all;
    for (uint32_t e = 0; e < emitters.size(); ++e) {
        LODE_CHECK(emitters[e].particles > 0 && emitters[e].lifetime > 0, emitters[e].particles, emitters[e].lifetime);
        const uint32_t count = emitters[e].grid ? 1 : emitters[e].particles;
        for (uint32_t i = 0; i < count; ++i) {
            all.push_back(emitters[e].grid ? particle_of_grid(emitters[e]) : particle_of(emitters[e], i, time));
            all.back().emitter = e;
        }
    }
    return all;
}

Bounds bounds_of(const Emitter& e, const glm::mat3& turned) {
    constexpr int pieces = 64;  // of a life
    Bounds bounds{glm::vec3(INFINITY), glm::vec3(-INFINITY)};
    if (e.grid) {
        const glm::mat4 to_box = glm::mat4(turned) * voxel_to_world(e);
        for (int k = 0; k < 8; ++k) {
            const glm::vec3 corner(to_box * glm::vec4(corner_of(*e.grid, k), 1));
            bounds.low = glm::min(bounds.low, corner);
            bounds.high = glm::max(bounds.high, corner);
        }
        return bounds;
    }
    for (int i = 0; i < pieces; ++i) {
        // Within a piece the path stays as near to its chord as a parabola does.
        const double from = e.lifetime * static_cast<double>(i) / pieces, to = e.lifetime * (i + 1.0) / pieces;
        const auto length = static_cast<float>(to - from);
        const float bend = glm::length(e.acceleration) * length * length / 8;
        const float reach = e.spread + e.velocity_spread * static_cast<float>(to) + bend +
                            std::max(radius_at(e, from / e.lifetime), radius_at(e, to / e.lifetime));
        for (const double age : {from, to}) {
            const glm::vec3 centre = turned * path(e, age);
            bounds.low = glm::min(bounds.low, centre - reach);
            bounds.high = glm::max(bounds.high, centre + reach);
        }
    }
    return bounds;
}

}  // namespace lodestone::volume
