#include "apps/drawing/flight.h"

#include "mesh/cache/vertex_cache.h"

namespace lodestone {

Result<std::vector<FlownFrame>> fly(DrawSession& session, const Flight& flight, const std::string& label,
                                    const Progress& progress) {
    Budget budget = flight.budget;
    if (flight.controller != nullptr) budget.pixel_error = flight.controller->error();
    if (auto warm = session.settle(flight.path->frame(0, flight.frames), budget, flight.width, flight.height); !warm)
        return tl::unexpected(warm.error());
    std::vector<FlownFrame> flown;
    for (uint32_t f = 0; f < flight.frames; ++f) {
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        progress.at(label, static_cast<double>(f) / flight.frames);
        if (flight.controller != nullptr) budget.pixel_error = flight.controller->error();
        auto drawn = session.draw(flight.path->frame(f, flight.frames), budget, flight.width, flight.height);
        if (!drawn) return tl::unexpected(drawn.error());
        if (flight.controller != nullptr) flight.controller->record(drawn->ms, budget.pixel_error);
        FlownFrame frame;
        frame.ms = drawn->ms;
        frame.plan_cpu_ms = drawn->plan_cpu_ms;
        frame.cpu_ms = drawn->cpu_ms;
        frame.gpu_ms = drawn->counters.gpu_ms;
        frame.pixel_error = budget.pixel_error;
        frame.triangles = drawn->stats.triangles;
        for (const auto& pass : drawn->counters.pass) frame.vertex_invocations += pass.vertices();
        frame.camera_invocations = drawn->counters.camera_vertices();
        frame.uploaded_bytes = drawn->stats.uploaded_bytes;
        frame.resident_bytes = drawn->stats.resident_bytes;
        flown.push_back(frame);
    }
    return flown;
}

double simulated_acmr(const PlanMirror& mirror) {
    const CacheModel fifo16;
    uint64_t transforms = 0, triangles = 0;
    for (const auto& draw : mirror.draws()) {
        if (!mirror.is_shown(draw)) continue;
        const CacheStatistics s = simulate(fifo16, draw.indices);
        transforms += s.transforms * draw.draw.instances;
        triangles += s.triangles * draw.draw.instances;
    }
    return triangles ? static_cast<double>(transforms) / static_cast<double>(triangles) : 0;
}

}  // namespace lodestone
