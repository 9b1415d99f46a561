// Points spread evenly over a square, and half vectors spread as GGX spreads them.
//
//   Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "shaders/shared/materials.h"

namespace lodestone {

// Of GGX, for a roughness 0 .. 1.
inline float alpha_of(float roughness) {
    const float r = std::max(roughness, static_cast<float>(LODE_SMOOTHEST));
    return r * r;
}

// Number i of Hammersley's `count` points.
inline glm::vec2 even_point(uint32_t i, uint32_t count) {
    uint32_t bits = i;
    uint32_t turned = 0;
    for (int k = 0; k < 32; ++k, bits >>= 1) turned = turned << 1 | (bits & 1);
    return {(static_cast<float>(i) + 0.5f) / static_cast<float>(count), static_cast<float>(turned) * 0x1p-32f};
}

// About the normal (0, 0, 1), of unit length; as dense as GGX's distribution times the cosine.
inline glm::vec3 half_vector(const glm::vec2& point, float alpha) {
    const float cosine = std::sqrt((1 - point.x) / (1 + (alpha * alpha - 1) * point.x));
    const float sine = std::sqrt(std::max(0.0f, 1 - cosine * cosine)), turn = 2 * std::numbers::pi_v<float> * point.y;
    return {sine * std::cos(turn), sine * std::sin(turn), cosine};
}

}  // namespace lodestone
