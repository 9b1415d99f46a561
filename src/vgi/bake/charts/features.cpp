#include "vgi/bake/charts/features.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "mesh/topology.h"

namespace lodestone::vgi {

namespace {

constexpr double crease_of_normals = 25, crease_of_faces = 60;  // degrees

uint64_t pair_of(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

}  // namespace

FeatureLines::FeatureLines(const TriMesh& mesh) {
    const auto cosine = [](double degrees) { return std::cos(degrees * std::numbers::pi / 180); };
    const double of_normals = cosine(crease_of_normals), of_faces = cosine(crease_of_faces);
    std::vector<uint32_t> corner_vertex;
    corner_vertex.reserve(mesh.triangle_count() * 3);
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) corner_vertex.push_back(mesh.vertex_of(t, k));
    }
    const std::vector<uint32_t> twin = half_edge_twins(corner_vertex, mesh.positions.size());
    const auto face_normal = [&](uint32_t t) {
        const glm::dvec3 n = area_vector(glm::dvec3(mesh.position_of(t, 0)), glm::dvec3(mesh.position_of(t, 1)),
                                         glm::dvec3(mesh.position_of(t, 2)));
        const double length = glm::length(n);
        return length > 0 ? n / length : n;
    };
    // Wedges of one vertex on both sides of an edge.
    const auto differ = [&](uint32_t a, uint32_t b) {
        if (!mesh.materials.empty() && mesh.materials[a] != mesh.materials[b]) return true;
        if (a == b) return false;
        if (!mesh.colours.empty() && mesh.colours[a] != mesh.colours[b]) return true;
        return !mesh.normals.empty() && static_cast<double>(glm::dot(mesh.normals[a], mesh.normals[b])) < of_normals;
    };
    const auto wedge = [&](uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
    for (uint32_t h = 0; h < twin.size(); ++h) {
        const uint32_t g = twin[h];
        if (g == no_neighbour || g < h) continue;
        const bool crease = mesh.normals.empty() && glm::dot(face_normal(h / 3), face_normal(g / 3)) < of_faces;
        if (crease || differ(wedge(h), wedge(next_corner(g))) || differ(wedge(next_corner(h)), wedge(g)))
            pairs_.push_back(pair_of(h / 3, g / 3));
    }
    std::ranges::sort(pairs_);
}

bool FeatureLines::between(uint32_t a, uint32_t b) const {
    return a != b && std::ranges::binary_search(pairs_, pair_of(a, b));
}

void FeatureLines::forget(const std::vector<bool>& triangles) {
    std::erase_if(pairs_, [&](uint64_t pair) { return triangles[pair >> 32] || triangles[pair & 0xffffffffu]; });
}

}  // namespace lodestone::vgi
