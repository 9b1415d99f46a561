#include "vgi/clusters.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <queue>

#include "base/clock.h"
#include "base/threads.h"

namespace lodestone::vgi {

namespace {

// The bucket of each triangle: the surface is halved at the median of its longest extent until the parts are small.
std::vector<uint32_t> cut_into_buckets(const Surface& surface, uint32_t wanted, uint32_t* count) {
    std::vector<glm::vec3> centre(surface.triangles.size());
    for (size_t t = 0; t < centre.size(); ++t) {
        const auto& v = surface.triangles[t].vertices;
        centre[t] = glm::vec3((surface.positions[v[0]] + surface.positions[v[1]] + surface.positions[v[2]]) / 3.0);
    }
    std::vector<uint32_t> order(centre.size()), bucket(centre.size(), 0);
    std::iota(order.begin(), order.end(), 0u);
    std::vector<std::pair<size_t, size_t>> parts{{0, order.size()}};
    *count = 0;
    while (!parts.empty()) {
        const auto [begin, end] = parts.back();
        parts.pop_back();
        if (end - begin <= wanted) {
            for (size_t i = begin; i < end; ++i) bucket[order[i]] = *count;
            ++*count;
            continue;
        }
        glm::vec3 low(1e30f), high(-1e30f);
        for (size_t i = begin; i < end; ++i) {
            low = glm::min(low, centre[order[i]]);
            high = glm::max(high, centre[order[i]]);
        }
        const glm::vec3 extent = high - low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const size_t middle = begin + (end - begin) / 2;
        std::nth_element(order.begin() + static_cast<ptrdiff_t>(begin), order.begin() + static_cast<ptrdiff_t>(middle),
                         order.begin() + static_cast<ptrdiff_t>(end), [&](uint32_t a, uint32_t b) {
                             return std::pair(centre[a][axis], a) < std::pair(centre[b][axis], b);
                         });
        parts.push_back({middle, end});
        parts.push_back({begin, middle});
    }
    return bucket;
}

class Merging {
public:
    Merging(CellComplex& complex, const ClusterOptions& options, double area)
        : complex_(complex), weights_(options.weights), wanted_(area / options.clusters) {
        version_.assign(complex.edge_slots(), 0);
    }

    // Merges cells across the edges given (and what becomes of them) while more than `target` of `cells` are left.
    // frozen: cells that stay as they are. Returns how many are left.
    size_t run(const std::vector<uint32_t>& edges, size_t cells, size_t target, const std::vector<bool>& frozen) {
        std::priority_queue<Entry> heap;
        const auto push = [&](uint32_t e) {
            const uint32_t a = complex_.cell_of(e * 2), b = complex_.cell_of(e * 2 + 1);
            if (a == b || a >= complex_.triangle_cells() || b >= complex_.triangle_cells()) return;
            if (!frozen.empty() && (frozen[a] || frozen[b])) return;
            heap.push({cost(e, a, b), e, version_[e]});
        };
        bool progress = true;
        while (cells > target && progress) {
            progress = false;
            for (const uint32_t e : edges) {
                if (complex_.edge_alive(e)) push(e);
            }
            while (cells > target && !heap.empty()) {
                const Entry top = heap.top();
                heap.pop();
                if (!complex_.edge_alive(top.edge) || version_[top.edge] != top.version) continue;
                if (!complex_.may_merge(top.edge)) continue;  // looked at again when all others are done
                const uint32_t cell = complex_.merge(top.edge);
                --cells;
                progress = true;
                uint32_t h = complex_.first_half_edge(cell);
                const uint32_t begin = h;
                do {
                    ++version_[h >> 1];
                    push(h >> 1);
                    h = complex_.next(h);
                } while (h != begin);
            }
            heap = {};
        }
        return cells;
    }

private:
    struct Entry {
        float cost;
        uint32_t edge, version;
        bool operator<(const Entry& other) const { return cost != other.cost ? cost > other.cost : edge > other.edge; }
    };

    double irregularity(double perimeter, double area) const {
        return area > 0 ? perimeter * perimeter / (4 * std::numbers::pi * area) : 1;
    }
    float cost(uint32_t edge, uint32_t a, uint32_t b) const {
        CellMoments m = complex_.moments(a);
        m.add(complex_.moments(b));
        // The area wanted here.
        const double wanted = m.weighted > 0 ? wanted_ * m.area / m.weighted : wanted_;
        const double perimeter = complex_.perimeter(a) + complex_.perimeter(b) - 2 * complex_.edge_length(edge);
        const double irregular = irregularity(perimeter, m.area),
                     before = std::max(irregularity(complex_.perimeter(a), complex_.moments(a).area),
                                       irregularity(complex_.perimeter(b), complex_.moments(b).area));
        const double share = m.area / wanted;
        return static_cast<float>(weights_.planarity * 12 * m.flatness() / wanted +
                                  weights_.compactness * perimeter * perimeter / (16 * wanted) +
                                  weights_.size * share * share +
                                  weights_.irregularity * (irregular - before) / std::max(irregular, 1e-30) +
                                  weights_.bulge * std::max(0.0, 1 / std::max(irregular, 1e-30) - 1) +
                                  weights_.curvature * (m.area - glm::length(m.normal)) / wanted +
                                  weights_.feature * complex_.feature_length(edge) / std::sqrt(wanted));
    }

    CellComplex& complex_;
    const ClusterWeights weights_;
    const double wanted_;  // area
    std::vector<uint32_t> version_;
};

}  // namespace

Result<Clusters> make_clusters(const Surface& surface, const ClusterOptions& options, const Progress& progress) {
    Clusters result;
    if (surface.triangles.empty()) return result;
    const Stopwatch cut_watch;
    CellComplex complex(surface, options.density, options.features);
    const double area = surface.area();
    double weighted = 0;
    for (uint32_t c = 0; c < complex.triangle_cells(); ++c) weighted += complex.moments(c).weighted;
    const auto wanted_clusters =
        static_cast<uint32_t>(std::lround(options.clusters * (area > 0 ? weighted / area : 1)));
    Merging merging(complex, options, area);
    std::vector<bool> frozen(complex.triangle_cells(), false);
    const std::vector<uint32_t> bucket = cut_into_buckets(surface, options.bucket_triangles, &result.buckets);
    result.cut_seconds = cut_watch.wall();
    const Stopwatch bucket_watch;
    size_t cells = complex.triangle_cells();
    std::vector<uint32_t> all;
    for (uint32_t e = 0; e < complex.edge_slots(); ++e) all.push_back(e);
    if (result.buckets > 1) {
        progress.at("clusters inside buckets", 0);
        // A triangle that shares a vertex with another bucket, or lies on the boundary, waits: then no merge touches
        // what another bucket reads.
        std::vector<uint32_t> only(surface.positions.size(), none);
        std::vector<bool> shared(surface.positions.size(), false);
        for (size_t t = 0; t < surface.triangles.size(); ++t) {
            for (const uint32_t v : surface.triangles[t].vertices) {
                if (only[v] == none) only[v] = bucket[t];
                if (only[v] != bucket[t]) shared[v] = true;
            }
        }
        for (uint32_t h = 0; h < complex.edge_slots() * 2; ++h) {
            if (complex.cell_of(h) >= complex.triangle_cells()) shared[complex.origin(h)] = true;
        }
        std::vector<uint32_t> free_cells(result.buckets, 0);
        for (size_t t = 0; t < surface.triangles.size(); ++t) {
            for (const uint32_t v : surface.triangles[t].vertices) frozen[t] = frozen[t] || shared[v];
            free_cells[bucket[t]] += !frozen[t];
        }
        std::vector<std::vector<uint32_t>> edges(result.buckets);
        for (uint32_t e = 0; e < complex.edge_slots(); ++e) {
            const uint32_t a = complex.cell_of(e * 2), b = complex.cell_of(e * 2 + 1);
            if (a < complex.triangle_cells() && b < complex.triangle_cells() && !frozen[a] && !frozen[b])
                edges[bucket[a]].push_back(e);
        }
        // Down to several times the clusters a bucket will have: the last merges are better made with sight of all.
        std::vector<size_t> left(result.buckets);
        parallel_for(result.buckets, 1, [&](size_t begin, size_t end) {
            for (size_t b = begin; b < end; ++b) {
                const auto share = static_cast<double>(free_cells[b]) / static_cast<double>(surface.triangles.size());
                const auto target = static_cast<size_t>(16 + 16 * share * wanted_clusters);
                left[b] = merging.run(edges[b], free_cells[b], target, frozen);
            }
        });
        for (uint32_t b = 0; b < result.buckets; ++b) cells -= free_cells[b] - left[b];
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    }
    result.bucket_seconds = bucket_watch.wall();
    const Stopwatch merge_watch;
    progress.at("clusters", 0);
    merging.run(all, cells, wanted_clusters, {});
    result.label = complex.labels();
    std::vector<uint32_t> number(complex.triangle_cells(), none);
    for (uint32_t& label : result.label) {
        if (number[label] == none) number[label] = result.count++;
        label = number[label];
    }
    result.merge_seconds = merge_watch.wall();
    return result;
}

}  // namespace lodestone::vgi
