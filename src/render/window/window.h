// A window on the screen: shows what a renderer drew, with Dear ImGui on top, and tells what keys and mouse did.
// Between poll() and present() the program may call ImGui to describe its panels. Needs a display.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/renderer.h"

namespace lodestone {

struct WindowOptions {
    std::string title = "Lodestone";
    uint32_t width = 1280, height = 720;  // pixels
};

// Letters and digits are their upper-case ASCII codes.
enum class Key : int { space = 32, escape = 256, tab = 258, home = 268, f1 = 290, f5 = 294, f12 = 301 };

// What of the panes is shown.
struct Composition {
    float split = 1;          // share of the width that shows pane 0; the rest shows pane 1
    bool difference = false;  // instead, where the panes differ, four times as bright
};

class Window {
public:
    static constexpr uint32_t most_panes = 2, most_turns = 3;

    // renderer: made with RendererOptions::presents; must outlive the window. One window at a time.
    static Result<std::unique_ptr<Window>> open(Renderer& renderer, const WindowOptions& options);
    virtual ~Window() = default;

    // Handles what happened since the last call and begins a frame of the overlay. False once the window is to close.
    virtual bool poll() = 0;
    virtual uint32_t width() const = 0;  // pixels; 0 while minimised
    virtual uint32_t height() const = 0;
    // Went down since the last poll, and no panel took it.
    virtual bool pressed(Key key) const = 0;
    virtual bool down(Key key) const = 0;
    virtual bool ctrl() const = 0;
    // Counts as pressed by the next poll: for demonstrations and tests.
    virtual void press(Key key) = 0;
    // Files dropped on the window since the last call.
    virtual std::vector<std::filesystem::path> take_dropped() = 0;

    // Copies the renderer's last picture into a pane. Neither this nor present() waits for it to be drawn, but for what
    // was shown `most_turns` times before.
    virtual Result<void> keep(uint32_t pane) = 0;
    // Shows the panes (pane 1 is pane 0 until it was kept) with the overlay on top; ends the overlay's frame.
    virtual Result<void> present(const Composition& composition) = 0;
    // What present() showed last, overlay included; depth is empty.
    virtual Result<Picture> read() = 0;
};

}  // namespace lodestone
