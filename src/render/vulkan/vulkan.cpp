#include "render/vulkan/vulkan.h"

namespace lodestone {

const char* name_of(VkResult result) {
    switch (result) {
        case VK_SUCCESS:
            return "VK_SUCCESS";
        case VK_NOT_READY:
            return "VK_NOT_READY";
        case VK_TIMEOUT:
            return "VK_TIMEOUT";
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            return "out of memory (VK_ERROR_OUT_OF_HOST_MEMORY)";
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
            return "out of device memory (VK_ERROR_OUT_OF_DEVICE_MEMORY)";
        case VK_ERROR_INITIALIZATION_FAILED:
            return "VK_ERROR_INITIALIZATION_FAILED";
        case VK_ERROR_DEVICE_LOST:
            return "the device was lost (VK_ERROR_DEVICE_LOST)";
        case VK_ERROR_MEMORY_MAP_FAILED:
            return "VK_ERROR_MEMORY_MAP_FAILED";
        case VK_ERROR_LAYER_NOT_PRESENT:
            return "VK_ERROR_LAYER_NOT_PRESENT";
        case VK_ERROR_EXTENSION_NOT_PRESENT:
            return "VK_ERROR_EXTENSION_NOT_PRESENT";
        case VK_ERROR_FEATURE_NOT_PRESENT:
            return "VK_ERROR_FEATURE_NOT_PRESENT";
        case VK_ERROR_INCOMPATIBLE_DRIVER:
            return "no driver found (VK_ERROR_INCOMPATIBLE_DRIVER)";
        case VK_ERROR_TOO_MANY_OBJECTS:
            return "VK_ERROR_TOO_MANY_OBJECTS";
        case VK_ERROR_FORMAT_NOT_SUPPORTED:
            return "VK_ERROR_FORMAT_NOT_SUPPORTED";
        case VK_INCOMPLETE:
            return "VK_INCOMPLETE";
        case VK_ERROR_FRAGMENTED_POOL:
            return "VK_ERROR_FRAGMENTED_POOL";
        case VK_ERROR_OUT_OF_POOL_MEMORY:
            return "VK_ERROR_OUT_OF_POOL_MEMORY";
        case VK_ERROR_FRAGMENTATION:
            return "VK_ERROR_FRAGMENTATION";
        case VK_ERROR_UNKNOWN:
            return "VK_ERROR_UNKNOWN";
        case VK_SUBOPTIMAL_KHR:
            return "the window has changed (VK_SUBOPTIMAL_KHR)";
        case VK_ERROR_OUT_OF_DATE_KHR:
            return "the window has changed (VK_ERROR_OUT_OF_DATE_KHR)";
        case VK_ERROR_SURFACE_LOST_KHR:
            return "the window's surface was lost (VK_ERROR_SURFACE_LOST_KHR)";
        case VK_ERROR_NATIVE_WINDOW_IN_USE_KHR:
            return "the window is in use (VK_ERROR_NATIVE_WINDOW_IN_USE_KHR)";
        case VK_ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT:
            return "VK_ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT";
        default:
            return "an error Vulkan did not have a name for";
    }
}

void vulkan_check(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    const std::string text = call;
    throw VulkanFailure(
        text.substr(0, text.find('(')) + ": " + name_of(result) + " [" + std::to_string(static_cast<int>(result)) + "]",
        result);
}

}  // namespace lodestone
