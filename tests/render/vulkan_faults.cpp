#include "render/vulkan_faults.h"

#include <dlfcn.h>

#include <atomic>
#include <mutex>

namespace lodestone {
namespace {

std::mutex mutex;
std::string chosen;
VkResult answer = VK_SUCCESS;
int left = 0, before = 0, done = 0;
std::atomic<long> allocations{0};
Capabilities pretended_capabilities = nullptr;
Format pretended_format = nullptr;

bool fails(const char* call) {
    const std::lock_guard lock(mutex);
    if (chosen != call || left == 0) return false;
    if (before > 0) {
        --before;
        return false;
    }
    --left;
    ++done;
    return true;
}

template <class F>
F real(const char* call) {
    return reinterpret_cast<F>(dlsym(RTLD_NEXT, call));
}

}  // namespace

void inject(const std::string& call, VkResult result, int times, int skipped) {
    const std::lock_guard lock(mutex);
    chosen = call;
    answer = result;
    left = times;
    before = skipped;
    done = 0;
}
void pretend(Capabilities capabilities, Format format) {
    pretended_capabilities = capabilities;
    pretended_format = format;
}
int injected() {
    const std::lock_guard lock(mutex);
    return done;
}
long device_allocations() { return allocations; }

}  // namespace lodestone

// The renderer is linked into this program, so its calls find these first.
#define LODE_INJECT(name, parameters, arguments)                             \
    extern "C" VKAPI_ATTR VkResult VKAPI_CALL name parameters {              \
        static const auto call = lodestone::real<PFN_##name>(#name);         \
        return lodestone::fails(#name) ? lodestone::answer : call arguments; \
    }

LODE_INJECT(vkQueueSubmit2, (VkQueue queue, uint32_t count, const VkSubmitInfo2* submits, VkFence fence),
            (queue, count, submits, fence))
LODE_INJECT(vkWaitForFences, (VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all, uint64_t timeout),
            (device, count, fences, all, timeout))
LODE_INJECT(vkGetFenceStatus, (VkDevice device, VkFence fence), (device, fence))
LODE_INJECT(vkMapMemory,
            (VkDevice device, VkDeviceMemory memory, VkDeviceSize offset, VkDeviceSize size, VkMemoryMapFlags flags,
             void** data),
            (device, memory, offset, size, flags, data))
LODE_INJECT(vkEnumeratePhysicalDevices, (VkInstance instance, uint32_t* count, VkPhysicalDevice* devices),
            (instance, count, devices))
LODE_INJECT(vkCreateGraphicsPipelines,
            (VkDevice device, VkPipelineCache cache, uint32_t count, const VkGraphicsPipelineCreateInfo* infos,
             const VkAllocationCallbacks* callbacks, VkPipeline* pipelines),
            (device, cache, count, infos, callbacks, pipelines))
LODE_INJECT(vkAcquireNextImageKHR,
            (VkDevice device, VkSwapchainKHR swapchain, uint64_t timeout, VkSemaphore semaphore, VkFence fence,
             uint32_t* index),
            (device, swapchain, timeout, semaphore, fence, index))

// What is presented is presented: the semaphore must be waited for whatever is answered.
extern "C" VKAPI_ATTR VkResult VKAPI_CALL vkQueuePresentKHR(VkQueue queue, const VkPresentInfoKHR* info) {
    static const auto call = lodestone::real<PFN_vkQueuePresentKHR>("vkQueuePresentKHR");
    const VkResult result = call(queue, info);
    return lodestone::fails("vkQueuePresentKHR") ? lodestone::answer : result;
}

extern "C" VKAPI_ATTR VkResult VKAPI_CALL vkAllocateMemory(VkDevice device, const VkMemoryAllocateInfo* info,
                                                           const VkAllocationCallbacks* callbacks,
                                                           VkDeviceMemory* memory) {
    static const auto call = lodestone::real<PFN_vkAllocateMemory>("vkAllocateMemory");
    if (lodestone::fails("vkAllocateMemory")) return lodestone::answer;
    const VkResult result = call(device, info, callbacks, memory);
    lodestone::allocations += result == VK_SUCCESS;
    return result;
}
extern "C" VKAPI_ATTR void VKAPI_CALL vkFreeMemory(VkDevice device, VkDeviceMemory memory,
                                                   const VkAllocationCallbacks* callbacks) {
    static const auto call = lodestone::real<PFN_vkFreeMemory>("vkFreeMemory");
    lodestone::allocations -= memory != VK_NULL_HANDLE;
    call(device, memory, callbacks);
}

extern "C" VKAPI_ATTR VkResult VKAPI_CALL vkGetPhysicalDeviceSurfaceCapabilitiesKHR(VkPhysicalDevice device,
                                                                                    VkSurfaceKHR surface,
                                                                                    VkSurfaceCapabilitiesKHR* can) {
    static const auto call =
        lodestone::real<PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR>("vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
    const VkResult result = call(device, surface, can);
    if (lodestone::pretended_capabilities != nullptr) lodestone::pretended_capabilities(*can);
    return result;
}
extern "C" VKAPI_ATTR VkResult VKAPI_CALL vkGetPhysicalDeviceSurfaceFormatsKHR(VkPhysicalDevice device,
                                                                               VkSurfaceKHR surface, uint32_t* count,
                                                                               VkSurfaceFormatKHR* formats) {
    static const auto call =
        lodestone::real<PFN_vkGetPhysicalDeviceSurfaceFormatsKHR>("vkGetPhysicalDeviceSurfaceFormatsKHR");
    const VkResult result = call(device, surface, count, formats);
    for (uint32_t i = 0; formats != nullptr && lodestone::pretended_format != nullptr && i < *count; ++i)
        lodestone::pretended_format(formats[i]);
    return result;
}
