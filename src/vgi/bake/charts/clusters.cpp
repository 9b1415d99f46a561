#include "vgi/bake/charts/clusters.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "base/clock.h"
#include "base/structures/disjoint_sets.h"
#include "base/structures/quad_heap.h"
#include "base/threads.h"
#include "vgi/bake/charts/chart_mesh.h"
#include "vgi/bake/charts/templates.h"

namespace lodestone::vgi {

namespace {

// Triangles bucket by bucket, in rising order within each: the surface is halved at the median of its longest extent
// until the parts are small.
struct Buckets {
    std::vector<uint32_t> triangles;
    std::vector<size_t> first;  // of each, and the end
    size_t count() const { return first.size() - 1; }
    std::span<const uint32_t> of(size_t bucket) const {
        return std::span(triangles).subspan(first[bucket], first[bucket + 1] - first[bucket]);
    }
};
Buckets cut_into_buckets(const Surface& surface, uint32_t wanted) {
    std::vector<glm::vec3> centre(surface.triangles.size());
    for (size_t t = 0; t < centre.size(); ++t) {
        const auto& v = surface.triangles[t].vertices;
        centre[t] = glm::vec3((surface.positions[v[0]] + surface.positions[v[1]] + surface.positions[v[2]]) / 3.0);
    }
    Buckets buckets;
    std::vector<uint32_t>& order = buckets.triangles;
    order.resize(centre.size());
    std::iota(order.begin(), order.end(), 0u);
    std::vector<std::pair<size_t, size_t>> parts{{0, order.size()}};
    while (!parts.empty()) {
        const auto [begin, end] = parts.back();
        parts.pop_back();
        if (end - begin <= wanted) {
            std::sort(order.begin() + static_cast<ptrdiff_t>(begin), order.begin() + static_cast<ptrdiff_t>(end));
            buckets.first.push_back(begin);
            continue;
        }
        Box box{glm::vec3(1e30f), glm::vec3(-1e30f)};
        for (size_t i = begin; i < end; ++i) {
            box.low = glm::min(box.low, centre[order[i]]);
            box.high = glm::max(box.high, centre[order[i]]);
        }
        const int axis = box.longest_axis();
        const size_t middle = begin + (end - begin) / 2;
        std::nth_element(order.begin() + static_cast<ptrdiff_t>(begin), order.begin() + static_cast<ptrdiff_t>(middle),
                         order.begin() + static_cast<ptrdiff_t>(end), [&](uint32_t a, uint32_t b) {
                             return std::pair(centre[a][axis], a) < std::pair(centre[b][axis], b);
                         });
        parts.push_back({middle, end});
        parts.push_back({begin, middle});
    }
    buckets.first.push_back(order.size());
    return buckets;
}

class Merging {
public:
    // kept: per cell, the cluster that stays of which it is, none of others; empty where none stays. progress: once it
    // says stop, run() ends soon, with more cells left than it should.
    Merging(CellComplex& complex, const ClusterOptions& options, double area, std::vector<uint32_t> kept,
            const Progress& progress)
        : complex_(complex),
          progress_(progress),
          weights_(options.weights),
          wanted_(area / options.clusters),
          kept_(std::move(kept)) {
        version_.assign(complex.edge_slots(), 0);
    }

    // Merges cells two by two, the cheapest pairs first but no cell twice in a round, while more than `target` of
    // `cells` are left. Takes a fraction of the time of run(), and as long as cells are much smaller than clusters does
    // as well. Returns how many are left.
    size_t pair_up(std::vector<uint32_t>& edges, size_t cells, size_t target, const std::vector<bool>& frozen) {
        std::vector<Entry> pairs;
        std::vector<bool> merged;
        for (bool progress = true; cells > target && progress;) {
            progress = false;
            std::erase_if(edges, [&](uint32_t e) { return !complex_.edge_alive(e); });
            pairs.clear();
            for (const uint32_t e : edges) {
                const uint32_t a = complex_.cell_of(e * 2), b = complex_.cell_of(e * 2 + 1);
                if (may_be_merged(a, b, frozen)) pairs.emplace_back(cost(e, a, b), e, 0);
            }
            std::sort(pairs.begin(), pairs.end());
            merged.assign(complex_.triangle_cells(), false);
            for (const Entry& pair : pairs) {
                const uint32_t e = pair.edge();
                if (cells <= target) break;
                if (!complex_.edge_alive(e)) continue;
                const uint32_t a = complex_.cell_of(e * 2), b = complex_.cell_of(e * 2 + 1);
                if (merged[a] || merged[b] || !is_small_enough(e) || !complex_.may_merge(e)) continue;
                merged[complex_.merge(e)] = true;
                --cells;
                progress = true;
            }
        }
        return cells;
    }

    // Merges cells across the edges given (and what becomes of them) while more than `target` of `cells` are left.
    // frozen: cells that stay as they are. Returns how many are left.
    size_t run(const std::vector<uint32_t>& edges, size_t cells, size_t target, const std::vector<bool>& frozen) {
        QuadHeap<Entry> heap;
        const auto push = [&](uint32_t e) {
            const uint32_t a = complex_.cell_of(e * 2), b = complex_.cell_of(e * 2 + 1);
            if (!may_be_merged(a, b, frozen)) return;
            heap.push(Entry(cost(e, a, b), e, version_[e]));
        };
        bool progress = true;
        while (cells > target && progress) {
            progress = false;
            for (const uint32_t e : edges) {
                if (complex_.edge_alive(e)) push(e);
            }
            while (cells > target && !heap.empty()) {
                if (progress_.stopped()) return cells;
                const Entry top = heap.pop();
                const uint32_t edge = top.edge();
                if (!complex_.edge_alive(edge) || version_[edge] != top.version) continue;
                if (!is_small_enough(edge)) continue;
                if (!complex_.may_merge(edge)) continue;  // looked at again when all others are done
                const uint32_t cell = complex_.merge(edge);
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
            heap.clear();
        }
        return cells;
    }

private:
    struct Entry {
        uint64_t order;  // by cost, then by edge
        uint32_t version;
        Entry(float cost, uint32_t edge, uint32_t made) : version(made) {
            // As integers, floats are in order but for those below zero.
            const auto bits = std::bit_cast<uint32_t>(cost + 0.0f);
            order = uint64_t{bits >> 31 != 0 ? ~bits : bits | 0x80000000u} << 32 | edge;
        }
        uint32_t edge() const { return static_cast<uint32_t>(order); }
        bool operator<(const Entry& other) const { return order < other.order; }
    };

    bool may_be_merged(uint32_t a, uint32_t b, const std::vector<bool>& frozen) const {
        return a != b && a < complex_.triangle_cells() && b < complex_.triangle_cells() &&
               (frozen.empty() || (!frozen[a] && !frozen[b])) && (kept_.empty() || kept_[a] == kept_[b]);
    }
    bool is_small_enough(uint32_t edge) const {
        return complex_.moments(complex_.cell_of(edge * 2)).weighted +
                   complex_.moments(complex_.cell_of(edge * 2 + 1)).weighted <=
               ClusterOptions::most_wanted * wanted_;
    }
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
    const Progress& progress_;
    const ClusterWeights weights_;
    const double wanted_;  // area
    const std::vector<uint32_t> kept_;
    std::vector<uint32_t> version_;
};

// What merging needs to know of the whole surface.
struct Whole {
    double area = 0, weighted = 0;
    glm::dvec3 middle{0};
    Whole(const Surface& surface, const ClusterOptions& options) {
        area = surface.area();
        for (size_t t = 0; t < surface.triangles.size(); ++t)
            weighted += wanted_of_triangle(surface.area(t), options.density.empty() ? 1 : options.density[t],
                                           area / options.clusters);
        glm::dvec3 low(1e300), high(-1e300);
        for (const glm::dvec3& p : surface.positions) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        if (!surface.positions.empty()) middle = (low + high) * 0.5;
    }
};

// Cells that are paired up: until there are so many for each that stays.
constexpr size_t paired_per_cell = 128;

// Clusters inside a bucket, down to several times those it will have: the last merges are better made with sight of
// all. A triangle at the bucket's border, or the surface's, stays as it is, so that parts fit together.
CellPart merged_bucket(const Surface& surface, std::span<const uint32_t> triangles, const ClusterOptions& options,
                       const Whole& whole, const Progress& progress, std::vector<uint32_t>& cell_of) {
    ChartMesh patch = take_chart_mesh(surface, triangles);
    Surface own;
    own.positions = std::move(patch.positions);
    own.triangles = std::move(patch.triangles);
    own.places = std::move(patch.places);
    std::vector<float> density;
    for (const uint32_t t : triangles) {
        if (!options.density.empty()) density.push_back(options.density[t]);
    }
    CellComplex complex(own, density, options.features, whole.middle);
    std::vector<bool> rim(own.positions.size(), false), frozen(triangles.size(), false);
    for (uint32_t h = 0; h < complex.edge_slots() * 2; ++h) {
        if (complex.cell_of(h) >= complex.triangle_cells()) rim[complex.origin(h)] = true;
    }
    size_t free_cells = 0;
    for (size_t t = 0; t < own.triangles.size(); ++t) {
        for (const uint32_t v : own.triangles[t].vertices) frozen[t] = frozen[t] || rim[v];
        free_cells += !frozen[t];
    }
    std::vector<uint32_t> edges;
    for (uint32_t e = 0; e < complex.edge_slots(); ++e) {
        const uint32_t a = complex.cell_of(e * 2), b = complex.cell_of(e * 2 + 1);
        if (a < complex.triangle_cells() && b < complex.triangle_cells() && !frozen[a] && !frozen[b])
            edges.push_back(e);
    }
    const double wanted = options.clusters * (whole.area > 0 ? whole.weighted / whole.area : 1);
    const auto target = static_cast<size_t>(16 + 16 * wanted * static_cast<double>(free_cells) /
                                                     static_cast<double>(surface.triangles.size()));
    std::vector<uint32_t> kept;
    for (const uint32_t t : triangles) {
        if (!options.kept.empty()) kept.push_back(options.kept[t]);
    }
    Merging merging(complex, options, whole.area, std::move(kept), progress);
    free_cells = merging.pair_up(edges, free_cells, paired_per_cell * target, frozen);
    merging.run(edges, free_cells, target, frozen);
    return complex.part(own, patch.origin, cell_of);
}

// Connected parts of a surface.
struct Components {
    struct One {
        double share = 0, wanted = 0;      // clusters, by its share of the area; by density too
        bool closed = true, plain = true;  // plain: no more clusters are wanted there than elsewhere
        // Whether it has more clusters than that whatever is wanted.
        bool is_small() const { return share < (closed ? 4 : 3); }
        bool takes_template() const { return plain && share <= (closed ? 2 : 1); }
    };
    std::vector<One> all;
    std::vector<uint32_t> of_vertex;

    Components(const Surface& surface, const CellComplex& complex, const ClusterOptions& options, const Whole& whole) {
        const size_t vertices = surface.positions.size();
        DisjointSets joined(vertices);
        for (const SurfaceTriangle& t : surface.triangles) {
            joined.join(t.vertices[0], t.vertices[1]);
            joined.join(t.vertices[1], t.vertices[2]);
        }
        of_vertex.resize(vertices);
        for (uint32_t v = 0; v < vertices; ++v) {
            const uint32_t lowest = joined.find(v);
            of_vertex[v] = lowest == v ? static_cast<uint32_t>(all.size()) : of_vertex[lowest];
            if (lowest == v) all.emplace_back();
        }
        for (size_t t = 0; t < surface.triangles.size(); ++t) {
            const auto& v = surface.triangles[t].vertices;
            const double area = surface.area(t);
            const float density = options.density.empty() ? 1 : options.density[t];
            One& one = all[of_vertex[v[0]]];
            one.plain = one.plain && density <= 1;
            if (!(whole.area > 0)) continue;
            one.share += options.clusters * area / whole.area;
            one.wanted +=
                options.clusters * wanted_of_triangle(area, density, whole.area / options.clusters) / whole.area;
        }
        for (uint32_t h = 0; h < complex.edge_slots() * 2; ++h) {
            if (complex.cell_of(h) >= complex.triangle_cells()) all[of_vertex[complex.origin(h)]].closed = false;
        }
    }
    const One& of(uint32_t vertex) const { return all[of_vertex[vertex]]; }
};

// Merges the clusters of components that templates do for.
std::vector<ReadyQuad> use_templates(const Surface& surface, const Components& components,
                                     std::vector<uint32_t>& label) {
    const auto component_of = [&](uint32_t t) { return components.of_vertex[surface.triangles[t].vertices[0]]; };
    std::map<uint32_t, std::vector<uint32_t>> small;  // component: its triangles
    for (uint32_t t = 0; t < label.size(); ++t) {
        if (components.all[component_of(t)].takes_template()) small[component_of(t)].push_back(t);
    }
    std::vector<ReadyQuad> ready;
    const auto take = [&](const TemplateQuad& quad) {
        const uint32_t cluster = label[quad.triangles.front()];
        for (const uint32_t t : quad.triangles) label[t] = cluster;
        ready.push_back({cluster, quad.corners});
    };
    for (const auto& [component, triangles] : small) {
        if (components.all[component].closed) {
            std::vector<uint32_t> its_label;
            for (const uint32_t t : triangles) its_label.push_back(label[t]);
            const auto quads = sphere_template(surface, triangles, its_label);
            if (quads) std::ranges::for_each(*quads, take);
        } else if (const auto quad = disk_template(surface, triangles)) {
            take(*quad);
        }
    }
    return ready;
}

}  // namespace

double wanted_of_triangle(double area, float density, double cluster) {
    return std::min(area * static_cast<double>(density), std::max(area, cluster));
}

std::vector<double> wanted_where(const Surface& surface, std::span<const float> density,
                                 std::span<const uint32_t> label, size_t count, double clusters) {
    std::vector<double> wanted(count, 0);
    const double cluster = surface.area() / clusters;
    for (size_t t = 0; t < label.size(); ++t)
        wanted[label[t]] += wanted_of_triangle(surface.area(t), density[t], cluster) / std::max(cluster, 1e-300);
    return wanted;
}

std::vector<bool> with_neighbours(const Surface& surface, std::span<const uint32_t> label, std::vector<bool> marked) {
    std::vector<bool> met(surface.positions.size(), false);
    for (size_t t = 0; t < label.size(); ++t) {
        for (const uint32_t v : surface.triangles[t].vertices) met[v] = met[v] || marked[label[t]];
    }
    for (size_t t = 0; t < label.size(); ++t) {
        for (const uint32_t v : surface.triangles[t].vertices) marked[label[t]] = marked[label[t]] || met[v];
    }
    return marked;
}

std::vector<uint32_t> kept_clusters(const Surface& surface, std::span<const uint32_t> label,
                                    const std::vector<bool>& bad) {
    const std::vector<bool> anew = with_neighbours(surface, label, bad);
    std::vector<uint32_t> kept(label.begin(), label.end());
    for (uint32_t& cluster : kept) {
        if (anew[cluster]) cluster = none;
    }
    return kept;
}

std::vector<uint32_t> Clusters::ready_corners() const {
    std::vector<uint32_t> corners;
    for (const ReadyQuad& quad : ready) corners.insert(corners.end(), quad.corners.begin(), quad.corners.end());
    return corners;
}

namespace {

// Merges clusters inside buckets, side by side. label: per triangle, its cell of the complex made of them. Nothing
// where that was stopped.
std::optional<CellComplex> merge_in_buckets(const Surface& surface, const ClusterOptions& options, const Whole& whole,
                                            const Buckets& buckets, const Progress& progress,
                                            std::vector<uint32_t>& label) {
    progress.at("clusters inside buckets", 0);
    std::vector<CellPart> parts(buckets.count());
    label.resize(surface.triangles.size());
    parallel_for(buckets.count(), 1, [&](size_t begin, size_t end) {
        for (size_t b = begin; b < end && !progress.stopped(); ++b) {
            std::vector<uint32_t> cell_of;
            parts[b] = merged_bucket(surface, buckets.of(b), options, whole, progress, cell_of);
            for (size_t i = 0; i < cell_of.size(); ++i) label[buckets.of(b)[i]] = cell_of[i];
        }
    });
    if (progress.stopped()) return std::nullopt;
    uint32_t first = 0;
    for (size_t b = 0; b < buckets.count(); ++b) {
        for (const uint32_t t : buckets.of(b)) label[t] += first;
        first += static_cast<uint32_t>(parts[b].cells.size());
    }
    return std::optional<CellComplex>(std::in_place, parts, surface.positions.size(), options.features);
}

// Merges clusters everywhere, those of small components apart from the others. label: per triangle, its cell before;
// empty where every triangle is a cell.
void merge_everywhere(CellComplex& complex, const ClusterOptions& options, const Whole& whole,
                      const Components& components, const Progress& progress, std::span<const uint32_t> label) {
    std::vector<uint32_t> kept_cells = options.kept;
    if (!options.kept.empty() && !label.empty()) {
        kept_cells.resize(complex.triangle_cells());
        for (size_t t = 0; t < options.kept.size(); ++t) kept_cells[label[t]] = options.kept[t];
    }
    std::vector<uint32_t> in_small, in_others;  // edges
    for (uint32_t e = 0; e < complex.edge_slots(); ++e)
        (components.of(complex.origin(e * 2)).is_small() ? in_small : in_others).push_back(e);
    size_t others = 0;  // cells
    for (uint32_t c = 0; c < complex.triangle_cells(); ++c)
        others += !components.of(complex.origin(complex.first_half_edge(c))).is_small();
    double wanted = 0;
    for (const Components::One& one : components.all) wanted += one.is_small() ? 0 : one.wanted;
    Merging merging(complex, options, whole.area, std::move(kept_cells), progress);
    merging.run(in_others, others, static_cast<size_t>(std::lround(wanted)), {});
    merging.run(in_small, complex.triangle_cells() - others, 0, {});
}

// Clusters by their lowest triangles. labels: how many there may have been before.
void number_clusters(Clusters& clusters, uint32_t labels) {
    std::vector<uint32_t> number(labels, none);
    for (uint32_t& label : clusters.label) {
        if (number[label] == none) number[label] = clusters.count++;
        label = number[label];
    }
    for (ReadyQuad& quad : clusters.ready) quad.cluster = number[quad.cluster];
    std::ranges::sort(clusters.ready, {}, &ReadyQuad::cluster);
}

}  // namespace

Result<Clusters> make_clusters(const Surface& surface, const ClusterOptions& options, const Progress& progress) {
    Clusters result;
    if (surface.triangles.empty()) return result;
    const Stopwatch cut_watch;
    const Whole whole(surface, options);
    const Buckets buckets = cut_into_buckets(surface, options.bucket_triangles);
    result.buckets = static_cast<uint32_t>(buckets.count());
    result.cut_seconds = cut_watch.wall();
    const Stopwatch bucket_watch;
    std::optional<CellComplex> complex;
    if (buckets.count() == 1) {
        complex.emplace(surface, options.density, options.features, whole.middle);
    } else {
        complex = merge_in_buckets(surface, options, whole, buckets, progress, result.label);
        if (!complex) return fail(Fault::interrupted, "interrupted");
    }
    result.bucket_seconds = bucket_watch.wall();
    const Stopwatch merge_watch;
    progress.at("clusters", 0);
    const Components components(surface, *complex, options, whole);
    merge_everywhere(*complex, options, whole, components, progress, result.label);
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    const std::vector<uint32_t> cell = complex->labels();
    if (result.label.empty()) {
        result.label = cell;
    } else {
        for (uint32_t& label : result.label) label = cell[label];
    }
    result.ready = use_templates(surface, components, result.label);
    number_clusters(result, complex->triangle_cells());
    result.merge_seconds = merge_watch.wall();
    return result;
}

}  // namespace lodestone::vgi
