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
#include "vgi/draw/open_atlas.h"

namespace lodestone::vgi {

// Words and records that cuts of some instances take.
struct DeviceCutSizes {
    uint64_t states = 0, leaves = 0, patches = 0, records = 0;
    static DeviceCutSizes of(const Atlas& about);  // one instance, whatever is drawn of it
    void raise(const DeviceCutSizes& other);       // to the larger of both, each
    DeviceCutSizes times(uint64_t instances) const;
    uint64_t list_bytes() const;   // of patches
    uint64_t table_bytes() const;  // of everything else that depends on instances
};

class DeviceCut {
public:
    // atlases: must outlive this, their pages numbered (PageCache).
    explicit DeviceCut(std::span<OpenAtlas> atlases) : atlases_(atlases) {}

    // Adds its buffers, which must come to stand from `cut_instances` on (recipe_layout.h), and its pipelines.
    static void add_to(Recipe& recipe, std::span<const OpenAtlas> atlases, const DeviceCutSizes& sizes,
                       uint32_t instances);

    void upload_tables(Plan& plan) const;  // once

    // Where an instance's draws are.
    struct DrawRange {
        uint64_t first_word, record_offset;  // of its patches; bytes to its indirect draws
        uint32_t records;
    };
    // Uploads what the frame asks for, and dispatches the cuts; one place for each instance, whose number among the
    // plan's instance_ids is its own. pixel_error: pixels, > 0.
    std::vector<DrawRange> cut(const FrameInput& input, double pixel_error, Plan& plan) const;

    struct Findings {
        uint64_t triangles = 0, nodes = 0;  // of views[0]; of all views
        std::vector<uint32_t> touched;      // pages of positions, numbered over all atlases, children first
        struct Wish {
            uint32_t atlas, number;
            float wanted;
        };
        std::vector<Wish> wishes;
    };
    // Of the last of these frames, if one of them brings any. instances: of that frame, or one like it.
    std::optional<Findings> findings(std::span<const ReadbackResult> readbacks,
                                     const InstanceSet& instances) const;

private:
    std::span<OpenAtlas> atlases_;
};

}  // namespace lodestone::vgi
