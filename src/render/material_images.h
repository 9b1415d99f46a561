// The scene's materials on the device: the table, and the texture array with its mip levels.
#pragma once

#include "frame/materials.h"
#include "render/vulkan/commands.h"
#include "render/vulkan/memory.h"

namespace lodestone {

struct MaterialImages {
    TexelBuffer table;     // gpu::MaterialConstants, in texels of four words
    TargetImage textures;  // sRGB array, one white texel where the scene has none; left as_sampled
};

// Uploads and waits. Mip levels are averaged in linear light.
MaterialImages make_material_images(BlockAllocator& allocator, const CommandPool& commands,
                                    const MaterialSet& materials);

}  // namespace lodestone
