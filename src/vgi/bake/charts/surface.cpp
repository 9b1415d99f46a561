#include "vgi/bake/charts/surface.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <queue>
#include <string>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

std::vector<uint32_t> twins_of(std::span<const SurfaceTriangle> triangles, size_t vertices, bool* manifold) {
    std::vector<uint32_t> corner_vertex;
    corner_vertex.reserve(triangles.size() * 3);
    for (const SurfaceTriangle& t : triangles)
        corner_vertex.insert(corner_vertex.end(), t.vertices.begin(), t.vertices.end());
    return half_edge_twins(corner_vertex, vertices, manifold);
}

glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return glm::cross(b - a, c - a);
}

double Surface::length(uint32_t half_edge) const {
    const auto& v = triangles[half_edge / 3].vertices;
    return glm::distance(positions[v[half_edge % 3]], positions[v[next_corner(half_edge) % 3]]);
}

double Surface::area() const {
    double sum = 0;
    for (size_t t = 0; t < triangles.size(); ++t) sum += area(t);
    return sum;
}

double Surface::area(size_t triangle) const {
    const auto& v = triangles[triangle].vertices;
    return glm::length(area_vector(positions[v[0]], positions[v[1]], positions[v[2]])) / 2;
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
        for (const glm::vec2& p : places.of(triangles[t])) {
            if (!(p.x >= -1e-6f && p.y >= -1e-6f && p.x + p.y <= 1 + 1e-5f))
                return wrong(name + " lies outside its source triangle");
        }
    }
    bool manifold = true;
    const std::vector<uint32_t> twin = twins_of(triangles, positions.size(), &manifold);
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
            h = twin[previous_corner(h)];  // across the edge that comes into v
        } while (h != none && h != some[v]);
        if (met != corners[v]) return wrong("vertex " + std::to_string(v) + " joins several fans");
    }
    return {};
}

namespace {

ChartMesh whole_patch(const TriMesh& mesh) {
    ChartMesh whole;
    for (const glm::vec3& p : mesh.positions) whole.positions.emplace_back(p);
    whole.triangles.reserve(mesh.triangle_count());
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t)
        whole.triangles.push_back({{mesh.vertex_of(t, 0), mesh.vertex_of(t, 1), mesh.vertex_of(t, 2)}, t});
    whole.twin = twins_of(whole.triangles, whole.positions.size());
    whole.origin.assign(whole.positions.size(), none);
    return whole;
}

// A mesh of needles has little area for the length of its edges: all that are longer than the area asks for would take
// hundreds of halvings each. So no more are made than this; what is longest then stays as long.
constexpr uint32_t most_halvings_of_each = 1;  // per triangle given
constexpr uint32_t halvings_of_any = 4096;     // however few are given

// The longest first; halves go back to the heap.
uint32_t split_long_edges(ChartMesh& whole, double longest) {
    struct Edge {
        double length;
        uint32_t half_edge, a, b;
        bool operator<(const Edge& other) const {
            return length != other.length ? length < other.length : half_edge > other.half_edge;
        }
    };
    std::priority_queue<Edge> heap;
    const auto push = [&](uint32_t h) {
        if (whole.twin[h] != none && whole.twin[h] < h) h = whole.twin[h];
        const uint32_t a = whole.from(h), b = whole.to(h);
        const double length = glm::length(whole.positions[b] - whole.positions[a]);
        if (length > longest) heap.push({length, h, a, b});
    };
    for (uint32_t h = 0; h < whole.twin.size(); ++h) {
        if (whole.twin[h] == none || whole.twin[h] > h) push(h);
    }
    const uint64_t most = most_halvings_of_each * uint64_t{whole.triangles.size()} + halvings_of_any;
    uint32_t count = 0;
    while (!heap.empty() && count < most) {
        const Edge edge = heap.top();
        heap.pop();
        const uint32_t h = edge.half_edge, g = whole.twin[h];
        if (whole.from(h) != edge.a || whole.to(h) != edge.b) continue;  // its number went to another edge
        const auto first_new = static_cast<uint32_t>(whole.triangles.size());
        whole.split_edge(h, 0.5, 0.5);
        ++count;
        // All edges of the triangles it touched: those whose numbers changed are entered again.
        for (uint32_t k = 0; k < 3; ++k) {
            push(h / 3 * 3 + k);
            if (g != none) push(g / 3 * 3 + k);
        }
        for (uint32_t e = first_new * 3; e < whole.twin.size(); ++e) push(e);
    }
    return count;
}

}  // namespace

Surface surface_of(const TriMesh& mesh, double longest, SurfaceChanges* changes) {
    ChartMesh whole = whole_patch(mesh);
    SurfaceChanges made;
    const auto given = static_cast<uint32_t>(whole.triangles.size());
    for (uint32_t t = 0; t < given; ++t) {
        if (whole.twin[t * 3] != none || whole.twin[t * 3 + 1] != none || whole.twin[t * 3 + 2] != none) continue;
        whole.split_triangle(t);
        whole.split_edge(t * 3, 0.5, 0.5);  // a boundary has room for a quad's corners then
        ++made.lone_triangles;
    }
    if (longest > 0) made.long_edges = split_long_edges(whole, longest);
    made.boundary_chords = split_chords(whole);
    if (changes != nullptr) *changes = made;
    Surface surface;
    surface.positions = std::move(whole.positions);
    surface.triangles = std::move(whole.triangles);
    surface.places = std::move(whole.places);
    surface.uncut = static_cast<uint32_t>(surface.positions.size());
    return surface;
}

}  // namespace lodestone::vgi
