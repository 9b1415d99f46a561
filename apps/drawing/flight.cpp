#include "apps/drawing/flight.h"

#include <chrono>
#include <utility>

#include "base/statistics.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

namespace {

FlownFrame flown_as(const DrawnFrame& drawn, double period_ms) {
    FlownFrame frame;
    frame.ms = drawn.ms;
    frame.period_ms = period_ms;
    frame.plan_cpu_ms = drawn.plan_cpu_ms;
    frame.cpu_ms = drawn.cpu_ms;
    frame.gpu_ms = drawn.counters.gpu_ms;
    frame.pixel_error = drawn.pixel_error;
    frame.triangles = drawn.stats.triangles;
    for (size_t s = 0; s < drawn.counters.pass.size(); ++s) {
        frame.vertex_invocations += drawn.counters.pass[s].vertices();
        frame.stage_gpu_ms[s] = drawn.counters.pass[s].gpu_ms;
    }
    frame.camera_invocations = drawn.counters.camera_vertices();
    frame.uploaded_bytes = drawn.stats.uploaded_bytes;
    frame.resident_bytes = drawn.stats.resident_bytes;
    frame.volume = drawn.volume;
    return frame;
}

// One flight: frames on their way, and those that have arrived.
class Flier {
public:
    Flier(DrawSession& session, const Flight& flight) : session_(session), flight_(flight), budget_(flight.budget) {}

    Result<void> draw(uint32_t number) {
        if (flight_.controller != nullptr) budget_.pixel_error = flight_.controller->error();
        const Camera camera = flight_.path->frame(number, flight_.frames);
        session_.time = number * flight_frame_seconds;
        if (!flight_.overlaps) {
            auto drawn = session_.draw(camera, budget_, flight_.width, flight_.height);
            if (!drawn) return tl::unexpected(drawn.error());
            arrive(*drawn, drawn->ms);
            return {};
        }
        if (auto done = session_.begin(camera, budget_, flight_.width, flight_.height); !done) return done;
        return take(false);
    }

    Result<void> take(bool wait) {
        const auto drawn = session_.take_drawn(wait);
        if (!drawn) return tl::unexpected(drawn.error());
        if (drawn->empty()) return {};
        // Of frames that are seen to be done together nobody knows which took how much.
        const auto now = std::chrono::steady_clock::now();
        const double ms = std::chrono::duration<double, std::milli>(now - std::exchange(seen_, now)).count();
        for (const DrawnFrame& frame : *drawn) arrive(frame, ms / static_cast<double>(drawn->size()));
        return {};
    }

    std::vector<FlownFrame> flown;

private:
    void arrive(const DrawnFrame& drawn, double period_ms) {
        flown.push_back(flown_as(drawn, period_ms));
        if (flight_.controller != nullptr) flight_.controller->record(period_ms, drawn.pixel_error);
    }

    DrawSession& session_;
    const Flight& flight_;
    Budget budget_;
    std::chrono::steady_clock::time_point seen_ = std::chrono::steady_clock::now();  // the frame before was done
};

}  // namespace

Result<std::vector<FlownFrame>> fly(DrawSession& session, const Flight& flight, const std::string& label,
                                    const Progress& progress) {
    Budget budget = flight.budget;
    if (flight.controller != nullptr) budget.pixel_error = flight.controller->error();
    session.time = 0;
    if (auto done = session.prepare(); !done) return tl::unexpected(done.error());
    if (auto warm = session.settle(flight.path->frame(0, flight.frames), budget, flight.width, flight.height); !warm)
        return tl::unexpected(warm.error());
    Flier flier(session, flight);
    for (uint32_t f = 0; f < flight.frames; ++f) {
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        progress.at(label, static_cast<double>(f) / flight.frames);
        if (auto done = flier.draw(f); !done) return tl::unexpected(done.error());
    }
    if (auto done = flier.take(true); !done) return tl::unexpected(done.error());
    return std::move(flier.flown);
}

FrameRates frame_rates(const std::vector<FlownFrame>& flown) {
    const auto periods = of_frames(flown, [](const FlownFrame& f) { return f.period_ms; });
    return {1000 / mean(periods), 1000 / percentile(periods, 1), 1000 / percentile(periods, 0)};
}

BudgetUse use_of(const std::vector<FlownFrame>& flown) {
    BudgetUse use;
    for (const FlownFrame& f : flown) use.add({f.triangles, f.uploaded_bytes, f.resident_bytes});
    return use;
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
