// Device memory in blocks, and the buffers and images that live in it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "render/vulkan/device.h"

namespace lodestone {

enum class MemoryKind { device_local, staging, readback };

// Hands out pieces of large blocks, one list of blocks per memory type. A piece of half a block or more gets its own
// allocation. Pieces are reused first-fit; freed neighbours merge. One empty block of each kind is kept: drivers take
// up to 20 ms to map one anew, and what is read back of a frame would ask for that in every frame.
class BlockAllocator {
public:
    explicit BlockAllocator(const Device& device) : device_(device) {}
    ~BlockAllocator();
    BlockAllocator(const BlockAllocator&) = delete;
    BlockAllocator& operator=(const BlockAllocator&) = delete;

    struct Piece {
        VkDeviceMemory memory = VK_NULL_HANDLE;
        VkDeviceSize offset = 0, bytes = 0;
        std::byte* mapped = nullptr;  // staging and readback memory only
        uint32_t type = 0;
    };
    // linear: buffers; images are kept in blocks of their own (bufferImageGranularity).
    Piece allocate(const VkMemoryRequirements& requirements, MemoryKind kind, bool linear);
    void free(const Piece& piece);
    // Gives empty blocks back; returns how many bytes they had.
    uint64_t trim();
    uint64_t allocated_bytes() const { return allocated_; }
    const Device& device() const { return device_; }

private:
    using Holes = std::map<VkDeviceSize, VkDeviceSize>;  // offset to size
    struct Block {
        VkDeviceMemory memory;
        VkDeviceSize bytes;
        std::byte* mapped;
        bool linear, dedicated;
        Holes holes;
        std::vector<Holes::node_type> spare;  // one for each piece, which is given back without memory for it
        bool empty() const { return holes.size() == 1 && holes.begin()->second == bytes; }
        bool is_like(const Block& o) const {  // the same pieces fit
            return linear == o.linear && dedicated == o.dedicated && (mapped != nullptr) == (o.mapped != nullptr);
        }
    };
    uint32_t memory_type(uint32_t allowed, MemoryKind kind) const;
    Block& add_block(uint32_t type, VkDeviceSize bytes, bool mapped, bool linear, bool dedicated);

    const Device& device_;
    std::map<uint32_t, std::vector<std::unique_ptr<Block>>> blocks_;  // by memory type
    uint64_t allocated_ = 0;
};

class Buffer {
public:
    Buffer() = default;
    Buffer(BlockAllocator& allocator, VkDeviceSize bytes, VkBufferUsageFlags usage, MemoryKind kind,
           const std::string& name);
    Buffer(Buffer&& o) noexcept;
    Buffer& operator=(Buffer&& o) noexcept;
    ~Buffer();
    VkBuffer get() const { return buffer_; }
    VkDeviceSize bytes() const { return bytes_; }
    VkDeviceSize held_bytes() const { return piece_.bytes; }  // of memory
    std::byte* mapped() const { return piece_.mapped; }

private:
    BlockAllocator* allocator_ = nullptr;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceSize bytes_ = 0;
    BlockAllocator::Piece piece_;
};

// A buffer that shaders read as texels of `words` 32-bit words, 1, 2 or 4 (shaders/shared/texels.glsl).
OwnedBufferView make_texel_view(const Device& device, VkBuffer buffer, uint32_t words);
struct TexelBuffer {
    Buffer buffer;
    OwnedBufferView view;
};

struct ImageSpec {
    VkFormat format = VK_FORMAT_UNDEFINED;
    uint32_t width = 1, height = 1, layers = 1, mips = 1;
    VkImageUsageFlags usage = 0;
    VkImageViewType view = VK_IMAGE_VIEW_TYPE_2D;  // 2D, 2D_ARRAY or CUBE
};

// An image of two dimensions, an array of them or a cube, with a view of all of it.
class TargetImage {
public:
    TargetImage() = default;
    TargetImage(BlockAllocator& allocator, const ImageSpec& spec, const std::string& name);
    TargetImage(TargetImage&& o) noexcept;
    TargetImage& operator=(TargetImage&& o) noexcept;
    ~TargetImage();
    VkImage get() const { return image_; }
    VkImageView view() const { return view_.get(); }
    // Colours or depths: what its view shows.
    VkImageAspectFlags aspect() const {
        return spec_.format == VK_FORMAT_D32_SFLOAT || has_stencil() ? VK_IMAGE_ASPECT_DEPTH_BIT
                                                                     : VK_IMAGE_ASPECT_COLOR_BIT;
    }
    VkImageAspectFlags all_aspects() const { return has_stencil() ? aspect() | VK_IMAGE_ASPECT_STENCIL_BIT : aspect(); }
    // Beside depths.
    bool has_stencil() const { return spec_.format == VK_FORMAT_D32_SFLOAT_S8_UINT; }
    const ImageSpec& spec() const { return spec_; }

private:
    BlockAllocator* allocator_ = nullptr;
    VkImage image_ = VK_NULL_HANDLE;
    ImageSpec spec_;
    OwnedImageView view_;
    BlockAllocator::Piece piece_;
};

}  // namespace lodestone
