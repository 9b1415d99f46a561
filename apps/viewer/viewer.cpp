#include "apps/viewer/viewer.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <glm/geometric.hpp>
#include <new>

#include "apps/drawing/budget_use.h"
#include "apps/drawing/environment.h"
#include "apps/drawing/grids.h"
#include "apps/options/common_options.h"
#include "apps/viewer/shader_reload.h"
#include "base/json.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

constexpr double seconds_per_key = 0.5;  // of a recorded path

double figure(const PlanStats& stats, const std::string& name) {
    const auto at = std::ranges::find(stats.more, name, &std::pair<std::string, double>::first);
    return at == stats.more.end() ? 0 : at->second;
}

// What a frame takes of the time from frame to frame, where they overlap: the longer of its plan and its drawing. Where
// the device has no clock, all the time until it was drawn.
double cost_of(const DrawnFrame& drawn) {
    return drawn.counters.gpu_ms > 0 ? std::max(drawn.plan_ms, drawn.counters.gpu_ms) : drawn.ms;
}

// The first name with a number that no file in the current folder has.
std::string new_file(const std::string& before, const std::string& after) {
    std::error_code ignored;
    for (int number = 1;; ++number) {
        std::string name = before + std::to_string(number) + after;
        if (!std::filesystem::exists(name, ignored)) return name;
    }
}

}  // namespace

Viewer::~Viewer() {
    if (bake_ != nullptr) bake_->stop = true;
}

SceneNeeds Viewer::needs(bool quickly) const {
    if (!quickly) return needs_of(backend_names());
    std::vector<std::string> drawn = {panes[0].way.backend};
    if (split) drawn.push_back(panes[1].way.backend);
    SceneNeeds needs = needs_of(drawn, Need::welcome);
    needs.quickly = true;
    return needs;
}

Result<void> Viewer::show(ReadyScene scene) { return show(std::move(scene), false); }

Result<void> Viewer::show(ReadyScene scene, bool is_better) {
    auto coming = std::make_unique<ReadyScene>(std::move(scene));
    if (is_better) coming->scene.budget = budget();
    std::array<Pane, 2> opened;
    for (uint32_t p = 0; p < panes.size(); ++p) {
        opened[p].way = panes[p].way;
        if (p == 1 && !split) continue;
        const auto ways = techniques_of(panes[p].way.backend, *coming);
        const bool usual = is_better && panes[p].way == techniques_of(panes[p].way.backend, *scene_).front();
        if (usual || std::ranges::find(ways, panes[p].way) == ways.end()) opened[p].way = ways.front();
        auto session = prepared(*coming, opened[p].way, p);
        if (!session) {
            opened = {};
            return keep_showing({session.error().fault, coming->scene.name + ": " + session.error().message});
        }
        opened[p].session = std::move(*session);
    }
    panes = std::move(opened);  // sessions refer to the scene they draw
    scene_ = std::move(coming);
    if (!scene_->whole) improve();
    if (is_better) return {};
    look = {};
    if (scene_->scene.light_direction) look.light_direction = *scene_->scene.light_direction;
    freeze(false, false);
    motion_ = Motion::free;
    path_ = scene_->camera;
    reset_camera();
    return {};
}

Viewer::State Viewer::take_state() {
    State state{std::move(*scene_),
                {panes[0].way, panes[1].way},
                look,
                pixel_error,
                fps,
                controller,
                shows_panel,
                shows_help,
                split,
                difference,
                flies,
                split_at,
                camera};
    for (Pane& pane : panes) pane.session.reset();
    return state;
}

Result<void> Viewer::go_on_with(State state) {
    for (size_t p = 0; p < panes.size(); ++p) panes[p].way = state.ways[p];
    split = state.split;
    if (auto done = show(std::move(state.scene)); !done) return done;
    look = state.look;
    pixel_error = state.pixel_error;
    fps = state.fps;
    controller = state.controller;
    shows_panel = state.shows_panel;
    shows_help = state.shows_help;
    difference = state.difference;
    flies = state.flies;
    split_at = state.split_at;
    camera = state.camera;
    return {};
}

Result<void> Viewer::keep_showing(const Error& why) {
    if (scene_ == nullptr) return tl::unexpected(why);
    for (uint32_t p = 0; p < panes.size(); ++p) {
        if (panes[p].session == nullptr) continue;
        if (auto done = revive(p, why); !done) return done;
    }
    return {};
}

// Frames that are looked at do not wait for pipelines.
Result<std::unique_ptr<DrawSession>> Viewer::prepared(const ReadyScene& scene, const Technique& way, uint32_t p) {
    auto session = DrawSession::open(scene, renderer_, way, look.debug == DebugView::misses, progress_, p);
    if (!session) return session;
    if (auto done = (*session)->prepare(); !done) return tl::unexpected(done.error());
    return session;
}

// In its pane, what was there goes once the new is there.
Result<void> Viewer::open(uint32_t p, const Technique& chosen) {
    const Technique way = chosen;  // which may be the pane's own
    auto opened = prepared(*scene_, way, p);
    if (!opened) return fail(opened.error().fault, way.backend + ": " + opened.error().message);
    panes[p] = {way, std::move(*opened), {}, {}, {}, {}, {}, {}, {}};
    return {};
}

Result<void> Viewer::dress_volumes(const volume::Look& dress) {
    for (volume::Emitter& emitter : volumes().emitters) emitter.look = dress;
    for (uint32_t p = 0; p < panes.size(); ++p) {
        if (panes[p].session == nullptr) continue;
        if (auto done = choose(p, panes[p].way); !done) return done;
    }
    return {};
}

// What the pane has drawn goes on, though something else should have been drawn.
Result<void> Viewer::revive(uint32_t p, const Error& why) {
    message = why.message + (bake_ != nullptr && bake_->is_better ? "; more is being baked" : "");
    if (panes[p].session == nullptr) return tl::unexpected(why);
    if (panes[p].session->lives()) return {};
    // It had to make room first.
    panes[p].session.reset();
    return open(p, panes[p].way);
}

Result<void> Viewer::choose(uint32_t p, const Technique& way) {
    auto done = open(p, way);
    return done ? done : revive(p, done.error());
}

Result<void> Viewer::reload_shaders() {
    const auto replaced = compile_shaders(shader_folder);
    if (!replaced) {
        message = replaced.error().message;
        return {};
    }
    const auto open_panes = [&]() -> Result<void> {
        for (uint32_t p = 0; p < panes.size(); ++p) {
            if (panes[p].session == nullptr) continue;
            if (auto done = open(p, panes[p].way); !done) return done;
        }
        return {};
    };
    if (replaced->count() == 0) {
        message = "no shader has changed";
    } else if (auto done = open_panes(); done) {
        message = std::to_string(replaced->count()) + " shaders compiled anew";
    } else {
        replaced->undo();
        message = done.error().message;
        return open_panes();
    }
    return {};
}

void Viewer::freeze(bool levels, bool culling) {
    if (levels != freeze_levels) frozen_levels_.reset();
    if (culling != freeze_culling) frozen_culling_.reset();
    const auto now = width_ > 0 ? std::optional(view_of(camera.camera(), width_, height_)) : std::nullopt;
    if (levels && !frozen_levels_) frozen_levels_ = now;
    if (culling && !frozen_culling_) frozen_culling_ = now;
    freeze_levels = levels;
    freeze_culling = culling;
}

void Viewer::reset_camera() { camera = FreeCamera(usual_camera(*scene_)); }

std::string Viewer::camera_text() const {
    const Camera& c = camera.camera();
    const auto vector = [](const glm::vec3& v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
    return nlohmann::ordered_json{{"eye", vector(c.eye)}, {"target", vector(c.target)}}.dump();
}

Result<void> Viewer::take_camera(const std::string& text) {
    const auto json = Json::parse(text, nullptr, false);
    const auto vector = [&](const char* name, glm::vec3& v) {
        if (!json.is_object() || !json.contains(name) || !json[name].is_array() || json[name].size() != 3) return false;
        for (int k = 0; k < 3; ++k) {
            const auto& number = json[name][static_cast<size_t>(k)];
            if (!number.is_number()) return false;
            v[k] = number.get<float>();
        }
        return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    };
    Camera c = camera.camera();
    if (!vector("eye", c.eye) || !vector("target", c.target) || c.eye == c.target)
        return fail(Fault::format,
                    R"(what was pasted is no camera; it must be {"eye": [x, y, z], "target": [x, y, z]})");
    camera = FreeCamera(c);
    motion_ = Motion::free;
    return {};
}

void Viewer::play() {
    if (motion_ == Motion::recording) record();
    motion_ = motion_ == Motion::playing ? Motion::free : Motion::playing;
    along_ = 0;
}

void Viewer::record() {
    if (motion_ != Motion::recording) {
        motion_ = Motion::recording;
        path_ = scene_->camera;
        path_.keys.clear();
        since_key_ = seconds_per_key;
        return;
    }
    motion_ = Motion::free;
    const Camera& c = camera.camera();
    path_.keys.push_back({c.eye, c.target});
    path_.frames = static_cast<uint32_t>(std::max<size_t>(2, path_.keys.size() * 30));
    const std::string file = new_file("recorded-", ".path.json");
    nlohmann::ordered_json json{{"lodestone", "camera-path"},
                                {"version", 1},
                                {"up", {path_.up.x, path_.up.y, path_.up.z}},
                                {"fov_y_degrees", path_.fov_y * 57.29577951f},
                                {"near", path_.near_plane},
                                {"far", path_.far_plane},
                                {"frames", path_.frames}};
    for (const CameraKey& key : path_.keys) {
        json["keys"].push_back(
            {{"eye", {key.eye.x, key.eye.y, key.eye.z}}, {"target", {key.target.x, key.target.y, key.target.z}}});
    }
    const auto written = write_json(file, json.dump(2));
    message = written ? "the path is in " + file + "; P flies it" : written.error().message;
}

void Viewer::load(const std::filesystem::path& path) {
    if (bake_ != nullptr && !bake_->is_better) {
        message = "one mesh at a time: " + bake_->state.file + " is still being baked";
        return;
    }
    bake(
        path.filename().string(), false, [path] { return read_scene(path); }, needs(true));
}

// What is shown, with all that any backend needs.
void Viewer::improve() {
    bake(
        scene_->scene.name, true, [scene = scene_->scene]() -> Result<Scene> { return scene; }, needs(false));
}

void Viewer::bake(const std::string& name, bool is_better, const std::function<Result<Scene>()>& read,
                  const SceneNeeds& needs) {
    if (bake_ != nullptr) {
        bake_->stop = true;
        stopping_.push_back(std::move(bake_));
    }
    bake_ = std::make_unique<Bake>();
    bake_->state.file = name;
    bake_->is_better = is_better;
    bake_->result = std::async(
        std::launch::async,
        [bake = bake_.get(), name, read, needs, environment = scene_->scene.environment,
         around = scene_->materials.environment, in_blocks = scene_->textures_in_blocks]() -> Result<ReadyScene> {
            Progress progress;
            progress.stop = &bake->stop;
            progress.report = [bake](const std::string& stage, double fraction) {
                const std::lock_guard lock(bake->mutex);
                bake->state.stage = stage;
                bake->state.fraction = fraction;
            };
            try {
                auto scene = read();
                if (!scene) return tl::unexpected(scene.error());
                if (auto grids = read_grids(scene->volumes); !grids) return tl::unexpected(grids.error());
                if (scene->environment == no_environment) scene->environment = environment;
                Result<std::shared_ptr<const Environment>> light = around;
                if (!bake->is_better) light = environment_of(*scene);  // what is better is lit as before
                if (!light) return tl::unexpected(light.error());
                auto ready = ready_scene(std::move(*scene), needs, progress);
                if (ready) ready->materials.environment = std::move(*light);
                if (ready) ready->textures_in_blocks = in_blocks;
                return ready;
            } catch (const std::bad_alloc&) {
                return fail(Fault::machine, name + ": out of memory");
            } catch (const std::exception& e) {
                return fail(Fault::machine, name + ": an operation of the system failed: " + e.what());
            }
        });
}

std::optional<Viewer::Baking> Viewer::baking() const {
    if (bake_ == nullptr) return std::nullopt;
    const std::lock_guard lock(bake_->mutex);
    return bake_->state;
}

Result<void> Viewer::take_baked() {
    std::erase_if(stopping_, [](const std::unique_ptr<Bake>& bake) {
        return bake->result.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    if (bake_ == nullptr || bake_->result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return {};
    auto baked = bake_->result.get();
    const bool is_better = bake_->is_better;
    bake_.reset();
    if (!baked) {
        message = baked.error().message;
        return {};
    }
    message.clear();
    return show(std::move(*baked), is_better);
}

void Viewer::move_camera() {
    const ImGuiIO& io = ImGui::GetIO();
    const double seconds = std::min(static_cast<double>(io.DeltaTime), 0.25);
    if (volumes_move) volume_time += seconds;
    if (motion_ == Motion::playing) {
        along_ += 1;
        if (along_ >= path_.frames) {
            motion_ = Motion::free;
        } else {
            camera = FreeCamera(path_.frame(static_cast<uint32_t>(along_), path_.frames));
        }
    }
    if (!io.WantCaptureMouse) {
        const float turn = 3 / std::max(1.0f, static_cast<float>(height_));
        const float reach = glm::distance(camera.camera().eye, camera.camera().target);
        if (ImGui::IsMouseDragging(ImGuiMouseButton_Left, 0)) {
            if (flies) {
                camera.look(io.MouseDelta.x * turn, -io.MouseDelta.y * turn);
            } else {
                camera.orbit(-io.MouseDelta.x * turn, io.MouseDelta.y * turn);
            }
        }
        if (ImGui::IsMouseDragging(ImGuiMouseButton_Right, 0))
            camera.move(0, -io.MouseDelta.x * turn * reach * 0.3f, io.MouseDelta.y * turn * reach * 0.3f);
        if (io.MouseWheel != 0) camera.approach(std::pow(0.9f, io.MouseWheel));
    }
    if (!window_.ctrl()) {
        const float step = scene_->bounds.radius * static_cast<float>(seconds) * (io.KeyShift ? 2.0f : 0.5f);
        const auto along = [&](char more, char less) {
            return step *
                   static_cast<float>(window_.down(static_cast<Key>(more)) - window_.down(static_cast<Key>(less)));
        };
        camera.move(along('W', 'S'), along('D', 'A'), along('E', 'Q'));
    }
    if (motion_ == Motion::recording) {
        since_key_ += seconds;
        if (since_key_ >= seconds_per_key) {
            since_key_ = 0;
            path_.keys.push_back({camera.camera().eye, camera.camera().target});
        }
    }
    if (motion_ != Motion::playing) camera.fit_planes(scene_->bounds.centre, scene_->bounds.radius);
}

Result<void> Viewer::draw_panes() {
    if (split && panes[1].session == nullptr) {
        // What does not fit beside the other pane is told in the message.
        if (!choose(1, techniques_of(panes[1].way.backend, *scene_).front())) split = false;
    }
    Budget allowed = budget();
    allowed.pixel_error = pixel_error = controller ? controller->error() : pixel_error;
    for (uint32_t p = 0; p < (split ? 2u : 1u); ++p) {
        if (auto done = draw_pane(p, allowed); !done) return done;
    }
    return {};
}

// Begins a frame of the pane, and shows the figures of those that are done. A mirror needs each frame whole.
Result<void> Viewer::draw_pane(uint32_t p, const Budget& allowed) {
    Pane& pane = panes[p];
    // A mirror must see every frame from the first on, and costs where nobody looks through it.
    if ((look.debug == DebugView::misses) != (pane.session->mirror() != nullptr)) {
        if (auto done = choose(p, pane.way); !done) return done;
        if (pane.session->mirror() == nullptr && look.debug == DebugView::misses) look.debug = DebugView::none;
    }
    pane.session->look = look;
    pane.session->frozen_levels = frozen_levels_;
    pane.session->frozen_culling = frozen_culling_;
    pane.session->time = volume_time;
    pane.session->shows_volumes = shows_volumes;
    if (pane.session->volumes() != nullptr) pane.session->volumes()->quality = volumes().quality;
    std::vector<DrawnFrame> done;
    if (pane.session->mirror() != nullptr) {
        auto drawn = pane.session->draw(camera.camera(), allowed, width_, height_);
        if (!drawn) return tl::unexpected(drawn.error());
        done.push_back(std::move(*drawn));
    } else if (auto begun = pane.session->begin(camera.camera(), allowed, width_, height_); !begun) {
        return begun;
    }
    if (auto kept = window_.keep(p); !kept) return kept;
    if (pane.session->mirror() == nullptr) {
        auto drawn = pane.session->take_drawn();
        if (!drawn) return tl::unexpected(drawn.error());
        done = std::move(*drawn);
    }
    for (DrawnFrame& frame : done) {
        pane.drawn = std::move(frame);
        show_figures(pane, allowed);
        if (p == 0 && controller) controller->record(cost_of(pane.drawn), pane.drawn.pixel_error);
    }
    return {};
}

void Viewer::show_figures(Pane& pane, const Budget& allowed) {
    const PlanStats& stats = pane.drawn.stats;
    if (!pane.drawn.warnings.empty()) message = pane.drawn.warnings.back();
    BudgetUse use = use_of(stats);
    if (pane.drawn.frame == 0) use.upload_bytes = 0;  // what the first frame needs is uploaded whatever the budget
    auto lines = beyond(allowed, use, pane.way.backend);
    if (!lines.empty() && pane.beyond.empty()) message = lines.front();
    pane.beyond = std::move(lines);
    const auto triangles = static_cast<float>(stats.triangles);
    pane.ms.add(static_cast<float>(cost_of(pane.drawn)));
    pane.triangles.add(triangles);
    pane.acmr.add(triangles > 0 ? static_cast<float>(pane.drawn.counters.camera_vertices()) / triangles : 0);
    pane.uploaded_kib.add(static_cast<float>(stats.uploaded_bytes) / 1024);
    pane.missing.add(static_cast<float>(figure(stats, "pages_missing") + figure(stats, "leaf_parts_missing")));
}

Result<void> Viewer::keep_to(uint64_t resident_bytes) {
    const uint64_t before = std::exchange(budget().resident_bytes, resident_bytes);
    for (uint32_t p = 0; p < panes.size(); ++p) {
        if (panes[p].session == nullptr) continue;
        const DrawSession* shown = panes[p].session.get();
        if (auto done = choose(p, panes[p].way); !done) return done;
        if (panes[p].session.get() == shown) budget().resident_bytes = before;  // it did not fit
    }
    return {};
}

Result<void> Viewer::turn(const std::function<void()>& panel) {
    if (auto done = take_baked(); !done) return done;
    for (const auto& path : window_.take_dropped()) load(path);
    const bool shown = window_.width() > 0 && window_.height() > 0;
    if (shown && (window_.width() != width_ || window_.height() != height_)) {
        width_ = window_.width();
        height_ = window_.height();
        if (auto done = renderer_.resize(width_, height_); !done) return done;
    }
    if (width_ > 0) {  // else it was never shown
        move_camera();
        if (auto done = draw_panes(); !done) return done;
    }
    panel();
    if (auto done = window_.present({split ? split_at : 1.0f, split && difference}); !done) return done;
    return wants_screenshot_ ? write_screenshot() : Result<void>{};
}

Result<void> Viewer::write_screenshot() {
    wants_screenshot_ = false;
    auto picture = window_.read();
    if (!picture) {
        message = picture.error().message;
        return {};
    }
    const std::string file = new_file("lodestone-", ".png");
    const auto written = write_png(opaque_image(*picture), file);
    message = written ? "the picture is in " + file : written.error().message;
    return {};
}

}  // namespace lodestone
