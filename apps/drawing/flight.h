// A flight along a camera path, frame by frame, with what every frame took.
#pragma once

#include <vector>

#include "apps/drawing/session.h"
#include "frame/camera_path.h"
#include "frame/error_controller.h"

namespace lodestone {

struct FlownFrame {
    double ms = 0, plan_cpu_ms = 0, cpu_ms = 0, gpu_ms = 0;
    double pixel_error = 0;
    uint64_t triangles = 0;
    uint64_t vertex_invocations = 0, camera_invocations = 0;  // of all passes; of one over the camera's triangles
    uint64_t uploaded_bytes = 0, resident_bytes = 0;
};

struct Flight {
    const CameraPath* path = nullptr;
    uint32_t frames = 0;  // of the whole flight
    Budget budget;
    uint32_t width = 0, height = 0;
    ErrorController* controller = nullptr;  // sets the pixel error of every frame, and learns what it took
};

// Settles at the first frame, which uploads what every frame needs, and then flies. Fault::interrupted.
Result<std::vector<FlownFrame>> fly(DrawSession& session, const Flight& flight, const std::string& label,
                                    const Progress& progress);

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
