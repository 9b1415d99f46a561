#include "vgi/bake/charts/quadrangulate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "base/check.h"
#include "base/threads.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/chart_mesh.h"
#include "vgi/bake/charts/harmonic.h"

namespace lodestone::vgi {

namespace {

constexpr double middle_tolerance = 0.1;  // of an arc's length: a vertex so near to the middle will do
constexpr double least_share = 0.1;       // of an edge: cuts keep so far away from its ends in space
constexpr double flat_half = 0.1;         // how far the flat half of a half-disk bulges: no three vertices in line
constexpr double snap = 1e-9;             // of an edge, in the plane: nearer to a vertex is at the vertex

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

// The inner vertex of an arc nearest to its middle, as a position in arc.vertices; 0 where none is near.
size_t middle_of(const Arc& arc, const std::vector<glm::dvec3>& positions, double tolerance) {
    double along = 0, nearest = tolerance * arc.length;
    size_t best = 0;
    for (size_t i = 1; i + 1 < arc.vertices.size(); ++i) {
        along += glm::length(positions[arc.vertices[i]] - positions[arc.vertices[i - 1]]);
        if (std::abs(along - arc.length / 2) <= nearest) {
            nearest = std::abs(along - arc.length / 2);
            best = i;
        }
    }
    return best;
}

// A vertex near the middle of every arc.
void insert_middles(ChartMesh& whole, std::vector<uint32_t>& label, const ChartComplex& patches) {
    // Half-edges by their ends, of borders alone.
    const auto key = [](uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; };
    std::unordered_map<uint64_t, uint32_t> edge;
    for (uint32_t h = 0; h < whole.twin.size(); ++h) {
        if (whole.twin[h] == none || label[h / 3] != label[whole.twin[h] / 3])
            edge[key(whole.from(h), whole.to(h))] = h;
    }
    for (const Arc& arc : patches.arcs) {
        if (middle_of(arc, whole.positions, middle_tolerance) != 0) continue;
        double along = 0;
        for (size_t i = 1; i < arc.vertices.size(); ++i) {
            const uint32_t a = arc.vertices[i - 1], b = arc.vertices[i];
            const double step = glm::length(whole.positions[b] - whole.positions[a]);
            if (along + step < arc.length / 2 && i + 1 < arc.vertices.size()) {
                along += step;
                continue;
            }
            const double share = step > 0 ? std::clamp((arc.length / 2 - along) / step, 0.02, 0.98) : 0.5;
            const size_t before = whole.triangles.size();
            const uint32_t h = edge.at(key(a, b)), g = whole.twin[h];
            whole.split_edge(h, share, share);
            label.push_back(label[h / 3]);
            if (g != none) label.push_back(label[g / 3]);
            // Edges that went to the new triangles.
            for (uint32_t e = static_cast<uint32_t>(before) * 3; e < whole.twin.size(); ++e) {
                const auto moved = edge.find(key(whole.from(e), whole.to(e)));
                if (moved != edge.end()) moved->second = e;
            }
            break;
        }
    }
}

class ClusterCut {
public:
    ClusterCut(const Surface& surface, std::span<const uint32_t> triangles)
        : patch(take_chart_mesh(surface, triangles)) {}

    ChartMesh patch;
    std::vector<uint32_t> quad;  // per triangle of the patch: its quad, as Outline::begins has them
    uint32_t centre = none;
    bool uniform = false;

    // What it is to be cut into; vertices of the surface, all but a given centre in order around it.
    struct Outline {
        std::vector<uint32_t> corners;  // of the whole
        std::vector<uint32_t> begins;   // per quad, a corner of its own
        std::vector<uint32_t> middles;  // that rays go to: between two quads
        uint32_t centre = none;         // where they come from, on the boundary; none: one is chosen inside
    };
    // Empty where all went well.
    std::string run(const Outline& outline) {
        const auto number = patch.numbers();
        const auto numbered = [&](std::span<const uint32_t> vertices) {
            std::vector<uint32_t> own;
            for (const uint32_t v : vertices) own.push_back(number.at(v));
            return own;
        };
        const std::vector<uint32_t> begin = numbered(outline.begins), middle = numbered(outline.middles);
        if (!flatten(numbered(outline.corners), outline.centre != none)) return "cannot be flattened";
        if (outline.centre == none) {
            choose_centre();
        } else {
            centre = number.at(outline.centre);
        }
        used_ = patch.on_boundary();
        used_[centre] = true;
        std::vector<std::vector<uint32_t>> rays;
        for (const uint32_t m : middle) {
            rays.emplace_back();
            if (!cut_ray(m, rays.back())) return "has a ray that leaves its sector";
        }
        return divide(begin, rays) ? "" : "falls into parts that are no quads";
    }

private:
    // Where the vertices of the boundary go: loop[i] to turn[i] of a whole turn, 0 .. 1.
    struct Turns {
        std::vector<uint32_t> loop;  // from the first corner
        std::vector<double> turn;
        std::vector<double> begin_of_side;
    };

    // Every side takes an equal part and a part by its length, and so does every edge of it.
    Turns turns_of(const std::vector<uint32_t>& corner) const {
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

    // Onto the unit circle. If the centre is on the boundary (half), the last two sides, either side of the centre,
    // make the flat half of a half-disk.
    bool flatten(const std::vector<uint32_t>& corner, bool half) {
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
            patch.flat[turns.loop[i]] = {std::cos(angle * std::numbers::pi),
                                         std::sin(angle * std::numbers::pi) * height};
        }
        HarmonicSolver solver(patch);
        if (solver.solve({}) && patch.flipped() == 0) return true;
        uniform = true;
        return solver.solve({}, true);
    }
    void choose_centre() {
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

    // A half-edge out of a vertex; on the boundary, the first of the edges from there.
    uint32_t edge_out_of(uint32_t vertex) const {
        uint32_t out = none;
        for (uint32_t h = 0; h < patch.twin.size() && (out == none || patch.twin[out] != none); ++h) {
            if (patch.from(h) == vertex) out = h;
        }
        return out;
    }

    // Around a vertex, from the half-edge `out` of it: the half-edge that goes to the target; else that of the triangle
    // in whose angle the target lies; none where there is neither.
    uint32_t edge_towards(uint32_t target, uint32_t vertex, uint32_t out) const {
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

    // From a vertex across the triangle of its half-edge `out` towards the goal: to a corner of it, or to a new vertex
    // on the edge across. `out` becomes a half-edge of the vertex it goes to; none where a ray or the boundary is met.
    uint32_t step_across(uint32_t vertex, const glm::dvec2& goal, uint32_t& out) {
        const uint32_t edge = next_corner(out), a = patch.from(edge), b = patch.to(edge);
        const glm::dvec2 d = goal - patch.flat[vertex];
        const double ca = std::max(0.0, cross(patch.flat[a] - patch.flat[vertex], d)),
                     cb = std::max(0.0, cross(d, patch.flat[b] - patch.flat[vertex]));
        double share = ca + cb > 0 ? ca / (ca + cb) : 0.5;
        const uint32_t near = share < 0.5 ? a : b;
        if (std::min(share, 1 - share) < snap && !used_[near]) {
            out = near == a ? edge : next_corner(edge);
            return near;
        }
        if (patch.twin[edge] == none || (used_[a] && used_[b] && wall(a, b))) return none;
        share = std::clamp(share, 1e-6, 1 - 1e-6);
        const uint32_t made = patch.split_edge(edge, std::clamp(share, least_share, 1 - least_share), share);
        used_.push_back(false);
        out = next_corner(edge);
        return made;
    }

    // From the centre to a vertex on the boundary, splitting every edge on the way.
    bool cut_ray(uint32_t target, std::vector<uint32_t>& path) {
        const glm::dvec2 goal = patch.flat[target];
        uint32_t x = centre, out = edge_out_of(centre);
        path.push_back(x);
        for (size_t step = 0; step < patch.triangles.size() + 1000; ++step) {
            out = edge_towards(target, x, out);
            if (out == none) return false;
            if (patch.to(out) == target) {
                path.push_back(target);
                return true;
            }
            x = step_across(x, goal, out);
            if (x == none) return false;
            used_[x] = true;
            path.push_back(x);
        }
        return false;
    }
    bool wall(uint32_t a, uint32_t b) const { return walls_.contains({std::min(a, b), std::max(a, b)}); }

    // Quads between the rays: what is reached from the edge after its own corner without crossing one.
    bool divide(const std::vector<uint32_t>& begin, const std::vector<std::vector<uint32_t>>& rays) {
        for (const auto& ray : rays) add_walls(ray);
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
    void add_walls(const std::vector<uint32_t>& path) {
        for (size_t i = 1; i < path.size(); ++i)
            walls_.insert({std::min(path[i - 1], path[i]), std::max(path[i - 1], path[i])});
    }

    struct PairHash {
        size_t operator()(const std::pair<uint32_t, uint32_t>& p) const {
            return std::hash<uint64_t>()(uint64_t{p.first} << 32 | p.second);
        }
    };
    std::unordered_set<std::pair<uint32_t, uint32_t>, PairHash> walls_;
    std::vector<bool> used_;  // vertices of the boundary and of rays
};

// Puts a cut patch back: vertices it made are added to the surface, its triangles to `triangles`, and the quad of each,
// quads[side it begins at], to `label`. Returns the centre's number on the surface.
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

// A few at a time, for memory's sake: work(i) side by side, then put(i) in order, whatever thread was first.
// members: triangles of each.
template <class Work, class Put>
void in_batches(const std::vector<std::vector<uint32_t>>& members, Work&& work, Put&& put) {
    constexpr size_t most_triangles = 400000;
    for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
        size_t triangles = 0;
        do {
            triangles += members[end].size();
            ++end;
        } while (end < members.size() && triangles + members[end].size() <= most_triangles);
        parallel_for(end - begin, 1, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i) work(begin + i);
        });
        for (size_t i = begin; i < end; ++i) put(i);
    }
}

// The surface gets a vertex near the middle of every border of two clusters, and `label` follows its triangles. Returns
// its charts as they are then.
Result<ChartComplex> trace_with_middles(Surface& surface, std::vector<uint32_t>& label, const Clusters& clusters) {
    const std::vector<uint32_t> given = clusters.ready_corners();
    ChartMesh whole;
    whole.twin = surface.twins();
    const auto traced = trace_charts(surface, whole.twin, label, clusters.count, given);
    if (!traced) return tl::unexpected(traced.error());
    whole.positions = std::move(surface.positions);
    whole.triangles = std::move(surface.triangles);
    whole.places = std::move(surface.places);
    whole.origin.resize(whole.positions.size());
    std::iota(whole.origin.begin(), whole.origin.end(), 0u);
    insert_middles(whole, label, *traced);
    surface.positions = std::move(whole.positions);
    surface.triangles = std::move(whole.triangles);
    surface.places = std::move(whole.places);
    return trace_charts(surface, whole.twin, label, clusters.count, given);
}

// Per arc: the vertex nearest to its middle.
std::vector<uint32_t> middles_of(const ChartComplex& patches, const std::vector<glm::dvec3>& positions) {
    std::vector<uint32_t> middle(patches.arcs.size());
    for (size_t a = 0; a < middle.size(); ++a) {
        const size_t at = middle_of(patches.arcs[a], positions, 0.5);
        LODE_CHECK(at > 0, a);
        middle[a] = patches.arcs[a].vertices[at];
    }
    return middle;
}

// Cuts clusters into quads: cut(c) for any cluster on any thread, then put(c) in order.
class ClustersIntoQuads {
public:
    // patches: of the surface with middles. label: per triangle, its cluster.
    ClustersIntoQuads(Surface surface, const Clusters& clusters, const ChartComplex& patches,
                      std::span<const uint32_t> label)
        : patches_(patches),
          middle_(middles_of(patches, surface.positions)),
          members_(members_of(label, clusters.count)),
          ready_(clusters.count, nullptr),
          cuts_(clusters.count),
          faults_(clusters.count),
          corners_(clusters.count),
          middles_(clusters.count) {
        result_.surface = std::move(surface);
        for (const ReadyQuad& quad : clusters.ready) ready_[quad.cluster] = &quad;
        triangles_.reserve(label.size() + label.size() / 16);
        result_.label.reserve(triangles_.capacity());
    }

    const std::vector<std::vector<uint32_t>>& members() const { return members_; }

    void cut(size_t c) {
        if (ready_[c] != nullptr) return;
        for (const Side& side : patches_.sides[c]) {
            const Arc& arc = patches_.arcs[side.arc];
            corners_[c].push_back(side.reversed ? arc.vertices.back() : arc.vertices.front());
            middles_[c].push_back(middle_[side.arc]);
        }
        cuts_[c] = std::make_unique<ClusterCut>(result_.surface, members_[c]);
        faults_[c] = cuts_[c]->run({corners_[c], corners_[c], middles_[c]});
    }

    void put(size_t at) {
        const auto c = static_cast<uint32_t>(at);
        if (!faults_[c].empty()) {
            if (result_.failed.empty()) result_.fault = faults_[c];
            result_.failed.push_back(c);
        }
        if (result_.failed.empty()) {
            if (ready_[c] != nullptr) {
                put_ready(c);
            } else {
                put_cut(c);
            }
        }
        cuts_[c].reset();
        members_[c] = {};
    }

    Quads take() {
        result_.surface.triangles = std::move(triangles_);
        return std::move(result_);
    }

private:
    void put_ready(uint32_t c) {
        for (const uint32_t t : members_[c]) {
            triangles_.push_back(result_.surface.triangles[t]);
            result_.label.push_back(static_cast<uint32_t>(result_.quads.size()));
        }
        result_.quads.push_back({c, ready_[c]->corners});
    }
    void put_cut(uint32_t c) {
        const size_t sides = corners_[c].size();
        std::vector<uint32_t> quads(sides);
        std::iota(quads.begin(), quads.end(), static_cast<uint32_t>(result_.quads.size()));
        const uint32_t centre = put_back(*cuts_[c], quads, result_.surface, triangles_, result_.label);
        for (size_t s = 0; s < sides; ++s)
            result_.quads.push_back(
                {c, {corners_[c][s], middles_[c][s], centre, middles_[c][(s + sides - 1) % sides]}});
        result_.uniform_clusters += cuts_[c]->uniform;
    }

    const ChartComplex& patches_;
    const std::vector<uint32_t> middle_;          // per arc
    std::vector<std::vector<uint32_t>> members_;  // triangles per cluster
    std::vector<const ReadyQuad*> ready_;         // per cluster; null where it is cut
    std::vector<std::unique_ptr<ClusterCut>> cuts_;
    std::vector<std::string> faults_;                       // per cluster, empty where it could be cut
    std::vector<std::vector<uint32_t>> corners_, middles_;  // per cluster, in turn
    std::vector<SurfaceTriangle> triangles_;
    Quads result_;
};

}  // namespace

std::vector<uint32_t> Quads::corners() const {
    std::vector<uint32_t> all;
    for (const Quad& quad : quads) all.insert(all.end(), quad.corners.begin(), quad.corners.end());
    return all;
}

Result<Quads> quadrangulate(Surface surface, const Clusters& clusters) {
    std::vector<uint32_t> label = clusters.label;
    const auto patches = trace_with_middles(surface, label, clusters);
    if (!patches) return tl::unexpected(patches.error());
    ClustersIntoQuads quads(std::move(surface), clusters, *patches, label);
    in_batches(
        quads.members(), [&](size_t c) { quads.cut(c); }, [&](size_t c) { quads.put(c); });
    return quads.take();
}

namespace {

// Pairs of quads, the lower one first, whose common border lies on features for the most part.
std::set<std::pair<uint32_t, uint32_t>> borders_on_features(const Quads& quads, std::span<const uint32_t> twin,
                                                            const FeatureLines& features) {
    std::set<std::pair<uint32_t, uint32_t>> kept;
    if (features.empty()) return kept;
    const Surface& surface = quads.surface;
    std::map<std::pair<uint32_t, uint32_t>, std::array<double, 2>> lengths;  // on features, in all
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] == none || twin[h] < h || quads.label[h / 3] == quads.label[twin[h] / 3]) continue;
        const double length = surface.length(h);
        auto& sum = lengths[std::minmax(quads.label[h / 3], quads.label[twin[h] / 3])];
        if (features.at(surface.triangles, twin, h)) sum[0] += length;
        sum[1] += length;
    }
    for (const auto& [pair, sum] : lengths) {
        if (sum[0] > 0.8 * sum[1]) kept.insert(pair);
    }
    return kept;
}

// recentre(), by its steps.
class Recentring {
public:
    Recentring(Quads& quads, Pivot pivot, const FeatureLines& features)
        : quads_(quads), pivot_(pivot), count_(static_cast<uint32_t>(quads.quads.size())), features_(features) {}

    // How many pivots were left where they were.
    Result<uint32_t> run() {
        if (auto done = find_neighbours(); !done) return tl::unexpected(done.error());
        if (auto done = choose_rings(); !done) return tl::unexpected(done.error());
        share_triangles();
        cuts_.resize(rings_.size());
        in_batches(
            members_, [&](size_t r) { cut(r); }, [&](size_t r) { put(r); });
        quads_.surface.triangles = std::move(triangles_);
        quads_.label = std::move(label_);
        return left_;
    }

private:
    // Quads around their pivot, counter-clockwise; where the boundary opens them (open), from one end of it to the
    // other.
    struct Ring {
        uint32_t pivot;
        bool open;
        std::vector<uint32_t> quads;
    };

    // What is across the sides of quads, and which borders are to stay.
    Result<void> find_neighbours() {
        const std::vector<uint32_t> twin = quads_.surface.twins();
        const auto patches = trace_charts(quads_.surface, twin, quads_.label, count_, quads_.corners());
        if (!patches) return tl::unexpected(patches.error());
        kept_ = borders_on_features(quads_, twin, features_);
        across_.assign(count_, {none, none, none, none});
        std::vector<std::array<uint32_t, 2>> first(patches->arcs.size(), {none, none});
        for (uint32_t q = 0; q < count_; ++q) {
            for (const Side& side : patches->sides[q]) {
                const auto& v = patches->arcs[side.arc].vertices;
                const uint32_t s = corner_of(q, side.reversed ? v.back() : v.front());
                if (s == 4) return fail(Fault::invariant, "quad " + std::to_string(q) + " has lost a corner");
                if (first[side.arc][0] == none) {
                    first[side.arc] = {q, s};
                } else {
                    across_[q][s] = first[side.arc][0];
                    across_[first[side.arc][0]][first[side.arc][1]] = q;
                }
            }
        }
        return {};
    }

    // 4 where the vertex is no corner of it.
    uint32_t corner_of(uint32_t q, uint32_t vertex) const {
        const auto& corners = quads_.quads[q].corners;
        return static_cast<uint32_t>(std::ranges::find(corners, vertex) - corners.begin());
    }
    uint32_t next(uint32_t q, uint32_t vertex) const { return across_[q][(corner_of(q, vertex) + 3) % 4]; }
    uint32_t before(uint32_t q, uint32_t vertex) const { return across_[q][corner_of(q, vertex)]; }

    std::optional<Ring> ring_around(uint32_t q, uint32_t vertex) const {
        uint32_t start = q;
        for (size_t steps = 0; before(start, vertex) != none && before(start, vertex) != q; ++steps) {
            start = before(start, vertex);
            if (steps > count_) return std::nullopt;
        }
        Ring ring{vertex, before(start, vertex) == none, {}};
        if (!ring.open) start = q;
        uint32_t at = start;
        do {
            ring.quads.push_back(at);
            at = next(at, vertex);
            if (ring.quads.size() > count_) return std::nullopt;
        } while (at != none && at != start);
        return ring;
    }

    // Whether a cluster's corner among the quads lies on the boundary.
    bool meets_boundary(const Ring& ring) const {
        return std::ranges::any_of(ring.quads,
                                   [&](uint32_t q) { return across_[q][0] == none || across_[q][3] == none; });
    }
    bool crosses_kept_border(const Ring& ring) const {
        return std::ranges::any_of(ring.quads, [&](uint32_t q) {
            const uint32_t after = next(q, ring.pivot);
            return !kept_.empty() && after != none && kept_.contains(std::minmax(q, after));
        });
    }

    // Rings share no quad: the first of two that would is taken.
    Result<void> choose_rings() {
        ring_of_.assign(count_, none);
        for (uint32_t q = 0; q < count_; ++q) {
            const auto& corners = quads_.quads[q].corners;
            const auto pivots = pivot_ == Pivot::corners   ? std::vector{corners[0]}
                                : pivot_ == Pivot::centres ? std::vector{corners[2]}
                                                           : std::vector{corners[1], corners[3]};
            for (const uint32_t vertex : pivots) {
                if (auto taken = take_ring(q, vertex); !taken) return taken;
            }
        }
        return {};
    }

    Result<void> take_ring(uint32_t q, uint32_t vertex) {
        if (ring_of_[q] != none) return {};
        auto ring = ring_around(q, vertex);
        if (!ring) return fail(Fault::invariant, "quads around a vertex do not close");
        if (ring->quads.size() < (ring->open ? 2u : 3u)) return {};
        if (pivot_ == Pivot::outer_middles && (ring->open || !meets_boundary(*ring))) return {};
        if (std::ranges::any_of(ring->quads, [&](uint32_t r) { return ring_of_[r] != none; })) return {};
        if (crosses_kept_border(*ring)) {
            ++left_;
            return {};
        }
        for (const uint32_t r : ring->quads) ring_of_[r] = static_cast<uint32_t>(rings_.size());
        rings_.push_back(std::move(*ring));
        return {};
    }

    // Triangles of rings go to their members, all others stay what they are.
    void share_triangles() {
        members_.resize(rings_.size());
        triangles_.reserve(quads_.label.size() + quads_.label.size() / 32);
        label_.reserve(triangles_.capacity());
        for (uint32_t t = 0; t < quads_.label.size(); ++t) {
            if (const uint32_t ring = ring_of_[quads_.label[t]]; ring != none) {
                members_[ring].push_back(t);
            } else {
                keep(t);
            }
        }
    }
    void keep(uint32_t triangle) {
        triangles_.push_back(quads_.surface.triangles[triangle]);
        label_.push_back(quads_.label[triangle]);
    }

    void cut(size_t r) {
        const Ring& ring = rings_[r];
        const auto from_pivot = [&](uint32_t q, uint32_t by) {
            return quads_.quads[q].corners[(corner_of(q, ring.pivot) + by) % 4];
        };
        ClusterCut::Outline outline;
        for (const uint32_t q : ring.quads) {
            outline.begins.push_back(from_pivot(q, 2));
            outline.middles.push_back(from_pivot(q, 3));
        }
        outline.corners = outline.begins;
        if (ring.open) {
            // The pivot stays where it is on the surface's boundary, and so do the middles next to it there.
            outline.centre = ring.pivot;
            outline.corners.push_back(outline.middles.back());
            outline.corners.push_back(outline.centre);
            outline.corners.push_back(from_pivot(ring.quads.front(), 1));
            outline.middles.pop_back();
        }
        cuts_[r] = std::make_unique<ClusterCut>(quads_.surface, members_[r]);
        if (!cuts_[r]->run(outline).empty() || cuts_[r]->uniform) cuts_[r].reset();
    }

    void put(size_t r) {
        if (cuts_[r] == nullptr) {
            ++left_;
            for (const uint32_t t : members_[r]) keep(t);
        } else {
            const Ring& ring = rings_[r];
            const uint32_t centre = put_back(*cuts_[r], ring.quads, quads_.surface, triangles_, label_);
            for (const uint32_t q : ring.quads) quads_.quads[q].corners[corner_of(q, ring.pivot)] = centre;
            cuts_[r].reset();
        }
        members_[r] = {};
    }

    Quads& quads_;
    const Pivot pivot_;
    const uint32_t count_;  // of quads
    const FeatureLines& features_;
    std::set<std::pair<uint32_t, uint32_t>> kept_;  // pairs of quads whose border stays
    std::vector<std::array<uint32_t, 4>> across_;   // per quad and corner that a side begins at: the quad across
    std::vector<Ring> rings_;
    std::vector<uint32_t> ring_of_;                  // per quad
    std::vector<std::vector<uint32_t>> members_;     // triangles per ring
    std::vector<std::unique_ptr<ClusterCut>> cuts_;  // per ring; null where it stays what it is
    std::vector<SurfaceTriangle> triangles_;         // of the result, and their quads
    std::vector<uint32_t> label_;
    uint32_t left_ = 0;
};

}  // namespace

Result<uint32_t> recentre(Quads& quads, Pivot pivot, const FeatureLines& features) {
    return Recentring(quads, pivot, features).run();
}

}  // namespace lodestone::vgi
