#include "vgi/surface.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <string>

namespace lodestone::vgi {

namespace {

// Twins by sorting edges: those that meet run opposite ways.
std::vector<uint32_t> pair_up(const std::vector<SurfaceTriangle>& triangles, size_t vertices, bool* manifold) {
    std::vector<uint32_t> first(vertices + 1, 0), of(triangles.size() * 3), twin(triangles.size() * 3, none);
    const auto from = [&](uint32_t h) { return triangles[h / 3].vertices[h % 3]; };
    const auto to = [&](uint32_t h) { return triangles[h / 3].vertices[(h + 1 - h / 3 * 3) % 3]; };
    for (uint32_t h = 0; h < twin.size(); ++h) ++first[from(h) + 1];
    for (size_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
    std::vector<uint32_t> fill(first.begin(), first.end() - 1);
    for (uint32_t h = 0; h < twin.size(); ++h) of[fill[from(h)]++] = h;
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] != none) continue;
        const uint32_t a = from(h), b = to(h);
        for (uint32_t i = first[b]; i < first[b + 1]; ++i) {
            const uint32_t g = of[i];
            if (to(g) != a) continue;
            if (twin[g] != none || twin[h] != none) {
                if (manifold != nullptr) *manifold = false;
                continue;
            }
            twin[h] = g;
            twin[g] = h;
        }
    }
    return twin;
}

}  // namespace

glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return glm::cross(b - a, c - a);
}

std::vector<uint32_t> Surface::twins() const { return pair_up(triangles, positions.size(), nullptr); }

double Surface::area() const {
    double sum = 0;
    for (const SurfaceTriangle& t : triangles)
        sum += glm::length(area_vector(positions[t.vertices[0]], positions[t.vertices[1]], positions[t.vertices[2]]));
    return sum / 2;
}

Result<void> Surface::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "surface: " + what); };
    for (size_t t = 0; t < triangles.size(); ++t) {
        const auto& v = triangles[t].vertices;
        const std::string name = "triangle " + std::to_string(t);
        for (const uint32_t i : v) {
            if (i >= positions.size()) return wrong(name + " has a vertex that is not there");
        }
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return wrong(name + " uses a vertex twice");
        for (const glm::vec2& p : triangles[t].place) {
            if (!(p.x >= -1e-6f && p.y >= -1e-6f && p.x + p.y <= 1 + 1e-5f))
                return wrong(name + " lies outside its source triangle");
        }
    }
    bool manifold = true;
    const std::vector<uint32_t> twin = pair_up(triangles, positions.size(), &manifold);
    if (!manifold) return wrong("an edge has more than two triangles");
    // One fan of triangles around every vertex.
    std::vector<uint32_t> corners(positions.size(), 0), some(positions.size(), none);
    for (uint32_t h = 0; h < twin.size(); ++h) {
        const uint32_t v = triangles[h / 3].vertices[h % 3];
        ++corners[v];
        if (some[v] == none || twin[h] == none) some[v] = h;  // on the boundary, the first of the fan
    }
    for (uint32_t v = 0; v < positions.size(); ++v) {
        if (some[v] == none) continue;
        uint32_t met = 0, h = some[v];
        do {
            ++met;
            const uint32_t in = h / 3 * 3 + (h + 2 - h / 3 * 3) % 3;  // the edge that comes into v
            h = twin[in];
        } while (h != none && h != some[v]);
        if (met != corners[v]) return wrong("vertex " + std::to_string(v) + " joins several fans");
    }
    return {};
}

Surface surface_of(const TriMesh& mesh, uint32_t* split) {
    Surface surface;
    surface.positions.reserve(mesh.vertex_count());
    for (const glm::vec3& p : mesh.positions) surface.positions.emplace_back(p);
    surface.triangles.reserve(mesh.triangle_count());
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t)
        surface.triangles.push_back({{mesh.vertex_of(t, 0), mesh.vertex_of(t, 1), mesh.vertex_of(t, 2)}, t});
    if (split != nullptr) *split = 0;
    // A triangle can have several such edges, so they are looked for again until none is left.
    for (bool again = true; again;) {
        again = false;
        const std::vector<uint32_t> twin = surface.twins();
        std::vector<bool> rim(surface.positions.size(), false), cut(surface.triangles.size(), false);
        for (uint32_t h = 0; h < twin.size(); ++h) {
            if (twin[h] != none) continue;
            rim[surface.triangles[h / 3].vertices[h % 3]] = true;
            rim[surface.triangles[h / 3].vertices[(h + 1 - h / 3 * 3) % 3]] = true;
        }
        for (uint32_t h = 0; h < twin.size(); ++h) {
            const uint32_t g = twin[h];
            if (g == none || g < h) continue;
            const uint32_t t = h / 3, k = h % 3, u = g / 3, j = g % 3;
            if (!rim[surface.triangles[t].vertices[k]] || !rim[surface.triangles[u].vertices[j]]) continue;
            if (cut[t] || cut[u]) {
                again = true;
                continue;
            }
            cut[t] = cut[u] = true;
            again = true;
            const auto middle = static_cast<uint32_t>(surface.positions.size());
            surface.positions.push_back((surface.positions[surface.triangles[t].vertices[k]] +
                                         surface.positions[surface.triangles[u].vertices[j]]) *
                                        0.5);
            for (const auto& [face, corner] : {std::pair(t, k), std::pair(u, j)}) {
                SurfaceTriangle& near = surface.triangles[face];
                SurfaceTriangle far = near;
                const uint32_t end = (corner + 1) % 3;
                const glm::vec2 place = (near.place[corner] + near.place[end]) * 0.5f;
                near.vertices[end] = far.vertices[corner] = middle;
                near.place[end] = far.place[corner] = place;
                surface.triangles.push_back(far);
                cut.push_back(true);
            }
            if (split != nullptr) ++*split;
        }
    }
    return surface;
}

}  // namespace lodestone::vgi
