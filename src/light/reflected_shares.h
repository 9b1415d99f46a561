// What share of the light that a surface mirrors goes to the eye: Environment::shares, for the model of
// shaders/shared/lighting.glsl (GGX, Smith's joint shadowing, Schlick's Fresnel term).
//
//   Karis, "Real shading in Unreal Engine 4", SIGGRAPH 2013 course
#pragma once

#include <glm/vec4.hpp>

namespace lodestone {

// As Environment::shares. cosine: between normal and eye, 0 .. 1. roughness: 0 .. 1.
glm::vec4 reflected_shares(float cosine, float roughness);

}  // namespace lodestone
