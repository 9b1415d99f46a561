#include "render/window.h"

// GLFW must come after Vulkan's header, which vulkan.h includes.
#include "render/surface.h"
//
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>

#include "base/check.h"
#include "render/recipe_build.h"
#include "render/renderer_access.h"

namespace lodestone {

std::vector<const char*> surface_extensions() {
    if (glfwInit() != GLFW_TRUE)
        throw VulkanFailure("no window can be opened: there is no display; set DISPLAY, or run under xvfb-run");
    static const int at_exit = std::atexit(glfwTerminate);
    static_cast<void>(at_exit);
    uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    if (names == nullptr) throw VulkanFailure("no window can be opened: the Vulkan driver cannot draw to this display");
    return {names, names + count};
}

namespace {

constexpr VkFormat canvas_format = VK_FORMAT_R8G8B8A8_UNORM;

struct Destroy {
    void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

using OwnedSemaphore = Owned<VkSemaphore, vkDestroySemaphore>;
using OwnedRenderPass = Owned<VkRenderPass, vkDestroyRenderPass>;
using OwnedFramebuffer = Owned<VkFramebuffer, vkDestroyFramebuffer>;
using OwnedSwapchain = Owned<VkSwapchainKHR, vkDestroySwapchainKHR>;

// Of a window; destroyed before it.
class OwnedSurface {
public:
    OwnedSurface(VkInstance instance, GLFWwindow* window) : instance_(instance) {
        LODE_VK(glfwCreateWindowSurface(instance, window, nullptr, &surface_));
    }
    OwnedSurface(const OwnedSurface&) = delete;
    OwnedSurface& operator=(const OwnedSurface&) = delete;
    ~OwnedSurface() { vkDestroySurfaceKHR(instance_, surface_, nullptr); }
    VkSurfaceKHR get() const { return surface_; }

private:
    VkInstance instance_;
    VkSurfaceKHR surface_ = VK_NULL_HANDLE;
};

struct PresentConstants {
    float split;
    uint32_t difference;
};

class VulkanWindow final : public Window {
public:
    VulkanWindow(Renderer& renderer, const WindowOptions& options) : a_(renderer.access()) {
        glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
        window_.reset(glfwCreateWindow(static_cast<int>(options.width), static_cast<int>(options.height),
                                       options.title.c_str(), nullptr, nullptr));
        if (window_ == nullptr) throw VulkanFailure("no window can be opened on this display");
        glfwSetWindowUserPointer(window_.get(), this);
        glfwSetKeyCallback(window_.get(), [](GLFWwindow* w, int key, int, int action, int) {
            if (action == GLFW_PRESS) self(w).went_down_.insert(key);
        });
        glfwSetDropCallback(window_.get(), [](GLFWwindow* w, int count, const char** paths) {
            for (int i = 0; i < count; ++i) self(w).dropped_.emplace_back(paths[i]);
        });
        surface_.emplace(a_.device.instance(), window_.get());
        VkBool32 supported = VK_FALSE;
        LODE_VK(vkGetPhysicalDeviceSurfaceSupportKHR(a_.device.physical(), a_.device.queue_family(), surface_->get(),
                                                     &supported));
        if (supported == VK_FALSE) throw VulkanFailure(a_.device.info().name + " cannot show pictures on this display");
        make_pipeline();
        make_swapchain();
        start_overlay();
    }
    ~VulkanWindow() override {
        vkDeviceWaitIdle(device());
        if (overlay_) {
            ImGui_ImplVulkan_Shutdown();
            ImGui_ImplGlfw_Shutdown();
            ImGui::DestroyContext();
        }
    }

    bool poll() override {
        went_down_.clear();
        for (const int key : std::exchange(to_press_, {})) went_down_.insert(key);
        glfwPollEvents();
        ImGui_ImplVulkan_NewFrame();
        ImGui_ImplGlfw_NewFrame();
        ImGui::NewFrame();
        return glfwWindowShouldClose(window_.get()) == GLFW_FALSE;
    }
    uint32_t width() const override { return framebuffer_size().first; }
    uint32_t height() const override { return framebuffer_size().second; }
    bool pressed(Key key) const override {
        return went_down_.contains(static_cast<int>(key)) && !ImGui::GetIO().WantTextInput;
    }
    bool down(Key key) const override {
        return glfwGetKey(window_.get(), static_cast<int>(key)) == GLFW_PRESS && !ImGui::GetIO().WantTextInput;
    }
    bool ctrl() const override { return ImGui::GetIO().KeyCtrl; }
    void press(Key key) override { to_press_.push_back(static_cast<int>(key)); }
    std::vector<std::filesystem::path> take_dropped() override { return std::exchange(dropped_, {}); }

    Result<void> keep(uint32_t pane) override {
        return guarded([&] {
            LODE_CHECK(pane < most_panes, pane);
            const ImageSpec& from = a_.targets.colour.spec();
            if (panes_[pane].get() == VK_NULL_HANDLE || panes_[pane].spec().width != from.width ||
                panes_[pane].spec().height != from.height) {
                panes_[pane] = {};
                // The same bits, not told to be sRGB: what is shown is what is stored.
                panes_[pane] = TargetImage(a_.allocator,
                                           {canvas_format, from.width, from.height, 1, 1,
                                            VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT},
                                           "pane");
                bound_ = false;
            }
            a_.pool.run([&](VkCommandBuffer commands) {
                change_use(commands, a_.targets.colour, a_.colour_use, as_copy_source);
                a_.colour_use = as_copy_source;
                change_use(commands, panes_[pane], {}, as_copy_destination);
                VkImageCopy region{};
                region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
                region.extent = {from.width, from.height, 1};
                vkCmdCopyImage(commands, a_.targets.colour.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                               panes_[pane].get(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
                change_use(commands, panes_[pane], as_copy_destination, as_sampled);
            });
        });
    }

    Result<void> present(const Composition& composition) override {
        return guarded([&] {
            ImGui::Render();
            const auto [width, height] = framebuffer_size();
            if (width == 0 || height == 0) return;  // minimised
            LODE_CHECK(panes_[0].get() != VK_NULL_HANDLE);
            if (canvas_.spec().width != width || canvas_.spec().height != height) make_swapchain();
            uint32_t image = 0;
            VkResult got =
                vkAcquireNextImageKHR(device(), swapchain_.get(), UINT64_MAX, acquired_.get(), VK_NULL_HANDLE, &image);
            if (got == VK_ERROR_OUT_OF_DATE_KHR) {
                make_swapchain();
                got = vkAcquireNextImageKHR(device(), swapchain_.get(), UINT64_MAX, acquired_.get(), VK_NULL_HANDLE,
                                            &image);
            }
            if (got != VK_SUBOPTIMAL_KHR) vulkan_check(got, "vkAcquireNextImageKHR");
            bind_panes();
            CommandPool::begin(commands_);
            draw_canvas(composition);
            show(images_[image]);
            submit(image);
            VkPresentInfoKHR info{};
            info.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
            info.waitSemaphoreCount = 1;
            const VkSemaphore drawn = drawn_[image].get();
            info.pWaitSemaphores = &drawn;
            info.swapchainCount = 1;
            const VkSwapchainKHR swapchain = swapchain_.get();
            info.pSwapchains = &swapchain;
            info.pImageIndices = &image;
            const VkResult shown = vkQueuePresentKHR(a_.device.queue(), &info);
            if (shown == VK_ERROR_OUT_OF_DATE_KHR || shown == VK_SUBOPTIMAL_KHR) {
                make_swapchain();
            } else {
                vulkan_check(shown, "vkQueuePresentKHR");
            }
            presented_ = true;
        });
    }

    Result<Picture> read() override {
        return guarded([&] {
            LODE_CHECK(presented_);
            Picture picture{canvas_.spec().width, canvas_.spec().height, {}, {}};
            const VkDeviceSize bytes = VkDeviceSize{4} * picture.width * picture.height;
            const Buffer landing(a_.allocator, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::readback, "canvas");
            a_.pool.run([&](VkCommandBuffer commands) {
                VkBufferImageCopy region{};
                region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
                region.imageExtent = {picture.width, picture.height, 1};
                vkCmdCopyImageToBuffer(commands, canvas_.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, landing.get(), 1,
                                       &region);
                memory_barrier(commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                               VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
            });
            picture.colour.resize(bytes);
            std::memcpy(picture.colour.data(), landing.mapped(), bytes);
            return picture;
        });
    }

private:
    static VulkanWindow& self(GLFWwindow* window) {
        return *static_cast<VulkanWindow*>(glfwGetWindowUserPointer(window));
    }
    VkDevice device() const { return a_.device.handle(); }
    std::pair<uint32_t, uint32_t> framebuffer_size() const {
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_.get(), &width, &height);
        return {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
    }

    void make_pipeline() {
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

        VkSamplerCreateInfo sampler_info{};
        sampler_info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
        sampler_info.addressModeU = sampler_info.addressModeV = sampler_info.addressModeW =
            VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
        VkSampler sampler = VK_NULL_HANDLE;
        LODE_VK(vkCreateSampler(device(), &sampler_info, nullptr, &sampler));
        sampler_ = OwnedSampler(device(), sampler);
        const VkDescriptorSetLayoutBinding binding{0, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, most_panes,
                                                   VK_SHADER_STAGE_FRAGMENT_BIT, nullptr};
        VkDescriptorSetLayoutCreateInfo set_info{};
        set_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
        set_info.bindingCount = 1;
        set_info.pBindings = &binding;
        VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
        LODE_VK(vkCreateDescriptorSetLayout(device(), &set_info, nullptr, &set_layout));
        set_layout_ = OwnedSetLayout(device(), set_layout);
        // Our set, and the overlay's one of its font.
        const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, most_panes + 4};
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

        const VkPushConstantRange push{VK_SHADER_STAGE_FRAGMENT_BIT, 0, sizeof(PresentConstants)};
        VkPipelineLayoutCreateInfo layout_info{};
        layout_info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
        layout_info.setLayoutCount = 1;
        layout_info.pSetLayouts = &set_layout;
        layout_info.pushConstantRangeCount = 1;
        layout_info.pPushConstantRanges = &push;
        VkPipelineLayout layout = VK_NULL_HANDLE;
        LODE_VK(vkCreatePipelineLayout(device(), &layout_info, nullptr, &layout));
        layout_ = OwnedPipelineLayout(device(), layout);

        const OwnedShader vertex = make_shader(a_.device, "window/present.vert"),
                          fragment = make_shader(a_.device, "window/present.frag");
        std::array<VkPipelineShaderStageCreateInfo, 2> stages{};
        for (size_t i = 0; i < 2; ++i) {
            stages[i].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
            stages[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
            stages[i].module = i == 0 ? vertex.get() : fragment.get();
            stages[i].pName = "main";
        }
        VkPipelineVertexInputStateCreateInfo input{};
        input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
        VkPipelineInputAssemblyStateCreateInfo assembly{};
        assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
        assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
        VkPipelineViewportStateCreateInfo viewport{};
        viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
        viewport.viewportCount = viewport.scissorCount = 1;
        VkPipelineRasterizationStateCreateInfo raster{};
        raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
        raster.lineWidth = 1;
        VkPipelineMultisampleStateCreateInfo multisample{};
        multisample.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
        multisample.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
        VkPipelineColorBlendAttachmentState blend_attachment{};
        blend_attachment.colorWriteMask = 0xf;
        VkPipelineColorBlendStateCreateInfo blend{};
        blend.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
        blend.attachmentCount = 1;
        blend.pAttachments = &blend_attachment;
        const VkDynamicState dynamic_states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
        VkPipelineDynamicStateCreateInfo dynamic{};
        dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
        dynamic.dynamicStateCount = 2;
        dynamic.pDynamicStates = dynamic_states;
        VkGraphicsPipelineCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
        info.stageCount = 2;
        info.pStages = stages.data();
        info.pVertexInputState = &input;
        info.pInputAssemblyState = &assembly;
        info.pViewportState = &viewport;
        info.pRasterizationState = &raster;
        info.pMultisampleState = &multisample;
        info.pColorBlendState = &blend;
        info.pDynamicState = &dynamic;
        info.layout = layout;
        info.renderPass = pass;
        VkPipeline pipeline = VK_NULL_HANDLE;
        LODE_VK(vkCreateGraphicsPipelines(device(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
        pipeline_ = OwnedPipeline(device(), pipeline);

        commands_ = a_.pool.allocate();
        VkFenceCreateInfo fence_info{};
        fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
        VkFence fence = VK_NULL_HANDLE;
        LODE_VK(vkCreateFence(device(), &fence_info, nullptr, &fence));
        fence_ = OwnedFence(device(), fence);
        acquired_ = make_semaphore();
    }

    OwnedSemaphore make_semaphore() const {
        VkSemaphoreCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
        VkSemaphore semaphore = VK_NULL_HANDLE;
        LODE_VK(vkCreateSemaphore(device(), &info, nullptr, &semaphore));
        return {device(), semaphore};
    }

    // Swapchain and canvas of the window's size.
    void make_swapchain() {
        LODE_VK(vkDeviceWaitIdle(device()));
        VkSurfaceCapabilitiesKHR can{};
        LODE_VK(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(a_.device.physical(), surface_->get(), &can));
        uint32_t count = 0;
        LODE_VK(vkGetPhysicalDeviceSurfaceFormatsKHR(a_.device.physical(), surface_->get(), &count, nullptr));
        std::vector<VkSurfaceFormatKHR> formats(count);
        LODE_VK(vkGetPhysicalDeviceSurfaceFormatsKHR(a_.device.physical(), surface_->get(), &count, formats.data()));
        LODE_CHECK(!formats.empty());
        // Values are sRGB already, so they must not be converted.
        const auto plain = std::ranges::find_if(formats, [](const VkSurfaceFormatKHR& f) {
            return f.format == VK_FORMAT_B8G8R8A8_UNORM || f.format == VK_FORMAT_R8G8B8A8_UNORM;
        });
        const VkSurfaceFormatKHR format = plain != formats.end() ? *plain : formats[0];
        auto [width, height] = framebuffer_size();
        width = std::clamp(std::max(width, 1u), can.minImageExtent.width, can.maxImageExtent.width);
        height = std::clamp(std::max(height, 1u), can.minImageExtent.height, can.maxImageExtent.height);
        VkSwapchainCreateInfoKHR info{};
        info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
        info.surface = surface_->get();
        info.minImageCount = std::max(2u, can.minImageCount);
        info.imageFormat = format.format;
        info.imageColorSpace = format.colorSpace;
        info.imageExtent = {width, height};
        info.imageArrayLayers = 1;
        info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
        info.preTransform = can.currentTransform;
        info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
        info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
        info.clipped = VK_TRUE;
        info.oldSwapchain = swapchain_.get();
        VkSwapchainKHR swapchain = VK_NULL_HANDLE;
        LODE_VK(vkCreateSwapchainKHR(device(), &info, nullptr, &swapchain));
        swapchain_ = OwnedSwapchain(device(), swapchain);
        LODE_VK(vkGetSwapchainImagesKHR(device(), swapchain, &count, nullptr));
        images_.resize(count);
        LODE_VK(vkGetSwapchainImagesKHR(device(), swapchain, &count, images_.data()));
        drawn_.clear();
        for (uint32_t i = 0; i < count; ++i) drawn_.push_back(make_semaphore());

        framebuffer_ = {};
        canvas_ = {};
        canvas_ = TargetImage(
            a_.allocator,
            {canvas_format, width, height, 1, 1, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT},
            "canvas");
        presented_ = false;
        VkFramebufferCreateInfo framebuffer_info{};
        framebuffer_info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
        framebuffer_info.renderPass = pass_.get();
        framebuffer_info.attachmentCount = 1;
        const VkImageView view = canvas_.view();
        framebuffer_info.pAttachments = &view;
        framebuffer_info.width = width;
        framebuffer_info.height = height;
        framebuffer_info.layers = 1;
        VkFramebuffer framebuffer = VK_NULL_HANDLE;
        LODE_VK(vkCreateFramebuffer(device(), &framebuffer_info, nullptr, &framebuffer));
        framebuffer_ = OwnedFramebuffer(device(), framebuffer);
    }

    void start_overlay() {
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr;  // leaves no file where the program is run
        ImGui::StyleColorsDark();
        ImGui_ImplGlfw_InitForVulkan(window_.get(), true);
        ImGui_ImplVulkan_InitInfo info{};
        info.Instance = a_.device.instance();
        info.PhysicalDevice = a_.device.physical();
        info.Device = device();
        info.QueueFamily = a_.device.queue_family();
        info.Queue = a_.device.queue();
        info.DescriptorPool = descriptors_.get();
        info.MinImageCount = 2;
        info.ImageCount = 2;
        info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
        info.CheckVkResultFn = [](VkResult result) { vulkan_check(result, "the overlay"); };
        ImGui_ImplVulkan_Init(&info, pass_.get());
        overlay_ = true;
        a_.pool.run([](VkCommandBuffer commands) { ImGui_ImplVulkan_CreateFontsTexture(commands); });
        ImGui_ImplVulkan_DestroyFontUploadObjects();
    }

    void bind_panes() {
        if (bound_) return;
        std::array<VkDescriptorImageInfo, most_panes> images{};
        for (uint32_t p = 0; p < most_panes; ++p) {
            const TargetImage& pane = panes_[p].get() != VK_NULL_HANDLE ? panes_[p] : panes_[0];
            images[p] = {sampler_.get(), pane.view(), VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
        }
        VkWriteDescriptorSet write{};
        write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        write.dstSet = set_;
        write.descriptorCount = most_panes;
        write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
        write.pImageInfo = images.data();
        vkUpdateDescriptorSets(device(), 1, &write, 0, nullptr);
        bound_ = true;
    }

    void draw_canvas(const Composition& composition) {
        const VkExtent2D extent{canvas_.spec().width, canvas_.spec().height};
        VkRenderPassBeginInfo begin{};
        begin.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
        begin.renderPass = pass_.get();
        begin.framebuffer = framebuffer_.get();
        begin.renderArea = {{0, 0}, extent};
        vkCmdBeginRenderPass(commands_, &begin, VK_SUBPASS_CONTENTS_INLINE);
        const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
        const VkRect2D scissor{{0, 0}, extent};
        vkCmdSetViewport(commands_, 0, 1, &viewport);
        vkCmdSetScissor(commands_, 0, 1, &scissor);
        vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
        vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_.get(), 0, 1, &set_, 0, nullptr);
        const PresentConstants constants{composition.split, composition.difference ? 1u : 0u};
        vkCmdPushConstants(commands_, layout_.get(), VK_SHADER_STAGE_FRAGMENT_BIT, 0, sizeof constants, &constants);
        vkCmdDraw(commands_, 3, 1, 0, 0);
        ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands_);
        vkCmdEndRenderPass(commands_);
    }

    // Copies the canvas to an image of the swapchain.
    void show(VkImage image) {
        VkImageMemoryBarrier2 barrier{};
        barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
        barrier.srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;  // which the acquiring semaphore waits at
        barrier.dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
        barrier.dstAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
        barrier.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
        barrier.newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        barrier.image = image;
        barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        VkDependencyInfo dependency{};
        dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
        dependency.imageMemoryBarrierCount = 1;
        dependency.pImageMemoryBarriers = &barrier;
        vkCmdPipelineBarrier2(commands_, &dependency);
        VkImageBlit region{};
        region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.srcOffsets[1] = region.dstOffsets[1] = {static_cast<int32_t>(canvas_.spec().width),
                                                       static_cast<int32_t>(canvas_.spec().height), 1};
        vkCmdBlitImage(commands_, canvas_.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image,
                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_NEAREST);
        barrier.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
        barrier.dstStageMask = VK_PIPELINE_STAGE_2_NONE;
        barrier.dstAccessMask = VK_ACCESS_2_NONE;
        barrier.oldLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        barrier.newLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
        vkCmdPipelineBarrier2(commands_, &dependency);
    }

    void submit(uint32_t image) {
        LODE_VK(vkEndCommandBuffer(commands_));
        VkCommandBufferSubmitInfo commands{};
        commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
        commands.commandBuffer = commands_;
        VkSemaphoreSubmitInfo wait{}, signal{};
        wait.sType = signal.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
        wait.semaphore = acquired_.get();
        wait.stageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
        signal.semaphore = drawn_[image].get();
        signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
        VkSubmitInfo2 info{};
        info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
        info.waitSemaphoreInfoCount = 1;
        info.pWaitSemaphoreInfos = &wait;
        info.commandBufferInfoCount = 1;
        info.pCommandBufferInfos = &commands;
        info.signalSemaphoreInfoCount = 1;
        info.pSignalSemaphoreInfos = &signal;
        const VkFence fence = fence_.get();
        LODE_VK(vkResetFences(device(), 1, &fence));
        LODE_VK(vkQueueSubmit2(a_.device.queue(), 1, &info, fence));
        LODE_VK(vkWaitForFences(device(), 1, &fence, VK_TRUE, UINT64_MAX));
    }

    RendererAccess a_;
    std::unique_ptr<GLFWwindow, Destroy> window_;
    std::optional<OwnedSurface> surface_;
    OwnedSwapchain swapchain_;
    std::vector<VkImage> images_;
    std::vector<OwnedSemaphore> drawn_;  // per image
    OwnedSemaphore acquired_;
    OwnedFence fence_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    OwnedRenderPass pass_;
    OwnedSampler sampler_;
    OwnedSetLayout set_layout_;
    OwnedDescriptorPool descriptors_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    OwnedPipelineLayout layout_;
    OwnedPipeline pipeline_;
    std::array<TargetImage, most_panes> panes_;
    TargetImage canvas_;
    OwnedFramebuffer framebuffer_;
    bool overlay_ = false, bound_ = false, presented_ = false;
    std::set<int> went_down_;
    std::vector<int> to_press_;
    std::vector<std::filesystem::path> dropped_;
};

}  // namespace

Result<std::unique_ptr<Window>> Window::open(Renderer& renderer, const WindowOptions& options) {
    return guarded([&]() -> std::unique_ptr<Window> { return std::make_unique<VulkanWindow>(renderer, options); });
}

}  // namespace lodestone
