// Loaded before the program (LD_PRELOAD): the device is lost at submission number LODESTONE_LOSE_AT, and again at that
// number of every later device until LODESTONE_LOSE_TIMES (1) are gone.
#include <dlfcn.h>
#include <vulkan/vulkan.h>

#include <cstdlib>

namespace {

int submissions = 0, devices_lost = 0;
bool lost = false;

int number(const char* name, int otherwise) {
    const char* given = std::getenv(name);
    return given != nullptr ? std::atoi(given) : otherwise;
}
template <class F>
F real(const char* name) {
    return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

VKAPI_ATTR VkResult VKAPI_CALL vkCreateDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                              const VkAllocationCallbacks* callbacks, VkDevice* device) {
    lost = false;
    submissions = 0;
    return real<PFN_vkCreateDevice>("vkCreateDevice")(physical, info, callbacks, device);
}
VKAPI_ATTR VkResult VKAPI_CALL vkQueueSubmit2(VkQueue queue, uint32_t count, const VkSubmitInfo2* infos,
                                              VkFence fence) {
    if (!lost && devices_lost < number("LODESTONE_LOSE_TIMES", 1) && ++submissions == number("LODESTONE_LOSE_AT", -1)) {
        lost = true;
        ++devices_lost;
        // A device that is lost runs nothing any more; this one would go on with the frames before.
        real<PFN_vkQueueWaitIdle>("vkQueueWaitIdle")(queue);
    }
    if (lost) return VK_ERROR_DEVICE_LOST;
    return real<PFN_vkQueueSubmit2>("vkQueueSubmit2")(queue, count, infos, fence);
}
VKAPI_ATTR VkResult VKAPI_CALL vkDeviceWaitIdle(VkDevice device) {
    if (lost) return VK_ERROR_DEVICE_LOST;
    return real<PFN_vkDeviceWaitIdle>("vkDeviceWaitIdle")(device);
}
VKAPI_ATTR VkResult VKAPI_CALL vkWaitForFences(VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all,
                                               uint64_t timeout) {
    if (lost) return VK_ERROR_DEVICE_LOST;
    return real<PFN_vkWaitForFences>("vkWaitForFences")(device, count, fences, all, timeout);
}
VKAPI_ATTR VkResult VKAPI_CALL vkGetFenceStatus(VkDevice device, VkFence fence) {
    if (lost) return VK_ERROR_DEVICE_LOST;
    return real<PFN_vkGetFenceStatus>("vkGetFenceStatus")(device, fence);
}

}  // extern "C"
