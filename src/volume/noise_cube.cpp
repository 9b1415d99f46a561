#include "volume/noise_cube.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/random.h"

namespace lodestone::volume {

namespace {

double gradient_noise(const glm::dvec3& p, uint64_t seed) {
    const glm::dvec3 low(std::floor(p.x), std::floor(p.y), std::floor(p.z)), f = p - low;
    const auto smooth = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
    const glm::dvec3 s(smooth(f.x), smooth(f.y), smooth(f.z));
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
        const glm::dvec3 corner(k & 1, k >> 1 & 1, k >> 2);
        const glm::dvec3 at = low + corner;
        uint64_t hash = seed;
        for (int axis = 0; axis < 3; ++axis) hash = mix64(hash ^ static_cast<uint64_t>(static_cast<int64_t>(at[axis])));
        const double z = 2 * static_cast<double>(hash >> 40) * 0x1p-24 - 1;
        const double angle = 6.283185307179586 * static_cast<double>(hash & 0xffffff) * 0x1p-24;
        const double side = std::sqrt(std::max(0.0, 1 - z * z));
        const glm::dvec3 gradient(side * std::cos(angle), side * std::sin(angle), z);
        const glm::dvec3 weight = corner * s + (1.0 - corner) * (1.0 - s);
        sum += weight.x * weight.y * weight.z * glm::dot(gradient, f - corner);
    }
    return sum;
}

double fractal(const glm::dvec3& direction, uint64_t seed) {
    double sum = 0, amplitude = 0.5, frequency = 1.9;
    for (uint64_t octave = 0; octave < 4; ++octave, amplitude /= 2, frequency *= 2.1)
        sum += amplitude * gradient_noise(direction * frequency, seed + octave);
    return std::clamp(0.5 + sum, 0.0, 1.0);
}

constexpr uint32_t face_side = NoiseCube::cells + 1;

}  // namespace

float NoiseCube::at(const glm::vec3& direction) const {
    const glm::vec3 d = direction, a(std::abs(d.x), std::abs(d.y), std::abs(d.z));
    const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    const uint32_t face = 2 * static_cast<uint32_t>(axis) + (d[axis] < 0 ? 1 : 0);
    LODE_CHECK(a[axis] > 0, d.x, d.y, d.z);
    const auto place = [&](int offset) {
        const float t = d[(axis + offset) % 3] / a[axis];
        return std::clamp((t * 0.5f + 0.5f) * cells, 0.0f, static_cast<float>(cells));
    };
    const float u = place(1), v = place(2);
    const auto x = std::min(static_cast<uint32_t>(u), cells - 1), y = std::min(static_cast<uint32_t>(v), cells - 1);
    const float fx = u - static_cast<float>(x), fy = v - static_cast<float>(y);
    const auto value = [&](uint32_t cx, uint32_t cy) {
        return static_cast<float>(values[(face * face_side + cy) * face_side + cx]) / 255;
    };
    return std::lerp(std::lerp(value(x, y), value(x + 1, y), fx), std::lerp(value(x, y + 1), value(x + 1, y + 1), fx),
                     fy);
}

std::vector<uint32_t> NoiseCube::words() const {
    std::vector<uint32_t> words;
    for (uint32_t face = 0; face < 6; ++face) {
        for (uint32_t y = 0; y < cells; ++y) {
            for (uint32_t x = 0; x < cells; ++x) {
                uint32_t word = 0;
                for (uint32_t k = 0; k < 4; ++k)
                    word |= uint32_t{values[(face * face_side + y + (k >> 1)) * face_side + x + (k & 1)]} << 8 * k;
                words.push_back(word);
            }
        }
    }
    return words;
}

NoiseCube make_noise_cube(uint64_t seed) {
    NoiseCube cube;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        for (uint32_t y = 0; y < face_side; ++y) {
            for (uint32_t x = 0; x < face_side; ++x) {
                glm::dvec3 d;
                d[axis] = face % 2 == 0 ? 1 : -1;
                d[(axis + 1) % 3] = 2.0 * x / NoiseCube::cells - 1;
                d[(axis + 2) % 3] = 2.0 * y / NoiseCube::cells - 1;
                cube.values.push_back(static_cast<uint8_t>(std::lround(255 * fractal(glm::normalize(d), seed))));
            }
        }
    }
    return cube;
}

}  // namespace lodestone::volume
