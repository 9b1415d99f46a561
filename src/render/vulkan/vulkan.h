// Vulkan inside this room: failed calls, owned handles. Failures travel as VulkanFailure up to the functions of
// Renderer, which turn them into Errors.
#pragma once

#include <vulkan/vulkan.h>

#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "base/result.h"

namespace lodestone {

// what(): one line that names the call and what it answered. result: that answer; VK_SUCCESS where no call failed.
class VulkanFailure : public std::runtime_error {
public:
    explicit VulkanFailure(const std::string& what, VkResult result = VK_SUCCESS)
        : std::runtime_error(what), result_(result) {}
    VkResult result() const { return result_; }
    bool out_of_memory() const {
        return result_ == VK_ERROR_OUT_OF_DEVICE_MEMORY || result_ == VK_ERROR_OUT_OF_HOST_MEMORY;
    }

private:
    VkResult result_;
};

const char* name_of(VkResult result);
void vulkan_check(VkResult result, const char* call);

// Runs a Vulkan call that returns a VkResult; anything but success is a VulkanFailure that names it.
#define LODE_VK(call) ::lodestone::vulkan_check(call, #call)

// Failures of Vulkan, and memory that runs out, stop here and become errors.
template <class F>
auto guarded(F&& f) -> Result<decltype(f())> {
    try {
        if constexpr (std::is_void_v<decltype(f())>) {
            f();
            return {};
        } else {
            return f();
        }
    } catch (const VulkanFailure& failure) {
        return fail(Fault::machine, failure.what());
    } catch (const std::bad_alloc&) { return fail(Fault::machine, "out of memory"); }
}

// A handle destroyed with its owner.
template <class T, auto Destroy>
class Owned {
public:
    Owned() = default;
    Owned(VkDevice device, T handle) : device_(device), handle_(handle) {}
    Owned(Owned&& o) noexcept : device_(o.device_), handle_(std::exchange(o.handle_, T{})) {}
    Owned& operator=(Owned&& o) noexcept {
        std::swap(device_, o.device_);
        std::swap(handle_, o.handle_);
        return *this;
    }
    ~Owned() {
        if (handle_ != T{}) Destroy(device_, handle_, nullptr);
    }
    T get() const { return handle_; }

private:
    VkDevice device_ = VK_NULL_HANDLE;
    T handle_{};
};

using OwnedSampler = Owned<VkSampler, vkDestroySampler>;
using OwnedBufferView = Owned<VkBufferView, vkDestroyBufferView>;
using OwnedImageView = Owned<VkImageView, vkDestroyImageView>;
using OwnedShader = Owned<VkShaderModule, vkDestroyShaderModule>;
using OwnedPipeline = Owned<VkPipeline, vkDestroyPipeline>;
using OwnedPipelineLayout = Owned<VkPipelineLayout, vkDestroyPipelineLayout>;
using OwnedSetLayout = Owned<VkDescriptorSetLayout, vkDestroyDescriptorSetLayout>;
using OwnedDescriptorPool = Owned<VkDescriptorPool, vkDestroyDescriptorPool>;
using OwnedCommandPool = Owned<VkCommandPool, vkDestroyCommandPool>;
using OwnedFence = Owned<VkFence, vkDestroyFence>;
using OwnedQueryPool = Owned<VkQueryPool, vkDestroyQueryPool>;

}  // namespace lodestone
