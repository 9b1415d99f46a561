#include "vgi/bake/images/borders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

namespace {

constexpr int farthest = 3;  // lattice steps a sample may give way, each way
constexpr uint32_t fewest_straight_cells = 4;

// A sample next to an end of an arc: it is the first of the chart on the arc's one side, the last of that on the other.
struct Slot {
    uint32_t arc = 0, step = 0;
    auto operator<=>(const Slot&) const = default;
};

// A chart's corner, between the samples next to it on the side that leaves it and on the side that comes in.
struct Wedge {
    Slot leaving, coming;
};

using WedgesAround = std::map<uint32_t, std::vector<Wedge>>;  // by the vertex they are at

WedgesAround wedges_of(const ChartComplex& patches, const Atlas& atlas, const SampleDepths& depths) {
    WedgesAround wedges;
    for (uint32_t q = 0; q < patches.sides.size(); ++q) {
        const auto& sides = patches.sides[q];
        if (atlas.cells_of(q) >> atlas.unsampled_levels[q] < fewest_straight_cells) continue;
        const uint32_t cells = atlas.attribute_cells_of(q), last = atlas.leaves_per_side(q) - 1;
        // Of a side, the sample so many texels from where it begins.
        const auto slot = [&](uint32_t side, uint32_t texels) {
            const Side& its = sides[side];
            return Slot{its.arc, its.reversed ? cells - texels : texels};
        };
        for (uint32_t s = 0; s < 4; ++s) {
            const uint32_t before = (s + 3) % 4;
            const auto [x, y] = on_side(s, 0u, last);
            const SquareDepths at = depths.of(atlas.leaf(q, x, y));
            const auto texels = [&](uint32_t side) { return atlas.attribute_ratio_of(q) << at.sides[side]; };
            wedges[patches.begin_of(sides[s])].push_back({slot(s, texels(s)), slot(before, cells - texels(before))});
        }
    }
    return wedges;
}

// Opens the wedges around one vertex after the other.
class WedgeOpening {
public:
    using Samples = std::vector<std::vector<BorderSample>>;
    WedgeOpening(Samples& samples, const Atlas& atlas, const glm::dvec3& up)
        : samples_(samples),
          atlas_(atlas),
          u_(up.x != 0   ? 1
             : up.y != 0 ? 2
                         : 0),
          v_(up.x != 0   ? 2
             : up.y != 0 ? 0
                         : 1),
          swapped_(up.x + up.y + up.z < 0) {}

    void open(const std::vector<Wedge>& around) {
        // All samples at its end of the first arc are where the vertex is.
        const Slot& any = around.front().leaving;
        const auto& arc = samples_[any.arc];
        corner_ = (2 * any.step < arc.size() ? arc.front() : arc.back()).position;
        const glm::dvec2 rounded_corner = flat(atlas_.rounded(corner_));
        way_.clear();
        for (const Wedge& wedge : around) {
            for (const Slot& slot : {wedge.leaving, wedge.coming})
                way_[slot] = flat(atlas_.rounded(position(slot))) - rounded_corner;
        }
        for (const Wedge& wedge : around) open(wedge, around);
    }

private:
    using Moves = std::array<glm::dvec2, 2>;  // of the sample leaving and the one coming in

    void open(const Wedge& wedge, const std::vector<Wedge>& around) {
        const Moves exact_ways = {exact(position(wedge.leaving)) - exact(corner_),
                                  exact(position(wedge.coming)) - exact(corner_)};
        // Turned over, or flat, by rounding: corners that are wide open are none of ours.
        if (opening(wedge) > 0 || glm::dot(exact_ways[0], exact_ways[1]) <= 0) return;
        const std::optional<Moves> best = least_moves(wedge, around, exact_ways);
        if (!best) return;
        move(wedge.leaving, (*best)[0]);
        move(wedge.coming, (*best)[1]);
    }

    // The moves that open the wedge and leave its samples nearest to where they are exactly; what opens must not close
    // others that share its samples.
    std::optional<Moves> least_moves(const Wedge& wedge, const std::vector<Wedge>& around, const Moves& exact_ways) {
        std::vector<const Wedge*> others;  // open ones
        for (const Wedge& other : around) {
            const bool shares = other.leaving == wedge.coming || other.coming == wedge.leaving;
            if (&other != &wedge && shares && opening(other) > 0) others.push_back(&other);
        }
        const glm::dvec2 leaving = way_[wedge.leaving], coming = way_[wedge.coming];
        std::optional<Moves> best;
        double least = 0;
        const auto try_moves = [&](const Moves& by) {
            way_[wedge.leaving] = leaving + by[0];
            way_[wedge.coming] = coming + by[1];
            const auto off = [](const glm::dvec2& p, const glm::dvec2& q) { return glm::dot(p - q, p - q); };
            const double moved = off(way_[wedge.leaving], exact_ways[0]) + off(way_[wedge.coming], exact_ways[1]);
            if ((best && moved >= least) || opening(wedge) <= 0) return;
            if (std::ranges::any_of(others, [&](const Wedge* other) { return opening(*other) <= 0; })) return;
            best = by;
            least = moved;
        };
        constexpr int moves = 2 * farthest + 1;
        for (int k = 0; k < moves * moves * moves * moves; ++k) {
            const auto digit = [&](int place) { return static_cast<double>(k / place % moves - farthest); };
            try_moves(
                {glm::dvec2(digit(1), digit(moves)), glm::dvec2(digit(moves * moves), digit(moves * moves * moves))});
        }
        way_[wedge.leaving] = leaving;
        way_[wedge.coming] = coming;
        return best;
    }

    void move(const Slot& slot, const glm::dvec2& by) {
        if (by == glm::dvec2(0)) return;
        glm::dvec3 p = atlas_.rounded(position(slot));
        p[u_] += swapped_ ? by.y : by.x;
        p[v_] += swapped_ ? by.x : by.y;
        position(slot) = atlas_.origin + p * atlas_.step;
        way_[slot] += by;
    }

    double opening(const Wedge& wedge) { return cross(way_[wedge.leaving], way_[wedge.coming]); }
    glm::dvec3& position(const Slot& slot) { return samples_[slot.arc][slot.step].position; }
    glm::dvec2 flat(const glm::dvec3& p) const {
        return swapped_ ? glm::dvec2(p[v_], p[u_]) : glm::dvec2(p[u_], p[v_]);
    }
    glm::dvec2 exact(const glm::dvec3& p) const { return flat((p - atlas_.origin) / atlas_.step); }

    Samples& samples_;
    const Atlas& atlas_;
    // On the lattice, seen from above: the two axes across from `up` so that turning left is positive.
    const int u_, v_;
    const bool swapped_;
    glm::dvec3 corner_{0};
    std::map<Slot, glm::dvec2> way_;  // from the corner, on the lattice
};

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

void Borders::keep_corners_open(const ChartComplex& patches, const Atlas& atlas, const SampleDepths& depths,
                                const glm::dvec3& up) {
    WedgeOpening opening(samples_, atlas, up);
    for (const auto& [vertex, around] : wedges_of(patches, atlas, depths)) opening.open(around);
}

}  // namespace lodestone::vgi
