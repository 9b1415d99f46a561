#include "tiles/placement.h"

#include <cmath>
#include <glm/common.hpp>
#include <numbers>

namespace lodestone::tiles {

Transform transform_of(const glm::dmat4& matrix) {
    Transform values{};
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) values[static_cast<size_t>(column * 4 + row)] = matrix[column][row];
    }
    return values;
}

TileBox moved(const TileBox& box, const glm::dmat4& by) {
    glm::dvec3 half(0);
    for (int axis = 0; axis < 3; ++axis) half += glm::abs(glm::dvec3(by[axis])) * box.half[axis];
    return {glm::dvec3(by * glm::dvec4(box.centre, 1)), half};
}

TileBox around(const TileBox& a, const TileBox& b) {
    const glm::dvec3 low = glm::min(a.centre - a.half, b.centre - b.half);
    const glm::dvec3 high = glm::max(a.centre + a.half, b.centre + b.half);
    return {(low + high) * 0.5, (high - low) * 0.5};
}

namespace {

constexpr double radians = std::numbers::pi / 180;

}  // namespace

glm::dvec3 earth_centred(double longitude, double latitude, double height) {
    constexpr double equator = 6378137.0, flattening = 1 / 298.257223563;  // WGS 84
    constexpr double eccentricity2 = flattening * (2 - flattening);
    const double sin_lat = std::sin(latitude * radians), cos_lat = std::cos(latitude * radians);
    const double normal = equator / std::sqrt(1 - eccentricity2 * sin_lat * sin_lat);
    return {(normal + height) * cos_lat * std::cos(longitude * radians),
            (normal + height) * cos_lat * std::sin(longitude * radians),
            (normal * (1 - eccentricity2) + height) * sin_lat};
}

glm::dmat4 east_north_up(double longitude, double latitude, double height) {
    const double sin_lon = std::sin(longitude * radians), cos_lon = std::cos(longitude * radians);
    const double sin_lat = std::sin(latitude * radians), cos_lat = std::cos(latitude * radians);
    return {glm::dvec4(-sin_lon, cos_lon, 0, 0), glm::dvec4(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat, 0),
            glm::dvec4(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat, 0),
            glm::dvec4(earth_centred(longitude, latitude, height), 1)};
}

glm::dmat4 to_tile_axes(UpAxis up) {
    if (up == UpAxis::z) return glm::dmat4(1);
    return {glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(0, -1, 0, 0), glm::dvec4(0, 0, 0, 1)};
}

}  // namespace lodestone::tiles
