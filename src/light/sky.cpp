#include "light/sky.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace lodestone {

namespace {

constexpr double lowest_sun = 5 * std::numbers::pi / 180;  // above the horizon

// Each times turbidity, plus each.
constexpr double shapes[3][5][2] = {
    {{0.1787, -1.4630}, {-0.3554, 0.4275}, {-0.0227, 5.3251}, {0.1206, -2.5771}, {-0.0670, 0.3703}},
    {{-0.0193, -0.2592}, {-0.0665, 0.0008}, {-0.0004, 0.2125}, {-0.0641, -0.8989}, {-0.0033, 0.0452}},
    {{-0.0167, -0.2608}, {-0.0950, 0.0092}, {-0.0079, 0.2102}, {-0.0441, -1.6537}, {-0.0109, 0.0529}}};
// Chromaticities of the zenith: turbidity squared, turbidity and 1, each times the sun's angle cubed, squared,
// itself, 1.
constexpr double zeniths[2][3][4] = {
    {{0.00166, -0.00375, 0.00209, 0}, {-0.02903, 0.06377, -0.03202, 0.00394}, {0.11693, -0.21196, 0.06052, 0.25886}},
    {{0.00275, -0.00610, 0.00317, 0}, {-0.04214, 0.08970, -0.04153, 0.00516}, {0.15346, -0.26756, 0.06670, 0.26688}}};

double zenith_luminance(double turbidity, double sun) {
    const double chi = (4.0 / 9 - turbidity / 120) * (std::numbers::pi - 2 * sun);
    return (4.0453 * turbidity - 4.9710) * std::tan(chi) - 0.2155 * turbidity + 2.4192;
}
double zenith_chromaticity(int which, double turbidity, double sun) {
    const double powers[4] = {sun * sun * sun, sun * sun, sun, 1}, by[3] = {turbidity * turbidity, turbidity, 1};
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 4; ++k) sum += by[i] * zeniths[which][i][k] * powers[k];
    }
    return sum;
}

float luminance(const glm::vec3& c) { return glm::dot(c, glm::vec3(0.2126f, 0.7152f, 0.0722f)); }

// CIE xyY to linear Rec. 709.
glm::vec3 linear_of(double x, double y, double luminance) {
    const double a = x / y * luminance, c = (1 - x - y) / y * luminance;
    return glm::max(
        glm::vec3(3.2406 * a - 1.5372 * luminance - 0.4986 * c, -0.9689 * a + 1.8758 * luminance + 0.0415 * c,
                  0.0557 * a - 0.2040 * luminance + 1.0570 * c),
        glm::vec3(0));
}

}  // namespace

double ClearSky::Perez::at(double cosine, double angle, double cosine_of_angle) const {
    return scale * (1 + shape[0] * std::exp(shape[1] / cosine)) *
           (1 + shape[2] * std::exp(shape[3] * angle) + shape[4] * cosine_of_angle * cosine_of_angle);
}

ClearSky::ClearSky(const glm::vec3& to_sun, const SkyLook& look) : ground_(look.ground) {
    const double height = std::max(std::asin(std::clamp(static_cast<double>(to_sun.y), -1.0, 1.0)), lowest_sun);
    const double turn = std::atan2(static_cast<double>(to_sun.z), static_cast<double>(to_sun.x));
    to_sun_ = glm::vec3(std::cos(height) * std::cos(turn), std::sin(height), std::cos(height) * std::sin(turn));
    const double sun = std::numbers::pi / 2 - height, turbidity = static_cast<double>(look.turbidity);
    for (size_t c = 0; c < channels_.size(); ++c) {
        for (size_t k = 0; k < 5; ++k) channels_[c].shape[k] = shapes[c][k][0] * turbidity + shapes[c][k][1];
        const double zenith =
            c == 0 ? zenith_luminance(turbidity, sun) : zenith_chromaticity(static_cast<int>(c) - 1, turbidity, sun);
        channels_[c].scale = zenith / channels_[c].at(1, sun, std::cos(sun));
    }
    // The mean that level ground sees, over rings of equal share.
    constexpr int rings = 64, parts = 128;
    double seen = 0;
    for (int r = 0; r < rings; ++r) {
        const double up = std::sqrt((r + 0.5) / rings), aside = std::sqrt(1 - up * up);
        for (int p = 0; p < parts; ++p) {
            const double around = 2 * std::numbers::pi * (p + 0.5) / parts;
            seen += static_cast<double>(luminance(above({aside * std::cos(around), up, aside * std::sin(around)})));
        }
    }
    scale_ = static_cast<float>(static_cast<double>(look.brightness) * rings * parts / seen);
}

glm::vec3 ClearSky::above(const glm::vec3& d) const {
    const double cosine = std::max(static_cast<double>(d.y), 1e-3);
    const double of_sun = std::clamp(static_cast<double>(glm::dot(d, to_sun_)), -1.0, 1.0), angle = std::acos(of_sun);
    const double luminance = channels_[0].at(cosine, angle, of_sun), x = channels_[1].at(cosine, angle, of_sun),
                 y = channels_[2].at(cosine, angle, of_sun);
    return linear_of(x, y, luminance);
}

glm::vec3 ClearSky::operator()(const glm::vec3& direction) const {
    return direction.y < 0 ? ground_ : scale_ * above(direction);
}

}  // namespace lodestone
