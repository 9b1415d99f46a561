// Backends, ways, sizes, budgets and scenes that change at random, frame after frame, under Vulkan validation with
// synchronisation checks: nothing is reported, and what is held stays what it was. LODESTONE_SOAK: frames (240 unless
// set); LODESTONE_SOAK_SEED: of the random choices (1).
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <link.h>
#include <malloc.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/drawing/session.h"
#include "apps/drawing/stage.h"
#include "base/random.h"
#include "base/sanitized.h"
#if LODE_SANITIZED
// Of the sanitizers' runtime. GCC has no header that declares it.
extern "C" size_t __sanitizer_get_current_allocated_bytes();  // NOLINT
#endif

namespace lodestone {
namespace {

namespace fs = std::filesystem;

uint64_t number_given(const char* name, uint64_t otherwise) {
    const char* given = std::getenv(name);
    return given != nullptr ? static_cast<uint64_t>(std::atoll(given)) : otherwise;
}

// What a program may leak.
struct Held {
    uint64_t bytes = 0;      // of the heap
    size_t descriptors = 0;  // of files
    size_t threads = 0;
    uint64_t device_bytes = 0;  // Renderer::allocated_bytes
};
size_t entries(const char* folder) {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}
Held held_now(const Renderer& renderer) {
    Held held;
#if LODE_SANITIZED
    held.bytes = __sanitizer_get_current_allocated_bytes();
#else
    const auto heap = mallinfo2();
    held.bytes = heap.uordblks + heap.hblkhd;
#endif
    held.descriptors = entries("/proc/self/fd");
    held.threads = entries("/proc/self/task");
    held.device_bytes = renderer.allocated_bytes();
    return held;
}

// Drivers and layers stay where they are to the end, so that the leak sanitizer can tell their leaks by the library.
void keep_libraries() {
    std::vector<std::string> names;
    const auto add = [](dl_phdr_info* library, size_t, void* to) {
        static_cast<std::vector<std::string>*>(to)->emplace_back(library->dlpi_name);
        return 0;
    };
    dl_iterate_phdr(add, &names);
    // One more handle to each, which nothing closes.
    for (const std::string& name : names) dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE);
}

// Small scenes of every kind: one thing, many things, materials of two assets, no shadows.
std::vector<fs::path> write_scenes(const fs::path& folder) {
    const std::string rock = R"({"name": "rock", "generate": {"shape": "rock", "triangles": 3000, "seed": 3}})",
                      cliff = R"({"name": "cliff", "generate": {"shape": "cliff", "triangles": 2000, "seed": 2}})";
    const auto write = [&](const std::string& name, const std::string& assets, const std::string& instances,
                           const char* shadows) {
        const fs::path path = folder / (name + ".scene.json");
        std::ofstream(path) << R"({"lodestone": "scene", "version": 1, "assets": [)" << assets << R"(], "instances": [)"
                            << instances << R"(], "light": {"shadows": )" << shadows << "}}";
        return path;
    };
    std::string many;
    for (int i = 0; i < 12; ++i) {
        many += (i > 0 ? ", " : "") + std::string(R"({"asset": ")") + (i % 3 == 0 ? "cliff" : "rock") +
                R"(", "position": [)" + std::to_string(i % 4 * 3) + ", 0, " + std::to_string(i / 4 * 3) + "]}";
    }
    return {write("one", rock, R"({"asset": "rock"})", "true"), write("open", cliff, R"({"asset": "cliff"})", "false"),
            write("many", rock + ", " + cliff, many, "true")};
}

class Soak : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_soak_" + std::to_string(getpid()));
        fs::create_directories(folder_);
        setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
        for (const fs::path& path : write_scenes(folder_)) {
            auto scene = read_scene(path);
            ASSERT_TRUE(scene) << scene.error().message;
            auto ready = ready_scene(std::move(*scene), needs_of(backend_names()), {});
            ASSERT_TRUE(ready) << ready.error().message;
            scenes_.push_back(std::make_unique<ReadyScene>(std::move(*ready)));
        }
        RendererOptions options;
        options.width = 64;
        options.height = 48;
        options.validation = true;
        auto made = Renderer::create(options);
        ASSERT_TRUE(made) << made.error().message;
        renderer_ = std::move(*made);
        keep_libraries();
    }
    void TearDown() override {
        for (auto& session : sessions_) session.reset();
        renderer_.reset();
        fs::remove_all(folder_);
    }

    bool chance(uint32_t in) { return random_.below(in) == 0; }

    void open_session(uint32_t place) {
        const auto backends = backend_names();
        const ReadyScene& scene = *scenes_[random_.below(static_cast<uint32_t>(scenes_.size()))];
        const auto ways = techniques_of(backends[random_.below(static_cast<uint32_t>(backends.size()))], scene);
        const Technique& way = ways[random_.below(static_cast<uint32_t>(ways.size()))];
        scene_of_[place] = &scene;
        SCOPED_TRACE(way.backend + " " + way.order + " " + way.raster);
        // Sometimes the old one goes first, sometimes the new one takes its place.
        if (chance(2)) sessions_[place].reset();
        auto opened = DrawSession::open(scene, *renderer_, way, chance(4), {}, place);
        ASSERT_TRUE(opened) << opened.error().message;
        sessions_[place] = std::move(*opened);
    }

    void change_something(uint32_t place) {
        if (sessions_[place] == nullptr || chance(20)) open_session(place);
        if (testing::Test::HasFatalFailure()) return;
        if (chance(30)) {
            width_ = 16 + random_.below(120);
            height_ = 16 + random_.below(90);
            ASSERT_TRUE(renderer_->resize(width_, height_));
        }
        if (chance(10)) budget_.pixel_error = std::pow(2.0, random_.uniform(-3, 5));
        if (chance(15)) budget_.max_triangles = chance(2) ? ~uint64_t{0} : 100 + random_.below(5000);
        if (chance(15)) budget_.upload_bytes = chance(2) ? ~uint64_t{0} : uint64_t{1} << (10 + random_.below(12));
        if (chance(15)) budget_.forced_level = chance(2) ? -1 : static_cast<int64_t>(random_.below(8));
        DrawSession& session = *sessions_[place];
        if (chance(12)) {
            const auto choices = debug_choices();
            session.look.debug = choices[random_.below(static_cast<uint32_t>(choices.size()))].view;
            if (session.mirror() == nullptr && session.look.debug == DebugView::misses)
                session.look.debug = DebugView::none;
        }
        const Sphere& bounds = scene_of_[place]->bounds;
        if (chance(6)) {
            const auto at = [&] { return static_cast<float>(random_.uniform(-3, 3)) * bounds.radius; };
            camera_ = usual_camera(*scene_of_[place]);
            camera_.eye = bounds.centre + glm::vec3(at(), at(), at());
        } else {
            camera_.eye += (camera_.target - camera_.eye) * 0.01f;
        }
        if (chance(25)) {
            const bool has_drawn = session.view().focal_px > 0;
            session.frozen_levels = chance(2) && has_drawn ? std::optional(session.view()) : std::nullopt;
        }
    }

    // All sessions closed.
    Held at_rest() {
        for (auto& session : sessions_) session.reset();
        const MaterialSet plain{{Material{}}, {}};
        for (uint32_t place = 0; place < Renderer::most_places; ++place) EXPECT_TRUE(renderer_->load({}, plain, place));
        width_ = 64;
        height_ = 48;
        EXPECT_TRUE(renderer_->resize(width_, height_));
        EXPECT_TRUE(renderer_->trim());
        return held_now(*renderer_);
    }

    fs::path folder_;
    std::vector<std::unique_ptr<ReadyScene>> scenes_;
    std::unique_ptr<Renderer> renderer_;
    std::array<std::unique_ptr<DrawSession>, 2> sessions_;
    std::array<const ReadyScene*, 2> scene_of_{};
    Random random_{number_given("LODESTONE_SOAK_SEED", 1)};
    uint32_t width_ = 64, height_ = 48;
    Budget budget_;
    Camera camera_;
};

TEST_F(Soak, WhatIsHeldStaysWhatItWas) {
    const uint64_t frames = number_given("LODESTONE_SOAK", 240), epochs = 6;
    std::vector<Held> held;
    for (uint64_t frame = 0; frame < frames; ++frame) {
        const uint32_t place = chance(4) ? 1 : 0;
        SCOPED_TRACE("frame " + std::to_string(frame));
        change_something(place);
        if (HasFatalFailure()) return;
        const auto drawn = sessions_[place]->draw(camera_, budget_, width_, height_);
        ASSERT_TRUE(drawn) << drawn.error().message;
        if (chance(8)) { ASSERT_TRUE(renderer_->read_picture()); }
        if (chance(16)) {
            const auto valid = sessions_[place]->source().validate();
            ASSERT_TRUE(valid) << valid.error().message;
        }
        if ((frame + 1) % (frames / epochs) == 0) held.push_back(at_rest());
    }
    EXPECT_TRUE(renderer_->validation_messages().empty()) << renderer_->validation_messages().front();
    ASSERT_GE(held.size(), 3u);
    // In the first epochs drivers and pools of threads take what they keep.
    const Held &early = held[held.size() / 2], &late = held.back();
    for (const Held& h : held) {
        std::printf("heap %.1f MiB, device %.1f MiB, %zu descriptors, %zu threads\n",
                    static_cast<double>(h.bytes) / (1 << 20), static_cast<double>(h.device_bytes) / (1 << 20),
                    h.descriptors, h.threads);
    }
    EXPECT_LE(late.bytes, early.bytes + early.bytes / 20 + (uint64_t{4} << 20));
    EXPECT_LE(late.device_bytes, early.device_bytes);
    EXPECT_LE(late.descriptors, early.descriptors);
    EXPECT_LE(late.threads, early.threads);
}

}  // namespace
}  // namespace lodestone
