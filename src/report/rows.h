// What was measured: one row per backend, face order, raster path and pixel error.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace lodestone {

// What the rows were measured on.
struct Machine {
    std::string cpu, device, driver, commit;
    bool software = false;
};

// Field names are the JSON names of the report. Means are over frames unless the name says otherwise.
struct Row {
    std::string backend, order, raster;
    double pixel_error = 0;
    uint32_t frames = 0;
    double ms_median = 0, ms_p95 = 0, ms_p99 = 0, ms_max = 0;  // plan to fence
    double ms_floor = 0;                                       // median of the same frame with an empty scene
    double fps_mean = 0, fps_min = 0, fps_max = 0;
    double cpu_plan_ms = 0, gpu_ms = 0;
    double uploaded_bytes = 0;  // per frame, the first left out
    uint64_t resident_bytes = 0;
    double triangles = 0, vertex_invocations = 0;  // per frame; all passes
    double acmr = 0;         // vertex invocations per drawn triangle of the colour pass, counted by the device
    double acmr_fifo16 = 0;  // simulated
    double psnr_db = 0, ssim = 0;
    double max_pixel_deviation = 0;  // the largest over the pictures compared
    uint64_t background_leaks = 0;   // the sum
    double bake_seconds = 0;
    uint64_t asset_bytes = 0;
};

// {"machine": {...}, "rows": [...]}
std::string report_json(const Machine& machine, std::span<const Row> rows);
// For eyes: a line per row under a line of headings.
std::string report_table(std::span<const Row> rows);

}  // namespace lodestone
