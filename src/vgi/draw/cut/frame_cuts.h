// The cuts of all instances for a region of views: good for every frame whose eye and frusta lie within it, as seen
// from each instance. So a cut can be made beside the frame before, for where camera and instances will be, and is kept
// for as long as it is good.
//
// A cut for more than one eye holds whatever any of them wants, and is as conforming as one for a single eye: what is
// wanted within a distance is wanted within a larger one, saturated alike. What a frame's own eye does not want is
// drawn where the coarser level has it, for it is not morphed at all.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/cut_region.h"
#include "vgi/draw/cut/incremental_cut.h"
#include "vgi/draw/cut/shared_cuts.h"

namespace lodestone::vgi {

struct FrameCuts {
    CutRegion region;
    struct Part {
        uint32_t first_instance, instances;  // in `instances`; all are of one asset
        uint32_t views;                      // bit v for views[v]
        uint32_t kinds;                      // LODE_VGI_KIND_... that vertices of triangles may be of
        uint32_t first_word, words;          // in `words`
    };
    // Those that share cuts first (shared_cuts.h), then those of instances that have their own, which rise.
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
    std::vector<SharedCuts> shared;  // by atlas; none where the technique has none
    // Room for what threads find of the pages of an atlas, by their number; empty between cuts.
    std::map<uint32_t, std::vector<PageDemand>> scratch;
};

// cutter: null where the device cuts; then what comes of it are attributes, and what is prefetched of positions.
FrameCuts make_cuts(const Cutter* cutter, const CutInput& input, const CutLimits& limits, CutMemory& memory);

}  // namespace lodestone::vgi
