// A cluster taken out, flattened onto a disk and cut along lines, so that its parts are disks whatever it looks like.
// The lines are straight but for vertices that are near them, which they go through: so they cut fewer triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "base/threads.h"
#include "vgi/bake/charts/chart_mesh.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// One cut, by run() or by halve().
class ClusterCut {
public:
    ClusterCut(const Surface& surface, std::span<const uint32_t> triangles);

    ChartMesh patch;
    std::vector<uint32_t>
        quad;                // per triangle of the patch: its part, as Outline::begins has them; or its half, 0 or 1
    uint32_t centre = none;  // of the patch: where the cuts come from
    bool uniform = false;    // flattened with equal weights, because the better ones could not be solved

    // What it is to be cut into; vertices of the surface, all but a given centre in order around it.
    struct Outline {
        std::vector<uint32_t> corners;  // of the whole
        std::vector<uint32_t> begins;   // per quad, a corner of its own
        std::vector<uint32_t> middles;  // that rays go to: between two quads
        uint32_t centre = none;         // where they come from, on the boundary; none: one is chosen inside
    };
    // Into quads, by rays. Empty where all went well, else what is wrong with the cluster.
    std::string run(const Outline& outline);
    // Into two, by a line from a corner to another: positions in `corners`, which are vertices of the surface
    // in order around it. The half that begins at the first corner is 0.
    std::string halve(std::span<const uint32_t> corners, size_t first, size_t second);

private:
    // Where the vertices of the boundary go: loop[i] to turn[i] of a whole turn, 0 .. 1.
    struct Turns {
        std::vector<uint32_t> loop;  // from the first corner
        std::vector<double> turn;
        std::vector<double> begin_of_side;
    };

    std::vector<uint32_t> numbered(std::span<const uint32_t> vertices) const;  // vertices of the surface, on the patch
    // Every side takes an equal part and a part by its length, and so does every edge of it.
    Turns turns_of(const std::vector<uint32_t>& corner) const;
    // Onto the unit circle. If the centre is on the boundary (half), the last two sides, either side of the centre,
    // make the flat half of a half-disk.
    bool flatten(const std::vector<uint32_t>& corner, bool half);
    void choose_centre();
    // A half-edge out of a vertex; on the boundary, the first of the edges from there.
    uint32_t edge_out_of(uint32_t vertex) const;
    // Around a vertex, from the half-edge `out` of it: the half-edge that goes to the target; else that of the triangle
    // in whose angle the target lies; none where there is neither.
    uint32_t edge_towards(uint32_t target, uint32_t vertex, uint32_t out) const;
    // Whether the vertex that the half-edge `out` begins at has an edge to the other; not on the boundary.
    bool are_joined(uint32_t out, uint32_t other) const;
    // From a vertex across the triangle of its half-edge `out` towards the goal: to a corner of it, or to a new vertex
    // on the edge across. before: the vertex before it on the way, or none. `out` becomes a half-edge of the vertex it
    // goes to; none where another line or the boundary is met.
    uint32_t step_across(uint32_t vertex, uint32_t before, const glm::dvec2& goal, uint32_t& out);
    struct Faults {
        const char *leaves, *falls;  // a line leaves the cluster; what lies between lines is not what it should be
    };
    // Along lines from the centre to the ends, into parts that begin at `begins`. Empty where all went well.
    std::string cut(std::span<const uint32_t> begins, std::span<const uint32_t> ends, const Faults& faults);
    // The same with lines that go to vertices which are so near: a share of an edge, in the plane.
    std::string cut(std::span<const uint32_t> begins, std::span<const uint32_t> ends, const Faults& faults,
                    double snap);
    // From the centre to a vertex on the boundary, splitting the edges on the way.
    bool cut_line(uint32_t target, std::vector<uint32_t>& path);
    // Parts between the lines: what is reached from the edge after its own corner without crossing one.
    bool divide(std::span<const uint32_t> begin);
    void add_walls(const std::vector<uint32_t>& path);
    bool wall(uint32_t a, uint32_t b) const { return walls_.contains({std::min(a, b), std::max(a, b)}); }

    struct PairHash {
        size_t operator()(const std::pair<uint32_t, uint32_t>& p) const {
            return std::hash<uint64_t>()(uint64_t{p.first} << 32 | p.second);
        }
    };
    std::unordered_set<std::pair<uint32_t, uint32_t>, PairHash> walls_;
    std::unordered_map<uint32_t, uint32_t> number_;  // vertex of the patch, by vertex of the surface
    std::vector<bool> used_;                         // vertices of the boundary and of rays
    double snap_ = 0;                                // as cut() has it
};

// Puts a cut patch back: vertices it made are added to the surface, its triangles to `triangles`, and the quad of each,
// quads[side it begins at], to `label`. Returns the centre's number on the surface.
uint32_t put_back(const ClusterCut& cut, std::span<const uint32_t> quads, Surface& surface,
                  std::vector<SurfaceTriangle>& triangles, std::vector<uint32_t>& label);

// A few at a time, for memory's sake: work(i) side by side, then put(i) in order, whatever thread was first.
// members: triangles of each. Fault::interrupted where it was told to stop; then not all were put.
template <class Work, class Put>
Result<void> in_batches(const std::vector<std::vector<uint32_t>>& members, const Progress& progress, Work&& work,
                        Put&& put) {
    constexpr size_t most_triangles = 400000;
    for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
        size_t triangles = 0;
        do {
            triangles += members[end].size();
            ++end;
        } while (end < members.size() && triangles + members[end].size() <= most_triangles);
        parallel_for(end - begin, 1, [&](size_t first, size_t last) {
            for (size_t i = first; i < last && !progress.stopped(); ++i) work(begin + i);
        });
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        for (size_t i = begin; i < end; ++i) put(i);
    }
    return {};
}

}  // namespace lodestone::vgi
