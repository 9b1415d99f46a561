#include "report/rows.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace lodestone {

using Json = nlohmann::ordered_json;

Json json_of(const Machine& machine) {
    return {{"cpu", machine.cpu},
            {"device", machine.device},
            {"driver", machine.driver},
            {"software", machine.software},
            {"commit", machine.commit}};
}

namespace {

void add_what_not_all_have(const Row& r, Json& json) {
    if (!r.compared) {
        for (const char* of_pictures :
             {"acmr_fifo16", "psnr_db", "ssim", "max_pixel_deviation", "background_leaks", "cracks"})
            json[of_pictures] = nullptr;
    }
    for (const auto& [stage, ms] : r.stages_gpu_ms) json["stages_gpu_ms"][stage] = ms;
    if (r.volume) {
        json["volume"] = {{"bin_ms", r.volume->bin_ms},
                          {"fill_ms", r.volume->fill_ms},
                          {"light_ms", r.volume->light_ms},
                          {"march_ms", r.volume->march_ms},
                          {"composite_ms", r.volume->composite_ms},
                          {"bricks", r.volume->bricks},
                          {"bytes", r.volume->bytes}};
    }
}

Json json_of(const Row& r) {
    Json json = {{"backend", r.backend},
                 {"order", r.order},
                 {"raster", r.raster},
                 {"volumes", r.volumes},
                 {"pixel_error", r.pixel_error},
                 {"frames", r.frames},
                 {"ms_median", r.ms_median},
                 {"ms_p95", r.ms_p95},
                 {"ms_p99", r.ms_p99},
                 {"ms_max", r.ms_max},
                 {"ms_floor", r.ms_floor},
                 {"ms_jolt", r.ms_jolt},
                 {"fps_mean", r.fps_mean},
                 {"fps_min", r.fps_min},
                 {"fps_max", r.fps_max},
                 {"throughput_fps", r.throughput_fps},
                 {"throughput_fps_min", r.throughput_fps_min},
                 {"throughput_fps_max", r.throughput_fps_max},
                 {"frames_in_flight", r.frames_in_flight},
                 {"cpu_plan_ms", r.cpu_plan_ms},
                 {"cpu_ms", r.cpu_ms},
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
                 {"cracks", r.cracks},
                 {"bake_seconds", r.bake_seconds},
                 {"asset_bytes", r.asset_bytes},
                 {"flight", {{"ms", r.flight_ms}, {"triangles", r.flight_triangles}}}};
    add_what_not_all_have(r, json);
    return json;
}

}  // namespace

Json json_of(const Report& report) {
    Json json;
    json["machine"] = json_of(report.machine);
    json["scene"] = report.scene;
    json["size"] = report.size;
    json["rows"] = Json::array();
    for (const Row& row : report.rows) json["rows"].push_back(json_of(row));
    json["equal_error"] = Json::array();
    for (const EqualError& e : at_equal_error(report.rows)) {
        json["equal_error"].push_back({{"row", e.row},
                                       {"metric", e.metric},
                                       {"value", e.value},
                                       {"backend", e.backend},
                                       {"order", e.order},
                                       {"raster", e.raster},
                                       {"volumes", e.volumes},
                                       {"pixel_error", e.pixel_error},
                                       {"ms", e.ms},
                                       {"ratio", e.ratio},
                                       {"where", e.where}});
    }
    json["steered"] = Json::array();
    for (const SteeredFlight& s : report.steered) {
        json["steered"].push_back({{"backend", s.backend},
                                   {"order", s.order},
                                   {"raster", s.raster},
                                   {"volumes", s.volumes},
                                   {"target_ms", s.target_ms},
                                   {"ms", s.ms},
                                   {"pixel_error", s.pixel_error}});
    }
    json["references"] = report.references;
    json["pictures"] = Json::array();
    for (const RowPicture& p : report.pictures) {
        json["pictures"].push_back(
            {{"row", p.row}, {"frame", p.frame}, {"picture", p.picture}, {"difference", p.difference}});
    }
    return json;
}

std::string choices_of(const Technique& way, char between) {
    std::string choices = way.order;
    const auto add = [&](const std::string& choice) {
        if (!choices.empty() && !choice.empty()) choices += between;
        choices += choice;
    };
    add(way.raster);
    if (!way.volumes.empty()) add(std::string("volumes") + between + way.volumes);
    return choices;
}

std::string name_of(const Technique& way, char between) {
    const std::string choices = choices_of(way, between);
    return choices.empty() ? way.backend : way.backend + between + choices;
}

std::string report_table(std::span<const Row> rows) {
    char line[256];
    std::snprintf(line, sizeof line, "%-9s %-17s %6s %10s %9s %9s %7s %7s %7s %12s %6s %8s %7s %9s %6s", "backend",
                  "way", "px err", "triangles", "ms", "floor ms", "fps", "least", "most", "vertex runs", "ACMR",
                  "PSNR dB", "SSIM", "deviation", "leaks");
    std::string table = line;
    for (const Row& r : rows) {
        const std::string chosen = choices_of(r);
        std::snprintf(line, sizeof line, "\n%-9s %-17s %6g %10.0f %9.2f %9.2f %7.1f %7.1f %7.1f %12.0f %6.3f",
                      r.backend.c_str(), chosen.empty() ? "-" : chosen.c_str(), r.pixel_error, r.triangles, r.ms_median,
                      r.ms_floor, r.throughput_fps, r.throughput_fps_min, r.throughput_fps_max, r.vertex_invocations,
                      r.acmr);
        table += line;
        if (!r.compared) continue;
        std::snprintf(line, sizeof line, " %8.2f %7.4f %6.2f px %6llu", r.psnr_db, r.ssim, r.max_pixel_deviation,
                      static_cast<unsigned long long>(r.background_leaks));
        table += line;
    }
    return table;
}

}  // namespace lodestone
