#include "mesh/tri_mesh.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace lodestone {

void TriMesh::set_identity_wedges() {
    wedge_vertex.resize(positions.size());
    std::iota(wedge_vertex.begin(), wedge_vertex.end(), 0u);
}

namespace {

bool is_tangent(const glm::vec4& t) {
    if (t == glm::vec4(0)) return true;
    return std::abs(glm::length(glm::vec3(t)) - 1) < 1e-3f && std::abs(t.w) == 1;
}

// What is wrong with a mesh's arrays of attributes, or nothing.
std::string wrong_attributes(const TriMesh& mesh) {
    const auto wrong_length = [&](const auto& values) {
        return !values.empty() && values.size() != mesh.wedge_count();
    };
    if (wrong_length(mesh.normals)) return "normals are not one per wedge";
    if (wrong_length(mesh.uvs)) return "texture coordinates are not one per wedge";
    if (wrong_length(mesh.second_uvs)) return "second texture coordinates are not one per wedge";
    if (!mesh.second_uvs.empty() && mesh.uvs.empty()) return "there are second texture coordinates without first ones";
    if (wrong_length(mesh.tangents)) return "tangents are not one per wedge";
    if (!mesh.tangents.empty() && mesh.normals.empty()) return "there are tangents without normals";
    if (wrong_length(mesh.colours)) return "colours are not one per wedge";
    if (wrong_length(mesh.materials)) return "materials are not one per wedge";
    for (size_t w = 0; w < mesh.tangents.size(); ++w) {
        if (!is_tangent(mesh.tangents[w])) return "the tangent of wedge " + std::to_string(w) + " is none";
    }
    return {};
}

}  // namespace

Result<void> TriMesh::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "mesh: " + what); };
    const size_t vertices = positions.size(), wedges = wedge_vertex.size();
    if (const std::string what = wrong_attributes(*this); !what.empty()) return wrong(what);
    for (size_t v = 0; v < vertices; ++v) {
        const glm::vec3 p = positions[v];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            return wrong("vertex " + std::to_string(v) + " has a coordinate that is not finite");
        }
    }
    for (size_t w = 0; w < wedges; ++w) {
        if (wedge_vertex[w] >= vertices)
            return wrong("wedge " + std::to_string(w) + " refers to a vertex out of range");
    }
    for (size_t t = 0; t < triangles.size(); ++t) {
        for (const uint32_t w : triangles[t]) {
            if (w >= wedges) return wrong("triangle " + std::to_string(t) + " refers to a wedge out of range");
        }
    }
    for (const uint16_t m : materials) {
        if (m >= material_table.size()) return wrong("material " + std::to_string(m) + " is out of range");
    }
    for (const Material& m : material_table) {
        for (const Texture* texture : m.textures()) {
            if (texture->image >= static_cast<int32_t>(images.size()))
                return wrong("material '" + m.name + "' refers to an image out of range");
        }
    }
    for (const Image& image : images) {
        if (image.texels.size() != size_t{image.width} * image.height)
            return wrong("an image has a wrong number of texels");
    }
    return {};
}

float Box::diagonal() const { return glm::length(high - low); }

int Box::longest_axis() const {
    const glm::vec3 extent = high - low;
    return extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
}

Box bounding_box(std::span<const glm::vec3> points) {
    if (points.empty()) return {};
    Box box{points[0], points[0]};
    for (const glm::vec3& p : points) {
        box.low = glm::min(box.low, p);
        box.high = glm::max(box.high, p);
    }
    return box;
}

std::vector<glm::vec3> vertex_normals(const TriMesh& mesh) {
    std::vector<glm::dvec3> sums(mesh.vertex_count(), glm::dvec3(0));
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::dvec3 a = mesh.position_of(t, 0), b = mesh.position_of(t, 1), c = mesh.position_of(t, 2);
        const glm::dvec3 normal = glm::cross(b - a, c - a);  // twice the area long
        for (int k = 0; k < 3; ++k) sums[mesh.vertex_of(t, k)] += normal;
    }
    std::vector<glm::vec3> normals(mesh.wedge_count());
    for (size_t w = 0; w < mesh.wedge_count(); ++w) {
        const glm::dvec3 sum = sums[mesh.wedge_vertex[w]];
        const double length = glm::length(sum);
        normals[w] = length > 0 ? glm::vec3(sum / length) : glm::vec3(0, 0, 1);
    }
    return normals;
}

void compute_normals(TriMesh& mesh) { mesh.normals = vertex_normals(mesh); }

size_t drop_unreferenced(TriMesh& mesh) {
    constexpr uint32_t gone = ~0u;
    std::vector<uint32_t> new_wedge(mesh.wedge_count(), gone), new_vertex(mesh.vertex_count(), gone);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) {
            new_wedge[w] = 0;
            new_vertex[mesh.wedge_vertex[w]] = 0;
        }
    }
    uint32_t wedges = 0, vertices = 0;
    for (size_t v = 0; v < new_vertex.size(); ++v) {
        if (new_vertex[v] == gone) continue;
        mesh.positions[vertices] = mesh.positions[v];
        new_vertex[v] = vertices++;
    }
    const size_t old_vertices = mesh.vertex_count();
    for (size_t w = 0; w < new_wedge.size(); ++w) {
        if (new_wedge[w] == gone) continue;
        mesh.wedge_vertex[wedges] = new_vertex[mesh.wedge_vertex[w]];
        for_attributes(
            [&](auto& attribute) {
                if (!attribute.empty()) attribute[wedges] = attribute[w];
            },
            mesh);
        new_wedge[w] = wedges++;
    }
    mesh.positions.resize(vertices);
    mesh.wedge_vertex.resize(wedges);
    for_attributes(
        [&](auto& attribute) {
            if (!attribute.empty()) attribute.resize(wedges);
        },
        mesh);
    for (Triangle& t : mesh.triangles) {
        for (uint32_t& w : t) w = new_wedge[w];
    }
    return old_vertices - vertices;
}

}  // namespace lodestone
