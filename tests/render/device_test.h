// A renderer on whatever device is there, under validation, which must have stayed silent when a test ends.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "render/renderer.h"

namespace lodestone {

// The materials of a mesh without any.
inline MaterialSet plain() { return {{Material{}}, {}}; }

class DeviceTest : public testing::Test {
protected:
    DeviceTest(uint32_t width, uint32_t height) : width_(width), height_(height) {}

    void SetUp() override {
        const auto devices = list_devices();
        if (!devices || devices->empty())
            GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    }
    void TearDown() override {
        if (renderer_ != nullptr) { EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty()); }
    }
    Renderer& make(RendererOptions options = {}) {
        options.width = width_;
        options.height = height_;
        options.shadow_size = 512;
        options.validation = true;
        auto made = Renderer::create(options);
        EXPECT_TRUE(made) << made.error().message;
        renderer_ = std::move(*made);
        return *renderer_;
    }

    uint32_t width_, height_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace lodestone
