#include "vgi/bake/quads/many_sides.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <memory>
#include <numeric>

#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/quads/cluster_cut.h"

namespace lodestone::vgi {

namespace {

// One halving of each cluster that has too many sides.
class Halving {
public:
    Halving(Surface& surface, std::vector<uint32_t>& label, HalvedClusters& clusters)
        : surface_(surface), label_(label), clusters_(clusters) {}

    // False where none has too many.
    Result<bool> run(std::span<const uint32_t> corners, const Progress& progress) {
        clusters_.twins = surface_.twins();
        auto patches = trace_charts(surface_, clusters_.twins, label_, clusters_.count, corners);
        if (!patches) return tl::unexpected(patches.error());
        clusters_.patches = std::move(*patches);
        find_large(clusters_.patches);
        if (large_.empty()) return false;
        share_triangles();
        cuts_.resize(large_.size());
        auto done = in_batches(
            members_, progress, [&](size_t i) { cut(i); }, [&](size_t i) { put(i); });
        if (!done) return tl::unexpected(done.error());
        surface_.triangles = std::move(triangles_);
        label_ = std::move(new_label_);
        return true;
    }

private:
    void find_large(const ChartComplex& patches) {
        for (uint32_t c = 0; c < clusters_.count; ++c) {
            if (patches.sides[c].size() <= most_sides || std::ranges::binary_search(clusters_.left_larger, c)) continue;
            large_.push_back(c);
            auto& corners = corners_.emplace_back();
            for (const Side& side : patches.sides[c]) corners.push_back(patches.begin_of(side));
        }
    }

    // Triangles of large clusters go to their members, all others stay what they are.
    void share_triangles() {
        std::vector<uint32_t> number(clusters_.count, none);
        for (uint32_t i = 0; i < large_.size(); ++i) number[large_[i]] = i;
        members_.resize(large_.size());
        for (uint32_t t = 0; t < label_.size(); ++t) {
            if (const uint32_t i = number[label_[t]]; i != none) {
                members_[i].push_back(t);
            } else {
                keep(t);
            }
        }
    }
    void keep(uint32_t triangle) {
        triangles_.push_back(surface_.triangles[triangle]);
        new_label_.push_back(label_[triangle]);
    }

    // From the corner that is nearest to the one across from it.
    void cut(size_t i) {
        const std::vector<uint32_t>& corners = corners_[i];
        const size_t half = corners.size() / 2;
        const auto length_from = [&](size_t from) {
            return glm::distance(surface_.positions[corners[from]], surface_.positions[corners[from + half]]);
        };
        size_t first = 0;
        for (size_t from = 1; from < half; ++from) {
            if (length_from(from) < length_from(first)) first = from;
        }
        cuts_[i] = std::make_unique<ClusterCut>(surface_, members_[i]);
        if (!cuts_[i]->halve(corners, first, first + half).empty()) cuts_[i].reset();
    }

    void put(size_t i) {
        const uint32_t cluster = large_[i];
        if (cuts_[i] == nullptr) {
            clusters_.left_larger.insert(std::ranges::lower_bound(clusters_.left_larger, cluster), cluster);
            for (const uint32_t t : members_[i]) keep(t);
        } else {
            const uint32_t halves[] = {cluster, clusters_.count++};
            clusters_.made_of.push_back(clusters_.made_of[cluster]);
            put_back(*cuts_[i], halves, surface_, triangles_, new_label_);
            cuts_[i].reset();
        }
        members_[i] = {};
    }

    Surface& surface_;
    std::vector<uint32_t>& label_;
    HalvedClusters& clusters_;
    std::vector<uint32_t> large_;                    // clusters
    std::vector<std::vector<uint32_t>> corners_;     // of each, in turn
    std::vector<std::vector<uint32_t>> members_;     // triangles of each
    std::vector<std::unique_ptr<ClusterCut>> cuts_;  // of each; null where it could not be halved
    std::vector<SurfaceTriangle> triangles_;         // of the result, and their clusters
    std::vector<uint32_t> new_label_;
};

}  // namespace

Result<HalvedClusters> halve_clusters(Surface& surface, std::vector<uint32_t>& label, uint32_t count,
                                      std::span<const uint32_t> corners, const Progress& progress) {
    HalvedClusters clusters{count, std::vector<uint32_t>(count), {}, {}, {}};
    std::iota(clusters.made_of.begin(), clusters.made_of.end(), 0u);
    for (;;) {
        const auto halved = Halving(surface, label, clusters).run(corners, progress);
        if (!halved) return tl::unexpected(halved.error());
        if (!*halved) return clusters;
    }
}

}  // namespace lodestone::vgi
