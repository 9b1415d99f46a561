#include "render/vulkan/commands.h"

namespace lodestone {

CommandPool::CommandPool(const Device& device) : device_(device) {
    VkCommandPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    info.queueFamilyIndex = device.queue_family();
    VkCommandPool pool = VK_NULL_HANDLE;
    LODE_VK(vkCreateCommandPool(device.handle(), &info, nullptr, &pool));
    pool_ = OwnedCommandPool(device.handle(), pool);
}

VkCommandBuffer CommandPool::allocate() const {
    VkCommandBufferAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    info.commandPool = pool_.get();
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    LODE_VK(vkAllocateCommandBuffers(device_.handle(), &info, &commands));
    return commands;
}

void CommandPool::begin(VkCommandBuffer commands) {
    VkCommandBufferBeginInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    LODE_VK(vkResetCommandBuffer(commands, 0));  // whoever began it before may have failed on the way
    LODE_VK(vkBeginCommandBuffer(commands, &info));
}

void CommandPool::submit(VkCommandBuffer commands, VkFence fence) const {
    LODE_VK(vkEndCommandBuffer(commands));
    VkCommandBufferSubmitInfo buffer{};
    buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
    buffer.commandBuffer = commands;
    VkSubmitInfo2 info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
    info.commandBufferInfoCount = 1;
    info.pCommandBufferInfos = &buffer;
    LODE_VK(vkQueueSubmit2(device_.queue(), 1, &info, fence));
}

void CommandPool::run(const std::function<void(VkCommandBuffer)>& record) const {
    struct Free {
        const CommandPool& pool;
        VkCommandBuffer commands;
        ~Free() { vkFreeCommandBuffers(pool.device_.handle(), pool.pool_.get(), 1, &commands); }
    };
    const Free commands{*this, allocate()};
    begin(commands.commands);
    record(commands.commands);
    submit(commands.commands, VK_NULL_HANDLE);
    LODE_VK(vkQueueWaitIdle(device_.queue()));
}

void memory_barrier(VkCommandBuffer commands, VkPipelineStageFlags2 from_stages, VkAccessFlags2 from_access,
                    VkPipelineStageFlags2 to_stages, VkAccessFlags2 to_access) {
    VkMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    barrier.srcStageMask = from_stages;
    barrier.srcAccessMask = from_access;
    barrier.dstStageMask = to_stages;
    barrier.dstAccessMask = to_access;
    VkDependencyInfo dependency{};
    dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    dependency.memoryBarrierCount = 1;
    dependency.pMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &dependency);
}

}  // namespace lodestone
