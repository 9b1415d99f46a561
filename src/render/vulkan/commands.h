// Command buffers of one queue: begun, submitted, waited for.
#pragma once

#include <functional>

#include "render/vulkan/device.h"

namespace lodestone {

class CommandPool {
public:
    explicit CommandPool(const Device& device);
    VkCommandBuffer allocate() const;
    // Begins anew a command buffer that the device is done with.
    static void begin(VkCommandBuffer commands);
    // Ends and submits; `fence` is signalled when the device is done.
    void submit(VkCommandBuffer commands, VkFence fence) const;
    // Records, submits and waits.
    void run(const std::function<void(VkCommandBuffer)>& record) const;

private:
    const Device& device_;
    OwnedCommandPool pool_;
};

void memory_barrier(VkCommandBuffer commands, VkPipelineStageFlags2 from_stages, VkAccessFlags2 from_access,
                    VkPipelineStageFlags2 to_stages, VkAccessFlags2 to_access);

}  // namespace lodestone
