// The greedy search for one group of collapses: a window of slots is ordered anew, faces from the end of the drawn
// range are taken into its dead slots, and what that saves and costs is counted.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lod/bake/orders/drawn_faces.h"
#include "lod/bake/orders/face_order.h"

namespace lodestone {

// A new arrangement of a window.
struct WindowPlan {
    uint32_t first = 0, last = 0;    // slots of the window
    uint32_t end = 0;                // behind it no living face is left
    bool whole = false;              // of the whole drawn range
    std::vector<uint32_t> faces;     // per slot of the window: the face it receives
    double saved = 0;                // transforms, at this level and a later one on average
    uint32_t writes = 0, lines = 0;  // slots written; lines of the CPU's cache that only this writes
    uint32_t taken = 0;              // living faces from behind `end`
};

// Searches for arrangements of windows.
class WindowSearch {
public:
    // input: its spans are kept. cache: entries of the FIFO. options.look_ahead: faces, when looking_ahead.
    WindowSearch(const OrderInput& input, uint32_t cache, const GreedyOptions& options);

    // The order of all faces before the first collapse, by the same search. Positions in input.indices / 3.
    std::vector<uint32_t> first_order(const std::atomic<bool>* stop);

    // Where the faces are, and the level they are at, from here on.
    void look_at(const DrawnFaces& faces, uint32_t level, uint32_t alive);
    // Lines that collapses have written since forget_lines(): these cost nothing more.
    void line_is_written(uint32_t slot);
    void forget_lines();

    // The cheapest arrangement found for slots [first, last) with the living faces behind `end` taken in, for which
    // the window must have dead slots enough; of the whole range: without dead slots.
    // careful: more is tried, looking ahead.
    WindowPlan plan(uint32_t first, uint32_t last, uint32_t end, bool careful);
    // What a plan is worth: transforms saved less what its writes and lines weigh.
    double worth(const WindowPlan& plan) const {
        return plan.saved - options_.in_place * plan.writes - options_.line * plan.lines;
    }

private:
    // The faces of a plan before they are ordered, and their wedges now and later, three per face.
    struct Faces {
        std::vector<uint32_t> alive, dead;
        std::vector<uint32_t> lead, behind;  // slots drawn before the window and after it
        std::vector<uint32_t> tail_lead;     // before the faces taken
        uint32_t own = 0;                    // of alive: those of the window; the others are taken
        std::vector<uint32_t> wedges[2];
    };
    Faces collect(uint32_t first, uint32_t last, uint32_t end) const;
    std::vector<uint32_t> slots_before(uint32_t slot) const;
    // Numbers the wedges of the lead and the living faces from 0 on, now and later; returns how many there are.
    uint32_t number_wedges(const Faces& faces, std::vector<uint32_t> (&numbered)[2]);
    double transforms(std::span<const uint32_t> lead, std::span<const uint32_t> wedges, std::span<const uint32_t> order,
                      std::span<const uint32_t> behind, uint32_t level);
    double transforms_now(const Faces& faces);
    std::vector<uint32_t> with_dead(const Faces& faces, std::span<const uint32_t> order, size_t slots) const;
    void count_writes(WindowPlan& plan, const Faces& faces);
    // The later level at which plans are judged as well.
    uint32_t level_after(uint32_t level, uint32_t alive) const;
    bool cached(uint32_t wedge) const { return now_ - stamp_[wedge] <= static_cast<int64_t>(cache_); }

    const OrderInput input_;
    const uint32_t cache_;
    const GreedyOptions options_;
    const DrawnFaces* faces_ = nullptr;
    uint32_t level_ = 0, later_ = 0;
    std::vector<uint32_t> number_;      // per wedge, while wedges are numbered
    std::vector<int64_t> stamp_;        // per wedge: when it last came into the simulated cache
    int64_t now_ = 0;                   // vertices brought in so far
    std::vector<uint64_t> line_stamp_;  // per line: the group that wrote it last
    uint64_t group_ = 1;
};

}  // namespace lodestone
