// What is drawn of one object for a view, as streams of vertices and indices for a renderer of one's own. The backend's
// plans are carried out on the CPU (frame/plan_mirror.h), and what they draw is read there.
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/scene/asset.h"
#include "apps/scene/page_reader.h"
#include "base/result.h"
#include "frame/frame_source.h"
#include "frame/plan_mirror.h"
#include "frame/view.h"

namespace lodestone {

// A vertex of a cut.
struct CutVertex {
    float position[3];  // object units
    float normal[3];    // object space, unit length
    float uv[2];        // texture coordinates
    uint8_t colour[4];  // sRGB and alpha
    uint32_t material;  // into the asset's materials
};
static_assert(sizeof(CutVertex) == 40);

// A view of the object, and how exact the cut is.
struct CutView {
    Camera camera;
    uint32_t width = 1280, height = 720;  // pixels
    glm::mat4 object_to_world{1};         // affine
    double pixel_error = 1;               // pixels
    uint64_t max_triangles = 0;           // 0 for no limit
    bool culls_back_faces = false;        // faces away from the eye may be left out
    bool wait = true;                     // until all pages are there that the cut needs
};
// Fault::usage names the number that makes no sense.
Result<void> check_view(const CutView& view);

// What is to be drawn. Valid until the next cut.
struct Cut {
    std::span<const CutVertex> vertices;
    std::span<const uint32_t> indices;  // three to a triangle, none of them degenerate
    uint64_t vertices_version = 0;      // raised whenever vertices may differ from the cut before
    int64_t level = -1;                 // of a progressive mesh, where it is seen
    double pixel_error = 0;             // that was kept to
    uint64_t resident_bytes = 0;        // of the backend's buffers
    bool settled = true;                // nothing is on its way that would make the same view finer
};

class Cutter {
public:
    // backend: lod or vgi. Fault::format where the asset was baked without it, Fault::machine where the budget is too
    // small.
    static Result<std::unique_ptr<Cutter>> open(const Asset& asset, const std::string& backend,
                                                uint64_t resident_bytes);

    // After any fault but Fault::usage, and after an exception, every further cut is Fault::invariant.
    Result<Cut> cut(const CutView& view);

private:
    Cutter(std::string backend, std::unique_ptr<FrameSource> source, const ChunkFile& file,
           std::shared_ptr<const ProgressiveMesh> lod);
    Result<PlanStats> draw_frame(const CutView& view);
    Result<PlanStats> settle(const CutView& view);
    void gather_lod(const PlanMirror::MirroredDraw& draw);
    void gather_vgi(const PlanMirror::MirroredDraw& draw);
    void gather(Cut& cut);

    std::string backend_;
    std::unique_ptr<FrameSource> source_;
    PlanMirror mirror_;
    PageReader reader_;
    std::shared_ptr<const ProgressiveMesh> lod_;  // null of an atlas
    FrameInput input_;                            // of the last frame
    uint64_t next_frame_ = 0;
    bool outstanding_ = false;  // the last frame asked for pages, or pages arrived with it
    bool broken_ = false;
    std::vector<CutVertex> vertices_;
    std::vector<uint32_t> indices_, pulled_;  // pulled_: the backend's numbers of vertices, rising
    uint64_t version_ = 0;
};

}  // namespace lodestone
