// Light from all around on the device (base/looks/environment.h).
#pragma once

#include <array>
#include <glm/vec4.hpp>

#include "base/looks/environment.h"
#include "render/targets.h"
#include "render/vulkan/commands.h"
#include "render/vulkan/memory.h"

namespace lodestone {

struct EnvironmentImages {
    // Left as_sampled; of one texel each where there is no environment.
    TargetImage cube, shares;
    uint32_t levels = 0;  // of the cube, by roughness; 0 where there is no environment
    std::array<glm::vec4, 9> matte{};
};

// Uploads and waits. environment: may be null.
EnvironmentImages make_environment_images(BlockAllocator& allocator, const CommandPool& commands,
                                          const Environment* environment);

}  // namespace lodestone
