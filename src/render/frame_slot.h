// What one frame in flight needs of its own: commands, a fence, staging memory, the frame's constants, queries.
#pragma once

#include <chrono>
#include <span>
#include <string>
#include <vector>

#include "render/recipe_build.h"
#include "render/renderer.h"
#include "render/vulkan/memory.h"

namespace lodestone {

inline constexpr VkDeviceSize staging_bytes = VkDeviceSize{16} << 20;

// Host-visible memory handed out front to back until reset.
class Staging {
public:
    Staging() = default;
    Staging(BlockAllocator& allocator, VkDeviceSize bytes)
        : buffer_(allocator, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::staging, "staging") {}
    VkDeviceSize free_bytes() const { return buffer_.bytes() - used_; }
    // Copies the bytes in; returns their offset. They must fit free_bytes().
    VkDeviceSize put(const void* data, VkDeviceSize bytes);
    VkBuffer get() const { return buffer_.get(); }
    void reset() { used_ = 0; }

private:
    Buffer buffer_;
    VkDeviceSize used_ = 0;
};

inline constexpr uint32_t most_effect_timestamps = 64;  // of a frame; what comes after them is not timed

struct FrameSlot {
    VkCommandBuffer commands = VK_NULL_HANDLE;
    OwnedFence fence;
    bool busy = false;
    uint64_t frame = 0;
    uint32_t place = 0;  // whose recipe it draws
    std::chrono::steady_clock::time_point submitted_at;
    Staging staging;
    Buffer constants, marks;              // device-local
    TexelBuffer instances, instance_ids;  // the same
    uint64_t instances_version = 0;       // InstanceTable::version() of what is in `instances`
    VkDescriptorSet frame_set = VK_NULL_HANDLE;
    OwnedQueryPool statistics, timestamps;
    struct PendingReadback {
        uint32_t tag;
        Buffer buffer;
    };
    std::vector<PendingReadback> readbacks, effect_readbacks;
    std::vector<Replaced> replaced;  // by this frame; it and those before may read them
    // Of an effect: what ran after each of its timestamps, empty where that is not the effect's.
    OwnedQueryPool effect_timestamps;
    std::vector<std::string> effect_timed;
};

// Makes sure the buffer holds at least `bytes`; true if it was made anew.
bool ensure_buffer(BlockAllocator& allocator, Buffer& buffer, VkDeviceSize bytes, VkBufferUsageFlags usage,
                   const char* name);
// The same of texels of so many words.
bool ensure_texels(BlockAllocator& allocator, TexelBuffer& texels, VkDeviceSize bytes, uint32_t words,
                   const char* name);

// Counters of a finished slot.
FrameCounters read_counters(const Device& device, const FrameSlot& slot);

}  // namespace lodestone
