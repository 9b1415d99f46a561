#include "render/vulkan/vulkan.h"

namespace lodestone {

namespace {

struct NamedResult {
    VkResult result;
    const char* name;
};
constexpr NamedResult named_results[] = {
    {VK_SUCCESS, "VK_SUCCESS"},
    {VK_NOT_READY, "VK_NOT_READY"},
    {VK_TIMEOUT, "VK_TIMEOUT"},
    {VK_ERROR_OUT_OF_HOST_MEMORY, "out of memory (VK_ERROR_OUT_OF_HOST_MEMORY)"},
    {VK_ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory (VK_ERROR_OUT_OF_DEVICE_MEMORY)"},
    {VK_ERROR_INITIALIZATION_FAILED, "VK_ERROR_INITIALIZATION_FAILED"},
    {VK_ERROR_DEVICE_LOST, "the device was lost (VK_ERROR_DEVICE_LOST)"},
    {VK_ERROR_MEMORY_MAP_FAILED, "VK_ERROR_MEMORY_MAP_FAILED"},
    {VK_ERROR_LAYER_NOT_PRESENT, "VK_ERROR_LAYER_NOT_PRESENT"},
    {VK_ERROR_EXTENSION_NOT_PRESENT, "VK_ERROR_EXTENSION_NOT_PRESENT"},
    {VK_ERROR_FEATURE_NOT_PRESENT, "VK_ERROR_FEATURE_NOT_PRESENT"},
    {VK_ERROR_INCOMPATIBLE_DRIVER, "no driver found (VK_ERROR_INCOMPATIBLE_DRIVER)"},
    {VK_ERROR_TOO_MANY_OBJECTS, "VK_ERROR_TOO_MANY_OBJECTS"},
    {VK_ERROR_FORMAT_NOT_SUPPORTED, "VK_ERROR_FORMAT_NOT_SUPPORTED"},
    {VK_INCOMPLETE, "VK_INCOMPLETE"},
    {VK_ERROR_FRAGMENTED_POOL, "VK_ERROR_FRAGMENTED_POOL"},
    {VK_ERROR_OUT_OF_POOL_MEMORY, "VK_ERROR_OUT_OF_POOL_MEMORY"},
    {VK_ERROR_FRAGMENTATION, "VK_ERROR_FRAGMENTATION"},
    {VK_ERROR_UNKNOWN, "VK_ERROR_UNKNOWN"},
    {VK_SUBOPTIMAL_KHR, "the window has changed (VK_SUBOPTIMAL_KHR)"},
    {VK_ERROR_OUT_OF_DATE_KHR, "the window has changed (VK_ERROR_OUT_OF_DATE_KHR)"},
    {VK_ERROR_SURFACE_LOST_KHR, "the window's surface was lost (VK_ERROR_SURFACE_LOST_KHR)"},
    {VK_ERROR_NATIVE_WINDOW_IN_USE_KHR, "the window is in use (VK_ERROR_NATIVE_WINDOW_IN_USE_KHR)"},
    {VK_ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT, "VK_ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT"},
};

}  // namespace

const char* name_of(VkResult result) {
    for (const NamedResult& each : named_results) {
        if (each.result == result) return each.name;
    }
    return "an error Vulkan did not have a name for";
}

void vulkan_check(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    const std::string text = call;
    throw VulkanFailure(
        text.substr(0, text.find('(')) + ": " + name_of(result) + " [" + std::to_string(static_cast<int>(result)) + "]",
        result);
}

}  // namespace lodestone
