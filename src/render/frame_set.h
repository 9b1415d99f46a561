// Descriptor set 0: what every shader of a frame can see (shaders/shared/frame.glsl).
#pragma once

#include <span>
#include <vector>

#include "render/frame_slot.h"
#include "render/material_images.h"
#include "render/targets.h"
#include "shaders/shared/frame_constants.h"

namespace lodestone {

// Frames' set layout, pool and samplers.
class FrameSets {
public:
    FrameSets(const Device& device, uint32_t slots);
    VkDescriptorSetLayout layout() const { return layout_.get(); }
    VkDescriptorSet allocate() const;
    // Points the slot's set at its buffers and the shared images. The device must be done with the set.
    void write(const FrameSlot& slot, const MaterialImages& materials, const Targets& targets,
               VkBufferView light_grid) const;

private:
    const Device& device_;
    OwnedSetLayout layout_;
    OwnedDescriptorPool pool_;
    OwnedSampler texture_sampler_, texel_sampler_, environment_sampler_;
};

// shadow_size: texels a side of the shadow map; 0 turns shadows off. shows_backs: of what has one side, too.
// environment: that was loaded.
gpu::FrameConstants frame_constants(const FrameInput& input, const ShadingOptions& look, uint32_t shadow_size,
                                    bool shows_backs, const EnvironmentImages& environment);

// Whether the frame is lit by an environment. Debug views are not.
bool lit_by(const EnvironmentImages& environment, const ShadingOptions& look);

}  // namespace lodestone
