#include "vgi/bake/quads/quadrangulate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>

#include "base/check.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/chart_mesh.h"
#include "vgi/bake/quads/cluster_cut.h"
#include "vgi/bake/quads/many_sides.h"

namespace lodestone::vgi {

namespace {

constexpr double middle_tolerance = 0.1;  // of an arc's length: a vertex so near to the middle will do

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

// The surface gets a vertex near the middle of every border of two clusters, and `label` follows its
// triangles. Returns its charts as they are then.
Result<ChartComplex> trace_with_middles(Surface& surface, std::vector<uint32_t>& label, HalvedClusters&& clusters,
                                        std::span<const uint32_t> given) {
    ChartMesh whole;
    whole.twin = std::move(clusters.twins);
    whole.positions = std::move(surface.positions);
    whole.triangles = std::move(surface.triangles);
    whole.places = std::move(surface.places);
    whole.origin.resize(whole.positions.size());
    std::iota(whole.origin.begin(), whole.origin.end(), 0u);
    insert_middles(whole, label, clusters.patches);
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
    // patches: of the surface with middles. label: per triangle, its cluster. made_of: HalvedClusters::made_of.
    ClustersIntoQuads(Surface surface, std::span<const ReadyQuad> ready, std::span<const uint32_t> made_of,
                      const ChartComplex& patches, std::span<const uint32_t> label)
        : patches_(patches),
          made_of_(made_of),
          middle_(middles_of(patches, surface.positions)),
          members_(members_of(label, static_cast<uint32_t>(made_of.size()))),
          ready_(made_of.size(), nullptr),
          cuts_(made_of.size()),
          faults_(made_of.size()),
          corners_(made_of.size()),
          middles_(made_of.size()) {
        result_.surface = std::move(surface);
        for (const ReadyQuad& quad : ready) ready_[quad.cluster] = &quad;
        triangles_.reserve(label.size() + label.size() / 16);
        result_.label.reserve(triangles_.capacity());
    }

    const std::vector<std::vector<uint32_t>>& members() const { return members_; }

    void cut(size_t c) {
        if (ready_[c] != nullptr) return;
        for (const Side& side : patches_.sides[c]) {
            corners_[c].push_back(patches_.begin_of(side));
            middles_[c].push_back(middle_[side.arc]);
        }
        cuts_[c] = std::make_unique<ClusterCut>(result_.surface, members_[c]);
        faults_[c] = cuts_[c]->run({corners_[c], corners_[c], middles_[c]});
    }

    void put(size_t at) {
        const auto c = static_cast<uint32_t>(at);
        if (!faults_[c].empty()) {
            if (result_.failed.empty()) result_.fault = faults_[c];
            result_.failed.push_back(made_of_[c]);
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
                {made_of_[c], {corners_[c][s], middles_[c][s], centre, middles_[c][(s + sides - 1) % sides]}});
        result_.uniform_clusters += cuts_[c]->uniform;
    }

    const ChartComplex& patches_;
    const std::span<const uint32_t> made_of_;
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

Result<Quads> quadrangulate(Surface surface, const Clusters& clusters, const Progress& progress) {
    std::vector<uint32_t> label = clusters.label;
    const std::vector<uint32_t> given = clusters.ready_corners();
    auto halved = halve_clusters(surface, label, clusters.count, given, progress);
    if (!halved) return tl::unexpected(halved.error());
    const std::vector<uint32_t> made_of = std::move(halved->made_of);
    const auto patches = trace_with_middles(surface, label, std::move(*halved), given);
    if (!patches) return tl::unexpected(patches.error());
    ClustersIntoQuads quads(std::move(surface), clusters.ready, made_of, *patches, label);
    auto done = in_batches(
        quads.members(), progress, [&](size_t c) { quads.cut(c); }, [&](size_t c) { quads.put(c); });
    if (!done) return tl::unexpected(done.error());
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
    Result<uint32_t> run(const Progress& progress) {
        if (auto done = find_neighbours(); !done) return tl::unexpected(done.error());
        if (auto done = choose_rings(); !done) return tl::unexpected(done.error());
        share_triangles();
        cuts_.resize(rings_.size());
        auto done = in_batches(
            members_, progress, [&](size_t r) { cut(r); }, [&](size_t r) { put(r); });
        if (!done) return tl::unexpected(done.error());
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
                const uint32_t s = corner_of(q, patches->begin_of(side));
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
        if (ring->quads.size() > most_sides || crosses_kept_border(*ring)) {
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
        if (!cuts_[r]->run(outline).empty() || cuts_[r]->uniform || is_dear(*cuts_[r], members_[r].size()))
            cuts_[r].reset();
    }

    // Rays along needles split every one of them: what that makes is not worth a straighter border.
    static bool is_dear(const ClusterCut& cut, size_t before) {
        constexpr size_t most_times = 2, always = 512;  // triangles
        return cut.patch.triangles.size() > most_times * before + always;
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

Result<uint32_t> recentre(Quads& quads, Pivot pivot, const FeatureLines& features, const Progress& progress) {
    return Recentring(quads, pivot, features).run(progress);
}

}  // namespace lodestone::vgi
