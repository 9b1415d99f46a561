#include "vgi/bake/quads/cluster_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "vgi/bake/charts/harmonic.h"
#include "vgi/bake/charts/merged_pieces.h"

namespace lodestone::vgi {

namespace {

constexpr double least_share = 0.1;  // of an edge: cuts keep so far away from its ends in space
constexpr double flat_half = 0.1;    // how far the flat half of a half-disk bulges: no three vertices in line
// How near to a vertex a line crosses an edge that it goes to the vertex; a share of the edge, in the plane. So it
// makes half as many pieces of triangles.
constexpr double nearly = 0.3;
constexpr double exactly = 1e-9;  // only where it meets the vertex

}  // namespace

ClusterCut::ClusterCut(const Surface& surface, std::span<const uint32_t> triangles)
    : patch(take_chart_mesh(surface, triangles)) {
    merge_pieces(patch, surface.uncut);
    number_ = patch.numbers();
}

std::vector<uint32_t> ClusterCut::numbered(std::span<const uint32_t> vertices) const {
    std::vector<uint32_t> own;
    for (const uint32_t v : vertices) own.push_back(number_.at(v));
    return own;
}

std::string ClusterCut::run(const Outline& outline) {
    const std::vector<uint32_t> begin = numbered(outline.begins), middle = numbered(outline.middles);
    if (!flatten(numbered(outline.corners), outline.centre != none)) return "cannot be flattened";
    if (outline.centre == none) {
        choose_centre();
    } else {
        centre = numbered(std::array{outline.centre})[0];
    }
    return cut(begin, middle, {"has a ray that leaves its sector", "falls into parts that are no quads"});
}

std::string ClusterCut::halve(std::span<const uint32_t> corners, size_t first, size_t second) {
    const std::vector<uint32_t> corner = numbered(corners);
    if (!flatten(corner, false)) return "cannot be flattened";
    centre = corner[first];
    return cut(std::array{corner[first], corner[second]}, std::array{corner[second]},
               {"has a chord that leaves it", "falls into parts that are no halves"});
}

std::string ClusterCut::cut(std::span<const uint32_t> begins, std::span<const uint32_t> ends, const Faults& faults) {
    // Lines that go to vertices may get into each other's way; then they go straight.
    const ChartMesh whole = patch;
    std::string fault = cut(begins, ends, faults, nearly);
    if (fault.empty()) return fault;
    patch = whole;
    walls_.clear();
    return cut(begins, ends, faults, exactly);
}

std::string ClusterCut::cut(std::span<const uint32_t> begins, std::span<const uint32_t> ends, const Faults& faults,
                            double snap) {
    snap_ = snap;
    used_ = patch.on_boundary();
    used_[centre] = true;
    for (const uint32_t end : ends) {
        std::vector<uint32_t> line;
        if (!cut_line(end, line)) return faults.leaves;
        add_walls(line);
    }
    return divide(begins) ? "" : faults.falls;
}

ClusterCut::Turns ClusterCut::turns_of(const std::vector<uint32_t>& corner) const {
    Turns turns{patch.boundary(), {}, {}};
    std::vector<uint32_t>& loop = turns.loop;
    std::rotate(loop.begin(), std::ranges::find(loop, corner[0]), loop.end());
    double total = 0;
    std::vector<double> length(loop.size());
    for (size_t i = 0; i < loop.size(); ++i) {
        length[i] = glm::length(patch.positions[loop[(i + 1) % loop.size()]] - patch.positions[loop[i]]);
        total += length[i];
    }
    turns.turn.resize(loop.size());
    double turned = 0;
    for (size_t side = 0, i = 0; i < loop.size(); ++side) {
        turns.begin_of_side.push_back(turned);
        // Edges of one side: up to the next corner.
        const uint32_t end = corner[(side + 1) % corner.size()];
        size_t last = i;
        double along = 0;
        do {
            along += length[last];
            ++last;
        } while (loop[last % loop.size()] != end && last < loop.size());
        const auto edges = static_cast<double>(last - i);
        const double share = 0.5 / static_cast<double>(corner.size()) + 0.5 * along / total;
        for (; i < last; ++i) {
            turns.turn[i] = turned;
            turned += share * (0.1 / edges + 0.9 * (along > 0 ? length[i] / along : 1 / edges));
        }
    }
    return turns;
}

bool ClusterCut::flatten(const std::vector<uint32_t>& corner, bool half) {
    const Turns turns = turns_of(corner);
    const size_t sides = turns.begin_of_side.size();
    patch.flat.assign(patch.positions.size(), {0, 0});
    for (size_t i = 0; i < turns.loop.size(); ++i) {
        const double turn = turns.turn[i];
        double angle = 2 * turn, height = 1;
        if (half) {
            const double from = turns.begin_of_side[sides - 3], to = turns.begin_of_side[sides - 1];
            const bool flat = turn >= from && turn < to;
            angle = flat ? 1 + (turn - from) / (to - from) : (turn - to + (turn < to ? 1 : 0)) / (1 - to + from);
            if (flat) height = flat_half;
        }
        patch.flat[turns.loop[i]] = {std::cos(angle * std::numbers::pi), std::sin(angle * std::numbers::pi) * height};
    }
    HarmonicSolver solver(patch);
    if (solver.solve({}) && patch.flipped() == 0) return true;
    uniform = true;
    return solver.solve({}, true);
}
void ClusterCut::choose_centre() {
    const std::vector<bool> rim = patch.on_boundary();
    double nearest = 1e300;
    for (uint32_t v = 0; v < patch.positions.size(); ++v) {
        const double d = glm::dot(patch.flat[v], patch.flat[v]);
        if (!rim[v] && d < nearest) {
            nearest = d;
            centre = v;
        }
    }
    // None at all, or far from the middle: a new one in the triangle around the middle.
    if (centre != none && nearest < 0.2) return;
    uint32_t around = 0;
    double best = -1e300;
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) {
        const auto& v = patch.triangles[t].vertices;
        double least = 1e300;
        for (uint32_t k = 0; k < 3; ++k)
            least = std::min(least, cross(patch.flat[v[(k + 1) % 3]] - patch.flat[v[k]], -patch.flat[v[k]]));
        if (least > best) {
            best = least;
            around = t;
        }
    }
    centre = patch.split_triangle(around);
}

uint32_t ClusterCut::edge_out_of(uint32_t vertex) const {
    uint32_t out = none;
    for (uint32_t h = 0; h < patch.twin.size() && (out == none || patch.twin[out] != none); ++h) {
        if (patch.from(h) == vertex) out = h;
    }
    return out;
}

uint32_t ClusterCut::edge_towards(uint32_t target, uint32_t vertex, uint32_t out) const {
    uint32_t found = none, best = none, h = out;
    double most = -1e300;
    do {
        if (patch.to(h) == target) return h;
        const glm::dvec2 a = patch.flat[patch.to(h)] - patch.flat[vertex],
                         b = patch.flat[patch.to(next_corner(h))] - patch.flat[vertex],
                         d = patch.flat[target] - patch.flat[vertex];
        const double ca = cross(a, d), cb = cross(d, b);
        if (ca >= 0 && cb > 0 && found == none) found = h;
        // Rounding may leave none: then the one that misses least.
        const double miss = std::min(ca / (glm::length(a) + 1e-300), cb / (glm::length(b) + 1e-300));
        if (glm::dot(a + b, d) > 0 && miss > most) {
            most = miss;
            best = h;
        }
        h = patch.twin[previous_corner(h)];
    } while (h != none && h != out);
    return found != none ? found : best;
}

bool ClusterCut::are_joined(uint32_t out, uint32_t other) const {
    uint32_t h = out;
    do {
        if (patch.to(h) == other || patch.to(next_corner(h)) == other) return true;
        h = patch.twin[previous_corner(h)];
    } while (h != none && h != out);
    return false;
}

uint32_t ClusterCut::step_across(uint32_t vertex, uint32_t before, const glm::dvec2& goal, uint32_t& out) {
    const uint32_t edge = next_corner(out), a = patch.from(edge), b = patch.to(edge);
    const glm::dvec2 d = goal - patch.flat[vertex];
    const double ca = std::max(0.0, cross(patch.flat[a] - patch.flat[vertex], d)),
                 cb = std::max(0.0, cross(d, patch.flat[b] - patch.flat[vertex]));
    double share = ca + cb > 0 ? ca / (ca + cb) : 0.5;
    const uint32_t near = share < 0.5 ? a : b;
    if (std::min(share, 1 - share) < snap_ && !used_[near]) {
        const uint32_t out_of_near = near == a ? edge : next_corner(edge);
        // Two edges of one triangle would be a corner in a side that is laid out straight.
        if (snap_ == exactly || before == none || !are_joined(out_of_near, before)) {
            out = out_of_near;
            return near;
        }
    }
    if (patch.twin[edge] == none || (used_[a] && used_[b] && wall(a, b))) return none;
    share = std::clamp(share, 1e-6, 1 - 1e-6);
    const uint32_t made = patch.split_edge(edge, std::clamp(share, least_share, 1 - least_share), share);
    used_.push_back(false);
    out = next_corner(edge);
    return made;
}

bool ClusterCut::cut_line(uint32_t target, std::vector<uint32_t>& path) {
    const glm::dvec2 goal = patch.flat[target];
    uint32_t x = centre, out = edge_out_of(centre);
    path.push_back(x);
    const size_t most_steps = patch.triangles.size() + 1000;
    for (size_t step = 0; step < most_steps; ++step) {
        out = edge_towards(target, x, out);
        if (out == none) return false;
        if (patch.to(out) == target) {
            path.push_back(target);
            return true;
        }
        x = step_across(x, path.size() > 1 ? path[path.size() - 2] : none, goal, out);
        if (x == none) return false;
        used_[x] = true;
        path.push_back(x);
    }
    return false;
}

bool ClusterCut::divide(std::span<const uint32_t> begin) {
    quad.assign(patch.triangles.size(), none);
    std::vector<uint32_t> begin_of(patch.positions.size(), none), stack;
    for (uint32_t s = 0; s < begin.size(); ++s) begin_of[begin[s]] = s;
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        if (patch.twin[h] != none || begin_of[patch.from(h)] == none) continue;
        const uint32_t side = begin_of[patch.from(h)];
        if (quad[h / 3] != none) return false;
        quad[h / 3] = side;
        stack.push_back(h / 3);
        while (!stack.empty()) {
            const uint32_t t = stack.back();
            stack.pop_back();
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t e = t * 3 + k, g = patch.twin[e];
                if (g == none || wall(patch.from(e), patch.to(e))) continue;
                if (quad[g / 3] == none) {
                    quad[g / 3] = side;
                    stack.push_back(g / 3);
                } else if (quad[g / 3] != side) {
                    return false;
                }
            }
        }
    }
    return std::ranges::find(quad, none) == quad.end();
}
void ClusterCut::add_walls(const std::vector<uint32_t>& path) {
    for (size_t i = 1; i < path.size(); ++i)
        walls_.insert({std::min(path[i - 1], path[i]), std::max(path[i - 1], path[i])});
}

uint32_t put_back(const ClusterCut& cut, std::span<const uint32_t> quads, Surface& surface,
                  std::vector<SurfaceTriangle>& triangles, std::vector<uint32_t>& label) {
    std::vector<uint32_t> number = cut.patch.origin;
    for (uint32_t v = 0; v < number.size(); ++v) {
        if (number[v] != none) continue;
        number[v] = static_cast<uint32_t>(surface.positions.size());
        surface.positions.push_back(cut.patch.positions[v]);
    }
    for (size_t t = 0; t < cut.patch.triangles.size(); ++t) {
        SurfaceTriangle global = surface.places.adopt(cut.patch.triangles[t], cut.patch.places);
        for (uint32_t& v : global.vertices) v = number[v];
        triangles.push_back(global);
        label.push_back(quads[cut.quad[t]]);
    }
    return number[cut.centre];
}

}  // namespace lodestone::vgi
