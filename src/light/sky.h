// A clear sky by day over a ground of one colour, without the disc of the sun.
//
//   Preetham, Shirley, Smits, "A practical analytic model for daylight", SIGGRAPH 1999
#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace lodestone {

// How bright a sky is, and what lies under it; linear.
struct SkyLook {
    float brightness = 0.56f;              // luminance of the mean radiance that level ground sees
    glm::vec3 ground{0.22f, 0.2f, 0.18f};  // radiance from below the horizon
    float turbidity = 3;                   // how hazy: 2 very clear, 6 warm and moist
};

// Up is +y.
class ClearSky {
public:
    // to_sun: unit vector. A sun lower than five degrees above the horizon is taken to stand there: the model knows no
    // night.
    ClearSky(const glm::vec3& to_sun, const SkyLook& look);
    // Linear radiance from a direction of unit length.
    glm::vec3 operator()(const glm::vec3& direction) const;

private:
    // Of luminance and of two chromaticities, by Perez' formula.
    struct Perez {
        std::array<double, 5> shape;
        double scale = 1;  // so that the zenith has its value
        double at(double cosine, double angle, double cosine_of_angle) const;
    };
    glm::vec3 above(const glm::vec3& direction) const;

    glm::vec3 to_sun_, ground_;
    std::array<Perez, 3> channels_;
    float scale_ = 1;
};

}  // namespace lodestone
