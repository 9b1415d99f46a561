// A flight along a camera path, frame by frame, with what every frame took.
#pragma once

#include <array>
#include <vector>

#include "apps/drawing/budget_use.h"
#include "apps/drawing/session.h"
#include "frame/camera_path.h"
#include "frame/error_controller.h"

namespace lodestone {

// Of what moves by itself: flights are the same however long frames take.
inline constexpr double flight_frame_seconds = 1.0 / 30;

struct FlownFrame {
    double ms = 0, plan_cpu_ms = 0, cpu_ms = 0, gpu_ms = 0;
    std::array<double, stage_count> stage_gpu_ms{};  // by Stage
    double period_ms = 0;  // since the frame before was done
    double pixel_error = 0;
    uint64_t triangles = 0;
    uint64_t vertex_invocations = 0, camera_invocations = 0;  // of all passes; of one over the camera's triangles
    uint64_t uploaded_bytes = 0, resident_bytes = 0;
    std::optional<VolumeFigures> volume;
};

struct Flight {
    const CameraPath* path = nullptr;
    uint32_t frames = 0;  // of the whole flight
    Budget budget;
    uint32_t width = 0, height = 0;
    ErrorController* controller = nullptr;  // sets the pixel error of every frame, and learns what it took
    // Frames are planned while those before are drawn, as many as the renderer takes; each takes its period. Otherwise
    // each is waited for, and takes what it takes alone.
    bool overlaps = false;
};

// Settles at the first frame, which uploads what every frame needs, and then flies. Fault::interrupted.
Result<std::vector<FlownFrame>> fly(DrawSession& session, const Flight& flight, const std::string& label,
                                    const Progress& progress);

// Frames a second of a flight whose frames overlapped: over all of it, of its longest period and of its shortest.
struct FrameRates {
    double mean = 0, least = 0, most = 0;
};
FrameRates frame_rates(const std::vector<FlownFrame>& flown);

// What the frames took of their budget.
BudgetUse use_of(const std::vector<FlownFrame>& flown);

// Transforms per triangle of a frame's colour stage by a simulated FIFO-16.
double simulated_acmr(const PlanMirror& mirror);

// One number of every frame.
template <class Of>
std::vector<double> of_frames(const std::vector<FlownFrame>& frames, Of&& of) {
    std::vector<double> values;
    values.reserve(frames.size());
    for (const FlownFrame& frame : frames) values.push_back(static_cast<double>(of(frame)));
    return values;
}

}  // namespace lodestone
