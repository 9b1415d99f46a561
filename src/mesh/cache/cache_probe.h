// Which vertex-cache model a device is closest to, found out by drawing made-up index patterns and counting vertex
// shader runs: what Kuzikowski, Belago, Gladky, Elykov, "Hardware Friendly Continuous Level of Details", Graphicon
// 2005, do when their program is installed, and Kerbl et al., "Revisiting the vertex cache", HPG 2018, on today's GPUs.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

struct ProbePattern {
    std::string name;
    std::vector<uint32_t> indices;  // three per triangle, each below probe_vertices
};
constexpr uint32_t probe_vertices = (1u << 16) + 8192;

// Triangles that come back after so many others, bands of a grid of several widths, a grid in random order, one whose
// indices are far apart: what tells sizes, replacement rules and batches apart.
std::vector<ProbePattern> probe_patterns();

struct ProbeResult {
    CacheModel model;  // the closest
    double error = 0;  // of it: root mean square of the natural logarithm of predicted over counted runs
    struct Candidate {
        CacheModel model;
        double error = 0;
    };
    std::vector<Candidate> candidates;  // the closest first
    struct Count {
        std::string pattern;
        uint64_t triangles = 0, counted = 0, predicted = 0;  // vertex shader runs; predicted by the closest model
    };
    std::vector<Count> counts;
};
// count: vertex shader runs of one draw of these indices.
Result<ProbeResult> probe_cache(const std::function<Result<uint64_t>(std::span<const uint32_t>)>& count);

}  // namespace lodestone
