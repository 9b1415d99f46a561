#include "vgi/bake/charts/chart_mesh.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "mesh/predicates.h"

namespace lodestone::vgi {

uint32_t ChartMesh::split_edge(uint32_t h, double at, double flat_at) {
    const auto middle = static_cast<uint32_t>(positions.size());
    const uint32_t a = from(h), b = to(h), g = twin[h];
    positions.push_back(positions[a] + (positions[b] - positions[a]) * at);
    if (!flat.empty()) flat.push_back(flat[a] + (flat[b] - flat[a]) * flat_at);
    origin.push_back(none);
    // The near half keeps the number of the triangle, the far half is new. The half-edge h keeps its number, from a.
    const auto halve = [&](uint32_t edge, double share) {  // edge: the half-edge to be cut, share from its begin
        const uint32_t t = edge / 3, k = edge % 3, end = (k + 1) % 3, apex = (k + 2) % 3;
        const auto far_number = static_cast<uint32_t>(triangles.size());
        SurfaceTriangle& near = triangles[t];
        SurfaceTriangle far = near;
        CutPlaces::Corners nearer = places.of(near), farther = nearer;
        nearer[end] = farther[k] = nearer[k] + (nearer[end] - nearer[k]) * static_cast<float>(share);
        near.vertices[end] = far.vertices[k] = middle;
        far.places = none;
        places.set(near, nearer);
        places.set(far, farther);
        triangles.push_back(far);
        // far: k..end is the far half of the edge, end..apex what was next, apex..k the cut.
        twin.resize(triangles.size() * 3, none);
        const uint32_t was_next = twin[t * 3 + end];
        twin[far_number * 3 + end] = was_next;
        if (was_next != none) twin[was_next] = far_number * 3 + end;
        twin[far_number * 3 + apex] = t * 3 + end;
        twin[t * 3 + end] = far_number * 3 + apex;
        return far_number * 3 + k;
    };
    const uint32_t far_h = halve(h, at);
    if (g != none) {
        const uint32_t far_g = halve(g, 1 - at);
        twin[h] = far_g;
        twin[far_g] = h;
        twin[far_h] = g;
        twin[g] = far_h;
    }
    return middle;
}

uint32_t ChartMesh::split_triangle(uint32_t t) {
    const auto middle = static_cast<uint32_t>(positions.size());
    const SurfaceTriangle whole = triangles[t];
    const auto& v = whole.vertices;
    positions.push_back((positions[v[0]] + positions[v[1]] + positions[v[2]]) / 3.0);
    if (!flat.empty()) flat.push_back((flat[v[0]] + flat[v[1]] + flat[v[2]]) / 3.0);
    origin.push_back(none);
    const CutPlaces::Corners place = places.of(whole);
    const glm::vec2 centre = (place[0] + place[1] + place[2]) / 3.0f;
    const auto count = static_cast<uint32_t>(triangles.size());
    const uint32_t part[3] = {t, count, count + 1};  // part k has edge k
    const uint32_t outside[3] = {twin[t * 3], twin[t * 3 + 1], twin[t * 3 + 2]};
    triangles.resize(count + 2);
    twin.resize(triangles.size() * 3, none);
    for (uint32_t k = 0; k < 3; ++k) {
        SurfaceTriangle& p = triangles[part[k]];
        p = {{v[k], v[(k + 1) % 3], middle}, whole.source};
        places.set(p, {place[k], place[(k + 1) % 3], centre});
        twin[part[k] * 3] = outside[k];
        if (outside[k] != none) twin[outside[k]] = part[k] * 3;
        twin[part[k] * 3 + 1] = part[(k + 1) % 3] * 3 + 2;
        twin[part[k] * 3 + 2] = part[(k + 2) % 3] * 3 + 1;
    }
    return middle;
}

std::vector<bool> ChartMesh::on_boundary() const {
    std::vector<bool> rim(positions.size(), false);
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] == none) rim[from(h)] = rim[to(h)] = true;
    }
    return rim;
}

std::unordered_map<uint32_t, uint32_t> ChartMesh::numbers() const {
    std::unordered_map<uint32_t, uint32_t> number;
    number.reserve(origin.size());
    for (uint32_t v = 0; v < origin.size(); ++v) {
        if (origin[v] != none) number[origin[v]] = v;
    }
    return number;
}

std::vector<uint32_t> ChartMesh::boundary() const {
    std::vector<uint32_t> after(positions.size(), none);
    uint32_t lowest = none;
    size_t count = 0;
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] != none) continue;
        after[from(h)] = to(h);
        lowest = std::min(lowest, from(h));
        ++count;
    }
    std::vector<uint32_t> loop;
    if (lowest == none) return loop;
    uint32_t v = lowest;
    do {
        loop.push_back(v);
        v = after[v];
    } while (v != lowest && loop.size() <= count);
    LODE_CHECK(loop.size() == count, loop.size(), count);
    return loop;
}

double ChartMesh::signed_flat_area(uint32_t t) const {
    const auto& v = triangles[t].vertices;
    const glm::dvec2 e = flat[v[1]] - flat[v[0]], f = flat[v[2]] - flat[v[0]];
    return cross(e, f);
}

double ChartMesh::area(uint32_t t) const {
    const auto& v = triangles[t].vertices;
    return glm::length(area_vector(positions[v[0]], positions[v[1]], positions[v[2]])) / 2;
}

uint32_t ChartMesh::flipped() const {
    uint32_t count = 0;
    for (const SurfaceTriangle& t : triangles) {
        const auto& v = t.vertices;
        count += orientation(flat[v[0]], flat[v[1]], flat[v[2]]) <= 0;
    }
    return count;
}

ChartMesh take_chart_mesh(const Surface& surface, std::span<const uint32_t> triangles) {
    ChartMesh patch;
    std::unordered_map<uint32_t, uint32_t> number;
    number.reserve(triangles.size());
    for (const uint32_t t : triangles) {
        SurfaceTriangle local = patch.places.adopt(surface.triangles[t], surface.places);
        for (uint32_t& v : local.vertices) {
            const auto [at, fresh] = number.try_emplace(v, static_cast<uint32_t>(patch.positions.size()));
            if (fresh) {
                patch.positions.push_back(surface.positions[v]);
                patch.origin.push_back(v);
            }
            v = at->second;
        }
        patch.triangles.push_back(local);
    }
    patch.twin = twins_of(patch.triangles, patch.positions.size());
    return patch;
}

uint32_t split_chords(ChartMesh& patch) {
    std::vector<bool> rim = patch.on_boundary();
    uint32_t count = 0;
    // New half-edges are looked at too: a triangle with three boundary vertices has several chords.
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        if (patch.twin[h] == none || !rim[patch.from(h)] || !rim[patch.to(h)]) continue;
        patch.split_edge(h, 0.5, 0.5);
        rim.push_back(false);
        ++count;
    }
    return count;
}

}  // namespace lodestone::vgi
