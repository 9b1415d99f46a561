#include "apps/drawing/session.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <iterator>
#include <variant>

#include "base/check.h"
#include "base/cpu_meter.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

namespace {

double ms_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

constexpr uint32_t shadow_texels = 2048;
// Frames that only put pages in the place of others, after which it is taken that the budget never holds all.
constexpr uint32_t most_swaps = 128;
constexpr uint32_t mirrored_tag = 1u << 31;  // of readbacks for the mirror; the rest is the buffer

bool swaps_pages(const PlanStats& stats) {
    return std::ranges::any_of(stats.more, [](const auto& f) { return f.first == "pages_evicted" && f.second > 0; });
}

// How many corners of every triangle in the camera's picture a FIFO-16 misses.
TriangleMarks cache_misses(const PlanMirror& mirror, size_t commands) {
    TriangleMarks marks;
    marks.first.assign(commands, TriangleMarks::no_marks);
    std::vector<uint8_t> misses;
    for (const PlanMirror::MirroredDraw& draw : mirror.draws()) {
        // Of patches the hardware makes the triangles, and numbers none.
        const bool patches = mirror.recipe().pipelines[draw.draw.pipeline].patch_vertices > 0;
        if (!mirror.is_shown(draw) || draw.indices.empty() || patches) continue;
        simulate(CacheModel{}, draw.indices, &misses);
        marks.first[draw.command] = static_cast<uint32_t>(marks.of_triangles.size());
        marks.of_triangles.insert(marks.of_triangles.end(), misses.begin(), misses.end());
    }
    return marks;
}

std::vector<View> views_of(const ReadyScene& scene, const ShadingOptions& look, const Camera& camera, uint32_t width,
                           uint32_t height) {
    std::vector<View> views = {view_of(camera, width, height)};
    views[0].culls_back_faces = !look.double_sided && !scene.materials.any_double_sided();
    if (scene.scene.shadows) {
        views.push_back(shadow_view(look.light_direction, scene.bounds.centre, std::max(scene.bounds.radius, 1e-6f),
                                    shadow_texels));
        // Volumes are lit wherever they are.
        views.back().shades_first_view_alone = scene.scene.volumes.emitters.empty();
    }
    return views;
}

// What is planned for: levels, or what is culled, as seen from where they were frozen.
FrameInput as_frozen(FrameInput input, const std::optional<View>& levels, const std::optional<View>& culling) {
    if (levels || culling) input.level_view = levels ? *levels : input.views[0];
    if (culling) {
        const bool culls_back_faces = input.views[0].culls_back_faces;
        input.views[0] = *culling;
        input.views[0].culls_back_faces = culls_back_faces;
    }
    return input;
}

// Carries the plan out on the CPU. Where draws need what the device computes, the plan reads it back for learn().
Result<void> mirror_plan(PlanMirror& mirror, const FrameInput& input, Plan& plan, ShadingOptions& shown) {
    if (auto done = mirror.execute(plan, input); !done) return done;
    if (shown.debug == DebugView::misses)
        shown.marks = std::make_shared<const TriangleMarks>(cache_misses(mirror, plan.commands.size()));
    for (const uint32_t buffer : mirror.computed_for_draws(plan)) {
        plan.commands.push_back(
            {Stage::composite, Readback{buffer, 0, mirror.recipe().buffers[buffer].bytes, mirrored_tag | buffer}});
    }
    return {};
}

// Takes what mirror_plan() asked for out of the readbacks of a frame.
void learn(std::optional<PlanMirror>& mirror, std::vector<ReadbackResult>& readbacks, uint64_t frame) {
    for (const ReadbackResult& r : readbacks) {
        if ((r.tag & mirrored_tag) != 0 && r.frame == frame)
            mirror->learn(r.tag & ~mirrored_tag, {r.blob.data(), r.blob.size()});
    }
    std::erase_if(readbacks, [](const ReadbackResult& r) { return (r.tag & mirrored_tag) != 0; });
}

void take_counters(const FrameCounters& counters, DrawnFrame& drawn) {
    drawn.counters = counters;
    if (!drawn.volume) return;
    VolumeFigures& v = *drawn.volume;
    const std::pair<const char*, double*> figures[] = {
        {"volume fill", &v.fill_ms},       {"volume halo", &v.fill_ms},          {"volume no_light", &v.light_ms},
        {"volume fill alone", &v.fill_ms}, {"volume by_metavoxel", &v.march_ms}, {"volume march", &v.march_ms},
        {"volume upsample", &v.march_ms},  {"volume misfits", &v.march_ms},      {"volume composite", &v.composite_ms}};
    for (const auto& [name, ms] : counters.effect_ms) {
        for (const auto& [pipeline, figure] : figures) {
            if (name == pipeline) *figure += ms;
        }
    }
}

// Frames free and take the same megabytes again, those of a software rasteriser most of all. Left to itself, glibc
// gives them back to the system each time, and faulting them in anew is a seventh of a frame.
void keep_freed_memory() {
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most it takes
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

}  // namespace

nlohmann::ordered_json json_of(const VolumeFigures& v) {
    return {{"bin_ms", v.bin_ms},     {"fill_ms", v.fill_ms},           {"light_ms", v.light_ms},
            {"march_ms", v.march_ms}, {"composite_ms", v.composite_ms}, {"bricks", v.bricks},
            {"bytes", v.bytes}};
}

Image opaque_image(const Picture& picture) {
    Image image{picture.width, picture.height, {}};
    image.texels.resize(size_t{image.width} * image.height);
    for (size_t i = 0; i < image.texels.size(); ++i)
        image.texels[i] = {picture.colour[i * 4], picture.colour[i * 4 + 1], picture.colour[i * 4 + 2], 255};
    return image;
}

DrawSession::DrawSession(const ReadyScene& scene, Renderer& renderer, const Progress& progress, uint32_t place)
    : scene_(&scene), renderer_(&renderer), progress_(progress), place_(place), reader_([&] {
          std::vector<ChunkFile> files;
          for (const Asset& asset : scene.assets)
              files.push_back(asset.atlas_file != nullptr ? asset.atlas_file->file() : asset.file);
          return files;
      }()) {}

Result<std::unique_ptr<DrawSession>> DrawSession::open(const ReadyScene& scene, Renderer& renderer,
                                                       const Technique& way, bool mirrored, const Progress& progress,
                                                       uint32_t place) {
    keep_freed_memory();
    if ((way.raster == "tess" || way.raster == "device") && !renderer.device().tessellates) {
        return fail(Fault::machine, renderer.device().name + " does not tessellate; choose --raster grid or bintree");
    }
    std::unique_ptr<DrawSession> session(new DrawSession(scene, renderer, progress, place));
    auto source = open_backend(way, scene, progress);
    if (!source) return tl::unexpected(source.error());
    session->source_ = std::move(*source);
    if (const SceneVolumes& volumes = scene.scene.volumes; !volumes.emitters.empty()) {
        LODE_CHECK(volumes.grids.empty(), volumes.grids.size());
        auto opened = volume::VolumeSource::open(volumes.emitters, volumes.options);
        if (!opened) return tl::unexpected(opened.error());
        session->volumes_ = std::move(*opened);
        session->volumes_->quality = volumes.quality;
        session->shows_volumes = way.volumes != "off";
        if (!way.volumes.empty() && session->shows_volumes) {
            if (auto done = choose_volumes("--volumes", way.volumes, session->volumes_->quality); !done)
                return tl::unexpected(done.error());
        }
        if (mirrored) session->volume_mirror_.emplace(session->volumes_->recipe());
    }
    const Recipe* effect = session->volumes_ != nullptr ? &session->volumes_->recipe() : nullptr;
    if (auto done = renderer.load(session->source_->recipe(), scene.materials, place, effect); !done)
        return tl::unexpected(done.error());
    session->loaded_ = renderer.loaded(place);
    if (mirrored) session->mirror_.emplace(session->source_->recipe(), puller_of(way.backend));
    if (scene.scene.light_direction) session->look.light_direction = *scene.scene.light_direction;
    return session;
}

Result<DrawnFrame> DrawSession::start(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height,
                                      bool empty) {
    FrameInput input;
    input.views = views_of(*scene_, look, camera, width, height);
    if (!empty) input.instances = scene_->instances;
    input.budget = budget;
    const auto completed = renderer_->completed_frame(place_);
    if (!completed) return tl::unexpected(completed.error());
    input.completed_frame = *completed;
    input.readbacks = std::exchange(readbacks_, {});
    std::ranges::move(renderer_->take_readbacks(place_), std::back_inserter(input.readbacks));
    input.arrivals = reader_.arrivals();
    input.frame = frame_++;
    input.time = time;
    input.light_direction = look.light_direction;
    view_ = input.views[0];

    DrawnFrame drawn;
    drawn.frame = input.frame;
    drawn.pixel_error = budget.pixel_error;
    const auto entered = std::chrono::steady_clock::now();
    const double cpu_start = thread_cpu_ms();
    Plan plan = source_->plan(as_frozen(input, frozen_levels, frozen_culling));
    drawn.plan_cpu_ms = thread_cpu_ms() - cpu_start;
    for (const std::string& warning : plan.warnings) progress_.warning(warning);
    drawn.warnings = std::move(plan.warnings);
    drawn.stats = plan.stats;
    outstanding_ = !plan.requests.empty() || !input.arrivals.empty();
    reads_back_ = std::ranges::any_of(
        plan.commands, [](const Command& command) { return std::holds_alternative<Readback>(command.what); });
    reader_.request(plan.requests);
    drawn.ms = drawn.plan_ms = ms_since(entered);
    // Nobody looks at it if others follow.
    if (settling_ && (outstanding_ || late_) && !reads_back_)
        std::erase_if(plan.commands, [](const Command& command) { return std::holds_alternative<Draw>(command.what); });
    ShadingOptions shown = look;
    if (mirror_) {
        if (auto done = mirror_plan(*mirror_, input, plan, shown); !done) return tl::unexpected(done.error());
    }
    const auto effect = empty ? Result<Plan>(Plan{}) : plan_volumes(input, drawn);
    if (!effect) return tl::unexpected(effect.error());
    const auto submitted = std::chrono::steady_clock::now();
    if (auto done = renderer_->submit(plan, input, shown, place_, &*effect); !done) return tl::unexpected(done.error());
    drawn.ms += ms_since(submitted);
    return drawn;
}

Result<Plan> DrawSession::plan_volumes(const FrameInput& input, DrawnFrame& drawn) {
    if (volumes_ == nullptr || !shows_volumes) return Plan{};
    const auto entered = std::chrono::steady_clock::now();
    const double cpu_start = thread_cpu_ms();
    // What debug views colour is the march through all.
    const volume::Quality quality = volumes_->quality;
    if (look.debug >= DebugView::volume_bricks && look.debug <= DebugView::volume_steps)
        volumes_->quality.by_metavoxel = false;
    Plan plan = volumes_->plan(input);
    volumes_->quality = quality;
    VolumeFigures figures;
    figures.bin_ms = thread_cpu_ms() - cpu_start;
    const double ms = ms_since(entered);
    drawn.ms += ms;
    drawn.plan_ms += ms;
    figures.bytes = plan.stats.resident_bytes;
    for (const auto& [name, value] : plan.stats.more) {
        if (name == "bricks") figures.bricks = static_cast<uint64_t>(value);
    }
    drawn.volume = figures;
    for (const std::string& warning : plan.warnings) {
        progress_.warning(warning);
        drawn.warnings.push_back(warning);
    }
    if (volume_mirror_) {
        if (auto done = volume_mirror_->execute(plan, input); !done) return tl::unexpected(done.error());
    }
    return plan;
}

Result<DrawnFrame> DrawSession::draw(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height,
                                     bool empty) {
    LODE_CHECK(begun_.empty(), begun_.size());
    auto drawn = start(camera, budget, width, height, empty);
    if (!drawn) return drawn;
    const auto submitted = std::chrono::steady_clock::now();
    if (auto done = renderer_->wait(); !done) return tl::unexpected(done.error());
    drawn->ms += ms_since(submitted);
    const double cpu = started_threads_cpu_ms();
    drawn->cpu_ms = cpu - std::exchange(cpu_before_, cpu);
    for (const FrameCounters& counters : renderer_->take_counters(place_)) {
        if (counters.frame == drawn->frame) take_counters(counters, *drawn);
    }
    readbacks_ = renderer_->take_readbacks(place_);
    learn(mirror_, readbacks_, drawn->frame);
    return drawn;
}

Result<void> DrawSession::begin(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height) {
    LODE_CHECK(!mirror_);
    auto drawn = start(camera, budget, width, height, false);
    if (!drawn) return tl::unexpected(drawn.error());
    const double cpu = started_threads_cpu_ms();
    drawn->cpu_ms = cpu - std::exchange(cpu_before_, cpu);
    begun_.push_back(std::move(*drawn));
    return {};
}

Result<std::vector<DrawnFrame>> DrawSession::take_drawn(bool wait) {
    if (wait) {
        if (auto done = renderer_->wait(); !done) return tl::unexpected(done.error());
    } else if (auto completed = renderer_->completed_frame(place_); !completed) {
        return tl::unexpected(completed.error());
    }
    std::vector<DrawnFrame> drawn;
    for (const FrameCounters& counters : renderer_->take_counters(place_)) {
        // One that was drawn, not begun, has told of itself.
        if (begun_.empty() || begun_.front().frame != counters.frame) continue;
        drawn.push_back(std::move(begun_.front()));
        begun_.pop_front();
        take_counters(counters, drawn.back());
        drawn.back().ms = drawn.back().plan_ms + counters.total_ms;
    }
    return drawn;
}

Result<DrawnFrame> DrawSession::settle(const Camera& camera, const Budget& budget, uint32_t width, uint32_t height,
                                       uint32_t frames) {
    Budget waiting = budget;
    waiting.page_requests = Budget::page_requests_waiting;
    uint32_t swaps = 0;
    for (bool first = true; frames > 1; --frames, first = false) {
        settling_ = true;
        auto drawn = draw(camera, waiting, width, height);
        settling_ = false;
        if (!drawn) return drawn;
        if (swaps_pages(drawn->stats) && ++swaps == most_swaps) break;
        // What arrived with this frame is decoded by the next, and shown by it.
        reader_.wait();
        // And what a device finds out about a frame is answered by the next.
        if (!outstanding_ && !late_ && !(first && reads_back_)) return drawn;
        late_ = outstanding_;
    }
    return draw(camera, waiting, width, height);
}

}  // namespace lodestone
