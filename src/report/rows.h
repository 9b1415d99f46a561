// What was measured: one row per backend, face order, raster path and pixel error, and what was seen beside.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace lodestone {

// What the rows were measured on.
struct Machine {
    std::string cpu, device, driver, commit;  // as system, driver and build name them
    bool software = false;                    // the device is a CPU rasteriser
};
// An object with the members as fields.
nlohmann::ordered_json json_of(const Machine& machine);

// One way to draw a scene: a backend, what of it is chosen, and what beside it.
struct Technique {
    std::string backend;       // full, discrete, lod or vgi
    std::string order;         // lod: of faces
    std::string raster;        // vgi, lod: how triangles are made and moved
    std::string volumes = {};  // smoke and fire: off, on, reference or a quality; empty: as the scene has them
    auto operator<=>(const Technique&) const = default;
};
// What is chosen, without the backend; empty where nothing is.
std::string choices_of(const Technique& way, char between = ' ');
// Backend and choices.
std::string name_of(const Technique& way, char between = ' ');

// Field names are the JSON names of the report. Means are over frames unless the name says otherwise.
struct Row : Technique {
    double pixel_error = 0;                                    // asked for; pixels
    uint32_t frames = 0;                                       // measured
    double ms_median = 0, ms_p95 = 0, ms_p99 = 0, ms_max = 0;  // plan to fence
    double ms_floor = 0;                                       // median of the same frame with an empty scene
    double ms_jolt = 0;  // 99th percentile of each frame over the median of the 15 around it; 1 is smooth
    double fps_mean = 0, fps_min = 0, fps_max = 0;  // frames a second: from the mean, longest, shortest time
    // The same where `frames_in_flight` overlap; of periods from one frame's end to the next one's.
    double throughput_fps = 0, throughput_fps_min = 0, throughput_fps_max = 0;
    uint32_t frames_in_flight = 1;                   // at most, where they overlap
    double cpu_plan_ms = 0, cpu_ms = 0, gpu_ms = 0;  // processor time of plans, and of threads beside; device time
    std::vector<std::pair<std::string, double>> stages_gpu_ms;  // device time by stage; medians
    double uploaded_bytes = 0;                                  // per frame, the first left out
    uint64_t resident_bytes = 0;                                // of all buffers, in the last frame
    double triangles = 0, vertex_invocations = 0;               // per frame; all passes
    double acmr = 0;                 // vertex invocations per drawn triangle of the colour pass, counted by the device
    double acmr_fifo16 = 0;          // simulated, of the pictures compared
    bool compared = true;            // false: no picture was, and the JSON has null for what is of pictures
    double psnr_db = 0, ssim = 0;    // means over the pictures compared (image_metrics.h)
    double max_pixel_deviation = 0;  // the largest over the pictures compared
    uint64_t background_leaks = 0;   // the sum
    uint64_t cracks = 0;             // the sum
    double bake_seconds = 0;         // of all that the scene needed baked; 0 where it was there
    uint64_t asset_bytes = 0;        // of all asset files
    // What smoke and fire took, where the scene has any; see docs/volumes.md.
    struct Volume {
        double bin_ms = 0, fill_ms = 0, light_ms = 0, march_ms = 0, composite_ms = 0;  // means
        double bricks = 0;   // metavoxels that are not empty; mean
        uint64_t bytes = 0;  // of all buffers, the largest
    };
    std::optional<Volume> volume;          // of scenes that have any
    std::vector<double> flight_ms;         // frame by frame, every round
    std::vector<double> flight_triangles;  // likewise
};

// Two of the pictures that were compared, as files beside the report.
struct RowPicture {
    uint32_t row = 0, frame = 0;      // frame: which of the pictures compared
    std::string picture, difference;  // names of the two files
};

// A flight on which a controller set the pixel error of every frame to hold a frame time.
struct SteeredFlight : Technique {
    double target_ms = 0;                 // that was to be held, milliseconds
    std::vector<double> ms, pixel_error;  // frame by frame
};

// A backend swept over pixel errors, read where it measures the same as a row of another.
struct EqualError : Technique {      // which is read
    uint32_t row = 0;                // which is compared
    std::string metric;              // "ssim" or "max_pixel_deviation"
    double value = 0;                // the row's
    double pixel_error = 0, ms = 0;  // of the other there, between its rows; ms: mean of a frame
    double ratio = 0;                // ms of the other over the row's: above 1 the row is faster
    // "between": read between two rows; "at least": even the other's cheapest row is better than asked, so its time is
    // an upper bound of what it needs; "never": even its best row is worse, and the numbers are that row's.
    std::string where;
};

// All that one run of `bench` measured.
struct Report {
    Machine machine;                      // what it ran on
    std::string scene, size;              // the name of the scene; WIDTHxHEIGHT in pixels
    std::vector<Row> rows;                // in the order they were measured
    std::vector<RowPicture> pictures;     // of rows
    std::vector<std::string> references;  // files, by frame
    std::vector<SteeredFlight> steered;   // where a frame time was to be held
};

// What a row can be judged by.
struct ErrorMetric {
    const char* name;             // as in EqualError
    double (*of)(const Row&);     // the row's
    double (*worse)(const Row&);  // the same, turned so that larger is worse
};
// All of them; valid for ever.
std::span<const ErrorMetric> error_metrics();

// Every row that has an error (`full` has none) against every other curve, and `full` against all.
std::vector<EqualError> at_equal_error(std::span<const Row> rows);

// {"machine": {...}, "rows": [...], ...}
nlohmann::ordered_json json_of(const Report& report);
// For eyes: a line per row under a line of headings.
std::string report_table(std::span<const Row> rows);

}  // namespace lodestone
