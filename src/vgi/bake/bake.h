// From a mesh to an atlas: all stages in a row, each timed and counted.
#pragma once

#include <cstdint>

#include "base/files/checkpoint_folder.h"
#include "base/progress.h"
#include "base/result.h"
#include "mesh/limits.h"
#include "vgi/asset/atlas.h"
#include "vgi/bake/charts/clusters.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// What the atlas shall be like.
struct AtlasOptions {
    ClusterOptions clusters;           // how the surface is divided; density, features and kept are set by the bake
    ParameteriseOptions parameterise;  // how charts are laid out
    // Per side of a chart, a power of two, 2 .. 4096. Halved while all images together would have more texels than
    // most_texels_per_triangle allows and charts are many more than `clusters` asks for: a mesh of thousands of small
    // components has several charts for each.
    uint32_t cells = 128;
    double most_texels_per_triangle = 40;  // see `cells`
    // How much rounding positions to the lattice may add to the error of sampling, rms: the lattice has no more points
    // than that needs. 0 for as many as 16 bits count.
    double rounding_share = 0.55;
    uint32_t attribute_ratio = 1;  // samples of attributes for one of positions, along a side; a power of two
    // A cluster with a chart stretched more than this is cut finer, and so again for so many rounds (rounds.h); shapes
    // that are needles stay what they are.
    double worst_stretch = 3;
    uint32_t most_rounds = 7;         // see `worst_stretch`
    uint32_t recentre_passes = 2;     // half passes: around corners, around centres, around corners, ...
    uint64_t error_samples = 200000;  // of all charts, either way; spread by area, and some of every chart
    bool leaves = false;              // the source's triangles below the finest samples (leaves.h)
    // Finest samples for each triangle of the source at most, 0 for as many as `cells` says: samples denser than the
    // source are of no use beside leaves. With leaves that holds for each chart (sizes_by_triangles()), else `cells` is
    // halved until it holds for all together. Images of attributes are only as coarse where they hold nothing but
    // normals: with textures or materials they are as fine as `cells` says, with colours twice as fine as positions.
    double samples_per_triangle = 0;
    // What textures hold is sampled into the images of attributes, which are as fine as texels of the source are and
    // have no texture coordinates: base colours, metal and roughness, occlusion, emission, and maps of normals.
    bool bake_textures = false;
    // Of what is baked as the file holds it: 1 .. 100, the more the better; 0 for without loss.
    uint32_t texture_quality = 0;
};

// What was made, and how long it took.
struct AtlasReport {
    uint32_t clusters = 0, charts = 0, buckets = 0, rounds = 0;  // how many of each
    uint32_t template_charts = 0;                         // of charts: those of components too small for clusters
    uint32_t coarse_charts = 0;                           // without samples of the finest levels (chart_sizes.h)
    uint32_t cells = 0;                                   // taken
    SurfaceChanges changes;                               // to the mesh, before it was divided
    uint32_t not_recentred = 0;                           // corners and centres that were left where they were
    uint32_t uniform_clusters = 0, uniform_charts = 0;    // laid out with equal weights, because the better ones folded
    uint32_t stretched_charts = 0;                        // more than worst_stretch, by as much as counts
    uint32_t charts_without_leaves = 0;                   // that could not be cut into squares (chart_leaves.h)
    uint32_t flipped_triangles = 0, missing_samples = 0;  // triangles folded over in the plane; samples in none
    uint32_t folded_cells = 0, still_folded_cells = 0;    // of the finest level, before and after untangle()
    double features_on_borders = 1;                       // of the length of creases and seams
    // L2 stretch, 1 where sampling is even: rms by area before weights were changed and after; the worst chart.
    double l2_stretch_tutte = 0, l2_stretch_rms = 0, l2_stretch_worst = 0;
    double rms_error = 0, max_error = 0;  // of the finest level, two-sided, object units
    // Wall clock of the stages. The last three run side by side; theirs are shares of it.
    double cut_seconds = 0, bucket_seconds = 0, merge_seconds = 0, quadrangulate_seconds = 0, straighten_seconds = 0,
           parameterise_seconds = 0, resample_seconds = 0, error_seconds = 0;
};

// The mesh must be what repair() leaves, and have a triangle. Fault::invariant where a stage cannot do its work.
// Fault::format where there would be more charts than the limit.
// work: stages found there are not made again, others are kept there; null for none. The same atlas either way.
Result<Atlas> make_atlas(const TriMesh& mesh, const AtlasOptions& options, AtlasReport& report,
                         const Progress& progress = {}, const CheckpointFolder* work = nullptr,
                         const Limits& limits = {});

}  // namespace lodestone::vgi
