// The contract between a backend and whatever executes its plans.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "frame/instance_set.h"
#include "frame/plan.h"
#include "frame/recipe.h"
#include "frame/view.h"

namespace lodestone {

// What a frame may cost, and how exact it must be.
struct Budget {
    double pixel_error = 1;                       // pixels, > 0
    int64_t forced_level = -1;                    // >= 0: every instance at this level, whatever its error
    uint64_t max_triangles = ~uint64_t{0};        // in views[0], over all instances
    uint64_t upload_bytes = ~uint64_t{0};         // per frame, once what the first frame needs is up
    uint64_t resident_bytes = uint64_t{1} << 30;  // of all buffers together
    // Pages of each kind that a frame asks for, so that the next one has not long to wait until they are decoded.
    uint32_t page_requests = 64;
    // The same where nothing is shown before all have come: what is decoded is held until it is placed.
    static constexpr uint32_t page_requests_waiting = 4096;
    bool operator==(const Budget&) const = default;
};

// Bytes that a plan asked for.
struct Arrival {
    uint64_t request = 0;  // PageRequest::id
    Blob blob;             // empty where reading failed
    bool operator==(const Arrival&) const = default;
};

// Bytes that a plan had read back.
struct ReadbackResult {
    uint32_t tag = 0;    // Readback::tag
    uint64_t frame = 0;  // the frame it was recorded in
    Blob blob;           // as many bytes as were asked for
    bool operator==(const ReadbackResult&) const = default;
};

// All that a frame depends on beside what the backend has kept of frames before.
struct FrameInput {
    std::vector<View> views;  // views[0], a camera, sets the levels; every view culls for itself
    // Sets the levels instead of views[0], and vertices do not morph: to look at what was chosen from elsewhere.
    std::optional<View> level_view;
    InstanceSet instances;                  // of the scene, by number
    Budget budget;                          // for this frame
    std::vector<Arrival> arrivals;          // since the frame before, in the order they were read
    std::vector<ReadbackResult> readbacks;  // since the frame before, by frame
    // Seconds; what moves by itself stands where it stands at that time, whatever the frames before were.
    double time = 0;
    glm::vec3 light_direction{0, -1, 0};  // from the light towards the scene, any length > 0
    uint64_t frame = 0;                   // counts up by one
    uint64_t completed_frame = 0;         // every frame before this number has left the GPU
    // The view that levels are chosen for.
    const View& sets_levels() const { return level_view ? *level_view : views[0]; }
    bool operator==(const FrameInput&) const = default;
};

// What a backend that cannot keep to Budget::resident_bytes is refused with; Fault::machine.
// what: it has, that cannot be left out. least: bytes of the smallest budget that it keeps to. budget: as it was given.
inline tl::unexpected<Error> over_budget(const std::string& what, uint64_t least, uint64_t budget) {
    const uint64_t mib = (least + (1 << 20) - 1) >> 20;
    return fail(Fault::machine, what + " need " + std::to_string(least) + " bytes and the budget is " +
                                    std::to_string(budget) + "; raise the budget to " + std::to_string(mib) +
                                    " MiB or more");
}

// A backend with its assets, or an effect: what is drawn beside any backend into the same picture, by a recipe and
// plans of its own. It is used by one thread at a time; nothing it does touches a GPU.
class FrameSource {
public:
    virtual ~FrameSource() = default;
    virtual const Recipe& recipe() const = 0;  // what its plans refer to
    // What is to be done for a frame. Plans are to be made and carried out in order, every one. Equal sequences of
    // inputs since construction give equal plans.
    virtual Plan plan(const FrameInput& input) = 0;
    // Whether what it keeps is as it must be; slow, for tests. Fault::invariant says what is not.
    virtual Result<void> validate() const = 0;
};

}  // namespace lodestone
