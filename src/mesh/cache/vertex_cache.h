// Simulators of post-transform vertex caches: what an index order costs on a given piece of hardware.
//   FIFO and LRU: Hoppe, "Optimization of mesh locality for transparent vertex caching", SIGGRAPH 1999.
//   Batch models: Kerbl et al., "Revisiting the vertex cache", HPG 2018; parameters as meshoptimizer analyses them.
// ACMR: transformed vertices per triangle, 0.5 .. 3 on large meshes. ATVR: transforms per distinct vertex used, >= 1.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace lodestone {

// What a device reuses transformed vertices by.
struct CacheModel {
    // How vertices stay in the cache.
    enum class Kind {
        fifo,   // the oldest entry goes; a hit changes nothing
        lru,    // the entry not used for longest goes
        batch,  // triangles are cut into batches, each with a FIFO of its own
    };
    Kind kind = Kind::fifo;  // size, and for batch the limits below, belong to it
    uint32_t size = 16;      // entries of the cache (fifo, lru) or of the FIFO inside each batch, 3 .. 1024
    // batch: a batch closes when another triangle would pass either limit; nothing is reused across batches. These are
    // the cache_size, warp_size and primgroup_size of meshoptimizer's analysis.
    uint32_t batch_vertices = 0;   // transforms of a batch at most, 0 for no limit
    uint32_t batch_triangles = 0;  // triangles of a batch at most, 0 for no limit
    // batch: indices of a batch agree above this many low bits, 0 for any; an index that does not agree closes it. Not
    // of meshoptimizer: measured on an NVIDIA H200 (16 bits; cache_probe.cpp draws what tells).
    uint32_t batch_index_bits = 0;
    bool operator==(const CacheModel&) const = default;
};

// "fifo16", "fifo24", "lru32", ..., "nvidia", "amd", "intel"; Fault::usage names the choices.
Result<CacheModel> cache_model_named(std::string_view name);
// The name that cache_model_named() takes; of a batch model of other sizes, one that tells them.
std::string name_of(const CacheModel& model);

// What an index order cost.
struct CacheStatistics {
    uint64_t transforms = 0;  // vertex shader runs
    uint64_t triangles = 0;   // non-degenerate ones
    uint64_t vertices = 0;    // distinct vertices used by non-degenerate triangles
    // Transforms per triangle; 0 where there is no triangle.
    double acmr() const { return triangles ? static_cast<double>(transforms) / static_cast<double>(triangles) : 0; }
    // Transforms per vertex used; 0 where there is none.
    double atvr() const { return vertices ? static_cast<double>(transforms) / static_cast<double>(vertices) : 0; }
};
// Draws the triangles through an empty cache.
// indices: three per triangle, in drawing order, of any size, as the device sees them where the model has index bits;
// memory follows how many there are. Degenerate triangles cost what their vertices cost, but are not counted. misses,
// if given: per triangle, how many of its corners missed (0 .. 3); resized to fit.
CacheStatistics simulate(const CacheModel& model, std::span<const uint32_t> indices,
                         std::vector<uint8_t>* misses = nullptr);

// CacheStatistics::transforms alone; every index below `vertices`.
uint64_t count_transforms(const CacheModel& model, std::span<const uint32_t> indices, uint32_t vertices);

}  // namespace lodestone
