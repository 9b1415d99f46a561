// The reference of volumes: the same particles, looks and camera, marched on the CPU in double precision straight from
// the definition of the primitives. It has no lattice, no voxels and no bricks, and shares no code with src/volume but
// the descriptions it is given.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "frame/view.h"
#include "render/renderer.h"
#include "volume/noise_cube.h"
#include "volume/particles.h"

namespace lodestone {

class AnalyticVolume {
public:
    // step: world units between samples, along rays and towards the light. density: factor of all.
    AnalyticVolume(std::vector<volume::Emitter> emitters, double time, const ShadingOptions& look, double step);

    struct Point {
        double density = 0;                    // per world unit
        glm::dvec3 scattered{0}, sent_out{0};  // times density
    };
    Point at(const glm::dvec3& place) const;
    // Share of the light that reaches a place, by colour.
    glm::dvec3 light_at(const glm::dvec3& place) const;
    struct Ray {
        glm::dvec3 light{0};
        double through = 1;
    };
    // From the eye through the middle of a pixel, as far as `depth` of view depth.
    Ray march(const View& view, uint32_t x, uint32_t y, double depth) const;

    double forward = 0.5;  // VolumeOptions::forward
    bool lit = true;       // false: nothing shadows anything, which is quicker

private:
    double noise(const glm::dvec3& direction) const;
    // Where the ray may meet a particle.
    bool span_of(const glm::dvec3& from, const glm::dvec3& along, double& begin, double& end) const;

    std::vector<volume::Emitter> emitters_;
    std::vector<volume::Particle> particles_;
    volume::NoiseCube cube_;
    ShadingOptions look_;
    double step_;
};

}  // namespace lodestone
