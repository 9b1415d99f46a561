#include "mesh/topology.h"

#include <algorithm>
#include <numeric>

#include "base/structures/disjoint_sets.h"

namespace lodestone {

namespace {

uint32_t start_vertex(const TriMesh& mesh, uint32_t half_edge) {
    return mesh.vertex_of(half_edge / 3, static_cast<int>(half_edge % 3));
}

// Half-edges by a vertex of each: those of v, in order of number, are order[first[v]] .. order[first[v + 1] - 1].
struct HalfEdgesByVertex {
    template <class VertexOf>
    HalfEdgesByVertex(uint32_t half_edges, size_t vertices, VertexOf&& vertex_of)
        : first(vertices + 1, 0), order(half_edges) {
        for (uint32_t h = 0; h < half_edges; ++h) ++first[vertex_of(h)];
        std::partial_sum(first.begin(), first.end(), first.begin());
        for (uint32_t h = half_edges; h-- > 0;) order[--first[vertex_of(h)]] = h;
    }
    std::span<const uint32_t> at(size_t v) const { return std::span(order).subspan(first[v], first[v + 1] - first[v]); }
    std::vector<uint32_t> first, order;
};

// Calls visit(half_edges) for every edge; those of one edge come in order of number. Vertex by vertex, so that what is
// looked at together lies together where neighbours in the mesh are neighbours in memory.
template <class Visit>
void for_edges(const TriMesh& mesh, Visit&& visit) {
    const auto low = [&](uint32_t h) { return std::min(start_vertex(mesh, h), start_vertex(mesh, next_corner(h))); };
    const auto high = [&](uint32_t h) { return std::max(start_vertex(mesh, h), start_vertex(mesh, next_corner(h))); };
    const HalfEdgesByVertex by_low(static_cast<uint32_t>(mesh.triangle_count() * 3), mesh.vertex_count(), low);
    std::vector<uint32_t> order;
    for (size_t v = 0; v < mesh.vertex_count(); ++v) {
        const auto those = by_low.at(v);
        order.assign(those.begin(), those.end());
        std::ranges::stable_sort(order, {}, high);
        for (size_t i = 0; i < order.size();) {
            size_t next = i + 1;
            while (next < order.size() && high(order[next]) == high(order[i])) ++next;
            visit(std::span(order).subspan(i, next - i));
            i = next;
        }
    }
}

}  // namespace

std::vector<uint32_t> half_edge_twins(std::span<const uint32_t> corner_vertex, size_t vertices, bool* manifold) {
    const auto from = [&](uint32_t h) { return corner_vertex[h]; };
    const auto to = [&](uint32_t h) { return corner_vertex[next_corner(h)]; };
    const HalfEdgesByVertex by_start(static_cast<uint32_t>(corner_vertex.size()), vertices, from);
    std::vector<uint32_t> twin(corner_vertex.size(), no_neighbour);
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] != no_neighbour) continue;
        for (const uint32_t g : by_start.at(to(h))) {
            if (to(g) != from(h)) continue;
            if (twin[g] != no_neighbour || twin[h] != no_neighbour) {
                if (manifold != nullptr) *manifold = false;
                continue;
            }
            twin[h] = g;
            twin[g] = h;
        }
    }
    return twin;
}

std::vector<uint32_t> components_of(const TriMesh& mesh, uint32_t* count) {
    DisjointSets sets(mesh.vertex_count());
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        sets.join(mesh.vertex_of(t, 0), mesh.vertex_of(t, 1));
        sets.join(mesh.vertex_of(t, 1), mesh.vertex_of(t, 2));
    }
    std::vector<uint32_t> number(mesh.vertex_count(), no_neighbour), component(mesh.triangle_count());
    uint32_t next = 0;
    for (size_t t = 0; t < component.size(); ++t) {
        uint32_t& n = number[sets.find(mesh.vertex_of(t, 0))];
        if (n == no_neighbour) n = next++;
        component[t] = n;
    }
    if (count != nullptr) *count = next;
    return component;
}

namespace {

// Counts edges and boundary loops. Joins the corners of one vertex whose triangles share an edge, in fans.
void count_edges(const TriMesh& mesh, Topology& t, DisjointSets& fans) {
    std::vector<bool> on_boundary(mesh.vertex_count(), false);
    DisjointSets boundary(mesh.vertex_count());
    for_edges(mesh, [&](std::span<const uint32_t> half_edges) {
        ++t.edges;
        const uint32_t h = half_edges[0], h_next = next_corner(h);
        if (half_edges.size() == 1) {
            ++t.boundary_edges;
            const uint32_t a = start_vertex(mesh, h), b = start_vertex(mesh, h_next);
            on_boundary[a] = on_boundary[b] = true;
            boundary.join(a, b);
        } else if (half_edges.size() > 2) {
            ++t.non_manifold_edges;
        }
        for (const uint32_t g : half_edges.subspan(1)) {
            const uint32_t g_next = next_corner(g);
            const bool same_way = start_vertex(mesh, g) == start_vertex(mesh, h);
            fans.join(h, same_way ? g : g_next);
            fans.join(h_next, same_way ? g_next : g);
            if (half_edges.size() != 2) continue;
            t.inconsistent_edges += same_way;
            const auto wedge = [&](uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
            t.seam_edges += wedge(h) != wedge(same_way ? g : g_next) || wedge(h_next) != wedge(same_way ? g_next : g);
        }
    });
    for (uint32_t v = 0; v < mesh.vertex_count(); ++v) t.boundary_loops += on_boundary[v] && boundary.find(v) == v;
}

// Vertices that are used, and those whose corners form more than one fan.
void count_vertices(const TriMesh& mesh, DisjointSets& fans, Topology& t) {
    std::vector<uint32_t> fan(mesh.vertex_count(), no_neighbour);
    std::vector<bool> used(mesh.vertex_count(), false), several(mesh.vertex_count(), false);
    for (uint32_t c = 0; c < mesh.triangle_count() * 3; ++c) {
        const uint32_t v = start_vertex(mesh, c), root = fans.find(c);
        used[v] = true;
        if (fan[v] == no_neighbour) fan[v] = root;
        several[v] = several[v] || fan[v] != root;
    }
    t.vertices = static_cast<uint64_t>(std::count(used.begin(), used.end(), true));
    t.non_manifold_vertices = static_cast<uint64_t>(std::count(several.begin(), several.end(), true));
}

int64_t genus_of(const Topology& t) {
    if (!t.manifold() || t.inconsistent_edges != 0) return -1;
    // chi = V - E + F = sum over components of 2 - 2 genus - loops
    const auto chi =
        static_cast<int64_t>(t.vertices) - static_cast<int64_t>(t.edges) + static_cast<int64_t>(t.triangles);
    return (2 * static_cast<int64_t>(t.components) - static_cast<int64_t>(t.boundary_loops) - chi) / 2;
}

}  // namespace

Topology topology_of(const TriMesh& mesh) {
    Topology t;
    t.triangles = mesh.triangle_count();
    DisjointSets fans(mesh.triangle_count() * 3);
    count_edges(mesh, t, fans);
    count_vertices(mesh, fans, t);
    uint32_t components = 0;
    components_of(mesh, &components);
    t.components = components;
    t.genus = genus_of(t);
    return t;
}

}  // namespace lodestone
