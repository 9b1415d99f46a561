#include "mesh/clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "mesh/repair.h"

namespace lodestone {

namespace {

// What the edge of a polygon that begins at a corner lies on: an edge of the triangle, or a plane.
struct Line {
    bool plane = false;
    uint32_t number = 0;
};
// A triangle on the way to what is kept of it.
struct OutlineCorner {
    uint32_t wedge = 0;
    Line line;
};
using Outline = std::vector<OutlineCorner>;

// A share of the way from one to the other: between tangents of two frames that mirror each other there is none.
glm::vec4 tangent_between(const glm::vec4& a, const glm::vec4& b, float share) {
    const glm::vec3 tangent = glm::mix(glm::vec3(a), glm::vec3(b), share);
    const float length = glm::length(tangent);
    return a.w == b.w && length > 0 ? glm::vec4(tangent / length, a.w) : a;
}

std::array<float, 3> key_of(const glm::vec3& p) { return {p.x, p.y, p.z}; }

class Clipping {
public:
    Clipping(TriMesh& mesh, std::vector<ClipPlane> planes) : mesh_(mesh), planes_(std::move(planes)) {}

    void run() {
        std::vector<Triangle> kept;
        for (const Triangle& triangle : mesh_.triangles) {
            const Outline polygon = clipped(triangle);
            for (size_t k = 2; k < polygon.size(); ++k)
                kept.push_back({polygon[0].wedge, polygon[k - 1].wedge, polygon[k].wedge});
        }
        mesh_.triangles = std::move(kept);
        drop_unreferenced(mesh_);
    }

private:
    const glm::vec3& place(uint32_t wedge) const { return mesh_.positions[mesh_.wedge_vertex[wedge]]; }
    // Above 0 outside of what a plane keeps.
    double outside(uint32_t plane, uint32_t wedge) const {
        const double height = planes_[plane].height(place(wedge));
        return planes_[plane].above ? -height : height;
    }

    Outline clipped(const Triangle& triangle) {
        Outline polygon;
        for (uint32_t k = 0; k < 3; ++k) polygon.push_back({triangle[k], {false, k}});
        for (uint32_t plane = 0; plane < planes_.size() && !polygon.empty(); ++plane)
            polygon = clipped(triangle, polygon, plane);
        return polygon;
    }
    Outline clipped(const Triangle& triangle, const Outline& polygon, uint32_t plane) {
        std::vector<double> out;
        for (const OutlineCorner& corner : polygon) out.push_back(outside(plane, corner.wedge));
        if (std::ranges::none_of(out, [](double d) { return d > 0; })) {
            const bool in_plane = std::ranges::all_of(out, [](double d) { return d == 0; });
            return in_plane && planes_[plane].above ? Outline{} : polygon;
        }
        if (std::ranges::none_of(out, [](double d) { return d < 0; })) return {};
        Outline kept;
        for (size_t i = 0; i < polygon.size(); ++i) {
            const size_t next = (i + 1) % polygon.size();
            const double a = out[i], b = out[next];
            if (a <= 0) kept.push_back({polygon[i].wedge, a == 0 && b > 0 ? Line{true, plane} : polygon[i].line});
            if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
                const uint32_t cut = crossing(triangle, polygon[i], polygon[next].wedge, plane);
                kept.push_back({cut, a < 0 ? Line{true, plane} : polygon[i].line});
            }
        }
        return kept;
    }

    // Where a plane cuts the edge of a polygon: told from the edge of the triangle that it is part of, or from the
    // segment in which another plane cuts the triangle.
    uint32_t crossing(const Triangle& triangle, const OutlineCorner& begin, uint32_t end, uint32_t plane) {
        if (!begin.line.plane) {
            const uint32_t a = triangle[begin.line.number], b = triangle[(begin.line.number + 1) % 3];
            return crosses(plane, a, b) ? between(a, b, plane) : between(begin.wedge, end, plane);
        }
        const uint32_t first = std::min(begin.line.number, plane), second = std::max(begin.line.number, plane);
        const auto segment = segment_of(triangle, first);
        if (!segment || !crosses(second, (*segment)[0], (*segment)[1])) return between(begin.wedge, end, plane);
        return between((*segment)[0], (*segment)[1], second);
    }
    bool crosses(uint32_t plane, uint32_t a, uint32_t b) const {
        const double at_a = outside(plane, a), at_b = outside(plane, b);
        return (at_a < 0 && at_b > 0) || (at_a > 0 && at_b < 0);
    }
    std::optional<std::array<uint32_t, 2>> segment_of(const Triangle& triangle, uint32_t plane) {
        std::vector<uint32_t> ends;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
            if (outside(plane, a) == 0) ends.push_back(a);
            if (crosses(plane, a, b)) ends.push_back(between(a, b, plane));
        }
        if (ends.size() != 2) return std::nullopt;
        return std::array{ends[0], ends[1]};
    }

    // The wedge where a plane cuts the segment from a to b, whose places say which of them comes first.
    uint32_t between(uint32_t a, uint32_t b, uint32_t plane) {
        if (std::pair(key_of(place(b)), b) < std::pair(key_of(place(a)), a)) std::swap(a, b);
        const auto [known, fresh] = wedges_.try_emplace({a, b, plane}, 0);
        if (!fresh) return known->second;
        const double at_a = planes_[plane].height(place(a)), at_b = planes_[plane].height(place(b));
        const double share = at_a / (at_a - at_b);
        known->second = add_wedge(a, b, plane, share);
        return known->second;
    }
    uint32_t add_wedge(uint32_t a, uint32_t b, uint32_t plane, double share) {
        const std::tuple vertex_key{mesh_.wedge_vertex[a], mesh_.wedge_vertex[b], plane};
        const auto [vertex, fresh] = vertices_.try_emplace(vertex_key, static_cast<uint32_t>(mesh_.positions.size()));
        if (fresh) {
            const glm::dvec3 p(place(a)), q(place(b));
            glm::vec3 cut(p + (q - p) * share);
            // Exactly where the plane is, if that lies along two axes.
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 unit(0);
                unit[axis] = 1;
                if (planes_[plane].normal == unit) cut[axis] = static_cast<float>(planes_[plane].offset);
            }
            mesh_.positions.push_back(cut);
        }
        mesh_.wedge_vertex.push_back(vertex->second);
        const auto f = static_cast<float>(share);
        if (!mesh_.normals.empty()) {
            const glm::vec3 normal = glm::mix(mesh_.normals[a], mesh_.normals[b], f);
            const float length = glm::length(normal);
            mesh_.normals.push_back(length > 0 ? normal / length : mesh_.normals[a]);
        }
        for (auto* uvs : {&mesh_.uvs, &mesh_.second_uvs}) {
            if (!uvs->empty()) uvs->push_back(glm::mix((*uvs)[a], (*uvs)[b], f));
        }
        if (!mesh_.tangents.empty()) mesh_.tangents.push_back(tangent_between(mesh_.tangents[a], mesh_.tangents[b], f));
        if (!mesh_.colours.empty())
            mesh_.colours.emplace_back(
                glm::round(glm::mix(glm::vec4(mesh_.colours[a]), glm::vec4(mesh_.colours[b]), f)));
        if (!mesh_.materials.empty()) mesh_.materials.push_back(mesh_.materials[a]);
        return static_cast<uint32_t>(mesh_.wedge_vertex.size() - 1);
    }

    TriMesh& mesh_;
    const std::vector<ClipPlane> planes_;
    // By both ends, the first one first, and the plane.
    std::map<std::tuple<uint32_t, uint32_t, uint32_t>, uint32_t> wedges_, vertices_;
};

}  // namespace

Result<void> clip(TriMesh& mesh, std::span<const ClipPlane> planes) {
    if (auto repaired = repair(mesh); !repaired) return tl::unexpected(repaired.error());
    // In an order that every piece has alike.
    std::vector<ClipPlane> sorted(planes.begin(), planes.end());
    std::ranges::sort(sorted, {}, [](const ClipPlane& p) {
        return std::tuple(p.normal.x, p.normal.y, p.normal.z, p.offset, p.above);
    });
    Clipping(mesh, std::move(sorted)).run();
    if (mesh.triangles.empty()) return fail(Fault::format, "nothing of the mesh is left by --clip");
    return {};
}

bool lies_on(const ClipPlane& plane, const glm::vec3& a, const glm::vec3& b, double largest) {
    const double rounding = largest * glm::length(plane.normal) * 0x1p-21;
    return std::abs(plane.height(a)) <= rounding && std::abs(plane.height(b)) <= rounding;
}

}  // namespace lodestone
