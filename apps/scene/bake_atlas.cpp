#include "apps/scene/bake_atlas.h"

#include <algorithm>
#include <iomanip>
#include <sstream>

#include "vgi/asset/leaves/leaves.h"
#include "vgi/bake/bake.h"
#include "vgi/bake/images/chart_sizes.h"

namespace lodestone {

namespace {

// With --target-error: as many clusters as bring the finest level under it, each try twice as many as the last.
constexpr uint32_t most_clusters = 1u << 14;

// As many as were asked for, but fewer where they would have fewer triangles than the range says, and more where they
// would have more: laying out one of n triangles takes n to the power of 1.5.
void fit_clusters(vgi::AtlasOptions& options, size_t triangles, const TrianglesPerCluster& range) {
    constexpr uint32_t fewest_clusters = 8;
    uint32_t& clusters = options.clusters.clusters;
    const auto of = [&](double each) {
        return static_cast<uint32_t>(std::min(static_cast<double>(triangles) / each, 1e9));
    };
    clusters = std::max(std::min(clusters, std::max(of(range.fewest), fewest_clusters)), of(range.most));
}
void warn_of(const vgi::AtlasReport& made, const vgi::AtlasOptions& options, double diagonal,
             const Progress& progress) {
    if (made.cells != options.cells && options.samples_per_triangle == 0) {
        progress.warning("the mesh needs so many charts, " + std::to_string(made.charts) +
                         ", that they are sampled at " + std::to_string(made.cells + 1) + "^2, not " +
                         std::to_string(options.cells + 1) + "^2");
    }
    if (made.charts_without_leaves > 0) {
        progress.warning(std::to_string(made.charts_without_leaves) + " of " + std::to_string(made.charts) +
                         " charts have no leaves: their triangles are too thin to be cut into squares; they are drawn "
                         "from samples");
    }
    if (made.stretched_charts > 0) {
        std::ostringstream line;
        line << made.stretched_charts << " of " << made.charts << " charts are stretched more than "
             << options.worst_stretch << " times, up to " << std::setprecision(3) << made.l2_stretch_worst
             << ": detail is lost there (largest error of the finest level: " << made.max_error / diagonal
             << " of the diagonal)";
        progress.warning(line.str());
    }
}

// Errors are shares of the diagonal.
Json json_of(const vgi::AtlasReport& made, const vgi::Atlas& atlas, double diagonal) {
    return {{"clusters", made.clusters},
            {"charts", made.charts},
            {"template_charts", made.template_charts},
            {"coarse_charts", made.coarse_charts},
            {"resolution", made.cells + 1},
            {"attribute_resolution", atlas.attribute_cells + 1},
            {"textures_baked", atlas.attributes.baked},
            {"buckets", made.buckets},
            {"rounds", made.rounds},
            {"lone_triangles", made.changes.lone_triangles},
            {"split_long_edges", made.changes.long_edges},
            {"split_boundary_chords", made.changes.boundary_chords},
            {"not_recentred", made.not_recentred},
            {"features_on_borders", made.features_on_borders},
            {"uniform_clusters", made.uniform_clusters},
            {"uniform_charts", made.uniform_charts},
            {"seconds",
             {{"buckets", made.cut_seconds},
              {"cluster", made.bucket_seconds},
              {"merge", made.merge_seconds},
              {"straighten", made.straighten_seconds},
              {"quadrangulate", made.quadrangulate_seconds},
              {"parameterise", made.parameterise_seconds},
              {"resample", made.resample_seconds},
              {"hierarchy", made.error_seconds}}},
            {"flipped_triangles", made.flipped_triangles},
            {"missing_samples", made.missing_samples},
            {"stretched_charts", made.stretched_charts},
            {"charts_without_leaves", made.charts_without_leaves},
            {"leaf_triangles", vgi::leaf_triangles(atlas)},
            {"folded_cells", made.folded_cells},
            {"still_folded_cells", made.still_folded_cells},
            {"l2_stretch_tutte", made.l2_stretch_tutte},
            {"l2_stretch_rms", made.l2_stretch_rms},
            {"l2_stretch_worst", made.l2_stretch_worst},
            {"rms_error", made.rms_error / diagonal},
            {"max_error", made.max_error / diagonal}};
}

}  // namespace

Result<vgi::Atlas> bake_atlas(const TriMesh& mesh, const BakeOptions& options, Json& report, const Progress& progress,
                              const CheckpointFolder* work) {
    if (mesh.triangles.empty()) return fail(Fault::format, "the mesh has no triangle to make an atlas of");
    vgi::AtlasOptions atlas_options = options.atlas;
    if (options.triangles_per_cluster)
        fit_clusters(atlas_options, mesh.triangle_count(), *options.triangles_per_cluster);
    const double diagonal = std::max(1e-30, static_cast<double>(bounding_box(mesh.positions).diagonal()));
    for (;;) {
        vgi::AtlasReport made;
        auto atlas = vgi::make_atlas(mesh, atlas_options, made, progress, work);
        if (!atlas) return tl::unexpected(atlas.error());
        const double finest = static_cast<double>(atlas->errors[0]);
        uint32_t& clusters = atlas_options.clusters.clusters;
        if (options.target_error > 0 && finest > options.target_error && clusters < most_clusters &&
            made.clusters < mesh.triangle_count() / 4) {
            clusters *= 2;
            continue;
        }
        if (options.target_error > 0 && finest > options.target_error) {
            progress.warning("--target-error " + std::to_string(options.target_error) + ": " +
                             std::to_string(made.clusters) + " clusters come within " + std::to_string(finest) +
                             "; a higher --resolution may bring it under");
        }
        warn_of(made, atlas_options, diagonal, progress);
        report = json_of(made, *atlas, diagonal);
        return atlas;
    }
}

}  // namespace lodestone
