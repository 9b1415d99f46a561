// The named targets a frame is drawn to.
#pragma once

#include <array>

#include "render/vulkan/memory.h"

namespace lodestone {

inline constexpr VkFormat depth_format = VK_FORMAT_D32_SFLOAT_S8_UINT;  // PipelineSpec::stencil beside depths
inline constexpr VkFormat shadow_format = VK_FORMAT_D32_SFLOAT;
inline constexpr VkFormat colour_format = VK_FORMAT_R8G8B8A8_SRGB;
inline constexpr VkFormat radiance_format = VK_FORMAT_R16G16B16A16_SFLOAT;
inline constexpr VkFormat visibility_format = VK_FORMAT_R32G32B32A32_UINT;

struct Targets {
    TargetImage colour, depth;              // of the camera views
    std::array<TargetImage, 2> visibility;  // of them; 1x1 where no recipe asks for it
    TargetImage radiance;      // linear colours of them until an effect is laid over; 1x1 where there is no effect
    TargetImage shadow_depth;  // 1x1 where there is no shadow map
};

Targets make_targets(BlockAllocator& allocator, uint32_t width, uint32_t height, uint32_t shadow_size);
TargetImage make_visibility(BlockAllocator& allocator, uint32_t width, uint32_t height);
TargetImage make_radiance(BlockAllocator& allocator, uint32_t width, uint32_t height);

// Levels of an image, all of them unless told otherwise.
struct ImageLevels {
    uint32_t mip = 0, mips = VK_REMAINING_MIP_LEVELS, layer = 0, layers = VK_REMAINING_ARRAY_LAYERS;
};

// An image from one use to another. `from` layout UNDEFINED drops what it held.
struct ImageUse {
    VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
    VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_NONE;
    VkAccessFlags2 access = VK_ACCESS_2_NONE;
};
void change_use(VkCommandBuffer commands, const TargetImage& image, const ImageUse& from, const ImageUse& to,
                const ImageLevels& levels = {});

// The uses images are put to.
inline constexpr ImageUse as_depth_target = {
    VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT,
    VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT};
// Tested against and sampled.
inline constexpr ImageUse as_depth_read = {
    VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL,
    VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT |
        VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
    VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_2_SHADER_SAMPLED_READ_BIT};
inline constexpr ImageUse as_colour_target = {
    VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
    VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
inline constexpr ImageUse as_sampled = {
    VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
    VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
    VK_ACCESS_2_SHADER_SAMPLED_READ_BIT};
inline constexpr ImageUse as_copy_source = {VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_2_COPY_BIT,
                                            VK_ACCESS_2_TRANSFER_READ_BIT};
inline constexpr ImageUse as_copy_destination = {VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                                 VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT};

}  // namespace lodestone
