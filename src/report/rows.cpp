#include "report/rows.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace lodestone {

std::string report_json(const Machine& machine, std::span<const Row> rows) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["machine"] = {{"cpu", machine.cpu},
                       {"device", machine.device},
                       {"driver", machine.driver},
                       {"software", machine.software},
                       {"commit", machine.commit}};
    json["rows"] = Json::array();
    for (const Row& r : rows) {
        json["rows"].push_back({{"backend", r.backend},
                                {"order", r.order},
                                {"raster", r.raster},
                                {"pixel_error", r.pixel_error},
                                {"frames", r.frames},
                                {"ms_median", r.ms_median},
                                {"ms_p95", r.ms_p95},
                                {"ms_p99", r.ms_p99},
                                {"ms_max", r.ms_max},
                                {"ms_floor", r.ms_floor},
                                {"fps_mean", r.fps_mean},
                                {"fps_min", r.fps_min},
                                {"fps_max", r.fps_max},
                                {"cpu_plan_ms", r.cpu_plan_ms},
                                {"gpu_ms", r.gpu_ms},
                                {"uploaded_bytes", r.uploaded_bytes},
                                {"resident_bytes", r.resident_bytes},
                                {"triangles", r.triangles},
                                {"vertex_invocations", r.vertex_invocations},
                                {"acmr", r.acmr},
                                {"acmr_fifo16", r.acmr_fifo16},
                                {"psnr_db", r.psnr_db},
                                {"ssim", r.ssim},
                                {"max_pixel_deviation", r.max_pixel_deviation},
                                {"background_leaks", r.background_leaks},
                                {"bake_seconds", r.bake_seconds},
                                {"asset_bytes", r.asset_bytes}});
    }
    return json.dump(2);
}

std::string report_table(std::span<const Row> rows) {
    char line[256];
    std::snprintf(line, sizeof line, "%-9s %-8s %6s %10s %9s %9s %12s %6s %8s %7s %9s %6s", "backend", "order",
                  "px err", "triangles", "ms", "floor ms", "vertex runs", "ACMR", "PSNR dB", "SSIM", "deviation",
                  "leaks");
    std::string table = line;
    for (const Row& r : rows) {
        std::snprintf(line, sizeof line, "\n%-9s %-8s %6g %10.0f %9.2f %9.2f %12.0f %6.3f %8.2f %7.4f %6.2f px %6llu",
                      r.backend.c_str(), r.order.empty() ? "-" : r.order.c_str(), r.pixel_error, r.triangles,
                      r.ms_median, r.ms_floor, r.vertex_invocations, r.acmr, r.psnr_db, r.ssim, r.max_pixel_deviation,
                      static_cast<unsigned long long>(r.background_leaks));
        table += line;
    }
    return table;
}

}  // namespace lodestone
