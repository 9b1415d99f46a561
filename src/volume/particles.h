// Particles: spheres with radial displacement that emitters send out. Where each is and how large follows from the time
// alone, so any frame can be drawn without those before it.
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "volume/grids/density_grid.h"
#include "volume/look.h"

namespace lodestone::volume {

struct PlacedGrid;

// Sends out particles one after the other, for ever. A particle moves along
//   place of birth + velocity * age + acceleration * age^2 / 2
// with a velocity that differs from particle to particle, grows, turns, and fades in and out.
// Or it is a density grid, which stands there at all times. Then of the members only position, look, and those of grids
// count, and particles is 1.
struct Emitter {
    glm::vec3 position{0};           // world units
    float spread = 0.1f;             // places of birth lie in a ball of this radius, world units, >= 0
    glm::vec3 velocity{0, 0.5f, 0};  // world units per second
    float velocity_spread = 0.1f;    // velocities differ from it by at most this, >= 0
    glm::vec3 acceleration{0};       // world units per second squared
    uint32_t particles = 24;         // at a time, 1 .. 4096
    float lifetime = 4;              // seconds, > 0
    float radius_from = 0.1f;        // at birth, world units, > 0
    float radius_to = 0.4f;          // in the end, > 0
    float displacement = 0.5f;       // share of the radius that noise takes away at most, 0 .. 0.9
    float turning = 0.5f;            // radians per second at most
    float fade = 0.25f;              // share of the lifetime in which it appears, and again disappears, 0 .. 0.5
    uint64_t seed = 1;               // of everything that differs from particle to particle
    Look look = smoke_look();
    std::shared_ptr<const DensityGrid> grid;  // in place of particles
    float grid_scale = 1;                     // world units for one of the grid's object space, > 0
    glm::quat grid_turn{1, 0, 0, 0};          // of its object space, about the origin; then it is moved by position
    bool operator==(const Emitter&) const = default;
};

// A primitive at a time. A place is inside iff it is nearer to the centre than radius * (1 - displacement * noise),
// noise taken in that direction as seen from the turned particle.
struct Particle {
    glm::vec3 centre{0};                     // world units
    float radius = 0;                        // that noise takes away from
    float displacement = 0;                  // as in Emitter
    glm::quat to_noise{1, 0, 0, 0};          // from world space to that of the noise
    float age = 0;                           // 0 .. 1 of the lifetime
    float density = 1;                       // factor of the look's
    uint32_t emitter = 0;                    // whose look it has
    std::shared_ptr<const PlacedGrid> grid;  // it is that, and the ball lies around it; none for most
};

// All particles of the emitters at a time (seconds, any), emitter after emitter.
std::vector<Particle> particles_at(const std::vector<Emitter>& emitters, double time);

// A box in a space that is turned against the world.
struct Bounds {
    glm::vec3 low{0}, high{0};
};
// Where its grid stands. Affine. The emitter has one.
glm::mat4 voxel_to_world(const Emitter& emitter);
// Contains every particle of an emitter at any time. turned: rows are the axes of the box in world space.
Bounds bounds_of(const Emitter& emitter, const glm::mat3& turned);

}  // namespace lodestone::volume
