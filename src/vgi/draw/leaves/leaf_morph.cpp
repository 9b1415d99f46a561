#include "vgi/draw/leaves/leaf_morph.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <tuple>

#include "base/check.h"
#include "mesh/distance/closest_point.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

uint32_t LeafMorph::packed() const {
    const auto seven = [](int8_t number) { return uint32_t{static_cast<uint8_t>(number)} & 127u; };
    return uint32_t{border} | uint32_t{exponent} << 8 | seven(off[0]) << 11 | seven(off[1]) << 18 | seven(off[2]) << 25;
}

LeafMorph LeafMorph::unpacked(uint32_t word) {
    const auto seven = [&](uint32_t shift) {
        return static_cast<int8_t>(std::bit_cast<int32_t>(word << (25 - shift)) >> 25);
    };
    return {static_cast<uint8_t>(word & 7), static_cast<uint8_t>(word >> 8 & 7), {seven(11), seven(18), seven(25)}};
}

LeafMorph leaf_morph(const glm::dvec3& start, uint8_t border) {
    constexpr double most = 63;
    const double longest = std::max({std::abs(start.x), std::abs(start.y), std::abs(start.z)});
    LeafMorph morph{border};
    while (morph.exponent < 7 && std::round(std::ldexp(longest, -2 * morph.exponent)) > most) ++morph.exponent;
    for (int k = 0; k < 3; ++k) {
        const double steps = std::round(std::ldexp(start[k], -2 * morph.exponent));
        morph.off[static_cast<size_t>(k)] = static_cast<int8_t>(std::clamp(steps, -most, most));
    }
    return morph;
}

namespace {

// The square's own samples, as points of the leaves' lattice.
class SquareSamples {
public:
    SquareSamples(const Atlas& about, Atlas::Tile square, std::span<const LeafSample> samples)
        : samples_(samples),
          shift_(about.leaf_shift),
          cells_(tree_of(about, Layer::geometry, square.chart).cells_per_page()),
          to_cells_(static_cast<double>(about.cells_of(square.chart)) / leaf_places),
          corner_(square.x * cells_, square.y * cells_),
          rising_(rising_diagonal(square.x, square.y)) {
        LODE_CHECK(samples.size() == size_t{cells_ + 1} * (cells_ + 1), samples.size(), cells_);
    }

    // Where a vertex of the square's leaf starts that moves as samples of an error do.
    glm::dvec3 start_of(const LeafVertex& v, uint8_t error) const {
        const glm::dvec3 at(v.position[0], v.position[1], v.position[2]);
        if (v.is_corner()) return at;
        return v.border > 0 ? nearest_on_side(v.border - 1u, at, error) : inside(v, at, error);
    }

private:
    glm::dvec3 point(GridPoint p) const {
        const auto& [x, y, z] = sample_at(p).position;
        return glm::dvec3(uint32_t{x} << shift_, uint32_t{y} << shift_, uint32_t{z} << shift_);
    }
    const LeafSample& sample_at(GridPoint p) const {
        return samples_[static_cast<size_t>(p.y) * (cells_ + 1) + static_cast<size_t>(p.x)];
    }
    // Of the triangle that has its place once samples of less than the error are left out.
    glm::dvec3 inside(const LeafVertex& v, const glm::dvec3& at, uint8_t error) const {
        const glm::dvec2 place =
            glm::clamp(glm::dvec2(v.place[0], v.place[1]) * to_cells_ - corner_, 0.0, static_cast<double>(cells_));
        const auto n = static_cast<int32_t>(cells_);
        GridPoint a{0, 0}, b{n, n}, c = place.x > place.y ? GridPoint{n, 0} : GridPoint{0, n};
        if (!rising_) {
            a = {n, 0};
            b = {0, n};
            c = place.x + place.y < cells_ ? GridPoint{0, 0} : GridPoint{n, n};
        }
        // Down the bintree: each sample halves the side from a to b.
        while ((a.x + b.x) % 2 == 0 && (a.y + b.y) % 2 == 0) {
            const GridPoint m{(a.x + b.x) / 2, (a.y + b.y) / 2};
            if (sample_at(m).error < error) break;
            // Nearer to a or to b.
            const double from_a = (place.x - a.x) * (place.x - a.x) + (place.y - a.y) * (place.y - a.y),
                         from_b = (place.x - b.x) * (place.x - b.x) + (place.y - b.y) * (place.y - b.y);
            if (from_a > from_b) a = b;
            b = c;
            c = m;
        }
        return closest_on_triangle(at, point(a), point(b), point(c));
    }
    // A sample of a side, or the middle of its hypotenuse where it is left out: both lie on the side.
    glm::dvec3 on_side(uint32_t side, uint32_t step, uint8_t error) const {
        const auto [x, y] = vgi::on_side(side, step, cells_);
        const GridPoint p{static_cast<int32_t>(x), static_cast<int32_t>(y)};
        const Bintree tree{static_cast<int32_t>(cells_)};
        if (tree.is_corner(p) || sample_at(p).error >= error) return point(p);
        const auto [a, b] = tree.hypotenuse(p);
        return 0.5 * (point(a) + point(b));
    }
    // The nearest point of a side. It is the same for both squares that have the side, though it runs the other way
    // in one of them: what is computed from two points has them in an order that both know.
    glm::dvec3 nearest_on_side(uint32_t side, const glm::dvec3& at, uint8_t error) const {
        const auto key = [&](const glm::dvec3& p) { return std::tuple(glm::dot(p - at, p - at), p.x, p.y, p.z); };
        glm::dvec3 last = on_side(side, 0, error), nearest = last;
        for (uint32_t step = 1; step <= cells_; ++step) {
            const glm::dvec3 next = on_side(side, step, error);
            const bool forth = std::tie(last.x, last.y, last.z) < std::tie(next.x, next.y, next.z);
            const glm::dvec3 p = forth ? closest_on_segment(at, last, next) : closest_on_segment(at, next, last);
            if (key(p) < key(nearest)) nearest = p;
            last = next;
        }
        return nearest;
    }

    const std::span<const LeafSample> samples_;
    const uint32_t shift_, cells_;
    const double to_cells_;
    const glm::dvec2 corner_;
    const bool rising_;
};

}  // namespace

std::array<Leaf, 5> leaf_and_across(const Atlas& about, Atlas::Tile square) {
    std::array<Leaf, 5> leaves;
    leaves.fill(about.leaves[about.leaf(square.chart, square.x, square.y)]);
    for (uint32_t s = 0; s < 4; ++s) {
        const LeafSide across = leaf_across(about, square, s);
        if (across.leaf != ~0u && about.leaves[across.leaf].error > 0) leaves[1 + s] = about.leaves[across.leaf];
    }
    return leaves;
}

std::vector<LeafMorph> leaf_morphs(const Atlas& about, Atlas::Tile square, const LeafPart& part,
                                   std::span<const LeafSample> samples) {
    const SquareSamples of_square(about, square, samples);
    const std::array<Leaf, 5> leaves = leaf_and_across(about, square);
    std::vector<LeafMorph> morphs;
    morphs.reserve(part.vertices.size());
    for (const LeafVertex& v : part.vertices) {
        const uint8_t border = v.is_corner() ? uint8_t{0} : v.border;
        const glm::dvec3 at(v.position[0], v.position[1], v.position[2]);
        const glm::dvec3 start = of_square.start_of(v, std::min(leaves[0].error, leaves[border].error));
        morphs.push_back(leaf_morph(start - at, border));
    }
    return morphs;
}

}  // namespace lodestone::vgi
