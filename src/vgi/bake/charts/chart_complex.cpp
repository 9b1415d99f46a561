#include "vgi/bake/charts/chart_complex.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <string>

namespace lodestone::vgi {

namespace {

class Tracing {
public:
    Tracing(const Surface& surface, std::span<const uint32_t> twins, std::span<const uint32_t> label, uint32_t count,
            std::span<const uint32_t> corners)
        : surface_(surface),
          twins_(twins),
          label_(label),
          count_(count),
          is_corner_(surface.positions.size(), false),
          is_given_(surface.positions.size(), false) {
        for (const uint32_t v : corners) is_given_[v] = is_corner_[v] = true;
    }

    Result<ChartComplex> run() {
        find_corners();
        ChartComplex patches;
        patches.sides.resize(count_);
        std::vector<uint32_t> arc_of(twins_.size(), none);  // border half-edge: its arc
        std::vector<uint32_t> loops(count_, 0);
        std::vector<bool> done(twins_.size(), false);
        for (uint32_t start = 0; start < twins_.size(); ++start) {
            if (!border(start) || done[start] || !is_corner_[from(start)]) continue;
            ++loops[label_[start / 3]];
            uint32_t h = start;
            do {
                // One side: to the next corner.
                std::vector<uint32_t> run;
                do {
                    run.push_back(h);
                    done[h] = true;
                    h = next_border(h);
                } while (!is_corner_[from(h)]);
                add_side(run, arc_of, patches);
            } while (h != start);
        }
        for (uint32_t h = 0; h < twins_.size(); ++h) {
            if (border(h) && !done[h]) return wrong(label_[h / 3], "has a border without corners");
        }
        if (auto good = check_disks(patches, loops); !good) return tl::unexpected(good.error());
        if (auto good = check_contacts(patches); !good) return tl::unexpected(good.error());
        return patches;
    }

private:
    uint32_t from(uint32_t h) const { return surface_.triangles[h / 3].vertices[h % 3]; }
    uint32_t to(uint32_t h) const { return from(next_corner(h)); }
    bool border(uint32_t h) const { return twins_[h] == none || label_[h / 3] != label_[twins_[h] / 3]; }
    // The border half-edge of the same patch that goes on from the end of h.
    uint32_t next_border(uint32_t h) const {
        for (;;) {
            h = next_corner(h);
            if (border(h)) return h;
            h = twins_[h];
        }
    }
    static tl::unexpected<Error> wrong(uint32_t patch, const std::string& what) {
        return fail(Fault::invariant, "patch " + std::to_string(patch) + ": " + what);
    }

    // Where three borders or more meet, every border edge counted once.
    void find_corners() {
        std::vector<uint32_t> borders(surface_.positions.size(), 0);
        for (uint32_t h = 0; h < twins_.size(); ++h) {
            if (!border(h) || (twins_[h] != none && twins_[h] < h)) continue;
            ++borders[from(h)];
            ++borders[to(h)];
        }
        for (uint32_t v = 0; v < borders.size(); ++v) {
            if (borders[v] < 3) continue;
            is_corner_[v] = true;
            is_given_[v] = false;
        }
    }

    // run: the half-edges of a patch from corner to corner. They are the arc that the patch across has made of them, or
    // a new one.
    void add_side(const std::vector<uint32_t>& run, std::vector<uint32_t>& arc_of, ChartComplex& patches) const {
        const uint32_t patch = label_[run[0] / 3], across = twins_[run[0]];
        if (across != none && arc_of[across] != none) {
            patches.sides[patch].push_back({arc_of[across], true});
            patches.arcs[arc_of[across]].right = patch;
            return;
        }
        const auto number = static_cast<uint32_t>(patches.arcs.size());
        Arc arc;
        arc.left = patch;
        for (const uint32_t g : run) {
            arc_of[g] = number;
            arc.vertices.push_back(from(g));
            arc.length += glm::length(surface_.positions[to(g)] - surface_.positions[from(g)]);
        }
        arc.vertices.push_back(to(run.back()));
        patches.arcs.push_back(std::move(arc));
        patches.sides[patch].push_back({number, false});
    }

    // loops: per patch, the borders it has.
    Result<void> check_disks(const ChartComplex& patches, const std::vector<uint32_t>& loops) const {
        // Euler: a connected patch is a disk iff vertices - edges + triangles is 1.
        std::vector<int64_t> euler(count_, 0);
        std::vector<uint32_t> last(surface_.positions.size(), none);
        const std::vector<std::vector<uint32_t>> triangles = members_of(label_, count_);
        for (uint32_t p = 0; p < count_; ++p) {
            for (const uint32_t t : triangles[p]) {
                ++euler[p];
                for (uint32_t k = 0; k < 3; ++k) {
                    const uint32_t h = t * 3 + k, v = from(h);
                    if (last[v] != p) {
                        last[v] = p;
                        ++euler[p];
                    }
                    if (border(h) || twins_[h] > h) --euler[p];
                }
            }
            if (loops[p] != 1 || euler[p] != 1) return wrong(p, "is not a disk");
            if (patches.sides[p].size() < 3) return wrong(p, "has fewer than three sides");
        }
        return {};
    }

    // As in CellComplex::validate: corners shared less arcs shared is one.
    Result<void> check_contacts(const ChartComplex& patches) const {
        std::map<std::pair<uint32_t, uint32_t>, int> contacts;
        std::map<uint32_t, std::vector<uint32_t>> at_corner;
        for (uint32_t p = 0; p < count_; ++p) {
            for (const Side& side : patches.sides[p]) {
                const auto& v = patches.arcs[side.arc].vertices;
                at_corner[side.reversed ? v.back() : v.front()].push_back(p);
            }
        }
        for (auto& [corner, around] : at_corner) {
            if (is_given_[corner]) continue;
            std::sort(around.begin(), around.end());
            for (size_t i = 0; i < around.size(); ++i) {
                for (size_t j = i + 1; j < around.size(); ++j) {
                    if (around[i] == around[j]) return wrong(around[i], "meets itself in a corner");
                    ++contacts[{around[i], around[j]}];
                }
            }
        }
        for (const Arc& arc : patches.arcs) {
            const bool between_given = is_given_[arc.vertices.front()] && is_given_[arc.vertices.back()];
            if (arc.right != none && !between_given) --contacts[std::minmax(arc.left, arc.right)];
        }
        for (const auto& [pair, number] : contacts) {
            if (number != 1)
                return wrong(pair.first, "touches patch " + std::to_string(pair.second) + " in " +
                                             std::to_string(number) + " places");
        }
        return {};
    }

    const Surface& surface_;
    const std::span<const uint32_t> twins_, label_;
    const uint32_t count_;
    std::vector<bool> is_corner_, is_given_;  // per vertex; given: and no more than two borders meet there
};

}  // namespace

std::vector<double> places_along(const Arc& arc, const std::vector<glm::dvec3>& positions) {
    constexpr double least_step = 1e-5;
    const size_t steps = arc.vertices.size() - 1;
    std::vector<double> places(steps + 1, 0);
    for (size_t i = 0; i < steps; ++i) {
        const double length = glm::length(positions[arc.vertices[i + 1]] - positions[arc.vertices[i]]);
        places[i + 1] = places[i] + (arc.length > 0 ? std::max(length, least_step * arc.length) : 1);
    }
    const double whole = places.back();
    for (double& place : places) place /= whole;
    return places;
}

std::vector<std::vector<uint32_t>> members_of(std::span<const uint32_t> label, uint32_t count) {
    std::vector<size_t> sizes(count, 0);
    for (const uint32_t patch : label) ++sizes[patch];
    std::vector<std::vector<uint32_t>> members(count);
    for (uint32_t patch = 0; patch < count; ++patch) members[patch].reserve(sizes[patch]);
    for (uint32_t t = 0; t < label.size(); ++t) members[label[t]].push_back(t);
    return members;
}

Result<ChartComplex> trace_charts(const Surface& surface, std::span<const uint32_t> twins,
                                  std::span<const uint32_t> label, uint32_t count, std::span<const uint32_t> corners) {
    return Tracing(surface, twins, label, count, corners).run();
}

}  // namespace lodestone::vgi
