// The scene's materials on the device: the table, and its images with their mip levels.
#pragma once

#include "frame/materials.h"
#include "render/environment_images.h"
#include "render/recipe_build.h"
#include "render/vulkan/commands.h"
#include "render/vulkan/memory.h"

namespace lodestone {

struct MaterialImages {
    TexelBuffer table;  // gpu::MaterialConstants, in texels of four words
    // At least one, at most LODE_MOST_TEXTURE_ARRAYS. Each has images of one size and kind; one white texel where the
    // scene has none. Left as_sampled.
    std::vector<TargetImage> arrays;
    EnvironmentImages environment;
    SceneLooks looks;
};

// Uploads and waits. Mip levels are averaged in linear light. Images keep their sizes; only where they are of more
// sizes and kinds than there are arrays, small ones are enlarged.
MaterialImages make_material_images(BlockAllocator& allocator, const CommandPool& commands,
                                    const MaterialSet& materials);

}  // namespace lodestone
