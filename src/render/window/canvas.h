// What a window shows before it is on the screen: panes with copies of pictures, put together, and an overlay on top.
#pragma once

#include <array>
#include <functional>

#include "render/renderer_access.h"
#include "render/window/window.h"

namespace lodestone {

using OwnedRenderPass = Owned<VkRenderPass, vkDestroyRenderPass>;
using OwnedFramebuffer = Owned<VkFramebuffer, vkDestroyFramebuffer>;

class Canvas {
public:
    explicit Canvas(const RendererAccess& access);

    // Records Window::keep. Waits for the device where the picture has another size.
    void keep(uint32_t pane, VkCommandBuffer commands);
    void resize(uint32_t width, uint32_t height);
    // Draws the panes and then what `overlay` records, inside the render pass; afterwards the image can be copied from.
    void record(VkCommandBuffer commands, const Composition& composition,
                const std::function<void(VkCommandBuffer)>& overlay);
    // What was drawn last, once the device is done with it.
    Picture read() const;

    const TargetImage& image() const { return image_; }  // sRGB values in a format that is not told so
    VkRenderPass pass() const { return pass_.get(); }
    VkDescriptorPool descriptors() const { return descriptors_.get(); }  // with room for an overlay's few

private:
    void make_pass();
    void make_sets();
    void make_pipeline();
    void make_pipeline_layout();
    void bind_panes();
    VkDevice device() const { return a_.device.handle(); }

    RendererAccess a_;
    OwnedRenderPass pass_;
    OwnedSampler sampler_;
    OwnedSetLayout set_layout_;
    OwnedDescriptorPool descriptors_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    OwnedPipelineLayout layout_;
    OwnedPipeline pipeline_;
    std::array<TargetImage, Window::most_panes> panes_;
    bool bound_ = false;  // the set tells of the panes
    TargetImage image_;
    OwnedFramebuffer framebuffer_;
};

}  // namespace lodestone
