#include "render/window/canvas.h"

#include <cstring>

#include "base/check.h"
#include "render/recipe_build.h"

namespace lodestone {

namespace {

constexpr VkFormat canvas_format = VK_FORMAT_R8G8B8A8_UNORM;

struct PresentConstants {
    float split;
    uint32_t difference;
};

// A triangle over the whole target, without vertices, blending or depth. Refers to itself, so it stays where it is.
struct FixedState {
    FixedState() {
        input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
        assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
        assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
        viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
        viewport.viewportCount = viewport.scissorCount = 1;
        raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
        raster.lineWidth = 1;
        multisample.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
        multisample.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
        attachment.colorWriteMask = 0xf;
        blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
        blend.attachmentCount = 1;
        blend.pAttachments = &attachment;
        dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
        dynamic.dynamicStateCount = 2;
        dynamic.pDynamicStates = dynamic_states.data();
    }
    FixedState(const FixedState&) = delete;
    FixedState& operator=(const FixedState&) = delete;

    std::array<VkDynamicState, 2> dynamic_states{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
    VkPipelineVertexInputStateCreateInfo input{};
    VkPipelineInputAssemblyStateCreateInfo assembly{};
    VkPipelineViewportStateCreateInfo viewport{};
    VkPipelineRasterizationStateCreateInfo raster{};
    VkPipelineMultisampleStateCreateInfo multisample{};
    VkPipelineColorBlendAttachmentState attachment{};
    VkPipelineColorBlendStateCreateInfo blend{};
    VkPipelineDynamicStateCreateInfo dynamic{};
};

}  // namespace

Canvas::Canvas(const RendererAccess& access) : a_(access) {
    make_pass();
    make_sets();
    make_pipeline();
}

void Canvas::make_pass() {
    // A render pass, as the overlay wants one.
    VkAttachmentDescription attachment{};
    attachment.format = canvas_format;
    attachment.samples = VK_SAMPLE_COUNT_1_BIT;
    attachment.loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    attachment.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    attachment.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    attachment.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
    attachment.finalLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const VkAttachmentReference reference{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = 1;
    subpass.pColorAttachments = &reference;
    const VkSubpassDependency around[] = {
        {VK_SUBPASS_EXTERNAL, 0, VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
         VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
         VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
         VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT, 0},
        {0, VK_SUBPASS_EXTERNAL, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
         VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT, VK_ACCESS_TRANSFER_READ_BIT, 0}};
    VkRenderPassCreateInfo pass_info{};
    pass_info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO;
    pass_info.attachmentCount = 1;
    pass_info.pAttachments = &attachment;
    pass_info.subpassCount = 1;
    pass_info.pSubpasses = &subpass;
    pass_info.dependencyCount = 2;
    pass_info.pDependencies = around;
    VkRenderPass pass = VK_NULL_HANDLE;
    LODE_VK(vkCreateRenderPass(device(), &pass_info, nullptr, &pass));
    pass_ = OwnedRenderPass(device(), pass);
}

void Canvas::make_sets() {
    VkSamplerCreateInfo sampler_info{};
    sampler_info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
    sampler_info.addressModeU = sampler_info.addressModeV = sampler_info.addressModeW =
        VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    VkSampler sampler = VK_NULL_HANDLE;
    LODE_VK(vkCreateSampler(device(), &sampler_info, nullptr, &sampler));
    sampler_ = OwnedSampler(device(), sampler);
    const VkDescriptorSetLayoutBinding binding{0, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, Window::most_panes,
                                               VK_SHADER_STAGE_FRAGMENT_BIT, nullptr};
    VkDescriptorSetLayoutCreateInfo set_info{};
    set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    set_info.bindingCount = 1;
    set_info.pBindings = &binding;
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorSetLayout(device(), &set_info, nullptr, &set_layout));
    set_layout_ = OwnedSetLayout(device(), set_layout);
    // Our set, and the overlay's one of its font.
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, Window::most_panes + 4};
    VkDescriptorPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool_info.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    pool_info.maxSets = 5;
    pool_info.poolSizeCount = 1;
    pool_info.pPoolSizes = &size;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorPool(device(), &pool_info, nullptr, &pool));
    descriptors_ = OwnedDescriptorPool(device(), pool);
    VkDescriptorSetAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocate.descriptorPool = pool;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    LODE_VK(vkAllocateDescriptorSets(device(), &allocate, &set_));
}

void Canvas::make_pipeline() {
    make_pipeline_layout();
    const OwnedShader vertex = make_shader(a_.device, "window/present.vert"),
                      fragment = make_shader(a_.device, "window/present.frag");
    std::array<VkPipelineShaderStageCreateInfo, 2> stages{};
    for (size_t i = 0; i < 2; ++i) {
        stages[i].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        stages[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
        stages[i].module = i == 0 ? vertex.get() : fragment.get();
        stages[i].pName = "main";
    }
    const FixedState fixed;
    VkGraphicsPipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
    info.stageCount = 2;
    info.pStages = stages.data();
    info.pVertexInputState = &fixed.input;
    info.pInputAssemblyState = &fixed.assembly;
    info.pViewportState = &fixed.viewport;
    info.pRasterizationState = &fixed.raster;
    info.pMultisampleState = &fixed.multisample;
    info.pColorBlendState = &fixed.blend;
    info.pDynamicState = &fixed.dynamic;
    info.layout = layout_.get();
    info.renderPass = pass_.get();
    VkPipeline pipeline = VK_NULL_HANDLE;
    LODE_VK(vkCreateGraphicsPipelines(device(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
    pipeline_ = OwnedPipeline(device(), pipeline);
}

void Canvas::make_pipeline_layout() {
    const VkDescriptorSetLayout set_layout = set_layout_.get();
    const VkPushConstantRange push{VK_SHADER_STAGE_FRAGMENT_BIT, 0, sizeof(PresentConstants)};
    VkPipelineLayoutCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    info.setLayoutCount = 1;
    info.pSetLayouts = &set_layout;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &push;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    LODE_VK(vkCreatePipelineLayout(device(), &info, nullptr, &layout));
    layout_ = OwnedPipelineLayout(device(), layout);
}

void Canvas::keep(uint32_t pane, VkCommandBuffer commands) {
    LODE_CHECK(pane < Window::most_panes, pane);
    const ImageSpec& from = a_.targets.colour.spec();
    if (panes_[pane].get() == VK_NULL_HANDLE || panes_[pane].spec().width != from.width ||
        panes_[pane].spec().height != from.height) {
        LODE_VK(vkDeviceWaitIdle(device()));
        panes_[pane] = {};
        // The same bits, not told to be sRGB: what is shown is what is stored.
        panes_[pane] = TargetImage(a_.allocator,
                                   {canvas_format, from.width, from.height, 1, 1,
                                    VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT},
                                   "pane");
        bound_ = false;
    }
    change_use(commands, a_.targets.colour, a_.colour_use, as_copy_source);
    a_.colour_use = as_copy_source;
    // What was shown last may still be read.
    change_use(commands, panes_[pane], {VK_IMAGE_LAYOUT_UNDEFINED, as_sampled.stages, VK_ACCESS_2_NONE},
               as_copy_destination);
    VkImageCopy region{};
    region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.extent = {from.width, from.height, 1};
    vkCmdCopyImage(commands, a_.targets.colour.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, panes_[pane].get(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    change_use(commands, panes_[pane], as_copy_destination, as_sampled);
}

void Canvas::resize(uint32_t width, uint32_t height) {
    framebuffer_ = {};
    image_ = {};
    image_ = TargetImage(
        a_.allocator,
        {canvas_format, width, height, 1, 1, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT},
        "canvas");
    VkFramebufferCreateInfo framebuffer_info{};
    framebuffer_info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
    framebuffer_info.renderPass = pass_.get();
    framebuffer_info.attachmentCount = 1;
    const VkImageView view = image_.view();
    framebuffer_info.pAttachments = &view;
    framebuffer_info.width = width;
    framebuffer_info.height = height;
    framebuffer_info.layers = 1;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
    LODE_VK(vkCreateFramebuffer(device(), &framebuffer_info, nullptr, &framebuffer));
    framebuffer_ = OwnedFramebuffer(device(), framebuffer);
}

void Canvas::bind_panes() {
    if (bound_) return;
    std::array<VkDescriptorImageInfo, Window::most_panes> images{};
    for (uint32_t p = 0; p < Window::most_panes; ++p) {
        const TargetImage& pane = panes_[p].get() != VK_NULL_HANDLE ? panes_[p] : panes_[0];
        images[p] = {sampler_.get(), pane.view(), VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    }
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set_;
    write.descriptorCount = Window::most_panes;
    write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    write.pImageInfo = images.data();
    vkUpdateDescriptorSets(device(), 1, &write, 0, nullptr);
    bound_ = true;
}

void Canvas::record(VkCommandBuffer commands, const Composition& composition,
                    const std::function<void(VkCommandBuffer)>& overlay) {
    bind_panes();
    const VkExtent2D extent{image_.spec().width, image_.spec().height};
    VkRenderPassBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
    begin.renderPass = pass_.get();
    begin.framebuffer = framebuffer_.get();
    begin.renderArea = {{0, 0}, extent};
    vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
    const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
    const VkRect2D scissor{{0, 0}, extent};
    vkCmdSetViewport(commands, 0, 1, &viewport);
    vkCmdSetScissor(commands, 0, 1, &scissor);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_.get(), 0, 1, &set_, 0, nullptr);
    const PresentConstants constants{composition.split, composition.difference ? 1u : 0u};
    vkCmdPushConstants(commands, layout_.get(), VK_SHADER_STAGE_FRAGMENT_BIT, 0, sizeof constants, &constants);
    vkCmdDraw(commands, 3, 1, 0, 0);
    overlay(commands);
    vkCmdEndRenderPass(commands);
}

Picture Canvas::read() const {
    Picture picture{image_.spec().width, image_.spec().height, {}, {}};
    const VkDeviceSize bytes = VkDeviceSize{4} * picture.width * picture.height;
    const Buffer landing(a_.allocator, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::readback, "canvas");
    a_.pool.run([&](VkCommandBuffer commands) {
        VkBufferImageCopy region{};
        region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.imageExtent = {picture.width, picture.height, 1};
        vkCmdCopyImageToBuffer(commands, image_.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, landing.get(), 1, &region);
        memory_barrier(commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                       VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
    });
    picture.colour.resize(bytes);
    std::memcpy(picture.colour.data(), landing.mapped(), bytes);
    return picture;
}

}  // namespace lodestone
