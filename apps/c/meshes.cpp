// Meshes of the C interface: from arrays, from files, simplified, unwrapped; and the simulated cache.
#include <span>

#include "apps/c/handles.h"
#include "apps/embed/arrays.h"
#include "apps/embed/levels.h"
#include "apps/embed/simplify.h"
#include "apps/embed/unwrap.h"
#include "base/text.h"
#include "mesh/cache/vertex_cache.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

using namespace lodestone;
using namespace lodestone::c;

namespace {

template <class To, class From>
std::span<const To> span_of(const From* values, uint64_t count) {
    return values == nullptr ? std::span<const To>() : std::span(reinterpret_cast<const To*>(values), count);
}

// What must be known of the arrays before they are looked at; null where nothing is wrong.
const char* fault_of(const lodestone_arrays& a) {
    const Limits limits;
    if (a.vertex_count == 0 || a.vertex_count > limits.vertices) return "vertex_count must be 1 .. 4294967280";
    if (a.triangle_count == 0 || a.triangle_count > limits.triangles) return "triangle_count must be 1 .. 1431655764";
    if (a.positions == nullptr) return "positions is NULL";
    if (a.triangles == nullptr) return "triangles is NULL";
    if (a.material_count > limits.materials) return "material_count must be 0 .. 65536";
    if (a.image_count > 65536) return "image_count must be 0 .. 65536";
    if (a.material_count > 0 && a.material_table == nullptr) return "material_table is NULL";
    if (a.image_count > 0 && a.images == nullptr) return "images is NULL";
    for (uint32_t i = 0; i < a.image_count; ++i) {
        const lodestone_image& image = a.images[i];
        if (image.width == 0 || image.height == 0 || image.width > limits.image_side ||
            image.height > limits.image_side)
            return "images: a side is not 1 .. 16384";
        if (image.rgba == nullptr) return "images: rgba is NULL";
    }
    return nullptr;
}

MeshArrays arrays_of(const lodestone_arrays& a) {
    MeshArrays arrays;
    arrays.positions = span_of<glm::vec3>(a.positions, a.vertex_count);
    arrays.triangles = span_of<Triangle>(a.triangles, a.triangle_count);
    arrays.normals = span_of<glm::vec3>(a.normals, a.vertex_count);
    arrays.uvs = span_of<glm::vec2>(a.uvs, a.vertex_count);
    arrays.colours = span_of<glm::u8vec4>(a.colours, a.vertex_count);
    arrays.materials = span_of<uint16_t>(a.materials, a.vertex_count);
    for (const lodestone_material& m : std::span(a.material_table, a.material_count)) {
        Material material;
        if (m.name != nullptr) material.name = m.name;
        material.base_colour = {m.base_colour[0], m.base_colour[1], m.base_colour[2], m.base_colour[3]};
        material.base_colour_texture.image = m.image;
        material.double_sided = m.double_sided != 0;
        arrays.material_table.push_back(std::move(material));
    }
    for (const lodestone_image& i : std::span(a.images, a.image_count)) {
        const auto texels = span_of<glm::u8vec4>(i.rgba, uint64_t{i.width} * i.height);
        arrays.images.push_back({i.width, i.height, {texels.begin(), texels.end()}});
    }
    return arrays;
}

}  // namespace

lodestone_status lodestone_mesh_create(const lodestone_arrays* arrays, lodestone_mesh** mesh) {
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    *mesh = nullptr;
    if (!is_sized(arrays)) return refused(__func__, "arrays is NULL, or its struct_size is not that of the struct");
    const lodestone_arrays given = taken(arrays);
    if (const char* fault = fault_of(given)) return refused(__func__, fault);
    return status_of([&]() -> Result<void> {
        auto made = mesh_of(arrays_of(given));
        if (!made) return fail_at("lodestone_mesh_create", made.error());
        *mesh = handle_of(NamedMesh{std::move(*made), "arrays"});
        return {};
    });
}

lodestone_status lodestone_mesh_read(const char* path, const char* options, lodestone_mesh** mesh) {
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    *mesh = nullptr;
    if (path == nullptr) return refused(__func__, "path is NULL");
    return status_of([&]() -> Result<void> {
        const auto words = bake_options_of_text(options == nullptr ? "" : options);
        if (!words) return tl::unexpected(words.error());
        auto read = read_mesh(path, words->read);
        if (!read) return tl::unexpected(read.error());
        *mesh = handle_of(NamedMesh{std::move(*read), as_utf8(std::filesystem::path(path).filename().string())});
        return {};
    });
}

lodestone_status lodestone_mesh_write(const lodestone_mesh* mesh, const char* path) {
    if (mesh == nullptr || path == nullptr) return refused(__func__, "mesh or path is NULL");
    return status_of([&] { return write_mesh(mesh->named.mesh, path); });
}

lodestone_status lodestone_mesh_arrays(const lodestone_mesh* mesh, lodestone_arrays* arrays) {
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    if (!is_sized(arrays)) return refused(__func__, "arrays is NULL, or its struct_size is not that of the struct");
    fill(arrays, mesh->arrays);
    return LODESTONE_OK;
}

void lodestone_mesh_free(lodestone_mesh* mesh) { delete mesh; }

lodestone_status lodestone_simplify(const lodestone_mesh* mesh, const lodestone_target* target,
                                    const lodestone_progress* progress, lodestone_mesh** simplified) {
    if (simplified == nullptr) return refused(__func__, "simplified is NULL");
    *simplified = nullptr;
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    if (!is_sized(target)) return refused(__func__, "target is NULL, or its struct_size is not that of the struct");
    if (const char* fault = c::fault_of(progress)) return refused(__func__, fault);
    const lodestone_target given = taken(target);
    return status_of([&]() -> Result<void> {
        std::atomic<bool> stop = false;
        auto made =
            simplify(mesh->named.mesh, {given.triangles, given.error, given.openmesh != 0 ? "openmesh" : "quadric"},
                     progress_of(progress, stop));
        if (!made) return tl::unexpected(made.error());
        *simplified = handle_of(NamedMesh{std::move(*made), mesh->named.name});
        return {};
    });
}

lodestone_status lodestone_unwrap(const lodestone_mesh* mesh, const char* options, const lodestone_progress* progress,
                                  lodestone_mesh** unwrapped, lodestone_unwrap_report* report) {
    if (unwrapped == nullptr) return refused(__func__, "unwrapped is NULL");
    *unwrapped = nullptr;
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    if (report != nullptr && !is_sized(report)) return refused(__func__, "struct_size of report is not its size");
    if (const char* fault = c::fault_of(progress)) return refused(__func__, fault);
    return status_of([&]() -> Result<void> {
        const auto choices = unwrap_choices_of_text(options == nullptr ? "" : options);
        if (!choices) return tl::unexpected(choices.error());
        std::atomic<bool> stop = false;
        auto made = unwrap(mesh->named.mesh, *choices, progress_of(progress, stop));
        if (!made) return tl::unexpected(made.error());
        const vgi::UnwrapReport& r = made->report;
        *unwrapped = handle_of(NamedMesh{std::move(made->unwrapped.mesh), mesh->named.name});
        if (report != nullptr)
            fill(report, {0, r.charts, r.source_triangles, r.triangles, r.seam_edges, r.seam_length, r.l2_stretch_rms,
                          r.l2_stretch_worst, r.coverage});
        return {};
    });
}

lodestone_status lodestone_simulate_cache(const uint32_t* indices, uint64_t index_count, const char* cache,
                                          lodestone_cache_cost* cost) {
    if (indices == nullptr && index_count > 0) return refused(__func__, "indices is NULL");
    if (index_count % 3 != 0) return refused(__func__, "index_count is no multiple of 3");
    if (!is_sized(cost)) return refused(__func__, "cost is NULL, or its struct_size is not that of the struct");
    return status_of([&]() -> Result<void> {
        const auto simulated = simulated_cost(std::span(indices, index_count), cache == nullptr ? "fifo16" : cache);
        if (!simulated) return fail_at("lodestone_simulate_cache", simulated.error());
        fill(cost, {0, simulated->transforms, simulated->triangles, simulated->vertices, simulated->acmr(),
                    simulated->atvr()});
        return {};
    });
}
