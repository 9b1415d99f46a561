#include "apps/embed/arrays.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "base/text.h"
#include "mesh/limits.h"

namespace lodestone {

namespace {

tl::unexpected<Error> wrong(const std::string& what) { return fail(Fault::usage, what); }

// Index of the first element with a number that is not finite; the size where there is none.
template <class Vector>
size_t first_not_finite(std::span<const Vector> values) {
    for (size_t i = 0; i < values.size(); ++i) {
        for (int k = 0; k < Vector::length(); ++k) {
            if (!std::isfinite(values[i][k])) return i;
        }
    }
    return values.size();
}

Result<void> check_sizes(const MeshArrays& arrays) {
    const Limits limits;
    const uint64_t vertices = arrays.positions.size(), triangles = arrays.triangles.size();
    if (vertices == 0) return wrong("positions: there are no vertices");
    if (triangles == 0) return wrong("triangles: there are none");
    if (vertices > limits.vertices)
        return wrong("positions: the mesh " + over_limit("vertices", vertices, limits.vertices));
    if (triangles > limits.triangles)
        return wrong("triangles: the mesh " + over_limit("triangles", triangles, limits.triangles));
    const std::pair<const char*, uint64_t> per_vertex[] = {{"normals", arrays.normals.size()},
                                                           {"uvs", arrays.uvs.size()},
                                                           {"colours", arrays.colours.size()},
                                                           {"materials", arrays.materials.size()}};
    for (const auto& [name, size] : per_vertex) {
        if (size != 0 && size != vertices)
            return wrong(std::string(name) + ": there are " + std::to_string(size) + ", and " +
                         std::to_string(vertices) + " vertices; give one for each");
    }
    return {};
}

Result<void> check_numbers(const MeshArrays& arrays) {
    const auto not_finite = [](const char* name, size_t at) {
        return wrong(std::string(name) + ": that of vertex " + std::to_string(at) + " is not finite");
    };
    if (const size_t at = first_not_finite(arrays.positions); at < arrays.positions.size())
        return not_finite("positions", at);
    if (const size_t at = first_not_finite(arrays.normals); at < arrays.normals.size())
        return not_finite("normals", at);
    if (const size_t at = first_not_finite(arrays.uvs); at < arrays.uvs.size()) return not_finite("uvs", at);
    for (size_t t = 0; t < arrays.triangles.size(); ++t) {
        for (const uint32_t v : arrays.triangles[t]) {
            if (v >= arrays.positions.size())
                return wrong("triangles: triangle " + std::to_string(t) + " refers to vertex " + std::to_string(v) +
                             ", and there are " + std::to_string(arrays.positions.size()));
        }
    }
    return {};
}

Result<void> check_looks(const MeshArrays& arrays) {
    const Limits limits;
    if (arrays.material_table.size() > limits.materials)
        return wrong("material_table: the mesh " +
                     over_limit("materials", arrays.material_table.size(), limits.materials));
    const size_t materials = std::max<size_t>(1, arrays.material_table.size());
    for (size_t v = 0; v < arrays.materials.size(); ++v) {
        if (arrays.materials[v] >= materials)
            return wrong("materials: vertex " + std::to_string(v) + " has material " +
                         std::to_string(arrays.materials[v]) + ", and there are " + std::to_string(materials));
    }
    for (size_t m = 0; m < arrays.material_table.size(); ++m) {
        const Material& material = arrays.material_table[m];
        for (int k = 0; k < 4; ++k) {
            if (!(material.base_colour[k] >= 0 && material.base_colour[k] <= 1))
                return wrong("material_table: the base colour of material " + std::to_string(m) +
                             " is not within 0 .. 1");
        }
        if (material.base_colour_texture.image < -1 ||
            material.base_colour_texture.image >= static_cast<int64_t>(arrays.images.size()))
            return wrong("material_table: material " + std::to_string(m) + " refers to image " +
                         std::to_string(material.base_colour_texture.image) + ", and there are " +
                         std::to_string(arrays.images.size()));
    }
    uint64_t texels = 0;
    for (size_t i = 0; i < arrays.images.size(); ++i) {
        const Image& image = arrays.images[i];
        if (image.width == 0 || image.height == 0 || image.width > limits.image_side ||
            image.height > limits.image_side)
            return wrong("images: image " + std::to_string(i) + " is " + std::to_string(image.width) + " x " +
                         std::to_string(image.height) + "; each side must be 1 .. " +
                         std::to_string(limits.image_side));
        texels += image.texels.size();
    }
    return texels <= limits.texels ? Result<void>{}
                                   : wrong("images: the mesh " + over_limit("texels", texels, limits.texels));
}

}  // namespace

Result<TriMesh> mesh_of(MeshArrays arrays) {
    for (const auto& check : {check_sizes, check_numbers, check_looks}) {
        if (auto good = check(arrays); !good) return tl::unexpected(good.error());
    }
    TriMesh mesh;
    mesh.positions.assign(arrays.positions.begin(), arrays.positions.end());
    mesh.triangles.assign(arrays.triangles.begin(), arrays.triangles.end());
    mesh.set_identity_wedges();
    mesh.normals.reserve(arrays.normals.size());
    for (const glm::vec3& normal : arrays.normals) {
        const double length = glm::length(glm::dvec3(normal));
        mesh.normals.push_back(length > 0 ? glm::vec3(glm::dvec3(normal) / length) : glm::vec3(0, 0, 1));
    }
    mesh.uvs.assign(arrays.uvs.begin(), arrays.uvs.end());
    mesh.colours.assign(arrays.colours.begin(), arrays.colours.end());
    mesh.materials.assign(arrays.materials.begin(), arrays.materials.end());
    mesh.material_table = std::move(arrays.material_table);
    for (Material& material : mesh.material_table) material.name = as_utf8(material.name);
    mesh.images = std::move(arrays.images);
    if (!mesh.materials.empty() && mesh.material_table.empty()) mesh.material_table.emplace_back();
    return mesh;
}

std::span<const glm::vec3> wedge_positions(const TriMesh& mesh, std::vector<glm::vec3>& room) {
    bool own = mesh.wedge_count() == mesh.vertex_count();
    for (size_t w = 0; own && w < mesh.wedge_count(); ++w) own = mesh.wedge_vertex[w] == w;
    if (own) return mesh.positions;
    room.clear();
    room.reserve(mesh.wedge_count());
    for (const uint32_t v : mesh.wedge_vertex) room.push_back(mesh.positions[v]);
    return room;
}

}  // namespace lodestone
