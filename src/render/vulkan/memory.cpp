#include "render/vulkan/memory.h"

#include <algorithm>
#include <utility>

#include "base/check.h"

namespace lodestone {

namespace {
constexpr VkDeviceSize block_bytes = VkDeviceSize{64} << 20;
constexpr VkDeviceSize aligned(VkDeviceSize offset, VkDeviceSize alignment) {
    return (offset + alignment - 1) / alignment * alignment;
}
template <class Holes>
auto put_hole(Holes& holes, typename Holes::node_type node, VkDeviceSize offset, VkDeviceSize bytes) {
    node.key() = offset;
    node.mapped() = bytes;
    return holes.insert(std::move(node)).position;
}
}  // namespace

BlockAllocator::~BlockAllocator() {
    for (auto& [type, blocks] : blocks_) {
        for (const auto& block : blocks) vkFreeMemory(device_.handle(), block->memory, nullptr);
    }
}

uint32_t BlockAllocator::memory_type(uint32_t allowed, MemoryKind kind) const {
    const VkPhysicalDeviceMemoryProperties& memory = device_.memory();
    constexpr VkMemoryPropertyFlags host = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    const auto find = [&](VkMemoryPropertyFlags needed) {
        uint32_t type = 0;
        while (type < memory.memoryTypeCount &&
               ((allowed >> type & 1) == 0 || (memory.memoryTypes[type].propertyFlags & needed) != needed))
            ++type;
        return type;
    };
    uint32_t type = kind == MemoryKind::device_local ? find(VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)
                    : kind == MemoryKind::readback   ? find(host | VK_MEMORY_PROPERTY_HOST_CACHED_BIT)
                                                     : find(host);
    if (type == memory.memoryTypeCount) type = kind == MemoryKind::device_local ? find(0) : find(host);
    if (type == memory.memoryTypeCount) throw VulkanFailure(device_.info().name + " has no memory of the kind needed");
    return type;
}

BlockAllocator::Block& BlockAllocator::add_block(uint32_t type, VkDeviceSize bytes, bool mapped, bool linear,
                                                 bool dedicated) {
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.allocationSize = bytes;
    info.memoryTypeIndex = type;
    auto block = std::make_unique<Block>(Block{VK_NULL_HANDLE, bytes, nullptr, linear, dedicated, {{0, bytes}}, {}});
    VkResult made = vkAllocateMemory(device_.handle(), &info, nullptr, &block->memory);
    if (made == VK_ERROR_OUT_OF_DEVICE_MEMORY && trim() > 0)
        made = vkAllocateMemory(device_.handle(), &info, nullptr, &block->memory);
    vulkan_check(made, "vkAllocateMemory");
    if (mapped) {
        void* address = nullptr;
        const VkResult done = vkMapMemory(device_.handle(), block->memory, 0, VK_WHOLE_SIZE, 0, &address);
        if (done != VK_SUCCESS) vkFreeMemory(device_.handle(), block->memory, nullptr);
        vulkan_check(done, "vkMapMemory");
        block->mapped = static_cast<std::byte*>(address);
    }
    allocated_ += bytes;
    blocks_[type].push_back(std::move(block));
    return *blocks_[type].back();
}

BlockAllocator::Piece BlockAllocator::allocate(const VkMemoryRequirements& requirements, MemoryKind kind, bool linear) {
    const uint32_t type = memory_type(requirements.memoryTypeBits, kind);
    const bool mapped = kind != MemoryKind::device_local;
    const auto take = [&](Block& block, VkDeviceSize hole, VkDeviceSize size) {
        const VkDeviceSize begin = aligned(hole, requirements.alignment), end = begin + requirements.size;
        Holes made{{0, 0}, {1, 0}};
        block.spare.push_back(made.extract(0));
        // From here on nothing can fail.
        if (auto own = block.holes.extract(hole); begin > hole)
            put_hole(block.holes, std::move(own), hole, begin - hole);
        if (end < hole + size) put_hole(block.holes, made.extract(1), end, hole + size - end);
        return Piece{block.memory, begin, requirements.size, block.mapped != nullptr ? block.mapped + begin : nullptr,
                     type};
    };
    const bool dedicated = requirements.size >= block_bytes / 2;
    if (!dedicated) {
        for (const auto& block : blocks_[type]) {
            if (block->linear != linear || block->dedicated || (block->mapped != nullptr) != mapped) continue;
            for (const auto& [hole, size] : block->holes) {
                if (aligned(hole, requirements.alignment) + requirements.size <= hole + size)
                    return take(*block, hole, size);
            }
        }
    }
    const VkDeviceSize bytes = dedicated ? requirements.size : block_bytes;
    return take(add_block(type, bytes, mapped, linear, dedicated), 0, bytes);
}

void BlockAllocator::free(const Piece& piece) {
    auto& blocks = blocks_[piece.type];
    const auto found =
        std::find_if(blocks.begin(), blocks.end(), [&](const auto& b) { return b->memory == piece.memory; });
    LODE_CHECK(found != blocks.end());
    auto& holes = (*found)->holes;
    auto hole = put_hole(holes, std::move((*found)->spare.back()), piece.offset, piece.bytes);
    (*found)->spare.pop_back();
    if (const auto next = std::next(hole); next != holes.end() && hole->first + hole->second == next->first) {
        hole->second += next->second;
        holes.erase(next);
    }
    if (hole != holes.begin()) {
        const auto before = std::prev(hole);
        if (before->first + before->second == hole->first) {
            before->second += hole->second;
            holes.erase(hole);
            hole = before;
        }
    }
    if (!(*found)->empty()) return;
    const bool another = std::any_of(blocks.begin(), blocks.end(),
                                     [&](const auto& b) { return b != *found && b->empty() && b->is_like(**found); });
    if (!(*found)->dedicated && !another) return;
    vkFreeMemory(device_.handle(), (*found)->memory, nullptr);
    allocated_ -= (*found)->bytes;
    blocks.erase(found);
}

uint64_t BlockAllocator::trim() {
    uint64_t freed = 0;
    for (auto& [type, blocks] : blocks_) {
        std::erase_if(blocks, [&](const auto& block) {
            if (!block->empty()) return false;
            vkFreeMemory(device_.handle(), block->memory, nullptr);
            freed += block->bytes;
            return true;
        });
    }
    allocated_ -= freed;
    return freed;
}

Buffer::Buffer(BlockAllocator& allocator, VkDeviceSize bytes, VkBufferUsageFlags usage, MemoryKind kind,
               const std::string& name)
    : allocator_(&allocator), bytes_(bytes) {
    const Device& device = allocator.device();
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage = usage;
    info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
    LODE_VK(vkCreateBuffer(device.handle(), &info, nullptr, &buffer_));
    try {
        VkMemoryRequirements requirements{};
        vkGetBufferMemoryRequirements(device.handle(), buffer_, &requirements);
        piece_ = allocator.allocate(requirements, kind, true);
        LODE_VK(vkBindBufferMemory(device.handle(), buffer_, piece_.memory, piece_.offset));
        device.name(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<uint64_t>(buffer_), name);
    } catch (const VulkanFailure& failure) {
        vkDestroyBuffer(device.handle(), buffer_, nullptr);
        if (piece_.memory != VK_NULL_HANDLE) allocator.free(piece_);
        throw VulkanFailure("buffer '" + name + "' of " + std::to_string(bytes) + " bytes: " + failure.what(),
                            failure.result());
    }
}
Buffer::Buffer(Buffer&& o) noexcept
    : allocator_(o.allocator_), buffer_(std::exchange(o.buffer_, VK_NULL_HANDLE)), bytes_(o.bytes_), piece_(o.piece_) {}
Buffer& Buffer::operator=(Buffer&& o) noexcept {
    std::swap(allocator_, o.allocator_);
    std::swap(buffer_, o.buffer_);
    std::swap(bytes_, o.bytes_);
    std::swap(piece_, o.piece_);
    return *this;
}
Buffer::~Buffer() {
    if (buffer_ == VK_NULL_HANDLE) return;
    vkDestroyBuffer(allocator_->device().handle(), buffer_, nullptr);
    allocator_->free(piece_);
}

OwnedBufferView make_texel_view(const Device& device, VkBuffer buffer, uint32_t words) {
    LODE_CHECK(words == 1 || words == 2 || words == 4, words);
    VkBufferViewCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
    info.buffer = buffer;
    info.format = words == 1 ? VK_FORMAT_R32_UINT : words == 2 ? VK_FORMAT_R32G32_UINT : VK_FORMAT_R32G32B32A32_UINT;
    info.range = VK_WHOLE_SIZE;
    VkBufferView view = VK_NULL_HANDLE;
    LODE_VK(vkCreateBufferView(device.handle(), &info, nullptr, &view));
    return {device.handle(), view};
}

TargetImage::TargetImage(BlockAllocator& allocator, const ImageSpec& spec, const std::string& name)
    : allocator_(&allocator), spec_(spec) {
    const Device& device = allocator.device();
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    if (spec.view == VK_IMAGE_VIEW_TYPE_CUBE) info.flags = VK_IMAGE_CREATE_CUBE_COMPATIBLE_BIT;
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = spec.format;
    info.extent = {spec.width, spec.height, 1};
    info.mipLevels = spec.mips;
    info.arrayLayers = spec.layers;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = spec.usage;
    info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
    LODE_VK(vkCreateImage(device.handle(), &info, nullptr, &image_));
    try {
        VkMemoryRequirements requirements{};
        vkGetImageMemoryRequirements(device.handle(), image_, &requirements);
        piece_ = allocator.allocate(requirements, MemoryKind::device_local, false);
        LODE_VK(vkBindImageMemory(device.handle(), image_, piece_.memory, piece_.offset));
        VkImageViewCreateInfo view{};
        view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
        view.image = image_;
        view.viewType = spec.view;
        view.format = spec.format;
        view.subresourceRange = {aspect(), 0, spec.mips, 0, spec.layers};
        VkImageView handle = VK_NULL_HANDLE;
        LODE_VK(vkCreateImageView(device.handle(), &view, nullptr, &handle));
        view_ = OwnedImageView(device.handle(), handle);
        device.name(VK_OBJECT_TYPE_IMAGE, reinterpret_cast<uint64_t>(image_), name);
    } catch (const VulkanFailure& failure) {
        vkDestroyImage(device.handle(), image_, nullptr);
        if (piece_.memory != VK_NULL_HANDLE) allocator.free(piece_);
        throw VulkanFailure("image '" + name + "': " + failure.what(), failure.result());
    }
}
TargetImage::TargetImage(TargetImage&& o) noexcept
    : allocator_(o.allocator_),
      image_(std::exchange(o.image_, VK_NULL_HANDLE)),
      spec_(o.spec_),
      view_(std::move(o.view_)),
      piece_(o.piece_) {}
TargetImage& TargetImage::operator=(TargetImage&& o) noexcept {
    std::swap(allocator_, o.allocator_);
    std::swap(image_, o.image_);
    std::swap(spec_, o.spec_);
    std::swap(view_, o.view_);
    std::swap(piece_, o.piece_);
    return *this;
}
TargetImage::~TargetImage() {
    if (image_ == VK_NULL_HANDLE) return;
    view_ = {};
    vkDestroyImage(allocator_->device().handle(), image_, nullptr);
    allocator_->free(piece_);
}

}  // namespace lodestone
