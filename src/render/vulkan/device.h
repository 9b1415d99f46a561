// Instance, physical device, device and queue, chosen and checked; validation messages are collected here.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "render/vulkan/vulkan.h"

namespace lodestone {

class Device {
public:
    // Throws VulkanFailure: no device, or a needed feature is missing.
    // presents: with what a window needs (window.h).
    Device(const std::string& wanted, bool validation, bool presents);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    VkInstance instance() const { return instance_; }
    VkDevice handle() const { return device_; }
    VkPhysicalDevice physical() const { return physical_; }
    VkQueue queue() const { return queue_; }
    uint32_t queue_family() const { return queue_family_; }
    const DeviceInfo& info() const { return info_; }
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    const VkPhysicalDeviceMemoryProperties& memory() const { return memory_; }
    bool has_statistics() const { return statistics_; }
    bool has_timestamps() const { return timestamps_; }
    bool has_draw_indirect_count() const { return draw_indirect_count_; }
    bool draws_lines() const { return lines_; }  // wireframes; only where it presents
    std::vector<std::string> messages() const;

    // Names an object for validation messages and debuggers; nothing where the extension is missing.
    void name(VkObjectType type, uint64_t object, const std::string& name) const;
    void begin_label(VkCommandBuffer commands, const char* label) const;
    void end_label(VkCommandBuffer commands) const;

    static std::vector<DeviceInfo> list();

private:
    void make_instance(bool validation, bool presents);
    void choose(const std::string& wanted);
    struct Features;
    void make_device(bool presents);
    void choose_queue_family();
    void check_features(const Features& have) const;  // throws where one is lacking that is needed
    void use_features(const Features& have, Features& use) const;
    void load_debug_functions();
    static VkBool32 VKAPI_PTR on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                         VkDebugUtilsMessageTypeFlagsEXT type,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* self);

    VkInstance instance_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    uint32_t queue_family_ = 0;
    DeviceInfo info_;
    VkPhysicalDeviceLimits limits_{};
    VkPhysicalDeviceMemoryProperties memory_{};
    bool debug_utils_ = false, statistics_ = false, timestamps_ = false, draw_indirect_count_ = false, lines_ = false;
    PFN_vkSetDebugUtilsObjectNameEXT set_name_ = nullptr;
    PFN_vkCmdBeginDebugUtilsLabelEXT begin_label_ = nullptr;
    PFN_vkCmdEndDebugUtilsLabelEXT end_label_ = nullptr;
    mutable std::mutex messages_mutex_;
    std::vector<std::string> messages_;
};

}  // namespace lodestone
