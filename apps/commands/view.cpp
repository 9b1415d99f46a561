#include <imgui.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <deque>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/drawing/stage.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "apps/viewer/panel.h"
#include "base/text.h"

namespace lodestone {

namespace {

struct ViewArguments {
    StageOptions stage;
    std::string backend = "lod", right = "full", keys, shaders = "shaders";
    double pixel_error = 1;
    uint64_t frames = 0;
};

constexpr uint32_t frames_per_key = 5;

// What --keys asks for: keys, files as if dropped, and frames to wait.
struct Press {
    const ViewKey* key;  // null: only wait
    uint32_t wait;
    std::string file;  // waits until it is baked
};
Result<std::deque<Press>> script_of(const std::string& text) {
    std::deque<Press> script;
    if (text.empty()) return script;
    const auto words = parse_list("--keys", text);
    if (!words) return tl::unexpected(words.error());
    for (const std::string& word : *words) {
        uint32_t wait = 0;
        const char* end = word.data() + word.size();
        if (word.starts_with("wait:") && std::from_chars(word.data() + 5, end, wait).ptr == end) {
            script.push_back({nullptr, wait, {}});
            continue;
        }
        if (word.starts_with("load:")) {
            script.push_back({nullptr, 1, word.substr(5)});
            continue;
        }
        const auto key = std::ranges::find(view_keys(), word, &ViewKey::name);
        if (key == view_keys().end())
            return fail(Fault::usage,
                        "--keys " + word + ": is no key of the viewer, nor wait:FRAMES or load:FILE; F1 shows them");
        script.push_back({&*key, frames_per_key, {}});
    }
    return script;
}

// Plays a script in the viewer.
class ScriptPlayer {
public:
    explicit ScriptPlayer(std::deque<Press> script) : script_(std::move(script)), scripted_(!script_.empty()) {}

    // After every frame. False where the script has ended.
    bool go_on(Viewer& viewer, Window& window) {
        if (!scripted_ || viewer.baking() || --wait_ > 0) return true;
        if (script_.empty()) return false;
        const Press& press = script_.front();
        if (press.key != nullptr) window.press(press.key->key);
        if (!press.file.empty()) viewer.load(press.file);
        wait_ = std::max(1u, press.wait);
        script_.pop_front();
        return true;
    }

private:
    std::deque<Press> script_;
    const bool scripted_;
    uint32_t wait_ = frames_per_key;
};

Result<void> act_on_keys(Viewer& viewer, Window& window) {
    for (const ViewKey& key : view_keys()) {
        if (window.ctrl() || !window.pressed(key.key)) continue;
        if (auto done = key.act(viewer); !done) return done;
    }
    if (window.ctrl() && window.pressed(static_cast<Key>('C'))) ImGui::SetClipboardText(viewer.camera_text().c_str());
    if (window.ctrl() && window.pressed(static_cast<Key>('V'))) {
        const char* text = ImGui::GetClipboardText();
        if (auto taken = viewer.take_camera(text != nullptr ? text : ""); !taken)
            viewer.message = taken.error().message;
    }
    return {};
}

// Shows a scene until the user ends it, with one device after the other where one is lost.
class Show {
public:
    Show(const ViewArguments& options, DrawStage& stage, ScriptPlayer player, const Progress& progress)
        : o_(options), stage_(stage), player_(std::move(player)), progress_(progress) {}

    Result<void> run() {
        std::optional<Viewer::State> state;
        std::string message;
        for (;;) {
            const uint64_t before = frames_;
            auto ended = on_one_device(state, message);
            // A device that is lost before it shows anything would be lost again.
            if (ended || frames_ == before || !stage_.renderer->lost()) return ended;
            message = ended.error().message + "; drawing goes on with a new device";
            std::fprintf(stderr, "%s\n", printable(message).c_str());
            if (auto renewed = stage_.renew_renderer(); !renewed) return renewed;
        }
    }
    uint64_t frames() const { return frames_; }

private:
    // state: what to go on with, where a device before was lost; becomes it where this one fails.
    Result<void> on_one_device(std::optional<Viewer::State>& state, const std::string& message) {
        auto window = Window::open(*stage_.renderer, {title_, stage_.width, stage_.height});
        if (!window) return tl::unexpected(window.error());
        Viewer viewer(*stage_.renderer, **window, progress_);
        viewer.shader_folder = o_.shaders;
        if (auto done = state ? viewer.go_on_with(std::move(*state)) : begin(viewer); !done) return done;
        if (!message.empty()) viewer.message = message;
        auto ended = turns(viewer, **window);
        if (!ended) state = viewer.take_state();
        return ended;
    }
    Result<void> begin(Viewer& viewer) {
        viewer.panes[0].way.backend = o_.backend;
        viewer.panes[1].way.backend = o_.right;
        viewer.pixel_error = o_.pixel_error;
        return viewer.show(std::move(stage_.scene));
    }
    Result<void> turns(Viewer& viewer, Window& window) {
        while (window.poll() && !progress_.stopped() && !window.pressed(Key::escape)) {
            if (auto done = act_on_keys(viewer, window); !done) return done;
            if (auto done = viewer.turn([&] { describe_panel(viewer); }); !done) return done;
            ++frames_;
            if ((o_.frames > 0 && frames_ >= o_.frames) || !player_.go_on(viewer, window)) break;
        }
        return {};
    }

    const ViewArguments& o_;
    DrawStage& stage_;
    ScriptPlayer player_;
    const Progress& progress_;
    const std::string title_ = "Lodestone: " + stage_.scene.scene.name;
    uint64_t frames_ = 0;
};

Result<int> view(const ViewArguments& o) {
    for (const auto& [option, name] : {std::pair("--backend", o.backend), std::pair("--right", o.right)}) {
        if (auto known = check_backend(option, name); !known) return tl::unexpected(known.error());
    }
    auto script = script_of(o.keys);
    if (!script) return tl::unexpected(script.error());
    const Progress progress = terminal_progress();
    SceneNeeds needs = needs_of({o.backend}, Need::welcome);
    needs.quickly = true;
    auto stage = set_stage(o.stage, needs, progress, true);
    if (!stage) return tl::unexpected(stage.error());
    end_progress();
    Show show(o, *stage, ScriptPlayer(std::move(*script)), progress);
    if (auto done = show.run(); !done) return tl::unexpected(done.error());
    if (verbosity() != Verbosity::quiet) {
        std::printf("%llu frames shown on %s\n", static_cast<unsigned long long>(show.frames()),
                    stage->device_text().c_str());
    }
    return stage->exit_code();
}

}  // namespace

void add_view(CLI::App& app, Run& run) {
    const auto o = std::make_shared<ViewArguments>();
    CLI::App* command = app.add_subcommand("view", "Fly around a scene and switch how it is drawn; F1 lists the keys");
    add_stage_options(*command, o->stage);
    command
        ->add_option("--backend", o->backend,
                     "Backend to begin with: full, discrete, lod (progressive mesh) or vgi (geometry images)")
        ->capture_default_str();
    command->add_option("--right", o->right, "Backend of the right half while the screen is split")
        ->capture_default_str();
    command->add_option("--pixel-error", o->pixel_error, "Largest error on screen to begin with, in pixels")
        ->check(CLI::Range(1.0 / 16, 64.0))
        ->capture_default_str();
    command->add_option("--shaders", o->shaders, "Folder of the shaders that F5 compiles")->capture_default_str();
    command->add_option(
        "--keys", o->keys,
        "Press these keys in turn, separated by commas and named as F1 lists them, and then end: 2,V,F12; "
        "wait:FRAMES waits between two, load:FILE opens a file as if it was dropped");
    command->add_option("--frames", o->frames, "End after this many frames; 0 never ends")->capture_default_str();
    command->footer(
        examples("lodestone view bunny.obj\n"
                 "lodestone view assets/cliff.scene.json --backend vgi --right full"));
    command->callback([o, &run] { run = [o] { return view(*o); }; });
}

}  // namespace lodestone
