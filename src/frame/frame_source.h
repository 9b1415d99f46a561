// The contract between a backend and whatever executes its plans.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "frame/instance_set.h"
#include "frame/plan.h"
#include "frame/recipe.h"
#include "frame/view.h"

namespace lodestone {

struct Budget {
    double pixel_error = 1;                       // pixels, > 0
    int64_t forced_level = -1;                    // >= 0: every instance at this level, whatever its error
    uint64_t max_triangles = ~uint64_t{0};        // in views[0], over all instances
    uint64_t upload_bytes = ~uint64_t{0};         // per frame, once what the first frame needs is up
    uint64_t resident_bytes = uint64_t{1} << 30;  // of all buffers together
    bool operator==(const Budget&) const = default;
};

struct Arrival {
    uint64_t request = 0;  // PageRequest::id
    Blob blob;             // empty where reading failed
    bool operator==(const Arrival&) const = default;
};

struct ReadbackResult {
    uint32_t tag = 0;    // Readback::tag
    uint64_t frame = 0;  // the frame it was recorded in
    Blob blob;
    bool operator==(const ReadbackResult&) const = default;
};

struct FrameInput {
    std::vector<View> views;  // views[0], a camera, sets the levels; every view culls for itself
    // Sets the levels instead of views[0], and vertices do not morph: to look at what was chosen from elsewhere.
    std::optional<View> level_view;
    InstanceSet instances;
    Budget budget;
    std::vector<Arrival> arrivals;
    std::vector<ReadbackResult> readbacks;
    uint64_t frame = 0;            // counts up by one
    uint64_t completed_frame = 0;  // every frame before this number has left the GPU
    const View& sets_levels() const { return level_view ? *level_view : views[0]; }
    bool operator==(const FrameInput&) const = default;
};

class FrameSource {
public:
    virtual ~FrameSource() = default;
    virtual const Recipe& recipe() const = 0;
    // Equal sequences of inputs since construction give equal plans.
    virtual Plan plan(const FrameInput& input) = 0;
    virtual Result<void> validate() const = 0;
};

}  // namespace lodestone
