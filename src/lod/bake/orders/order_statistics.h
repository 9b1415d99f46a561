// What a face order costs over all levels: transforms by a simulated vertex cache, and the writes that keep it up.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lod/asset/progressive_mesh.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

// How sample_levels() spreads levels.
enum class LevelSpacing {
    uniform,  // equal steps of the triangle count
    log,      // equal factors
};

// `count` levels whose triangle counts lie at base + (full - base) * i / count, i = 1 .. count (uniform), or in
// geometric progression between the same ends (log). base is the coarsest level's count. Each is the finest level of at
// most that many triangles; the first entry is the coarsest.
std::vector<uint32_t> sample_levels(const ProgressiveMesh& pm, uint32_t count, LevelSpacing spacing);

// What an order costs at one level.
struct LevelCost {
    uint32_t level = 0;                    // 0 for full detail
    uint64_t triangles = 0, vertices = 0;  // alive faces; distinct wedges they use
    double atvr = 0;                       // transforms per vertex, degenerate faces' misses included
    double acmr = 0;                       // transforms per alive triangle
};

// What an order costs over levels.
struct OrderCost {
    std::vector<LevelCost> levels;        // as sample_levels
    double atvr_mean = 0, acmr_mean = 0;  // of the levels
    double atvr_worst = 0;                // the largest of a level
    double moved_per_ecol = 0;            // slots written by tswap, from full to base
    double cache_lines_per_ecol = 0;  // distinct 64-byte lines of the index buffer written by ecol and tswap together
    double bytes_per_ecol = 0;        // permutation data
};
// What a face order costs on a device with this cache.
// order: into pm.orders. levels: as sample_levels() gives them.
OrderCost cost_of_order(const ProgressiveMesh& pm, uint32_t order, const CacheModel& model,
                        const std::vector<uint32_t>& levels);

// What orders a level afresh.
enum class FreshOrder {
    meshoptimizer,       // meshopt_optimizeVertexCache
    meshoptimizer_fifo,  // meshopt_optimizeVertexCacheFifo, for the size of the model
    tipsify,             // mesh/cache/tipsify.h, likewise
    random,              // the faces shuffled, alike on every machine
};
// Mean ATVR over the same levels when each level is ordered afresh.
double atvr_of_fresh_order(const ProgressiveMesh& pm, FreshOrder order, const CacheModel& model,
                           const std::vector<uint32_t>& levels);
// Mean, over the levels, of three transforms for every living face: what no order exceeds.
double worst_atvr(const ProgressiveMesh& pm, const std::vector<uint32_t>& levels);
// Mean ATVR of meshoptimizer's order of full detail with the dead faces taken out; 0 where the mesh lacks the order
// "static".
double atvr_of_static_order(const ProgressiveMesh& pm, const CacheModel& model, const std::vector<uint32_t>& levels);

}  // namespace lodestone
