#include "render/window/window.h"

// GLFW must come after Vulkan's header, which vulkan.h includes.
#include "render/window/surface.h"
//
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>
#include <set>

#include "base/check.h"
#include "render/window/canvas.h"

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

struct Destroy {
    void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

using OwnedSemaphore = Owned<VkSemaphore, vkDestroySemaphore>;
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

// The format of a surface that takes values as they are. Ours are sRGB already: a format that says so would convert
// them a second time.
VkSurfaceFormatKHR plain_format(VkPhysicalDevice physical, VkSurfaceKHR surface) {
    uint32_t count = 0;
    LODE_VK(vkGetPhysicalDeviceSurfaceFormatsKHR(physical, surface, &count, nullptr));
    std::vector<VkSurfaceFormatKHR> formats(count);
    LODE_VK(vkGetPhysicalDeviceSurfaceFormatsKHR(physical, surface, &count, formats.data()));
    for (const VkFormat plain :
         {VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_A8B8G8R8_UNORM_PACK32,
          VK_FORMAT_A2B10G10R10_UNORM_PACK32, VK_FORMAT_A2R10G10B10_UNORM_PACK32, VK_FORMAT_R5G6B5_UNORM_PACK16}) {
        const auto found = std::ranges::find_if(formats, [&](const VkSurfaceFormatKHR& f) {
            return f.format == plain && f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR;
        });
        if (found != formats.end()) return *found;
    }
    throw VulkanFailure("the display shows none of the formats that are drawn; use render in place of view");
}

// What a swapchain of the surface is made with, but for its extent. Everything it asks for, the surface has.
VkSwapchainCreateInfoKHR swapchain_for(VkPhysicalDevice physical, VkSurfaceKHR surface,
                                       const VkSurfaceCapabilitiesKHR& can) {
    if ((can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT) == 0)
        throw VulkanFailure("the display's images cannot be copied to; use render in place of view");
    VkSwapchainCreateInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
    info.surface = surface;
    info.minImageCount = std::max(2u, can.minImageCount);
    if (can.maxImageCount > 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
    const VkSurfaceFormatKHR format = plain_format(physical, surface);
    info.imageFormat = format.format;
    info.imageColorSpace = format.colorSpace;
    info.imageArrayLayers = 1;
    info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    info.preTransform = can.currentTransform;
    // Opaque where it can be; otherwise whatever there is, and the canvas is opaque.
    for (const VkCompositeAlphaFlagBitsKHR alpha :
         {VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR, VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR,
          VK_COMPOSITE_ALPHA_PRE_MULTIPLIED_BIT_KHR, VK_COMPOSITE_ALPHA_POST_MULTIPLIED_BIT_KHR}) {
        if ((can.supportedCompositeAlpha & alpha) == 0) continue;
        info.compositeAlpha = alpha;
        break;
    }
    info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
    info.clipped = VK_TRUE;
    return info;
}

class VulkanWindow final : public Window {
public:
    VulkanWindow(Renderer& renderer, const WindowOptions& options) : a_(renderer.access()), canvas_(a_) {
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
        make_surface();
        for (Turn& turn : turns_) make_turn(turn);
        make_swapchain();
        const auto [width, height] = framebuffer_size();
        canvas_.resize(std::max(width, 1u), std::max(height, 1u));
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
            Turn& turn = this_turn();
            const VkCommandBuffer commands = turn.kept[pane];
            if (turn.was_kept[pane]) LODE_VK(vkDeviceWaitIdle(device()));  // and was not shown
            turn.was_kept[pane] = true;
            CommandPool::begin(commands);
            canvas_.keep(pane, commands);
            a_.pool.submit(commands, VK_NULL_HANDLE);
        });
    }

    Result<void> present(const Composition& composition) override {
        return guarded([&] {
            ImGui::Render();
            const auto [width, height] = framebuffer_size();
            if (width == 0 || height == 0) return;  // minimised
            if (canvas_.image().spec().width != width || canvas_.image().spec().height != height) {
                LODE_VK(vkDeviceWaitIdle(device()));
                presented_ = false;
                canvas_.resize(width, height);
                stale_ = true;
            }
            Turn& turn = this_turn();
            const std::optional<uint32_t> image = acquire(turn);
            CommandPool::begin(turn.shown);
            canvas_.record(turn.shown, composition, [](VkCommandBuffer commands) {
                ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands);
            });
            if (image) show(images_[*image], turn.shown);
            submit(turn, image);
            presented_ = true;
            if (image) hand_over(*image);
        });
    }

    Result<Picture> read() override {
        return guarded([&] {
            if (!presented_) throw VulkanFailure("the window has shown nothing yet at its present size");
            LODE_VK(vkDeviceWaitIdle(device()));
            return canvas_.read();
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

    // What is recorded from one present() to the next. Its fence is that of the last of it.
    struct Turn {
        std::array<VkCommandBuffer, most_panes> kept{};
        std::array<bool, most_panes> was_kept{};
        VkCommandBuffer shown = VK_NULL_HANDLE;
        OwnedFence fence;
        OwnedSemaphore acquired;
        bool submitted = false, ready = false;  // ready: the device is done with what it had before
    };
    void make_turn(Turn& turn) const {
        for (VkCommandBuffer& commands : turn.kept) commands = a_.pool.allocate();
        turn.shown = a_.pool.allocate();
        VkFenceCreateInfo fence_info{};
        fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
        VkFence fence = VK_NULL_HANDLE;
        LODE_VK(vkCreateFence(device(), &fence_info, nullptr, &fence));
        turn.fence = OwnedFence(device(), fence);
        turn.acquired = make_semaphore();
    }
    Turn& this_turn() {
        Turn& turn = turns_[turn_ % most_turns];
        if (turn.ready) return turn;
        const VkFence fence = turn.fence.get();
        if (turn.submitted) LODE_VK(vkWaitForFences(device(), 1, &fence, VK_TRUE, UINT64_MAX));
        turn.submitted = false;
        turn.was_kept = {};
        turn.ready = true;
        return turn;
    }

    OwnedSemaphore make_semaphore() const {
        VkSemaphoreCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
        VkSemaphore semaphore = VK_NULL_HANDLE;
        LODE_VK(vkCreateSemaphore(device(), &info, nullptr, &semaphore));
        return {device(), semaphore};
    }

    void make_surface() {
        surface_.emplace(a_.device.instance(), window_.get());
        VkBool32 supported = VK_FALSE;
        LODE_VK(vkGetPhysicalDeviceSurfaceSupportKHR(a_.device.physical(), a_.device.queue_family(), surface_->get(),
                                                     &supported));
        if (supported == VK_FALSE) throw VulkanFailure(a_.device.info().name + " cannot show pictures on this display");
    }

    // An image of the swapchain to show the canvas in. None where there is none now: the window changes faster than
    // swapchains are made, or is not shown; the next present tries again.
    std::optional<uint32_t> acquire(const Turn& turn) {
        constexpr int most_tries = 3;
        constexpr uint64_t longest_wait = 1000000000;  // ns; a compositor may hold images back from a hidden window
        for (int tries = 0; tries < most_tries; ++tries) {
            if (stale_ && !make_swapchain()) return {};
            uint32_t image = 0;
            const VkResult got = vkAcquireNextImageKHR(device(), swapchain_.get(), longest_wait, turn.acquired.get(),
                                                       VK_NULL_HANDLE, &image);
            if (got == VK_SUCCESS || got == VK_SUBOPTIMAL_KHR) {
                stale_ = got == VK_SUBOPTIMAL_KHR;
                return image;
            }
            if (got == VK_TIMEOUT || got == VK_NOT_READY) return {};
            lost(got, "vkAcquireNextImageKHR");
        }
        return {};
    }

    // The canvas, drawn into the image, goes to the screen.
    void hand_over(uint32_t image) {
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
        if (shown == VK_SUBOPTIMAL_KHR) {
            stale_ = true;
        } else if (shown != VK_SUCCESS) {
            lost(shown, "vkQueuePresentKHR");
        }
    }

    // What the swapchain was for is no more; what cannot be made anew is a failure.
    void lost(VkResult result, const char* call) {
        if (result == VK_ERROR_SURFACE_LOST_KHR) {
            LODE_VK(vkDeviceWaitIdle(device()));
            swapchain_ = {};
            make_surface();
        } else if (result != VK_ERROR_OUT_OF_DATE_KHR) {
            vulkan_check(result, call);
        }
        stale_ = true;
    }

    // A swapchain of the window's size; false where the window has none now.
    bool make_swapchain() {
        LODE_VK(vkDeviceWaitIdle(device()));
        VkSurfaceCapabilitiesKHR can{};
        LODE_VK(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(a_.device.physical(), surface_->get(), &can));
        VkExtent2D extent = can.currentExtent;
        if (extent.width == ~0u) {  // what the swapchain has, the window gets
            const auto [width, height] = framebuffer_size();
            extent = {std::clamp(width, can.minImageExtent.width, can.maxImageExtent.width),
                      std::clamp(height, can.minImageExtent.height, can.maxImageExtent.height)};
        }
        if (extent.width == 0 || extent.height == 0) return false;
        VkSwapchainCreateInfoKHR info = swapchain_for(a_.device.physical(), surface_->get(), can);
        info.imageExtent = extent;
        const OwnedSwapchain old = std::move(swapchain_);
        info.oldSwapchain = old.get();
        VkSwapchainKHR swapchain = VK_NULL_HANDLE;
        LODE_VK(vkCreateSwapchainKHR(device(), &info, nullptr, &swapchain));
        swapchain_ = OwnedSwapchain(device(), swapchain);
        shown_extent_ = extent;
        uint32_t count = 0;
        LODE_VK(vkGetSwapchainImagesKHR(device(), swapchain, &count, nullptr));
        images_.resize(count);
        LODE_VK(vkGetSwapchainImagesKHR(device(), swapchain, &count, images_.data()));
        drawn_.clear();
        for (uint32_t i = 0; i < count; ++i) drawn_.push_back(make_semaphore());
        stale_ = false;
        return true;
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
        info.DescriptorPool = canvas_.descriptors();
        info.MinImageCount = 2;
        info.ImageCount = most_turns;
        info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
        info.CheckVkResultFn = [](VkResult result) { vulkan_check(result, "the overlay"); };
        ImGui_ImplVulkan_Init(&info, canvas_.pass());
        overlay_ = true;
        a_.pool.run([](VkCommandBuffer commands) { ImGui_ImplVulkan_CreateFontsTexture(commands); });
        ImGui_ImplVulkan_DestroyFontUploadObjects();
    }

    // Copies the canvas to an image of the swapchain.
    void show(VkImage image, VkCommandBuffer commands) const {
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
        vkCmdPipelineBarrier2(commands, &dependency);
        VkImageBlit region{};
        region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        const auto corner = [](uint32_t width, uint32_t height) {
            return VkOffset3D{static_cast<int32_t>(width), static_cast<int32_t>(height), 1};
        };
        region.srcOffsets[1] = corner(canvas_.image().spec().width, canvas_.image().spec().height);
        region.dstOffsets[1] = corner(shown_extent_.width, shown_extent_.height);
        vkCmdBlitImage(commands, canvas_.image().get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image,
                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_NEAREST);
        barrier.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
        barrier.dstStageMask = VK_PIPELINE_STAGE_2_NONE;
        barrier.dstAccessMask = VK_ACCESS_2_NONE;
        barrier.oldLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        barrier.newLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
        vkCmdPipelineBarrier2(commands, &dependency);
    }

    // image: of the swapchain, which was acquired.
    void submit(Turn& turn, std::optional<uint32_t> image) {
        LODE_VK(vkEndCommandBuffer(turn.shown));
        VkCommandBufferSubmitInfo commands{};
        commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
        commands.commandBuffer = turn.shown;
        VkSemaphoreSubmitInfo wait{}, signal{};
        wait.sType = signal.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
        wait.semaphore = turn.acquired.get();
        wait.stageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
        if (image) signal.semaphore = drawn_[*image].get();
        signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
        VkSubmitInfo2 info{};
        info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
        info.waitSemaphoreInfoCount = info.signalSemaphoreInfoCount = image ? 1 : 0;
        info.pWaitSemaphoreInfos = &wait;
        info.commandBufferInfoCount = 1;
        info.pCommandBufferInfos = &commands;
        info.pSignalSemaphoreInfos = &signal;
        const VkFence fence = turn.fence.get();
        LODE_VK(vkResetFences(device(), 1, &fence));
        LODE_VK(vkQueueSubmit2(a_.device.queue(), 1, &info, fence));
        turn.submitted = true;
        turn.ready = false;
        ++turn_;
    }

    RendererAccess a_;
    std::unique_ptr<GLFWwindow, Destroy> window_;
    std::optional<OwnedSurface> surface_;
    OwnedSwapchain swapchain_;
    std::vector<VkImage> images_;
    std::vector<OwnedSemaphore> drawn_;  // per image
    std::array<Turn, most_turns> turns_;
    uint64_t turn_ = 0;  // presented so far
    Canvas canvas_;
    VkExtent2D shown_extent_{};  // of the swapchain
    bool stale_ = true;          // the swapchain is to be made anew
    bool overlay_ = false;
    bool presented_ = false;  // the canvas holds what was shown last
    std::set<int> went_down_;
    std::vector<int> to_press_;
    std::vector<std::filesystem::path> dropped_;
};

}  // namespace

Result<std::unique_ptr<Window>> Window::open(Renderer& renderer, const WindowOptions& options) {
    return guarded([&]() -> std::unique_ptr<Window> { return std::make_unique<VulkanWindow>(renderer, options); });
}

}  // namespace lodestone
