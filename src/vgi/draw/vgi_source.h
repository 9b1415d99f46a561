// The backend `vgi`: virtual geometry images at run time. A cut of every atlas is made for each instance; the pages it
// takes samples from live in pools that grow within a budget, of positions and of attributes, and come from the asset
// files as they are asked for (PlanStats::requests). The coarsest pages are always there, so there is something to draw
// from the first frame on, and whatever is missing makes the picture coarser and never breaks it.
#pragma once

#include <memory>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone::vgi {

// How what is drawn is made of triangles.
enum class Raster {
    bintree,    // draw/cut/bintree_cut.h, pulled from pages by index lists
    grid,       // study/grid_cut.h, the same way
    grid_area,  // the same by areas on screen, not by errors
    tess,       // study/grid_cut.h, a patch for each node, which the device tessellates
    device,     // study/device_cut.h: as tess, by nodes that the device chooses
};

// How atlases are drawn.
struct VgiOptions {
    // For pools, tables and index lists together, with what they replace until no frame reads it.
    uint64_t resident_bytes = uint64_t{1} << 30;
    uint32_t instances = 1;           // most instances in the scene, of all assets
    Raster raster = Raster::bintree;  // how triangles are made
    bool leaves = true;               // draws leaves where assets have them (bintree alone)
    // Attributes lie in blocks of 4 x 4 samples (draw/attributes/attribute_blocks.h), in about half of the memory,
    // where textures are baked into an atlas and no asset has texture coordinates.
    bool textures_in_blocks = false;
};

// A backend that draws the assets, at least one. Fault::machine where the coarsest pages alone exceed the budget;
// Fault::format where one of them is damaged.
//
// Requests and arrivals: PageRequest::chunk, offset and bytes say what to read; an arrival with an empty blob is a page
// that could not be read, which is asked for again later. Statistics in PlanStats::more: pages_resident,
// attribute_bytes_resident (of those of attributes, with their small levels: the texture memory held), pages_missing
// (wanted by this frame and not there), leaf_parts_resident and leaf_parts_missing (the same of leaves),
// pages_uploaded, pages_evicted, pages_failed, requests_waiting, raised_error (times the pixel error that was asked
// for, where triangles had to be saved), cut_in_frame (1: the frame was not where the frames before led to, and made
// its cut itself).
Result<std::unique_ptr<FrameSource>> open_vgi(const std::vector<std::shared_ptr<const AtlasFile>>& assets,
                                              const VgiOptions& options);

}  // namespace lodestone::vgi
