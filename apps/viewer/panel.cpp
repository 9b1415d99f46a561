#include "apps/viewer/panel.h"

#include <imgui.h>

#include <algorithm>
#include <cstdio>

#include "apps/drawing/stage.h"

namespace lodestone {

namespace {

auto colouring_of(const Viewer& v) { return std::ranges::find(debug_choices(), v.look.debug, &DebugChoice::view); }

Result<void> choose(Viewer& viewer, const char* backend) {
    return viewer.choose(0, techniques_of(backend, viewer.scene()).front());
}

Result<void> choose_next_way(Viewer& v) {
    const auto ways = techniques_of(v.panes[0].way.backend, v.scene());
    const auto at = std::ranges::find(ways, v.panes[0].way);
    return v.choose(0, at == ways.end() || at + 1 == ways.end() ? ways.front() : *(at + 1));
}

void steer(Viewer& viewer, bool on) {
    viewer.controller.reset();
    if (on) viewer.controller.emplace(1000 / viewer.fps, viewer.pixel_error);
}

void choose_in_combo(Viewer& viewer, uint32_t p) {
    Pane& pane = viewer.panes[p];
    Technique way = pane.way;
    ImGui::PushID(static_cast<int>(p));
    if (ImGui::BeginCombo(p == 0 ? "backend" : "right half", way.backend.c_str())) {
        for (const std::string& name : backend_names()) {
            if (ImGui::Selectable(name.c_str(), name == pane.way.backend)) way.backend = name;
        }
        ImGui::EndCombo();
    }
    const auto ways = techniques_of(way.backend, viewer.scene());
    if (std::ranges::find(ways, way) == ways.end()) way = ways.front();
    if (ways.size() > 1 && ImGui::BeginCombo("way", choices_of(way).c_str())) {
        for (const Technique& other : ways) {
            if (ImGui::Selectable(choices_of(other).c_str(), other == way)) way = other;
        }
        ImGui::EndCombo();
    }
    ImGui::PopID();
    if (way == pane.way && pane.session != nullptr) return;
    if (p == 1 && pane.session == nullptr) {
        pane.way = way;
        return;
    }
    // A failure is told in the message; what was shown goes on.
    if (auto done = viewer.choose(p, way); !done) viewer.message = done.error().message;
}

void plot(const char* name, const char* format, const History& history) {
    char text[64];
    std::snprintf(text, sizeof text, format, static_cast<double>(history.last()));
    ImGui::PlotLines(name, history.data(), history.size(), history.oldest(), text, 0, FLT_MAX, {0, 42});
}

void describe_pane(const Pane& pane) {
    ImGui::TextUnformatted(name_of(pane.way).c_str());
    plot("ms", "%.1f ms", pane.ms);
    plot("triangles", "%.0f", pane.triangles);
    plot("ACMR", "%.3f", pane.acmr);
    plot("upload", "%.0f KiB", pane.uploaded_kib);
    if (pane.way.backend == "vgi") plot("pages and leaves missing", "%.0f", pane.missing);
    ImGui::Text("buffers %.1f MiB, plan %.2f ms CPU", static_cast<double>(pane.drawn.stats.resident_bytes) / (1 << 20),
                pane.drawn.plan_cpu_ms);
    if (pane.drawn.volume) {
        const VolumeFigures& f = *pane.drawn.volume;
        ImGui::Text("volumes %llu bricks, %.1f MiB", static_cast<unsigned long long>(f.bricks),
                    static_cast<double>(f.bytes) / (1 << 20));
        ImGui::Text("  bin %.2f, fill %.1f, march %.1f, composite %.1f ms", f.bin_ms, f.fill_ms + f.light_ms,
                    f.march_ms, f.composite_ms);
    }
}

void describe_help(Viewer& viewer) {
    ImGui::SetNextWindowPos({20, 20}, ImGuiCond_FirstUseEver);
    ImGui::Begin("Keys", &viewer.shows_help, ImGuiWindowFlags_AlwaysAutoResize);
    for (const ViewKey& key : view_keys()) ImGui::Text("%-6s %s", key.name.c_str(), key.what.c_str());
    ImGui::Separator();
    ImGui::Text("drag   turn (left), shift (right); wheel: nearer and farther");
    ImGui::Text("WASDQE fly; with shift faster");
    ImGui::Text("ctrl+C, ctrl+V  copy and paste the camera");
    ImGui::Text("drop a mesh or a scene on the window to bake and see it");
    ImGui::End();
}

}  // namespace

const std::vector<ViewKey>& view_keys() {
    static const std::vector<ViewKey> keys = [] {
        std::vector<ViewKey> all;
        const auto add = [&](int key, std::string name, std::string what, std::function<Result<void>(Viewer&)> act) {
            all.push_back({static_cast<Key>(key), std::move(name), std::move(what), std::move(act)});
        };
        const auto set = [&](int key, std::string name, std::string what, std::function<void(Viewer&)> act) {
            add(key, std::move(name), std::move(what), [act = std::move(act)](Viewer& v) -> Result<void> {
                act(v);
                return {};
            });
        };
        set(static_cast<int>(Key::f1), "F1", "this help", [](Viewer& v) { v.shows_help = !v.shows_help; });
        set('H', "H", "hide or show the panel", [](Viewer& v) { v.shows_panel = !v.shows_panel; });
        int number = '1';
        for (const std::string& backend : backend_names()) {
            add(number, std::string(1, static_cast<char>(number)), "draw by " + backend,
                [backend](Viewer& v) { return choose(v, backend.c_str()); });
            ++number;
        }
        add('O', "O", "the next face order or raster", choose_next_way);
        set('V', "V", "the next colouring", [](Viewer& v) {
            const auto at = colouring_of(v) + 1;
            v.look.debug = (at == debug_choices().end() ? debug_choices().begin() : at)->view;
        });
        set('M', "M", "smoke and fire: on or off", [](Viewer& v) { v.shows_volumes = !v.shows_volumes; });
        set('I', "I", "light of the environment: on or off",
            [](Viewer& v) { v.look.environment = !v.look.environment; });
        set('X', "X", "wireframe", [](Viewer& v) { v.look.wireframe = !v.look.wireframe; });
        set('L', "L", "freeze levels", [](Viewer& v) { v.freeze(!v.freeze_levels, v.freeze_culling); });
        set('K', "K", "freeze culling", [](Viewer& v) { v.freeze(v.freeze_levels, !v.freeze_culling); });
        set('B', "B", "both: another backend in the right half", [](Viewer& v) { v.split = !v.split; });
        set('N', "N", "where the two halves' backends differ", [](Viewer& v) {
            v.difference = !v.difference;
            v.split = v.split || v.difference;
        });
        set('T', "T", "hold the frame rate", [](Viewer& v) { steer(v, !v.controller); });
        set('F', "F", "fly or turn about", [](Viewer& v) { v.flies = !v.flies; });
        set('P', "P", "fly the path", [](Viewer& v) { v.play(); });
        set('R', "R", "record a path", [](Viewer& v) { v.record(); });
        add(static_cast<int>(Key::f5), "F5", "compile the shaders anew", [](Viewer& v) { return v.reload_shaders(); });
        set(static_cast<int>(Key::home), "Home", "back to where it began", [](Viewer& v) { v.reset_camera(); });
        set(static_cast<int>(Key::f12), "F12", "screenshot", [](Viewer& v) { v.take_screenshot(); });
        return all;
    }();
    return keys;
}

namespace {

void describe_baking(Viewer& v) {
    const auto baking = v.baking();
    if (!baking) return;
    ImGui::SetNextWindowPos({20, 20}, ImGuiCond_Always);
    ImGui::Begin("Baking", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::Text("%s: %s", baking->file.c_str(), baking->stage.c_str());
    ImGui::ProgressBar(static_cast<float>(baking->fraction), {320, 0});
    ImGui::End();
}

void choose_error(Viewer& v) {
    auto error = static_cast<float>(v.pixel_error);
    if (ImGui::SliderFloat("pixel error", &error, 1.0f / 16, 64, "%.3g px", ImGuiSliderFlags_Logarithmic)) {
        v.pixel_error = std::clamp(static_cast<double>(error), 1.0 / 16, 64.0);
        steer(v, false);
    }
    bool steered = v.controller.has_value();
    if (ImGui::Checkbox("hold", &steered)) steer(v, steered);
    ImGui::SameLine();
    auto fps = static_cast<float>(v.fps);
    if (ImGui::SliderFloat("frames/s", &fps, 1, 240, "%.0f", ImGuiSliderFlags_Logarithmic)) {
        v.fps = std::clamp(static_cast<double>(fps), 1.0, 240.0);
        if (v.controller) v.controller->aim(1000 / v.fps);
    }
}

// A slider over MiB or numbers whose right end is "any".
bool choose_limit(const char* name, uint64_t unit, uint64_t most, uint64_t& limit) {
    const bool any = limit == ~uint64_t{0};
    auto value = static_cast<float>(any ? most : std::clamp<uint64_t>(limit / unit, 1, most));
    const bool moved = ImGui::SliderFloat(name, &value, 1, static_cast<float>(most), any ? "any" : "%.0f",
                                          ImGuiSliderFlags_Logarithmic);
    if (moved) {
        const auto chosen = static_cast<uint64_t>(std::max(1.0f, value));
        limit = chosen >= most ? ~uint64_t{0} : chosen * unit;
    }
    return moved;
}

void choose_budget(Viewer& v) {
    choose_limit("most triangles", 1, 10'000'000, v.budget().max_triangles);
    choose_limit("MiB uploaded", uint64_t{1} << 20, 256, v.budget().upload_bytes);
    // Buffers are made anew, so only once it is let go.
    float& resident = v.resident_slider;
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) resident = static_cast<float>(v.budget().resident_bytes >> 20);
    ImGui::SliderFloat("MiB of buffers", &resident, 1, 16384, "%.0f", ImGuiSliderFlags_Logarithmic);
    if (!ImGui::IsItemDeactivatedAfterEdit()) return;
    if (auto done = v.keep_to(static_cast<uint64_t>(std::max(1.0f, resident)) << 20); !done)
        v.message = done.error().message;
}

void choose_look(Viewer& v) {
    bool levels = v.freeze_levels, culling = v.freeze_culling;
    const bool froze = ImGui::Checkbox("freeze levels", &levels);
    ImGui::SameLine();
    if (ImGui::Checkbox("freeze culling", &culling) || froze) v.freeze(levels, culling);
    ImGui::Checkbox("wireframe", &v.look.wireframe);
    ImGui::SameLine();
    ImGui::Checkbox("both sides", &v.look.double_sided);
    if (v.scene().materials.environment != nullptr) ImGui::Checkbox("environment", &v.look.environment);
    if (ImGui::BeginCombo("colours", colouring_of(v)->title)) {
        for (const DebugChoice& choice : debug_choices()) {
            if (ImGui::Selectable(choice.title, choice.view == v.look.debug)) v.look.debug = choice.view;
        }
        ImGui::EndCombo();
    }
}

// How smoke and fire are drawn, where the scene has any.
void choose_volumes(Viewer& v) {
    if (v.volumes().emitters.empty()) return;
    volume::Quality& quality = v.volumes().quality;
    ImGui::Checkbox("smoke and fire", &v.shows_volumes);
    ImGui::SameLine();
    ImGui::Checkbox("moving", &v.volumes_move);
    ImGui::Checkbox("metavoxel by metavoxel", &quality.by_metavoxel);
    auto level = static_cast<int>(v.volume_level);
    if (ImGui::SliderInt("quality", &level, volume::lowest_level, volume::highest_level)) {
        v.volume_level =
            std::clamp(static_cast<uint32_t>(std::max(level, 0)), volume::lowest_level, volume::highest_level);
        quality = volume::at_level(quality, v.volume_level);
    }
    ImGui::SliderFloat("density", &quality.density, 0.05f, 8, "%.2f", ImGuiSliderFlags_Logarithmic);
    ImGui::SliderFloat("steps a voxel", &quality.steps, 0.125f, 4, "%.2f", ImGuiSliderFlags_Logarithmic);
    quality.density = std::clamp(quality.density, 0.0f, 100.0f);
    quality.steps = std::clamp(quality.steps, 0.125f, 4.0f);
    auto divisor = static_cast<int>(quality.divisor), refresh = static_cast<int>(quality.refresh);
    if (ImGui::SliderInt("target smaller by", &divisor, 1, 4))
        quality.divisor = static_cast<uint32_t>(std::clamp(divisor, 1, 4));
    if (ImGui::SliderInt("frames a filling", &refresh, 0, 30, refresh == 0 ? "once" : "%d"))
        quality.refresh = static_cast<uint32_t>(std::clamp(refresh, 0, 30));
    if (ImGui::BeginCombo("look", "as it is")) {
        for (const bool fire : {false, true}) {
            if (!ImGui::Selectable(fire ? "fire" : "smoke")) continue;
            if (auto done = v.dress_volumes(fire ? volume::fire_look() : volume::smoke_look()); !done)
                v.message = done.error().message;
        }
        ImGui::EndCombo();
    }
}

void choose_split(Viewer& v) {
    ImGui::Checkbox("split", &v.split);
    if (!v.split) return;
    ImGui::SameLine();
    ImGui::Checkbox("difference", &v.difference);
    ImGui::SliderFloat("line", &v.split_at, 0, 1, "%.2f");
    choose_in_combo(v, 1);
}

void choose_motion(Viewer& v) {
    if (ImGui::Button(v.motion() == Viewer::Motion::playing ? "stop" : "fly the path")) v.play();
    ImGui::SameLine();
    if (ImGui::Button(v.motion() == Viewer::Motion::recording ? "end recording" : "record")) v.record();
    ImGui::SameLine();
    if (ImGui::Button("screenshot")) v.take_screenshot();
}

}  // namespace

void describe_panel(Viewer& v) {
    if (v.shows_help) describe_help(v);
    describe_baking(v);
    if (!v.shows_panel) return;
    // Its right edge stays where it is when it grows.
    ImGui::SetNextWindowPos({static_cast<float>(v.window().width()) - 10, 10}, ImGuiCond_FirstUseEver, {1, 0});
    ImGui::Begin("Lodestone", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(200);
    ImGui::Text("%s, %s%s", v.scene().scene.name.c_str(), v.renderer().device().name.c_str(),
                v.renderer().device().software ? " (software)" : "");
    if (!v.message.empty()) {
        ImGui::PushTextWrapPos(310);
        ImGui::TextUnformatted(v.message.c_str());
        ImGui::PopTextWrapPos();
    }
    choose_in_combo(v, 0);
    choose_error(v);
    choose_budget(v);
    choose_look(v);
    choose_volumes(v);
    choose_split(v);
    choose_motion(v);
    ImGui::Separator();
    describe_pane(v.panes[0]);
    if (v.split) {
        ImGui::Separator();
        ImGui::PushID("right");
        describe_pane(v.panes[1]);
        ImGui::PopID();
    }
    ImGui::PopItemWidth();
    ImGui::Text("device memory %.1f MiB; F1: keys", static_cast<double>(v.renderer().allocated_bytes()) / (1 << 20));
    ImGui::End();
}

}  // namespace lodestone
