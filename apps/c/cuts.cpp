// Cuts of the C interface.
#include <algorithm>
#include <cstddef>
#include <iterator>

#include "apps/c/handles.h"

using namespace lodestone;
using namespace lodestone::c;

// Vertices are handed out as they lie.
static_assert(sizeof(lodestone_vertex) == sizeof(CutVertex) &&
              offsetof(lodestone_vertex, position) == offsetof(CutVertex, position) &&
              offsetof(lodestone_vertex, normal) == offsetof(CutVertex, normal) &&
              offsetof(lodestone_vertex, uv) == offsetof(CutVertex, uv) &&
              offsetof(lodestone_vertex, colour) == offsetof(CutVertex, colour) &&
              offsetof(lodestone_vertex, material) == offsetof(CutVertex, material));

namespace {

CutView view_of(const lodestone_view& given) {
    CutView view;
    view.camera = {{given.eye[0], given.eye[1], given.eye[2]},
                   {given.target[0], given.target[1], given.target[2]},
                   {given.up[0], given.up[1], given.up[2]},
                   given.fov_y,
                   given.near_plane,
                   given.far_plane};
    view.width = given.width;
    view.height = given.height;
    const bool is_given = std::any_of(std::begin(given.object_to_world), std::end(given.object_to_world),
                                      [](float number) { return number != 0; });
    for (int i = 0; is_given && i < 16; ++i) view.object_to_world[i / 4][i % 4] = given.object_to_world[i];
    view.pixel_error = given.pixel_error;
    view.max_triangles = given.max_triangles;
    view.culls_back_faces = given.culls_back_faces != 0;
    view.wait = given.wait != 0;
    return view;
}

lodestone_cut cut_of(const Cut& made) {
    lodestone_cut cut{};
    cut.vertices = made.vertices.empty() ? nullptr : reinterpret_cast<const lodestone_vertex*>(made.vertices.data());
    cut.indices = made.indices.empty() ? nullptr : made.indices.data();
    cut.vertex_count = made.vertices.size();
    cut.index_count = made.indices.size();
    cut.vertices_version = made.vertices_version;
    cut.level = made.level;
    cut.pixel_error = made.pixel_error;
    cut.resident_bytes = made.resident_bytes;
    cut.settled = made.settled ? 1 : 0;
    return cut;
}

}  // namespace

lodestone_status lodestone_cutter_create(const lodestone_asset* asset, lodestone_backend backend,
                                         uint64_t resident_bytes, lodestone_cutter** cutter) {
    if (cutter == nullptr) return refused(__func__, "cutter is NULL");
    *cutter = nullptr;
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    if (backend != LODESTONE_LOD && backend != LODESTONE_VGI)
        return refused(__func__, "backend must be LODESTONE_LOD or LODESTONE_VGI");
    if (resident_bytes > uint64_t{1} << 40) return refused(__func__, "resident_bytes must be at most 2^40");
    return status_of([&]() -> Result<void> {
        auto opened = Cutter::open(asset->asset, backend == LODESTONE_LOD ? "lod" : "vgi",
                                   resident_bytes == 0 ? uint64_t{1} << 30 : resident_bytes);
        if (!opened) return tl::unexpected(opened.error());
        *cutter = new lodestone_cutter{std::move(*opened)};
        return {};
    });
}

lodestone_status lodestone_cutter_cut(lodestone_cutter* cutter, const lodestone_view* view, lodestone_cut* cut) {
    if (cutter == nullptr) return refused(__func__, "cutter is NULL");
    if (!is_sized(view)) return refused(__func__, "view is NULL, or its struct_size is not that of the struct");
    if (!is_sized(cut)) return refused(__func__, "cut is NULL, or its struct_size is not that of the struct");
    return status_of([&]() -> Result<void> {
        const auto made = cutter->cutter->cut(view_of(taken(view)));
        if (!made) return fail_at("lodestone_cutter_cut", made.error());
        fill(cut, cut_of(*made));
        return {};
    });
}

void lodestone_cutter_free(lodestone_cutter* cutter) { delete cutter; }
