#include "volume/draw/analytic.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <limits>

namespace lodestone {

AnalyticVolume::AnalyticVolume(std::vector<volume::Emitter> emitters, double time, const ShadingOptions& look,
                               double step)
    : emitters_(std::move(emitters)),
      particles_(volume::particles_at(emitters_, time)),
      cube_(volume::make_noise_cube(1)),
      look_(look),
      step_(step) {}

// The table of the cube map is given; how it is looked up is done here by itself.
double AnalyticVolume::noise(const glm::dvec3& d) const {
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
        if (std::abs(d[k]) > std::abs(d[axis])) axis = k;
    }
    const double length = std::abs(d[axis]);
    if (length == 0) return 0;
    const int n = volume::NoiseCube::cells, face = 2 * axis + (d[axis] < 0 ? 1 : 0);
    double coordinate[2];
    int cell[2];
    for (int k = 0; k < 2; ++k) {
        coordinate[k] = std::clamp((d[(axis + 1 + k) % 3] / length + 1) / 2 * n, 0.0, double(n));
        cell[k] = std::min(int(coordinate[k]), n - 1);
        coordinate[k] -= cell[k];
    }
    double sum = 0;
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) {
            const double weight = (x ? coordinate[0] : 1 - coordinate[0]) * (y ? coordinate[1] : 1 - coordinate[1]);
            sum += weight * cube_.values[size_t((face * (n + 1) + cell[1] + y) * (n + 1) + cell[0] + x)];
        }
    }
    return sum / 255;
}

AnalyticVolume::Point AnalyticVolume::at(const glm::dvec3& place) const {
    Point point;
    for (const volume::Particle& p : particles_) {
        const glm::dvec3 v = place - glm::dvec3(p.centre);
        const double distance = glm::length(v);
        if (distance >= p.radius || distance == 0) continue;
        const double pushed = noise(glm::mat3_cast(glm::dquat(p.to_noise)) * v);
        const double surface = p.radius * (1 - p.displacement * pushed);
        if (distance >= surface) continue;
        const volume::Look& look = emitters_[p.emitter].look;
        const double share = distance / surface;
        double by = share;
        if (look.colour_by == volume::ColourBy::displacement) by = pushed;
        if (look.colour_by == volume::ColourBy::heat) by = 1 - (1 - share) * (1 - p.age);
        glm::dvec3 colour = glm::mix(glm::dvec3(look.colour_from), glm::dvec3(look.colour_to), by);
        double density = std::lerp(double(look.density_from), double(look.density_to), share) * p.density;
        if (!look.table.empty()) {
            const double entry = share * double(look.table.size() - 1);
            const size_t low = std::min(size_t(entry), look.table.size() - 2);
            const glm::dvec4 found =
                glm::mix(glm::dvec4(look.table[low]), glm::dvec4(look.table[low + 1]), entry - double(low));
            colour = glm::dvec3(found);
            density *= found.w;
        }
        point.density += density;
        point.scattered += density * double(look.scatter) * colour;
        point.sent_out += density * double(look.emission) * colour;
    }
    return point;
}

bool AnalyticVolume::span_of(const glm::dvec3& from, const glm::dvec3& along, double& begin, double& end) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const double squared = glm::dot(along, along);
    for (const volume::Particle& p : particles_) {
        const glm::dvec3 v = glm::dvec3(p.centre) - from;
        const double middle = glm::dot(v, along) / squared;
        const double away = glm::dot(v, v) - middle * middle * squared;
        const double half = double(p.radius) * p.radius - away;
        if (half <= 0) continue;
        low = std::min(low, middle - std::sqrt(half / squared));
        high = std::max(high, middle + std::sqrt(half / squared));
    }
    begin = std::max(begin, low);
    end = std::min(end, high);
    return begin < end;
}

glm::dvec3 AnalyticVolume::light_at(const glm::dvec3& place) const {
    const glm::dvec3 along = -glm::normalize(glm::dvec3(look_.light_direction));
    double begin = 0, end = std::numeric_limits<double>::infinity();
    if (!lit || !span_of(place, along, begin, end)) return glm::dvec3(1);
    const auto steps = static_cast<int>(std::ceil((end - begin) / step_));
    const double length = (end - begin) / steps;
    glm::dvec3 taken(0);
    for (int i = 0; i < steps; ++i) {
        const Point p = at(place + along * (begin + (i + 0.5) * length));
        taken += length * (glm::dvec3(p.density) - forward * p.scattered);
    }
    return {std::exp(-taken.x), std::exp(-taken.y), std::exp(-taken.z)};
}

AnalyticVolume::Ray AnalyticVolume::march(const View& view, uint32_t x, uint32_t y, double depth) const {
    const glm::dmat3 rows(glm::dmat4(view.world_to_view));
    const glm::dvec3 right(rows[0][0], rows[1][0], rows[2][0]), up(rows[0][1], rows[1][1], rows[2][1]);
    const glm::dvec3 ahead = -glm::dvec3(rows[0][2], rows[1][2], rows[2][2]);
    const glm::dvec3 along = ahead + right * ((x + 0.5 - view.width / 2.0) / double(view.focal_px)) -
                             up * ((y + 0.5 - view.height / 2.0) / double(view.focal_px));
    Ray ray;
    double begin = view.near_plane, end = depth;
    if (!span_of(glm::dvec3(view.eye), along, begin, end)) return ray;
    const double stretch = glm::length(along);
    const auto steps = static_cast<int>(std::ceil((end - begin) * stretch / step_));
    const double length = (end - begin) * stretch / steps;
    const glm::dvec3 arriving = glm::dvec3(look_.light_colour) / (4 * 3.14159265358979);
    const glm::dvec3 around = 0.5 * (glm::dvec3(look_.sky_colour) + glm::dvec3(look_.ground_colour));
    for (int i = 0; i < steps && ray.through > 1e-5; ++i) {
        const glm::dvec3 place = glm::dvec3(view.eye) + along * (begin + (i + 0.5) * (end - begin) / steps);
        const Point p = at(place);
        if (p.density <= 0) continue;
        const double blend = std::exp(-p.density * length);
        const glm::dvec3 radiance =
            (p.scattered * ((1 - forward) * arriving * light_at(place) + around) + p.sent_out) / p.density;
        ray.light += ray.through * (1 - blend) * radiance;
        ray.through *= blend;
    }
    return ray;
}

}  // namespace lodestone
