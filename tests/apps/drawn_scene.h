// A scene that is ready to be drawn by any backend, under validation.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "apps/drawing/session.h"
#include "apps/program.h"
#include "fixtures/materials.h"
#include "mesh/io/write.h"

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
    // The still life of every kind of material, with smoke in it, lit from above.
    void make_still_life(uint32_t width, uint32_t height, const TriMesh& mesh = fixtures::still_life()) {
        ASSERT_TRUE(write_mesh(mesh, folder_ / "still.glb"));
        write_still_life("still.glb");
        make_ready("s.scene.json", width, height);
    }
    // file: of the mesh, or an asset.
    void write_still_life(const std::string& file) const {
        std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
            "assets": [{"name": "a", "file": ")" << file
                                                << R"("}], "light": {"direction": [-0.1, -0.9, 0.4]},
            "volumes": [{"position": [0.3, 0, 0.3], "spread": 0.8, "velocity": [0, 0, 0], "radius": [0.2, 0.4], "density": 3}],
            "volume_options": {"metavoxels": 8, "voxels": 16}})";
    }
    ReadyScene scene_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace lodestone
