// A slow zoom on one progressive mesh, looked at frame by frame: how much changes from one to the next.
#pragma once

#include <memory>

#include "lod/draw/lod_source.h"

namespace lodestone {

struct ZoomOptions {
    uint32_t frames = 600;
    double growth = 1.004;  // of the distance from the eye to the centre, a frame
    double nearest = 2.5;   // the first distance, in radii of the bounding sphere
    double pixel_error = 1;
    uint32_t width = 1280, height = 720;
};

struct ZoomFigures {
    uint32_t frames = 0, changed = 0;  // frames, and those that draw another number of triangles than the one before
    uint32_t first_triangles = 0, last_triangles = 0;
    double most_changed = 0;    // triangles that came or went in a frame, as a share of those drawn before
    double mean_triangles = 0;  // drawn
    // The longest way in one frame of what stands for a wedge of full detail, seen by the camera of the frame before;
    // pixels.
    double farthest = 0;
    uint32_t farthest_frame = 0;
};

ZoomFigures zoom_on(std::shared_ptr<const ProgressiveMesh> pm, const LodOptions& lod, const ZoomOptions& options = {});

}  // namespace lodestone
