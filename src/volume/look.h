// What a primitive looks like: colour and density as functions of the place in it and of the displaced radius in that
// direction. Source: "Sparse procedural volumetric rendering" (Intel, in GPU Pro 6), section on filling the volume.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

namespace lodestone::volume {

// What goes from `from` to `to`, 0 .. 1.
enum class ColourBy : uint8_t {
    radius,        // the way from the centre to the displaced surface
    displacement,  // how far the noise pushes the surface in, in that direction
    heat,          // 0 in the centre of a young particle; 1 at its surface, and everywhere once it is old
};

// One way of colouring. Binary: both densities alike, both colours alike. Gradient: they differ.
struct Look {
    ColourBy colour_by = ColourBy::radius;
    glm::vec3 colour_from{0.8f}, colour_to{0.8f};  // linear, 0 .. 1
    float density_from = 4, density_to = 4;        // extinction at the centre and at the surface, per world unit
    float scatter = 1;                             // share of what is taken out of light that is scattered, 0 .. 1
    float emission = 0;                            // radiance that a thick layer of colour 1 sends out, >= 0
    // Texture lookup, from the centre to the surface: colour, and a factor of density. In place of colours where it is
    // given; 2 .. 256 entries.
    std::vector<glm::vec4> table;
    bool operator==(const Look&) const = default;
};

// The two looks of the source: a constant colour tinted by displacement, and yellow to black by radius and age.
Look smoke_look();
Look fire_look();

}  // namespace lodestone::volume
