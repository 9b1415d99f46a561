// Grid cuts of all instances made by the device: the recipe's part of it, what every frame uploads and dispatches, and
// what comes back of it. The passes are shaders/vgi/cut_*.comp; they choose the nodes that cut_grid chooses
// (grid_cut.h), for the frame's own views, and write patches and indirect draws of them.
//
//   The seed, section 4, names the flat test in a compute shader as its future work.
//
// What pages a cut uses and misses is known here when the frame has left the device; a page that came too late makes
// the picture coarser, as anywhere.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "frame/frame_source.h"
#include "frame/instance_tree.h"
#include "vgi/draw/open_atlas.h"

namespace lodestone::vgi {

// Words and records that cuts of some instances take.
struct DeviceCutSizes {
    uint64_t states = 0, leaves = 0, patches = 0, records = 0;
    static DeviceCutSizes of(const Atlas& about);                          // one instance, whatever is drawn of it
    static DeviceCutSizes largest_of(std::span<const OpenAtlas> atlases);  // one instance of any of them
    DeviceCutSizes times(uint64_t instances) const;
    uint64_t list_bytes() const;   // of patches
    uint64_t table_bytes() const;  // of everything else that depends on instances
};

class DeviceCut {
public:
    // atlases: must outlive this, their pages numbered (PageCache).
    explicit DeviceCut(std::span<const OpenAtlas> atlases)
        : atlases_(atlases), one_(DeviceCutSizes::largest_of(atlases)) {}

    // Adds its buffers, which must come to stand from `cut_instances` on (recipe_layout.h), and its pipelines.
    // instances: that a frame may see, at most.
    void add_to(Recipe& recipe, uint32_t instances) const;

    // Once, before the first cut. recipe: that it was added to.
    void upload_tables(const Recipe& recipe, Plan& plan) const;

    // Where an instance's draws are.
    struct DrawRange {
        uint64_t first_word, record_offset;  // of its patches; bytes to its indirect draws
        uint32_t records;
    };
    // Uploads what the frame asks for, and dispatches the cuts of the instances that are seen (InstanceTree::seen for
    // the frame's views); one place for each of them. Its draws refer to the plan's instance_ids by its place in
    // `seen`. pixel_error: pixels, > 0.
    std::vector<DrawRange> cut(const FrameInput& input, std::span<const InstanceTree::Seen> seen, double pixel_error,
                               Plan& plan) const;

    struct Findings {
        uint64_t frame = 0;                 // in which they were found
        uint64_t triangles = 0, nodes = 0;  // of views[0]; of all views
        std::vector<uint32_t> touched;      // pages of positions, numbered over all atlases, children first
        struct Wish {
            uint32_t atlas, number;
            float wanted;
        };
        std::vector<Wish> wishes;
    };
    // Of the last of these frames, if one of them brings any.
    std::optional<Findings> findings(std::span<const ReadbackResult> readbacks) const;

private:
    uint64_t finding_words() const;

    std::span<const OpenAtlas> atlases_;
    DeviceCutSizes one_;  // what each instance has room for
};

}  // namespace lodestone::vgi
