#include "mesh/topology.h"

#include <algorithm>
#include <numeric>

#include "base/structures/disjoint_sets.h"

namespace lodestone {

namespace {

// A half-edge by the vertices of its edge, smaller first; sorted, the half-edges of one edge stand together.
struct EdgeKey {
    uint64_t key;
    uint32_t half_edge;
};

uint32_t start_vertex(const TriMesh& mesh, uint32_t half_edge) {
    return mesh.vertex_of(half_edge / 3, static_cast<int>(half_edge % 3));
}

// Radix sort by key, 16 bits a pass; stable, so half-edges of one edge stay in order of number.
void sort_keys(std::vector<EdgeKey>& keys, uint32_t vertices) {
    std::vector<EdgeKey> other(keys.size());
    const auto pass = [&](int shift) {
        std::vector<size_t> first(65537, 0);
        for (const EdgeKey& k : keys) ++first[(k.key >> shift & 0xffff) + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        for (const EdgeKey& k : keys) other[first[k.key >> shift & 0xffff]++] = k;
        keys.swap(other);
    };
    for (const int half : {0, 32}) {
        pass(half);
        if (vertices > 65536) pass(half + 16);
    }
}

std::vector<EdgeKey> sorted_edges(const TriMesh& mesh) {
    std::vector<EdgeKey> keys(mesh.triangle_count() * 3);
    for (uint32_t h = 0; h < keys.size(); ++h) {
        const uint32_t a = start_vertex(mesh, h), b = start_vertex(mesh, next_corner(h));
        keys[h] = {uint64_t{std::max(a, b)} << 32 | std::min(a, b), h};
    }
    sort_keys(keys, static_cast<uint32_t>(mesh.vertex_count()));
    return keys;
}

}  // namespace

std::vector<uint32_t> half_edge_twins(std::span<const uint32_t> corner_vertex, size_t vertices, bool* manifold) {
    const auto from = [&](uint32_t h) { return corner_vertex[h]; };
    const auto to = [&](uint32_t h) { return corner_vertex[next_corner(h)]; };
    // Half-edges by the vertex they begin at.
    std::vector<uint32_t> first(vertices + 1, 0), out(corner_vertex.size()), twin(out.size(), no_neighbour);
    for (const uint32_t v : corner_vertex) ++first[v + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> fill(first.begin(), first.end() - 1);
    for (uint32_t h = 0; h < twin.size(); ++h) out[fill[from(h)]++] = h;
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] != no_neighbour) continue;
        for (uint32_t i = first[to(h)]; i < first[to(h) + 1]; ++i) {
            const uint32_t g = out[i];
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
void count_edges(const TriMesh& mesh, std::span<const EdgeKey> keys, Topology& t, DisjointSets& fans) {
    std::vector<bool> on_boundary(mesh.vertex_count(), false);
    DisjointSets boundary(mesh.vertex_count());
    for (size_t i = 0; i < keys.size();) {
        size_t end = i + 1;
        while (end < keys.size() && keys[end].key == keys[i].key) ++end;
        ++t.edges;
        const uint32_t h = keys[i].half_edge;
        const uint32_t h_next = next_corner(h);
        if (end - i == 1) {
            ++t.boundary_edges;
            const uint32_t a = start_vertex(mesh, h), b = start_vertex(mesh, h_next);
            on_boundary[a] = on_boundary[b] = true;
            boundary.join(a, b);
        } else if (end - i > 2) {
            ++t.non_manifold_edges;
        }
        for (size_t k = i + 1; k < end; ++k) {
            const uint32_t g = keys[k].half_edge, g_next = next_corner(g);
            const bool same_way = start_vertex(mesh, g) == start_vertex(mesh, h);
            fans.join(h, same_way ? g : g_next);
            fans.join(h_next, same_way ? g_next : g);
            if (end - i != 2) continue;
            t.inconsistent_edges += same_way;
            const auto wedge = [&](uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
            t.seam_edges += wedge(h) != wedge(same_way ? g : g_next) || wedge(h_next) != wedge(same_way ? g_next : g);
        }
        i = end;
    }
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
    const auto keys = sorted_edges(mesh);
    DisjointSets fans(keys.size());
    count_edges(mesh, keys, t, fans);
    count_vertices(mesh, fans, t);
    uint32_t components = 0;
    components_of(mesh, &components);
    t.components = components;
    t.genus = genus_of(t);
    return t;
}

}  // namespace lodestone
