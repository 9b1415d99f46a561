#include "mesh/noise.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace lodestone {

namespace {

constexpr double lacunarity = 2.03;  // not 2, so that lattice planes of the octaves do not coincide
constexpr int most_octaves = 24;

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// Dot product with one of the twelve edge directions of a cube, chosen by hash.
double gradient_dot(uint64_t hash, double x, double y, double z) {
    switch (hash % 12) {
        case 0:
            return x + y;
        case 1:
            return x - y;
        case 2:
            return -x + y;
        case 3:
            return -x - y;
        case 4:
            return x + z;
        case 5:
            return x - z;
        case 6:
            return -x + z;
        case 7:
            return -x - z;
        case 8:
            return y + z;
        case 9:
            return y - z;
        case 10:
            return -y + z;
        default:
            return -y - z;
    }
}

uint64_t lattice_hash(int64_t x, int64_t y, int64_t z, uint64_t seed) {
    uint64_t h = seed + static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ (h >> 29)) + static_cast<uint64_t>(y) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ (h >> 31)) + static_cast<uint64_t>(z) * 0x94d049bb133111ebULL;
    h = (h ^ (h >> 27)) * 0x9e3779b97f4a7c15ULL;
    return h >> 33;
}

}  // namespace

double gradient_noise(const glm::dvec3& p, uint64_t seed) {
    const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
    const auto x0 = static_cast<int64_t>(fx), y0 = static_cast<int64_t>(fy), z0 = static_cast<int64_t>(fz);
    const double x = p.x - fx, y = p.y - fy, z = p.z - fz;
    const auto corner = [&](int dx, int dy, int dz) {
        return gradient_dot(lattice_hash(x0 + dx, y0 + dy, z0 + dz, seed), x - dx, y - dy, z - dz);
    };
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    const double u = fade(x), v = fade(y), w = fade(z);
    return mix(mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v),
               mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v), w);
}

double fractal_noise(const glm::dvec3& p, uint64_t seed, double gain, double smallest_feature) {
    double sum = 0, amplitude = 1, frequency = 1;
    for (int octave = 0; octave < most_octaves && 1 / frequency > smallest_feature; ++octave) {
        sum += amplitude * gradient_noise(p * frequency, seed + static_cast<uint64_t>(octave) * 7919);
        amplitude *= gain;
        frequency *= lacunarity;
    }
    return sum;
}

double ridged_noise(const glm::dvec3& p, uint64_t seed, double gain, double smallest_feature) {
    double sum = 0, amplitude = 0.5, frequency = 1, weight = 1;
    for (int octave = 0; octave < most_octaves && 1 / frequency > smallest_feature; ++octave) {
        double signal = 1 - std::abs(gradient_noise(p * frequency, seed + static_cast<uint64_t>(octave) * 7919));
        signal *= signal * weight;
        sum += signal * amplitude;
        weight = std::clamp(signal * 2, 0.0, 1.0);
        amplitude *= gain;
        frequency *= lacunarity;
    }
    return sum;
}

}  // namespace lodestone
