#include "apps/scene/unwrap.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include "base/clock.h"
#include "mesh/repair.h"
#include "vgi/unwrap/texture_bake.h"

namespace lodestone {

Result<UnwrapDone> unwrap_mesh(const TriMesh& mesh, const UnwrapChoices& choices, const Progress& progress) {
    if (!choices.bake && !mesh.images.empty())
        progress.warning(
            "the textures of the mesh do not fit its new texture coordinates and are left out; --bake "
            "brings them over");
    UnwrapDone done;
    vgi::UnwrapOptions options = choices.squares;
    options.gutter = choices.gutter / choices.resolution;
    auto made = vgi::unwrap(mesh, options, done.report, progress);
    if (!made) return tl::unexpected(made.error());
    done.unwrapped = std::move(*made);
    if (!choices.bake) return done;
    progress.at("textures", 0);
    const Stopwatch watch;
    vgi::use_textures(done.unwrapped.mesh,
                      vgi::bake_textures(mesh, done.unwrapped, options.textures, choices.resolution),
                      mesh.material_table);
    done.bake_seconds = watch.wall();
    return done;
}

namespace {

// Texels along a side of a square, a power of two, that holds as many as the images of any one kind of texture.
uint32_t side_of_textures(const TriMesh& mesh) {
    uint64_t most = 0;
    for (size_t kind = 0; kind < texture_names.size(); ++kind) {
        std::set<int32_t> images;
        for (const Material& material : mesh.material_table) images.insert(material.textures()[kind]->image);
        uint64_t texels = 0;
        for (const int32_t i : images) {
            if (i >= 0) texels += mesh.images[static_cast<size_t>(i)].texels.size();
        }
        most = std::max(most, texels);
    }
    const auto side = static_cast<uint64_t>(std::ceil(std::sqrt(static_cast<double>(most))));
    return static_cast<uint32_t>(std::clamp<uint64_t>(std::bit_ceil(side), 16, Limits{}.image_side));
}

}  // namespace

Result<vgi::UnwrapReport> retexture(TriMesh& mesh, const Progress& progress) {
    UnwrapChoices choices;
    // Each keeps two triangles or more from being simplified away: half as many as `unwrap` takes.
    choices.squares.charts = static_cast<uint32_t>(std::clamp<uint64_t>(mesh.triangle_count() / 4000, 24, 160));
    choices.resolution = side_of_textures(mesh);
    choices.bake = true;
    auto done = unwrap_mesh(mesh, choices, progress);
    if (!done) return tl::unexpected(done.error());
    mesh = std::move(done->unwrapped.mesh);
    if (auto repaired = repair(mesh, {}, progress); !repaired) return tl::unexpected(repaired.error());
    return done->report;
}

Json unwrap_report(const vgi::UnwrapReport& r, const UnwrapChoices& choices) {
    const double more = r.source_triangles > 0 ? static_cast<double>(r.triangles - r.source_triangles) /
                                                     static_cast<double>(r.source_triangles)
                                               : 0;
    return {{"charts", r.charts},
            {"rounds", r.rounds},
            {"source_triangles", r.source_triangles},
            {"source_vertices", r.source_vertices},
            {"triangles", r.triangles},
            {"vertices", r.vertices},
            {"cut_share", more},
            {"seam_edges", r.seam_edges},
            {"seam_length", r.seam_length},
            {"l2_stretch_rms", r.l2_stretch_rms},
            {"l2_stretch_worst", r.l2_stretch_worst},
            {"coverage", r.coverage},
            {"flipped_triangles", r.flipped},
            {"overlapping_pairs", r.overlapping},
            {"textures", choices.squares.textures},
            {"resolution", choices.resolution},
            {"gutter", choices.gutter},
            {"baked", choices.bake}};
}

}  // namespace lodestone
