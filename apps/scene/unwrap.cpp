#include "apps/scene/unwrap.h"

#include <algorithm>

#include "base/clock.h"
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

nlohmann::json unwrap_report(const vgi::UnwrapReport& r, const UnwrapChoices& choices) {
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
