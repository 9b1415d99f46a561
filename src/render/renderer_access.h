// What the window shares with the renderer: the device, and the picture drawn last.
#pragma once

#include "render/targets.h"
#include "render/vulkan/commands.h"
#include "render/vulkan/memory.h"

namespace lodestone {

struct RendererAccess {
    const Device& device;
    const CommandPool& pool;
    BlockAllocator& allocator;
    const Targets& targets;
    ImageUse& colour_use;  // of targets.colour, once every submitted frame has been waited for
};

}  // namespace lodestone
