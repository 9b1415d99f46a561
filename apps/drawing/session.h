// One backend drawing one scene on one renderer, frame after frame.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "apps/scene/backends.h"
#include "apps/scene/page_reader.h"
#include "apps/scene/workplace.h"
#include "base/cpu_meter.h"
#include "base/json.h"
#include "frame/plan_mirror.h"
#include "mesh/tri_mesh.h"
#include "render/renderer.h"

namespace lodestone {

// What volumes took of a frame.
struct VolumeFigures {
    double bin_ms = 0;                      // CPU of the calling thread: particles, binning, plans
    double fill_ms = 0, light_ms = 0;       // voxels, with the light through them; the light grid of empty columns
    double march_ms = 0, composite_ms = 0;  // with what is put back from a smaller target; laid over the picture
    uint64_t bricks = 0, bytes = 0;         // metavoxels that are not empty; of all buffers
};

struct DrawnFrame {
    uint64_t frame = 0;      // FrameInput::frame
    double pixel_error = 0;  // that was asked for
    FrameCounters counters;
    PlanStats stats;
    std::optional<VolumeFigures> volume;  // where the scene has volumes, and they are drawn
    double plan_ms = 0;                   // wall clock of that plan
    double plan_cpu_ms = 0;               // CPU of the calling thread inside FrameSource::plan
    double cpu_ms = 0;                    // CPU of the threads we start, since the frame before was done, or begun
    std::vector<std::string> warnings;    // Plan::warnings
    // Wall clock, from plan() entered to the fence seen signalled; simulations left out. Where several frames are in
    // flight, the wait for those before is in it.
    double ms = 0;
};

// Of a row: bin_ms, fill_ms, light_ms, march_ms, composite_ms, bricks, bytes.
nlohmann::ordered_json json_of(const VolumeFigures& figures);

// A picture as an image to write; its alpha only marked coverage.
Image opaque_image(const Picture& picture);

class DrawSession {
public:
    // Opens the backend and loads its recipe. scene and renderer must outlive the session. What plans warn of is told
    // to progress. After an error a session that was in the place before lives on where its lives() says so.
    // mirrored: also carry every plan out on the CPU, for mirror(). place: of the renderer's.
    static Result<std::unique_ptr<DrawSession>> open(const ReadyScene& scene, Renderer& renderer, const Technique& way,
                                                     bool mirrored, const Progress& progress, uint32_t place = 0);

    // Whether its recipe is still loaded: a session in the same place, opened or tried, may have needed the room.
    bool lives() const { return renderer_->loaded(place_) == loaded_; }

    // Makes ready what frames may draw by (Renderer::prepare), so that none of them waits.
    Result<void> prepare() { return renderer_->prepare(place_); }

    // Plans, submits and waits for one frame. empty: the same frame with no instance in it.
    Result<DrawnFrame> draw(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height,
                            bool empty = false);

    // Plans and submits one frame, and waits only where as many are under way as the renderer takes. Not of a session
    // that is mirrored.
    Result<void> begin(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height);
    // Frames begun that have been seen to leave the GPU since the last call, oldest first; wait: all of them.
    Result<std::vector<DrawnFrame>> take_drawn(bool wait = false);

    // The same frame again and again until every page it asked for has come, or the budget is seen to hold no
    // more of them, at most `frames` times; the last is told.
    Result<DrawnFrame> settle(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height,
                              uint32_t frames = 4096);

    // What the last frame looked like to a CPU; null unless mirrored. Colours of cache misses need it.
    const PlanMirror* mirror() const { return mirror_ ? &*mirror_ : nullptr; }
    const View& view() const { return view_; }  // views[0] of the last frame
    FrameSource& source() { return *source_; }
    volume::VolumeSource* volumes() { return volumes_.get(); }  // null where the scene has none
    ShadingOptions look;
    double time = 0;            // of the next frame, FrameInput::time
    bool shows_volumes = true;  // false leaves them out of frames
    // Levels, or what is culled, stay as this view has them, though the camera moves on.
    std::optional<View> frozen_levels, frozen_culling;

private:
    DrawSession(const ReadyScene& scene, Renderer& renderer, const Progress& progress, uint32_t place);

    // The volumes' plan of the frame; without commands where nothing of them is drawn.
    Result<Plan> plan_volumes(const FrameInput& input, DrawnFrame& drawn);
    // Plans a frame and submits it; `ms` is then what that took, plans apart from simulations.
    Result<DrawnFrame> start(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height, bool empty);

    const ReadyScene* scene_;
    Renderer* renderer_;
    Progress progress_;
    uint32_t place_;
    uint64_t loaded_ = 0;  // Renderer::loaded
    std::unique_ptr<FrameSource> source_;
    std::unique_ptr<volume::VolumeSource> volumes_;
    std::optional<PlanMirror> mirror_, volume_mirror_;
    PageReader reader_;
    bool outstanding_ = false;  // the last frame asked for pages, or pages arrived with it
    bool late_ = false;         // and so did the one before
    bool reads_back_ = false;   // the last frame reads something back
    bool settling_ = false;     // frames that others follow draw nothing
    std::vector<ReadbackResult> readbacks_;
    std::deque<DrawnFrame> begun_;  // without counters yet
    View view_;
    uint64_t frame_ = 0;
    double cpu_before_ = started_threads_cpu_ms();  // when the last frame was done
};

}  // namespace lodestone
