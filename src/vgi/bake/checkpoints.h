// Stages of an atlas in the making, as chunks of a work folder's files (base/files/checkpoint_folder.h).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/files/chunk_file.h"
#include "vgi/bake/charts/clusters.h"
#include "vgi/bake/images/chart_error.h"
#include "vgi/bake/images/chart_leaves.h"
#include "vgi/bake/images/resample.h"
#include "vgi/bake/images/sample_errors.h"
#include "vgi/bake/quads/quadrangulate.h"

namespace lodestone::vgi {

Result<void> write_checkpoint(const Clusters& clusters, ChunkWriter& writer);
std::optional<Clusters> read_clusters(const ChunkFile& file);

// Quads once they are straight. not_recentred: places that were left where they were.
struct StraightQuads {
    Quads quads;
    uint32_t not_recentred = 0;
};
Result<void> write_checkpoint(const StraightQuads& straight, ChunkWriter& writer);
std::optional<StraightQuads> read_quads(const ChunkFile& file);

// What making a chart told, besides its images.
struct ChartResult {
    struct Figures {
        double area = 0, stretch = 0, tutte_stretch = 0;
        double spacing = 1;  // of samples, against what is usual
        uint32_t flipped = 0, uniform = 0;
        Sampled sampled;
        uint32_t samples = 0;
    } figures;
    ChartErrors errors;
    std::vector<SourceSample> samples;
    ChartLeaves leaves;
    std::string fault;  // empty where it could be made

    bool lacks_leaves() const { return !leaves.parts.empty() && leaves.coded.empty(); }
};
// Some charts: their results, and their images out of an atlas.
Result<void> write_checkpoint(std::span<const uint32_t> charts, const std::vector<ChartResult>& results,
                              const Atlas& atlas, ChunkWriter& writer);
// False where the file is not of these charts; then some may have been written.
bool read_charts(const ChunkFile& file, std::span<const uint32_t> charts, std::vector<ChartResult>& results,
                 Atlas& atlas);

}  // namespace lodestone::vgi
