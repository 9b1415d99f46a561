#include "mesh/packed_vertices.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"

namespace lodestone {

namespace {
float sign_not_zero(float x) { return x < 0 ? -1.0f : 1.0f; }
int16_t snorm(float x, int steps) { return static_cast<int16_t>(std::lround(std::clamp(x, -1.0f, 1.0f) * steps)); }

// Octahedral, so many steps to 1.
std::array<int16_t, 2> packed_in(int steps, const glm::vec3& unit) {
    const float sum = std::abs(unit.x) + std::abs(unit.y) + std::abs(unit.z);
    if (!(sum > 0)) return {0, 0};
    float x = unit.x / sum, y = unit.y / sum;
    if (unit.z < 0) {
        const float folded = (1 - std::abs(y)) * sign_not_zero(x);
        y = (1 - std::abs(x)) * sign_not_zero(y);
        x = folded;
    }
    return {snorm(x, steps), snorm(y, steps)};
}
glm::vec3 unpacked_of(int steps, int packed_x, int packed_y) {
    const float x = static_cast<float>(packed_x) / static_cast<float>(steps),
                y = static_cast<float>(packed_y) / static_cast<float>(steps);
    glm::vec3 n(x, y, 1 - std::abs(x) - std::abs(y));
    const float fold = std::max(-n.z, 0.0f);
    n.x -= sign_not_zero(n.x) * fold;
    n.y -= sign_not_zero(n.y) * fold;
    return glm::normalize(n);
}

constexpr int normal_steps = 32767;
}  // namespace

std::array<int16_t, 2> pack_normal(const glm::vec3& unit) { return packed_in(normal_steps, unit); }
glm::vec3 unpack_normal(const std::array<int16_t, 2>& packed) {
    return unpacked_of(normal_steps, packed[0], packed[1]);
}

uint32_t pack_tangent(const glm::vec4& tangent) {
    if (tangent.w == 0) return 0;
    const auto [x, y] = packed_in(LODE_TANGENT_STEPS, glm::vec3(tangent));
    constexpr uint32_t mask = (1u << LODE_TANGENT_BITS) - 1;
    return (static_cast<uint32_t>(x) & mask) | (static_cast<uint32_t>(y) & mask) << LODE_TANGENT_BITS |
           LODE_TANGENT_THERE | (tangent.w < 0 ? LODE_TANGENT_MIRRORED : 0u);
}

glm::vec4 unpack_tangent(uint32_t word) {
    if ((word & LODE_TANGENT_THERE) == 0) return glm::vec4(0);
    const auto number = [&](int first) {
        return static_cast<int32_t>(word << (32 - LODE_TANGENT_BITS - first)) >> (32 - LODE_TANGENT_BITS);
    };
    return {unpacked_of(LODE_TANGENT_STEPS, number(0), number(LODE_TANGENT_BITS)),
            (word & LODE_TANGENT_MIRRORED) != 0 ? -1 : 1};
}

std::vector<FurtherAttributes> pack_further(const TriMesh& mesh) {
    std::vector<FurtherAttributes> further(attributes_of(mesh).further() ? mesh.wedge_count() : 0);
    for (size_t w = 0; w < further.size(); ++w) {
        if (!mesh.second_uvs.empty()) further[w] = {{mesh.second_uvs[w].x, mesh.second_uvs[w].y}, 0};
        if (!mesh.tangents.empty()) further[w].tangent = pack_tangent(mesh.tangents[w]);
    }
    return further;
}

std::vector<MeshVertex> pack_vertices(const TriMesh& mesh) {
    TriMesh with_normals;
    const std::vector<glm::vec3>* normals = &mesh.normals;
    if (mesh.normals.empty()) {
        with_normals.positions = mesh.positions;
        with_normals.wedge_vertex = mesh.wedge_vertex;
        with_normals.triangles = mesh.triangles;
        compute_normals(with_normals);
        normals = &with_normals.normals;
    }
    std::vector<MeshVertex> vertices(mesh.wedge_count());
    for (size_t w = 0; w < vertices.size(); ++w) {
        MeshVertex& v = vertices[w];
        const glm::vec3 p = mesh.positions[mesh.wedge_vertex[w]];
        const auto n = pack_normal((*normals)[w]);
        const glm::vec2 uv = mesh.uvs.empty() ? glm::vec2(0) : mesh.uvs[w];
        const glm::u8vec4 c = mesh.colours.empty() ? glm::u8vec4(255) : mesh.colours[w];
        v = {{p.x, p.y, p.z},
             {n[0], n[1]},
             {uv.x, uv.y},
             {c.x, c.y, c.z, c.w},
             mesh.materials.empty() ? 0u : mesh.materials[w]};
    }
    return vertices;
}

PresentAttributes attributes_of(const TriMesh& mesh) {
    return {!mesh.normals.empty(),   !mesh.uvs.empty(),        !mesh.colours.empty(),
            !mesh.materials.empty(), !mesh.second_uvs.empty(), !mesh.tangents.empty()};
}

TriMesh unpack_vertices(std::span<const MeshVertex> wedges, std::span<const FurtherAttributes> further,
                        std::span<const uint32_t> wedge_vertex, const PresentAttributes& present) {
    LODE_CHECK(wedges.size() == wedge_vertex.size(), wedges.size(), wedge_vertex.size());
    LODE_CHECK(further.size() == (present.further() ? wedges.size() : 0), further.size(), wedges.size());
    TriMesh mesh;
    mesh.wedge_vertex.assign(wedge_vertex.begin(), wedge_vertex.end());
    uint32_t vertices = 0;
    for (const uint32_t v : wedge_vertex) vertices = std::max(vertices, v + 1);
    mesh.positions.resize(vertices);
    for (size_t w = wedges.size(); w-- > 0;) {
        const MeshVertex& v = wedges[w];
        mesh.positions[wedge_vertex[w]] = {v.position[0], v.position[1], v.position[2]};
    }
    for (const MeshVertex& v : wedges) {
        if (present.normals) mesh.normals.push_back(unpack_normal({v.normal[0], v.normal[1]}));
        if (present.uvs) mesh.uvs.emplace_back(v.uv[0], v.uv[1]);
        if (present.colours) mesh.colours.emplace_back(v.colour[0], v.colour[1], v.colour[2], v.colour[3]);
        if (present.materials) mesh.materials.push_back(static_cast<uint16_t>(v.material));
    }
    for (const FurtherAttributes& f : further) {
        if (present.second_uvs) mesh.second_uvs.emplace_back(f.second_uv[0], f.second_uv[1]);
        if (present.tangents) mesh.tangents.push_back(unpack_tangent(f.tangent));
    }
    return mesh;
}

}  // namespace lodestone
