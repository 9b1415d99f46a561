#include "vgi/bake/images/borders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>

namespace lodestone::vgi {

namespace {

constexpr int farthest = 3;  // lattice steps a sample may give way, each way
constexpr uint32_t fewest_cells = 4;

// A sample next to an end of an arc: it is the first of the chart on the arc's one side, the last of that on the other.
struct Slot {
    uint32_t arc = 0, step = 0;
    auto operator<=>(const Slot&) const = default;
};

// A chart's corner, between the samples next to it on the side that leaves it and on the side that comes in.
struct Wedge {
    Slot leaving, coming;
};

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

}  // namespace

Borders::Borders(const Surface& surface, const ChartComplex& patches, const Atlas& atlas)
    : samples_(patches.arcs.size()) {
    for (size_t a = 0; a < samples_.size(); ++a) {
        const Arc& arc = patches.arcs[a];
        const std::vector<double> places = places_along(arc, surface.positions);
        const auto last = static_cast<uint32_t>(arc.vertices.size()) - 2;
        const uint32_t steps = atlas.attribute_cells_of(arc.left);
        uint32_t segment = 0;
        for (uint32_t k = 0; k <= steps; ++k) {
            const double wanted = static_cast<double>(k) / steps;
            while (places[segment + 1] < wanted && segment < last) ++segment;
            double share = std::clamp((wanted - places[segment]) / (places[segment + 1] - places[segment]), 0.0, 1.0);
            if (k == steps) {
                segment = last;
                share = 1;
            }
            const glm::dvec3 &p = surface.positions[arc.vertices[segment]],
                             &q = surface.positions[arc.vertices[segment + 1]];
            samples_[a].push_back({share == 1 ? q : p + (q - p) * share, segment, share});
        }
    }
}

void Borders::keep_corners_open(const ChartComplex& patches, const Atlas& atlas, const glm::dvec3& up) {
    const uint32_t ratio = atlas.attribute_cells / atlas.cells;
    std::map<uint32_t, std::vector<Wedge>> wedges;  // by the vertex they are at
    for (uint32_t q = 0; q < patches.sides.size(); ++q) {
        const auto& sides = patches.sides[q];
        if (atlas.cells_of(q) < fewest_cells) continue;
        // The sample so many texels from where a side begins, for this chart.
        const auto slot = [&](const Side& side, uint32_t texels) {
            return Slot{side.arc, side.reversed ? atlas.attribute_cells_of(q) - texels : texels};
        };
        for (size_t s = 0; s < sides.size(); ++s) {
            const Side &side = sides[s], &before = sides[(s + sides.size() - 1) % sides.size()];
            const auto& vertices = patches.arcs[side.arc].vertices;
            wedges[side.reversed ? vertices.back() : vertices.front()].push_back(
                {slot(side, ratio), slot(before, atlas.attribute_cells_of(q) - ratio)});
        }
    }
    // On the lattice, seen from above: the two axes across from `up` so that turning left is positive.
    const int u = up.x != 0 ? 1 : up.y != 0 ? 2 : 0, v = up.x != 0 ? 2 : up.y != 0 ? 0 : 1;
    const bool swapped = up.x + up.y + up.z < 0;
    const auto flat = [&](const glm::dvec3& p) { return swapped ? glm::dvec2(p[v], p[u]) : glm::dvec2(p[u], p[v]); };
    const auto exact = [&](const glm::dvec3& p) { return flat((p - atlas.origin) / atlas.step); };
    const auto position = [&](const Slot& slot) -> glm::dvec3& { return samples_[slot.arc][slot.step].position; };
    for (const auto& [vertex, around] : wedges) {
        // All samples at its end of the first arc are where the vertex is.
        const Slot& any = around.front().leaving;
        const auto& arc = samples_[any.arc];
        const glm::dvec3& corner = (2 * any.step < arc.size() ? arc.front() : arc.back()).position;
        const glm::dvec2 rounded_corner = flat(atlas.rounded(corner));
        std::map<Slot, glm::dvec2> way;  // from the corner, on the lattice
        for (const Wedge& wedge : around) {
            for (const Slot& slot : {wedge.leaving, wedge.coming})
                way[slot] = flat(atlas.rounded(position(slot))) - rounded_corner;
        }
        const auto opening = [&](const Wedge& wedge) { return cross(way[wedge.leaving], way[wedge.coming]); };
        for (const Wedge& wedge : around) {
            const glm::dvec2 a = exact(position(wedge.leaving)) - exact(corner),
                             b = exact(position(wedge.coming)) - exact(corner);
            // Turned over, or flat, by rounding: corners that are wide open are none of ours.
            if (opening(wedge) > 0 || glm::dot(a, b) <= 0) continue;
            const glm::dvec2 leaving = way[wedge.leaving], coming = way[wedge.coming];
            // What opens must not close others that share its samples.
            std::vector<std::pair<const Wedge*, bool>> others;
            for (const Wedge& other : around) {
                const bool shares = other.leaving == wedge.coming || other.coming == wedge.leaving;
                if (&other != &wedge && shares) others.emplace_back(&other, opening(other) > 0);
            }
            std::optional<std::array<glm::dvec2, 2>> best;
            double least = 0;
            const auto try_moves = [&](const glm::dvec2& by_leaving, const glm::dvec2& by_coming) {
                way[wedge.leaving] = leaving + by_leaving;
                way[wedge.coming] = coming + by_coming;
                const auto off = [](const glm::dvec2& p, const glm::dvec2& q) { return glm::dot(p - q, p - q); };
                const double moved = off(way[wedge.leaving], a) + off(way[wedge.coming], b);
                if ((best && moved >= least) || opening(wedge) <= 0) return;
                for (const auto& [other, was_open] : others) {
                    if (was_open && opening(*other) <= 0) return;
                }
                best = {by_leaving, by_coming};
                least = moved;
            };
            constexpr int moves = 2 * farthest + 1;
            for (int k = 0; k < moves * moves * moves * moves; ++k) {
                const auto digit = [&](int place) { return static_cast<double>(k / place % moves - farthest); };
                try_moves({digit(1), digit(moves)}, {digit(moves * moves), digit(moves * moves * moves)});
            }
            way[wedge.leaving] = leaving;
            way[wedge.coming] = coming;
            if (!best) continue;
            const auto move = [&](const Slot& slot, const glm::dvec2& by) {
                if (by == glm::dvec2(0)) return;
                glm::dvec3 p = atlas.rounded(position(slot));
                p[u] += swapped ? by.y : by.x;
                p[v] += swapped ? by.x : by.y;
                position(slot) = atlas.origin + p * atlas.step;
                way[slot] += by;
            };
            move(wedge.leaving, (*best)[0]);
            move(wedge.coming, (*best)[1]);
        }
    }
}

}  // namespace lodestone::vgi
