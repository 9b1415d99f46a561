// The cuts of all instances for a region of views: good for every frame whose eye and frusta lie within it, as seen
// from each instance. So a cut can be made beside the frame before, for where camera and instances will be, and is kept
// for as long as it is good.
//
// A cut for more than one eye holds whatever any of them wants, and is as conforming as one for a single eye: what is
// wanted within a distance is wanted within a larger one, saturated alike. What a frame's own eye does not want is
// drawn where the coarser level has it, for it is not morphed at all.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "frame/frame_source.h"
#include "frame/instance_tree.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/distant_cuts.h"
#include "vgi/draw/cut/incremental_cut.h"
#include "vgi/draw/open_atlas.h"

namespace lodestone::vgi {

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
    // where instances came, went, or changed their size or shape.
    static std::optional<CutRegion> after(const FrameInput& last, const FrameInput& now);
    bool covers(const FrameInput& input) const;
    // Where an instance is thought to be.
    const Moved* find_moved(uint32_t instance) const;
    bool operator==(const CutRegion&) const = default;
};

// An instance that is cut.
struct CutInstance {
    uint32_t number;  // in the region's set
    uint32_t views;   // that may see it, bit v for views[v]
    Instance there;
    CutMargin margin;
};

// What the cut of a region is made from; nothing of it changes while it is made.
struct CutInput {
    CutRegion region;
    std::vector<AtlasSnapshot> atlases;
    std::vector<CutInstance> seen;        // those that some view of the region may see, rising
    std::optional<View> ahead;            // the camera further along its way, where it moves
    std::vector<CutInstance> seen_ahead;  // those that this one may see
};
// tree: of the region's instances.
CutInput cut_input(CutRegion region, std::vector<AtlasSnapshot> atlases, const InstanceTree& tree,
                   const FrameInput* last);

struct FrameCuts {
    CutRegion region;
    struct Part {
        uint32_t first_instance, instances;  // in `instances`; all are of one asset
        uint32_t views;                      // bit v for views[v]
        uint32_t kinds;                      // LODE_VGI_KIND_... that vertices of triangles may be of
        uint32_t first_word, words;          // in `words`
    };
    // Those that share cuts first (distant_cuts.h), then those of instances that have their own, which rise.
    std::vector<Part> parts;
    std::vector<uint32_t> instances;          // numbers, each once
    std::shared_ptr<const uint32_t[]> words;  // as Cut::parts has them
    size_t word_count = 0;
    uint32_t instances_drawn = 0;  // in views[0]
    double pixel_error = 1;        // that cuts were made with, at most: what had to be raised to stay within the budget
    double raised = 1;             // by how much
    int64_t level = -1;            // drawn everywhere, as Budget::forced_level, or -1
    uint64_t triangles = 0;        // of views[0]
    bool given_up = false;         // it came to more than CutLimits::worth, and there is nothing

    // Pages used, children before their parents, numbered over all atlases, by layer.
    std::array<std::vector<uint32_t>, 3> touched;
    struct Wish {
        float wanted;  // PageDemand::wanted
        Layer layer;
        bool prefetched;  // not by this region, but further along the way
        uint32_t atlas, number;
    };
    std::vector<Wish> wishes;  // pages that were not there, the most wanted first
};

void sort_wishes(std::vector<FrameCuts::Wish>& wishes);  // the most wanted first

inline constexpr double error_scale_step =
    1.189207115;  // of errors, where there are too many triangles: a quarter of an octave

// Errors that were raised fall again step by step, where a step's triangles will hardly be too many: they would go to
// and fro, and be cut twice.
inline bool may_lower(uint64_t count, uint64_t most) {
    return static_cast<double>(count) * error_scale_step * error_scale_step < static_cast<double>(most);
}

struct CutLimits {
    uint64_t most_words;
    // Of the cuts before.
    double raised = 1;
    uint64_t triangles = 0, words = 0;
    // Words beyond which cuts are not worth while. What a camera that jumps may see next can be a thousand times what
    // it sees; then the next frame cuts for itself.
    uint64_t worth = ~uint64_t{0};
};

// What a cut goes on from, and room that is used again: of the cuts before, whatever they were of.
struct CutMemory {
    std::unordered_map<uint32_t, IncrementalCut> instances;  // of those that had their own in the last cut
    struct Demand {
        PageDemand positions, prefetched, attributes;
    };
    std::vector<Demand> atlases;
    std::vector<DistantCuts> distant;  // by atlas; none where the technique has none
    // What threads found of positions, by atlas: empty between cuts.
    using Scratch = std::vector<PageDemand>;
    std::vector<Scratch> scratch;
};

// cutter: null where the device cuts; then what comes of it are attributes, and what is prefetched of positions.
FrameCuts make_cuts(const Cutter* cutter, const CutInput& input, const CutLimits& limits, CutMemory& memory);

}  // namespace lodestone::vgi
