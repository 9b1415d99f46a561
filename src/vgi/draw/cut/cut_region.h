// What cuts are made for: a small region of views, where camera and instances are thought to be in the next frame, and
// the instances that some view of it may see.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "frame/frame_source.h"
#include "frame/instance_tree.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/open_atlas.h"

namespace lodestone::vgi {

// How well a camera's next step is foreseen, told from the last ones. What cuts allow for is what they cost: a camera
// that goes on as it did needs a margin of little more than nothing.
class Foresight {
public:
    static constexpr float least = 0.1f, most = 0.5f;  // of a step

    // Once a frame. now: FrameInput::views[0].
    void see(const View& now);
    // How much of a step the camera may be off from what the last two frames tell, and half as much again; `most` until
    // enough is known.
    float share() const;

private:
    std::optional<View> before_, last_;
    std::array<float, 6> needed_{};  // by the last steps
    size_t next_ = 0;
};

struct CutInstance;

// What cuts are made for.
struct CutRegion {
    std::vector<View> views;         // as FrameInput::views, where the camera is thought to be
    std::optional<View> level_view;  // as FrameInput::level_view
    CutMargin margin;                // of the views
    InstanceSet instances;           // as they were last known
    // Those that are thought to be elsewhere by then, rising.
    struct Moved {
        uint32_t instance;
        Instance there;
        CutMargin margin;  // of the views as it sees them
        bool operator==(const Moved&) const = default;
    };
    std::vector<Moved> moved;
    Budget budget;  // pixel_error, forced_level and max_triangles count

    // Exactly this frame.
    static CutRegion of(const FrameInput& input);
    // The next frame, if camera and instances go on as they did between the two; exact where nothing has moved. None
    // where instances came, went, or changed their size or shape. share: of the camera's step, that it may be off.
    static std::optional<CutRegion> after(const FrameInput& last, const FrameInput& now, float share);
    bool covers(const FrameInput& input) const;
    // Null where it stands where it stood.
    const Moved* find_moved(uint32_t instance) const;
    // Where an instance that is cut is thought to be, and the margin of the views as it sees them.
    const Instance& there(const CutInstance& instance) const;
    const CutMargin& margin_of(const CutInstance& instance) const;
    bool operator==(const CutRegion&) const = default;
};

// An instance that is cut.
struct CutInstance {
    uint32_t number;                // in the region's set
    uint32_t views;                 // that may see it, bit v for views[v]
    const CutRegion::Moved* moved;  // of the region; null where it stands
};

// What the cut of a region is made from; nothing of it changes while it is made.
struct CutInput {
    CutInput() = default;
    CutInput(CutInput&&) = default;
    CutInput& operator=(CutInput&&) = default;

    CutRegion region;
    std::vector<AtlasSnapshot> atlases;
    std::vector<CutInstance> seen;        // those that some view of the region may see, rising
    std::optional<View> ahead;            // the camera further along its way, where it moves
    std::vector<CutInstance> seen_ahead;  // those that this one may see
};
// tree: of the region's instances. last: the camera before, if any.
CutInput cut_input(CutRegion region, std::vector<AtlasSnapshot> atlases, const InstanceTree& tree, const View* last);

}  // namespace lodestone::vgi
