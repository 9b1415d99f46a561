// What a driver, a device or a display can do to a renderer and its window: always an error or a picture.
#include <cstdlib>
#include <filesystem>

#include "base/process/process.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "mesh/generate.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"
#include "render/device_test.h"
#include "render/vulkan_faults.h"
#include "render/window/window.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr uint32_t small_width = 96, small_height = 64;

std::unique_ptr<FrameSource> rock() {
    TriMesh mesh = generate(Shape::rock, 500, 1);
    EXPECT_TRUE(repair(mesh));
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    auto source = open_fixed_levels({full_level(pack_vertices(mesh), indices)}, uint64_t{1} << 30);
    EXPECT_TRUE(source);
    return std::move(*source);
}

FrameInput look(uint64_t frame) {
    Camera camera;
    camera.eye = {0, 0, 3};
    camera.near_plane = 0.05f;
    FrameInput input;
    input.views = {view_of(camera, small_width, small_height)};
    input.instances = {Instance{}};
    input.frame = frame;
    return input;
}

class RendererFaults : public DeviceTest {
protected:
    RendererFaults() : DeviceTest(small_width, small_height) {}
    void TearDown() override {
        inject("", VK_SUCCESS, 0);
        pretend(nullptr, nullptr);
        DeviceTest::TearDown();
    }
    static void fails(const Result<void>& result, const char* what) {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().fault, Fault::machine);
        EXPECT_THAT(result.error().message, HasSubstr(what));
        EXPECT_THAT(result.error().message, testing::Not(HasSubstr("\n")));
    }
    // The frame drawn, or why not.
    static Result<void> drawn(Renderer& renderer, FrameSource& source, uint64_t frame) {
        const FrameInput input = look(frame);
        return renderer.submit(source.plan(input), input, {});
    }
    // Of a source that is loaded; empty where that fails.
    static Picture first_picture(Renderer& renderer, FrameSource& source) {
        const Result<void> loaded = renderer.load(source.recipe(), plain());
        EXPECT_TRUE(loaded);
        EXPECT_TRUE(loaded && drawn(renderer, source, 0));
        auto picture = renderer.read_picture();
        EXPECT_TRUE(picture);
        return picture ? std::move(*picture) : Picture{};
    }
};

TEST_F(RendererFaults, ADeviceThatIsLostIsToldOfByEveryFunction) {
    Renderer& renderer = make();
    auto source = rock();
    ASSERT_TRUE(renderer.load(source->recipe(), plain()));
    inject("vkQueueSubmit2", VK_ERROR_DEVICE_LOST);
    fails(drawn(renderer, *source, 0), "device was lost");
    EXPECT_EQ(injected(), 1);
    EXPECT_EQ(*renderer.completed_frame(), 0u);
    // The device of this test is there again. Whoever planned is loaded anew.
    source = rock();
    ASSERT_TRUE(renderer.load(source->recipe(), plain()));
    ASSERT_TRUE(drawn(renderer, *source, 0));
    inject("vkGetFenceStatus", VK_ERROR_DEVICE_LOST);
    const auto completed = renderer.completed_frame();
    ASSERT_FALSE(completed) << "a fence that is never signalled would be waited for without end";
    EXPECT_THAT(completed.error().message, HasSubstr("device was lost"));
    inject("vkWaitForFences", VK_ERROR_DEVICE_LOST, 3);
    fails(renderer.wait(), "device was lost");
    EXPECT_FALSE(renderer.read_picture());
    EXPECT_FALSE(renderer.resize(small_width, small_height));
    inject("", VK_SUCCESS, 0);
    ASSERT_TRUE(renderer.wait());
    EXPECT_EQ(*renderer.completed_frame(), 1u);
    EXPECT_TRUE(renderer.read_picture());
}

// A renderer that cannot be made says so, and gives back what it has.
void fail_each_of(const char* call, VkResult result, const char* told) {
    ASSERT_EQ(device_allocations(), 0);
    RendererOptions options;
    options.width = small_width;
    options.height = small_height;
    int tried = 0;
    for (;; ++tried) {
        inject(call, result, 1, tried);
        const auto made = Renderer::create(options);
        if (injected() == 0) {
            EXPECT_TRUE(made);
            break;
        }
        ASSERT_FALSE(made);
        EXPECT_THAT(made.error().message, HasSubstr(told));
        EXPECT_EQ(device_allocations(), 0);
    }
    EXPECT_GT(tried, 0);
}

TEST_F(RendererFaults, MemoryThatCannotBeMappedOrHadIsGivenBack) {
    fail_each_of("vkMapMemory", VK_ERROR_MEMORY_MAP_FAILED, "vkMapMemory");
    EXPECT_EQ(device_allocations(), 0);
    fail_each_of("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory");
    EXPECT_EQ(device_allocations(), 0);
}

TEST_F(RendererFaults, EveryAllocationMayFail) {
    auto source = rock();
    RendererOptions options;
    options.width = small_width;
    options.height = small_height;
    for (int skipped = 0;; ++skipped) {
        auto made = Renderer::create(options);
        ASSERT_TRUE(made);
        Renderer& renderer = **made;
        inject("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, 1, skipped);
        Recipe large;
        large.buffers = {{"large", uint64_t{40} << 20, use_storage, 4}, {"more", uint64_t{40} << 20, use_storage, 4}};
        const Result<void> loaded = renderer.load(large, plain());
        if (injected() == 0) {
            EXPECT_TRUE(loaded);
            EXPECT_GT(skipped, 1);
            break;
        }
        fails(loaded, "out of device memory");
        EXPECT_EQ(renderer.loaded(0), 0u);
        // Nothing was there before, so nothing is there now; that is no crash.
        const FrameInput input = look(0);
        fails(renderer.submit(Plan{}, input, {}), "nothing to draw");
        ASSERT_TRUE(renderer.load(large, plain()));
    }
    EXPECT_EQ(device_allocations(), 0);
}

// After a size that there is no room for, the size before is drawn again.
TEST_F(RendererFaults, ASizeWithoutRoomIsToldOf) {
    Renderer& renderer = make();
    auto source = rock();
    const Picture before = first_picture(renderer, *source);
    int tried = 0;
    for (;; ++tried) {
        inject("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, 1, tried);
        // Smaller ones have room in what the renderer has.
        const Result<void> resized = renderer.resize(4096, 4096);
        if (injected() == 0) {
            EXPECT_TRUE(resized);
            break;
        }
        fails(resized, "out of device memory");
        inject("", VK_SUCCESS, 0);
        ASSERT_TRUE(renderer.resize(small_width, small_height));
        source = rock();
        EXPECT_EQ(first_picture(renderer, *source).colour, before.colour);
    }
    EXPECT_GT(tried, 0);
}

TEST_F(RendererFaults, WhatWasLoadedStaysWhereTheNextCannotBeBuilt) {
    Renderer& renderer = make();
    auto source = rock();
    const Picture before = first_picture(renderer, *source);
    const uint64_t loaded = renderer.loaded(0);
    Recipe broken = source->recipe();
    broken.generation += 7;
    broken.buffers.push_back({"another", 4096, use_storage, 4});
    broken.pipelines[0].vertex = "no/such/shader.vert";
    fails(renderer.load(broken, plain()), "no/such/shader.vert");
    EXPECT_EQ(renderer.loaded(0), loaded);
    ASSERT_TRUE(drawn(renderer, *source, 1));
    EXPECT_EQ(renderer.read_picture()->colour, before.colour);

    // Where there is no room for both, what was there goes first.
    Recipe large;
    large.buffers = {{"large", uint64_t{40} << 20, use_storage, 4}};
    inject("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, 1);
    ASSERT_TRUE(renderer.load(large, plain()));
    EXPECT_EQ(injected(), 1);
    EXPECT_NE(renderer.loaded(0), loaded);
    inject("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, 2);
    fails(renderer.load(large, plain()), "out of device memory");
    EXPECT_EQ(renderer.loaded(0), 0u);
}

TEST_F(RendererFaults, PipelinesAreMadeByTheFirstFrameThatHasThemOrBeforeIt) {
    Renderer& renderer = make();
    auto source = rock();
    const Picture before = first_picture(renderer, *source);
    inject("vkCreateGraphicsPipelines", VK_ERROR_OUT_OF_DEVICE_MEMORY, 100);
    ASSERT_TRUE(drawn(renderer, *source, 1));
    source = rock();
    ASSERT_TRUE(renderer.load(source->recipe(), plain()));
    EXPECT_EQ(injected(), 0) << "nothing is drawn yet";
    fails(renderer.prepare(), "out of device memory");
    fails(drawn(renderer, *source, 0), "out of device memory");

    inject("", VK_SUCCESS, 0);
    source = rock();
    ASSERT_TRUE(renderer.load(source->recipe(), plain()));
    ASSERT_TRUE(renderer.prepare());
    inject("vkCreateGraphicsPipelines", VK_ERROR_OUT_OF_DEVICE_MEMORY, 100);
    ASSERT_TRUE(drawn(renderer, *source, 0));
    EXPECT_EQ(renderer.read_picture()->colour, before.colour);
    // A debug view asks for others.
    const FrameInput input = look(1);
    ShadingOptions normals;
    normals.debug = DebugView::normal;
    fails(renderer.submit(source->plan(input), input, normals), "out of device memory");
    EXPECT_GT(injected(), 0);
}

TEST_F(RendererFaults, AFrameThatCannotBeRecordedLeavesNothingBehind) {
    Renderer& renderer = make();
    Recipe recipe;
    constexpr uint64_t bytes = uint64_t{40} << 20;
    recipe.buffers = {{"large", bytes, use_storage, 4}};
    ASSERT_TRUE(renderer.load(recipe, plain()));
    const std::vector<uint32_t> words{3, 1, 4, 1};
    const auto plan_of = [&](uint32_t tag) {
        Plan plan;
        plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(words.data(), words.size())}},
                         {Stage::update, Readback{0, 0, 16, tag}},
                         {Stage::update, Readback{0, 0, bytes, tag + 1}}};
        return plan;
    };
    FrameInput input = look(0);
    input.instances = {};
    inject("vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY);  // for the second readback
    fails(renderer.submit(plan_of(10), input, {}), "out of device memory");
    EXPECT_EQ(injected(), 1);
    for (uint64_t frame = 1; frame < 5; ++frame) {
        input.frame = frame;
        ASSERT_TRUE(renderer.submit(plan_of(20), input, {}));
    }
    ASSERT_TRUE(renderer.wait());
    const auto back = renderer.take_readbacks();
    ASSERT_EQ(back.size(), 8u);
    for (const ReadbackResult& r : back) {
        EXPECT_GE(r.tag, 20u);
        EXPECT_EQ(reinterpret_cast<const uint32_t*>(r.blob.data())[2], 4u);
    }
}

TEST_F(RendererFaults, ADriverThatCannotTellItsDevicesIsNoListOfNone) {
    inject("vkEnumeratePhysicalDevices", VK_ERROR_INITIALIZATION_FAILED);
    const auto devices = list_devices();
    ASSERT_FALSE(devices);
    EXPECT_THAT(devices.error().message, HasSubstr("vkEnumeratePhysicalDevices"));
    inject("vkEnumeratePhysicalDevices", VK_INCOMPLETE, 1, 1);
    EXPECT_TRUE(list_devices()) << "it is asked again";
}

// Needs a display.
class WindowFaults : public RendererFaults {
protected:
    void SetUp() override {
        if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display; WindowFaults.InADisplayOfTheirOwn has one";
        RendererFaults::SetUp();
        if (IsSkipped()) return;
        RendererOptions options;
        options.presents = true;
        Renderer& renderer = make(options);
        source_ = rock();
        ASSERT_TRUE(renderer.load(source_->recipe(), plain()));
        auto window = Window::open(renderer, {"test", small_width, small_height});
        ASSERT_TRUE(window) << window.error().message;
        window_ = std::move(*window);
        ASSERT_TRUE(shown());
        before_ = *window_->read();
    }
    void TearDown() override {
        window_.reset();
        RendererFaults::TearDown();
    }
    Result<void> shown() {
        window_->poll();
        if (auto done = drawn(*renderer_, *source_, frame_++); !done) return done;
        if (auto done = renderer_->wait(); !done) return done;
        if (auto done = window_->keep(0); !done) return done;
        return window_->present({});
    }
    // Injects, shows, and finds the same picture as ever, then and in the next frame.
    void goes_on(const char* call, VkResult result, int times) {
        SCOPED_TRACE(std::string(call) + " " + std::to_string(result) + " " + std::to_string(times));
        inject(call, result, times);
        for (int frame = 0; frame < 3; ++frame) {
            const auto done = shown();
            ASSERT_TRUE(done) << done.error().message;
            EXPECT_GT(injected(), 0);
            const auto picture = window_->read();
            ASSERT_TRUE(picture) << picture.error().message;
            EXPECT_EQ(picture->colour, before_.colour);
        }
    }
    std::unique_ptr<FrameSource> source_;
    std::unique_ptr<Window> window_;
    Picture before_;
    uint64_t frame_ = 0;
};

TEST_F(WindowFaults, GoesOnWhateverBecomesOfItsSwapchain) {
    for (const int times : {1, 2, 5}) {
        goes_on("vkAcquireNextImageKHR", VK_ERROR_OUT_OF_DATE_KHR, times);
        goes_on("vkAcquireNextImageKHR", VK_ERROR_SURFACE_LOST_KHR, times);
        goes_on("vkAcquireNextImageKHR", VK_TIMEOUT, times);
        goes_on("vkQueuePresentKHR", VK_ERROR_OUT_OF_DATE_KHR, times);
        goes_on("vkQueuePresentKHR", VK_SUBOPTIMAL_KHR, times);
        goes_on("vkQueuePresentKHR", VK_ERROR_SURFACE_LOST_KHR, times);
    }
}

TEST_F(WindowFaults, TakesOnlyWhatTheSurfaceHas) {
    const auto with = [&](Capabilities capabilities, Format format) {
        inject("vkQueuePresentKHR", VK_ERROR_OUT_OF_DATE_KHR);  // so that the next frame makes a swapchain
        EXPECT_TRUE(shown());
        pretend(capabilities, format);
        auto done = shown();
        pretend(nullptr, nullptr);
        return done;
    };
    // A window of size 0: nothing to show in, and what was drawn can be read all the same.
    EXPECT_TRUE(with([](VkSurfaceCapabilitiesKHR& can) { can.currentExtent = {0, 0}; }, nullptr));
    EXPECT_EQ(window_->read()->colour, before_.colour);
    fails(with([](VkSurfaceCapabilitiesKHR& can) { can.supportedUsageFlags = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT; },
               nullptr),
          "cannot be copied to");
    // Colours would be converted a second time.
    fails(with(nullptr, [](VkSurfaceFormatKHR& format) { format.format = VK_FORMAT_B8G8R8A8_SRGB; }),
          "none of the formats");
    EXPECT_TRUE(shown());
    EXPECT_EQ(window_->read()->colour, before_.colour);
}

TEST_F(WindowFaults, ALostDeviceIsAnErrorThatNamesIt) {
    inject("vkQueuePresentKHR", VK_ERROR_DEVICE_LOST);
    fails(shown(), "device was lost");
    inject("vkAcquireNextImageKHR", VK_ERROR_DEVICE_LOST);
    fails(shown(), "device was lost");
    inject("", VK_SUCCESS, 0);
    EXPECT_TRUE(shown());
}

// Those above, under a display that is made for them.
TEST(WindowFaultsDisplay, InADisplayOfTheirOwn) {
    if (std::getenv("DISPLAY") != nullptr) GTEST_SKIP() << "there is a display, and they have run there";
    if (std::system("command -v xvfb-run > /dev/null") != 0)
        GTEST_SKIP() << "no display; install xvfb to run this test";
    const std::string self = this_program()->string();
    // The file of who may use it: a folder that xvfb-run makes for one cannot always be taken away.
    const std::filesystem::path permissions = testing::TempDir() + "lodestone-display-" + std::to_string(getpid());
    const std::string command = "xvfb-run -a -f '" + permissions.string() + "' -s '-screen 0 800x600x24' '" + self +
                                "' --gtest_filter='WindowFaults.*'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    std::filesystem::remove(permissions);
}

}  // namespace
}  // namespace lodestone
