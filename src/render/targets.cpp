#include "render/targets.h"

#include <algorithm>

namespace lodestone {

Targets make_targets(BlockAllocator& allocator, uint32_t width, uint32_t height, uint32_t shadow_size) {
    Targets targets;
    targets.colour = TargetImage(
        allocator,
        {colour_format, width, height, 1, 1, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT},
        "colour");
    targets.depth = TargetImage(
        allocator,
        {depth_format, width, height, 1, 1,
         VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_SAMPLED_BIT},
        "depth");
    for (TargetImage& image : targets.visibility) image = make_visibility(allocator, 1, 1);
    targets.radiance = make_radiance(allocator, 1, 1);
    const uint32_t side = std::max(shadow_size, 1u);
    targets.shadow_depth = TargetImage(
        allocator,
        {shadow_format, side, side, 1, 1, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT},
        "shadow_depth");
    return targets;
}

TargetImage make_visibility(BlockAllocator& allocator, uint32_t width, uint32_t height) {
    return {allocator,
            {visibility_format, width, height, 1, 1, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT},
            "visibility"};
}

TargetImage make_radiance(BlockAllocator& allocator, uint32_t width, uint32_t height) {
    return {allocator,
            {radiance_format, width, height, 1, 1, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT},
            "radiance"};
}

void change_use(VkCommandBuffer commands, const TargetImage& image, const ImageUse& from, const ImageUse& to,
                const ImageLevels& levels) {
    VkImageMemoryBarrier2 barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
    barrier.srcStageMask = from.stages;
    barrier.srcAccessMask = from.access;
    barrier.dstStageMask = to.stages;
    barrier.dstAccessMask = to.access;
    barrier.oldLayout = from.layout;
    barrier.newLayout = to.layout;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image.get();
    barrier.subresourceRange = {image.all_aspects(), levels.mip, levels.mips, levels.layer, levels.layers};
    VkDependencyInfo dependency{};
    dependency.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    dependency.imageMemoryBarrierCount = 1;
    dependency.pImageMemoryBarriers = &barrier;
    vkCmdPipelineBarrier2(commands, &dependency);
}

}  // namespace lodestone
