// A scene that is ready to be drawn by any backend, under validation.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "apps/drawing/session.h"
#include "apps/program.h"

namespace lodestone {

class DrawnSceneTest : public ProgramTest {
protected:
    // file: of the scene, in the test's folder. change: to the scene, before it is made ready.
    void make_ready(
        const std::string& file, uint32_t width, uint32_t height,
        const std::function<void(Scene&)>& change = [](Scene&) {}) {
        auto scene = read_scene(folder_ / file);
        ASSERT_TRUE(scene) << scene.error().message;
        change(*scene);
        auto ready = ready_scene(std::move(*scene), {.vgi = Need::must}, {});
        ASSERT_TRUE(ready) << ready.error().message;
        scene_ = std::move(*ready);
        RendererOptions options;
        options.width = width;
        options.height = height;
        options.validation = true;
        auto made = Renderer::create(options);
        ASSERT_TRUE(made) << made.error().message;
        renderer_ = std::move(*made);
    }
    ReadyScene scene_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace lodestone
