// What the samples of a page are expected to be by those that are known: what pages.h codes differences from.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "vgi/asset/bintree.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Of a sample in the mean of it and its two neighbours, whose weights are 1. More, and noise is left; less, and what
// the mean leaves open of the sample takes more bytes.
inline constexpr int32_t own_weight = 4;

// One channel of a page while it is coded: samples are known one after the other, in the order of `for_order`. Where
// the parent has means they stand for the samples until those are known.
struct Plane {
    const uint16_t* page;  // its first channel; those before this one are known
    uint32_t number;       // of the channel
    int32_t n;             // cells
    uint32_t level;        // of the page, the chart's own
    Channel channel;

    size_t size() const { return static_cast<size_t>(n + 1) * static_cast<size_t>(n + 1); }
    size_t index(int32_t x, int32_t y) const { return number * size() + static_cast<size_t>(y * (n + 1) + x); }

    // Low bits that are mostly 0 in what is coded as a difference.
    uint32_t shift() const { return channel.kind == Channel::Kind::error ? error_code_shift(level) : 0; }

    int32_t at(int32_t x, int32_t y) const {
        const uint16_t v = page[index(x, y)];
        return channel.is_signed ? static_cast<int16_t>(v) : v;
    }
    static int32_t rounded(int32_t sum, int32_t count) {
        return sum >= 0 ? (sum + count / 2) / count : -((-sum + count / 2) / count);
    }
    // Halfway between b and c on a line of evenly spaced samples a, b, c, d, by the cubic through all four.
    static int32_t cubic(int32_t a, int32_t b, int32_t c, int32_t d) { return rounded(9 * (b + c) - a - d, 16); }
    uint16_t predict_base(int32_t x, int32_t y) const {
        if (x == 0 && y == 0) return 0;
        if (channel.kind == Channel::Kind::name || x == 0 || y == 0)
            return static_cast<uint16_t>(x > 0 ? at(x - 1, y) : at(x, y - 1));
        return static_cast<uint16_t>(at(x - 1, y) + at(x, y - 1) - at(x - 1, y - 1));
    }
    // The sample whose mean is known, and what else it is of.
    int32_t sample_of_mean(int32_t x, int32_t y) const {
        const bool in_x = x > 0 && x < n;
        const bool in_y = y > 0 && y < n;
        const auto across = [&](int32_t row) { return at(x - 1, row) + at(x + 1, row); };
        int32_t sample = at(x, y);
        constexpr int32_t own = own_weight, all = own_weight + 2;
        if (in_x && in_y) {
            const int32_t edges = across(y) + at(x, y - 1) + at(x, y + 1), corners = across(y - 1) + across(y + 1);
            sample = rounded(all * all * sample - own * edges - corners, own * own);
        } else if (in_x) {
            sample = rounded(all * sample - across(y), own);
        } else if (in_y) {
            sample = rounded(all * sample - at(x, y - 1) - at(x, y + 1), own);
        }
        return channel.is_signed ? std::clamp(sample, -127, 127) : std::clamp(sample, 0, 255);
    }
    uint16_t predict(int32_t x, int32_t y) const {
        if (channel.averaged && ((x | y) & 1) == 0) return static_cast<uint16_t>(sample_of_mean(x, y));
        if (channel.kind == Channel::Kind::name) return static_cast<uint16_t>(at(x & ~1, y & ~1));
        if (channel.kind == Channel::Kind::error) return error_at({x, y});
        if (channel.kind == Channel::Kind::radius) return radius_around({x, y});
        if ((y & 1) == 0) {
            if (x < 3 || x + 3 > n) return static_cast<uint16_t>(rounded(at(x - 1, y) + at(x + 1, y), 2));
            return static_cast<uint16_t>(cubic(at(x - 3, y), at(x - 1, y), at(x + 1, y), at(x + 3, y)));
        }
        if ((x & 1) == 0) {
            if (y < 3 || y + 3 > n) return static_cast<uint16_t>(rounded(at(x, y - 1) + at(x, y + 1), 2));
            return static_cast<uint16_t>(cubic(at(x, y - 3), at(x, y - 1), at(x, y + 1), at(x, y + 3)));
        }
        const int32_t edges = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
        if (channel.kind != Channel::Kind::smooth && channel.kind != Channel::Kind::direction)
            return static_cast<uint16_t>(rounded(edges, 4));
        const int32_t corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
        return static_cast<uint16_t>(rounded(3 * edges - corners, 8));
    }
    glm::dvec3 lattice_point(GridPoint p) const {
        const auto i = static_cast<size_t>(p.y * (n + 1) + p.x);
        return {page[i], page[size() + i], page[2 * size() + i]};
    }
    // Squared distance of p from the plane through three points, in steps of the lattice. The same on every machine:
    // products are not contracted (see the flags of the build), and most numbers are whole.
    double off_plane(GridPoint p, GridPoint a, GridPoint b, GridPoint c) const {
        const glm::dvec3 from = lattice_point(a), normal = glm::cross(lattice_point(b) - from, lattice_point(c) - from);
        const double height = glm::dot(normal, lattice_point(p) - from), squared = glm::dot(normal, normal);
        return squared > 0 ? height * height / squared : 0;
    }
    // Error of a finest sample as far as samples tell: that of the triangles it splits, and more than those whose
    // parent it is.
    uint32_t own_error(const Bintree& tree, GridPoint p) const {
        double own = 0, of_children = 0;
        const auto ends = tree.hypotenuse(p);
        tree.for_parents(p, [&](GridPoint apex) { own = std::max(own, off_plane(p, ends[0], ends[1], apex)); });
        tree.for_children(p, [&](GridPoint child) {
            const auto its_ends = tree.hypotenuse(child);
            of_children = std::max(of_children, off_plane(child, its_ends[0], its_ends[1], p));
        });
        uint32_t code = round_up(error_code_of_squared(own), level);
        if (of_children > 0) {
            const uint32_t above = 1u + round_up(error_code_of_squared(of_children), level);
            code = std::max<uint32_t>(code, round_up(above, level));
        }
        return code;
    }
    // Errors of the finest samples are mostly those of the triangles without them, which positions tell; of coarser
    // ones that is the least there can be, and their parents' is nearer.
    uint16_t error_at(GridPoint p) const {
        const Bintree tree{n};
        uint32_t expected = 255;
        tree.for_parents(p, [&](GridPoint q) { expected = std::min(expected, static_cast<uint32_t>(at(q.x, q.y))); });
        if (level == 0 && expected > 0) expected = std::min(expected, own_error(tree, p));
        return static_cast<uint16_t>(expected >> shift() << shift());
    }
    // Code of the distance to the farthest corner of the triangles that p splits, as ErrorCodes::of_radius has it, in
    // integers: half octaves of a length are octaves of its square, and code 255 is that of 3 * 2^40 lattice steps,
    // squared.
    uint16_t radius_around(GridPoint p) const {
        const size_t here = static_cast<size_t>(p.y * (n + 1) + p.x);
        if (page[3 * size() + here] == 0) return 0;  // an error of 0 is never wanted
        uint64_t largest = 1;
        const auto reach = [&](GridPoint q) {
            uint64_t squared = 0;
            for (size_t k = 0; k < 3; ++k) {
                const int64_t off =
                    int64_t{page[k * size() + static_cast<size_t>(q.y * (n + 1) + q.x)]} - page[k * size() + here];
                squared += static_cast<uint64_t>(off * off);
            }
            largest = std::max(largest, squared);
        };
        const Bintree tree{n};
        for (const GridPoint end : tree.hypotenuse(p)) reach(end);
        tree.for_parents(p, reach);
        const auto octave = static_cast<uint32_t>(std::bit_width(largest)) - 1;
        return static_cast<uint16_t>(214 + octave + (2 * largest > uint64_t{3} << octave ? 1 : 0));
    }
    // Samples that are coded: all of a base page; otherwise middles of edges and centres, whichever tell more of the
    // others first, and then those of which the parent has means.
    template <class Visit>
    void for_order(bool base, Visit&& visit) const {
        if (base) {
            for (int32_t y = 0; y <= n; ++y) {
                for (int32_t x = 0; x <= n; ++x) visit(x, y, predict_base(x, y));
            }
            return;
        }
        const auto centres = [&] {
            for (int32_t y = 1; y <= n; y += 2) {
                for (int32_t x = 1; x <= n; x += 2) visit(x, y, predict(x, y));
            }
        };
        if (channel.kind == Channel::Kind::error) centres();
        for (int32_t y = 0; y <= n; y += 2) {
            for (int32_t x = 1; x <= n; x += 2) visit(x, y, predict(x, y));
        }
        for (int32_t y = 1; y <= n; y += 2) {
            for (int32_t x = 0; x <= n; x += 2) visit(x, y, predict(x, y));
        }
        if (channel.kind != Channel::Kind::error) centres();
        for (int32_t y = 0; channel.averaged && y <= n; y += 2) {
            for (int32_t x = 0; x <= n; x += 2) visit(x, y, predict(x, y));
        }
    }
};

}  // namespace lodestone::vgi
