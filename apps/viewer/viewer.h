// What the interactive demo does, apart from its window's panel: backends side by side, levels and culling frozen, the
// pixel error steered, paths flown and recorded, meshes baked as they are dropped.
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <mutex>
#include <optional>

#include "apps/drawing/session.h"
#include "frame/camera_path.h"
#include "frame/error_controller.h"
#include "frame/free_camera.h"
#include "render/window/window.h"

namespace lodestone {

// Numbers of the last frames, oldest first.
class History {
public:
    void add(float value) {
        values_[static_cast<size_t>(next_)] = value;
        next_ = (next_ + 1) % size();
    }
    const float* data() const { return values_.data(); }
    int size() const { return static_cast<int>(values_.size()); }
    int oldest() const { return next_; }
    float last() const { return values_[static_cast<size_t>((next_ + size() - 1) % size())]; }

private:
    std::array<float, 240> values_{};
    int next_ = 0;
};

// One half of the picture: a backend, what it draws and what that took.
struct Pane {
    Technique way;
    std::unique_ptr<DrawSession> session;
    DrawnFrame drawn;
    History ms, triangles, acmr, uploaded_kib, missing;
    std::vector<std::string> beyond;  // the limits that the frame before did not keep to
};

class Viewer {
public:
    Viewer(Renderer& renderer, Window& window, const Progress& progress)
        : renderer_(renderer), window_(window), progress_(progress) {}
    ~Viewer();

    // Shows the scene, whose assets have what the panes' backends need; where they lack something else, or it was baked
    // quickly, that is baked in the background. Where it cannot be drawn the scene shown before goes on, and `message`
    // says why; an error only where there is nothing to go on with.
    Result<void> show(ReadyScene scene);
    // One turn of the loop after Window::poll(): keys, camera, both panes, then `panel` may describe the overlay, and
    // all is presented.
    Result<void> turn(const std::function<void()>& panel);

    const ReadyScene& scene() const { return *scene_; }
    const Renderer& renderer() const { return renderer_; }
    Window& window() { return window_; }

    std::array<Pane, 2> panes;
    // Draws the pane so. Where that cannot be, what was drawn goes on, and `message` says why; an error as of show().
    Result<void> choose(uint32_t pane, const Technique& way);
    // Compiles shader_folder anew and draws with what it gives; what does not work is told in `message`, and changes
    // nothing.
    Result<void> reload_shaders();
    std::filesystem::path shader_folder = "shaders";

    // The look of both panes, and what both are asked for.
    ShadingOptions look;
    double pixel_error = 1;
    // What the scene allows its frames; of it resident_bytes is set by keep_to().
    Budget& budget() { return scene_->scene.budget; }
    // Draws the panes within so many bytes. Where a backend cannot, all stays as it was, and `message` says what it
    // needs.
    Result<void> keep_to(uint64_t resident_bytes);
    float resident_slider = 0;                  // MiB; where the panel's slider is
    std::optional<ErrorController> controller;  // steers pixel_error while there
    double fps = 30;                            // that it holds
    bool shows_panel = true, shows_help = false;
    bool split = false, difference = false;
    float split_at = 0.5f;
    bool freeze_levels = false, freeze_culling = false;
    void freeze(bool levels, bool culling);

    FreeCamera camera;
    // Smoke and fire of the scene: how they are drawn, whether at all, and whether their time goes on.
    SceneVolumes& volumes() { return scene_->scene.volumes; }
    bool shows_volumes = true, volumes_move = true;
    uint32_t volume_level =
        volume::highest_level;  // of quality, as last set; sliders may have changed parts of it since
    double volume_time = 0;     // seconds
    // Gives all volumes a look in place of their own.
    Result<void> dress_volumes(const volume::Look& dress);

    bool flies = false;  // the mouse looks round, not about the target
    void reset_camera();
    std::string camera_text() const;  // as JSON, for the clipboard
    Result<void> take_camera(const std::string& text);

    enum class Motion { free, playing, recording };
    Motion motion() const { return motion_; }
    void play();    // the path recorded last, else the scene's; stops where it plays
    void record();  // begins, or ends and writes it to a file

    // A picture of the window, overlay included, to a file of its own.
    void take_screenshot() { wants_screenshot_ = true; }

    // Bakes a mesh or scene in the background, quickly, and shows it. What it said last, and how far it is.
    void load(const std::filesystem::path& path);
    struct Baking {
        std::string file, stage;
        double fraction = 0;
    };
    std::optional<Baking> baking() const;

    std::string message;  // the last thing worth telling

    // What a viewer on another device goes on with: the scene, its camera, and all that was chosen. What was being
    // baked is begun anew; a path that was being recorded is lost.
    struct State {
        ReadyScene scene;
        std::array<Technique, 2> ways;
        ShadingOptions look;
        double pixel_error = 1, fps = 30;
        std::optional<ErrorController> controller;
        bool shows_panel = true, shows_help = false, split = false, difference = false, flies = false;
        float split_at = 0.5f;
        FreeCamera camera;
    };
    State take_state();  // the viewer shows nothing any more
    Result<void> go_on_with(State state);

private:
    Result<void> show(ReadyScene scene, bool is_better);
    SceneNeeds needs(bool quickly) const;
    void improve();
    Result<void> open(uint32_t pane, const Technique& way);
    Result<std::unique_ptr<DrawSession>> prepared(const ReadyScene& scene, const Technique& way, uint32_t pane);
    Result<void> revive(uint32_t pane, const Error& why);
    Result<void> keep_showing(const Error& why);  // all of it
    void move_camera();
    Result<void> draw_panes();
    Result<void> draw_pane(uint32_t p, const Budget& budget);
    void show_figures(Pane& pane, const Budget& budget);
    Result<void> take_baked();
    Result<void> write_screenshot();

    Renderer& renderer_;
    Window& window_;
    const Progress& progress_;
    std::unique_ptr<ReadyScene> scene_;
    std::optional<View> frozen_levels_, frozen_culling_;
    uint32_t width_ = 0, height_ = 0;
    Motion motion_ = Motion::free;
    CameraPath path_;       // flown or recorded
    double along_ = 0;      // of the path, frames
    double since_key_ = 0;  // seconds, while recording
    bool wants_screenshot_ = false;

    struct Bake {
        mutable std::mutex mutex;
        Baking state;
        bool is_better = false;  // of what is shown
        std::atomic<bool> stop{false};
        std::future<Result<ReadyScene>> result;
    };
    void bake(const std::string& name, bool is_better, const std::function<Result<Scene>()>& read,
              const SceneNeeds& needs);
    std::unique_ptr<Bake> bake_;
    std::vector<std::unique_ptr<Bake>> stopping_;  // that were told to stop
};

}  // namespace lodestone
