#include "render/frame_set.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "base/check.h"
#include "frame/screen_error.h"
#include "shaders/shared/materials.h"

namespace lodestone {

namespace {

// repeats: beyond 0 .. 1.
OwnedSampler make_sampler(const Device& device, bool filtered, bool repeats) {
    VkSamplerCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
    info.magFilter = info.minFilter = filtered ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
    info.mipmapMode = filtered ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = info.addressModeV = info.addressModeW =
        repeats ? VK_SAMPLER_ADDRESS_MODE_REPEAT : VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.maxLod = VK_LOD_CLAMP_NONE;
    VkSampler sampler = VK_NULL_HANDLE;
    LODE_VK(vkCreateSampler(device.handle(), &info, nullptr, &sampler));
    return {device.handle(), sampler};
}

}  // namespace

FrameSets::FrameSets(const Device& device, uint32_t slots) : device_(device) {
    constexpr VkShaderStageFlags all = VK_SHADER_STAGE_ALL_GRAPHICS | VK_SHADER_STAGE_COMPUTE_BIT;
    const VkDescriptorSetLayoutBinding bindings[] = {
        {LODE_FRAME_CONSTANTS, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1, all, nullptr},
        {LODE_INSTANCES, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, all, nullptr},
        {LODE_INSTANCE_IDS, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, all, nullptr},
        {LODE_MATERIALS, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, all, nullptr},
        {LODE_TEXTURES, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, LODE_MOST_TEXTURE_ARRAYS, all, nullptr},
        {LODE_SHADOW_DEPTH, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_LIGHT_GRID, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, all, nullptr},
        {LODE_TRIANGLE_MARKS, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, all, nullptr},
        {LODE_SCENE_DEPTH, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_VISIBILITY, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_FURTHER_VISIBILITY, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_RADIANCE, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_ENVIRONMENT, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
        {LODE_REFLECTED_SHARES, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, all, nullptr},
    };
    VkDescriptorSetLayoutCreateInfo layout_info{};
    layout_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    layout_info.bindingCount = std::size(bindings);
    layout_info.pBindings = bindings;
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorSetLayout(device.handle(), &layout_info, nullptr, &layout));
    layout_ = OwnedSetLayout(device.handle(), layout);

    const VkDescriptorPoolSize sizes[] = {
        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, slots},
        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, slots},
        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 4 * slots},
        {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, (LODE_MOST_TEXTURE_ARRAYS + 7) * slots}};
    VkDescriptorPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool_info.maxSets = slots;
    pool_info.poolSizeCount = std::size(sizes);
    pool_info.pPoolSizes = sizes;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorPool(device.handle(), &pool_info, nullptr, &pool));
    pool_ = OwnedDescriptorPool(device.handle(), pool);
    texture_sampler_ = make_sampler(device, true, true);
    texel_sampler_ = make_sampler(device, false, false);
    environment_sampler_ = make_sampler(device, true, false);
}

VkDescriptorSet FrameSets::allocate() const {
    const VkDescriptorSetLayout layout = layout_.get();
    VkDescriptorSetAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    info.descriptorPool = pool_.get();
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    VkDescriptorSet set = VK_NULL_HANDLE;
    LODE_VK(vkAllocateDescriptorSets(device_.handle(), &info, &set));
    return set;
}

void FrameSets::write(const FrameSlot& slot, const MaterialImages& materials, const Targets& targets,
                      VkBufferView light_grid) const {
    const std::pair<uint32_t, VkDescriptorBufferInfo> buffers[] = {
        {LODE_FRAME_CONSTANTS, {slot.constants.get(), 0, VK_WHOLE_SIZE}},
        {LODE_TRIANGLE_MARKS, {slot.marks.get(), 0, VK_WHOLE_SIZE}}};
    const std::pair<uint32_t, VkBufferView> texels[] = {{LODE_INSTANCES, slot.instances.view.get()},
                                                        {LODE_INSTANCE_IDS, slot.instance_ids.view.get()},
                                                        {LODE_MATERIALS, materials.table.view.get()},
                                                        {LODE_LIGHT_GRID, light_grid}};
    const std::pair<uint32_t, VkDescriptorImageInfo> images[] = {
        {LODE_SHADOW_DEPTH,
         {texel_sampler_.get(), targets.shadow_depth.view(), VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL}},
        {LODE_SCENE_DEPTH, {texel_sampler_.get(), targets.depth.view(), as_depth_read.layout}},
        {LODE_VISIBILITY, {texel_sampler_.get(), targets.visibility[0].view(), as_sampled.layout}},
        {LODE_FURTHER_VISIBILITY, {texel_sampler_.get(), targets.visibility[1].view(), as_sampled.layout}},
        {LODE_RADIANCE, {texel_sampler_.get(), targets.radiance.view(), as_sampled.layout}},
        {LODE_ENVIRONMENT, {environment_sampler_.get(), materials.environment.cube.view(), as_sampled.layout}},
        {LODE_REFLECTED_SHARES, {environment_sampler_.get(), materials.environment.shares.view(), as_sampled.layout}}};
    std::vector<VkWriteDescriptorSet> writes;
    const auto write = [&](uint32_t binding, VkDescriptorType type) -> VkWriteDescriptorSet& {
        VkWriteDescriptorSet& w = writes.emplace_back();
        w.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        w.dstSet = slot.frame_set;
        w.dstBinding = binding;
        w.descriptorCount = 1;
        w.descriptorType = type;
        return w;
    };
    std::vector<VkDescriptorImageInfo> textures;
    for (size_t i = 0; i < LODE_MOST_TEXTURE_ARRAYS; ++i) {
        const TargetImage& array = materials.arrays[i < materials.arrays.size() ? i : 0];
        textures.push_back({texture_sampler_.get(), array.view(), as_sampled.layout});
    }
    VkWriteDescriptorSet& arrays = write(LODE_TEXTURES, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER);
    arrays.descriptorCount = LODE_MOST_TEXTURE_ARRAYS;
    arrays.pImageInfo = textures.data();
    for (const auto& [binding, buffer] : buffers) {
        const bool constants = binding == LODE_FRAME_CONSTANTS;
        write(binding, constants ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER).pBufferInfo =
            &buffer;
    }
    for (const auto& [binding, view] : texels)
        write(binding, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER).pTexelBufferView = &view;
    for (const auto& [binding, image] : images)
        write(binding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER).pImageInfo = &image;
    vkUpdateDescriptorSets(device_.handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0, nullptr);
}

bool lit_by(const EnvironmentImages& environment, const ShadingOptions& look) {
    return environment.levels > 0 && look.environment && look.debug == DebugView::none;
}

gpu::FrameConstants frame_constants(const FrameInput& input, const ShadingOptions& look, uint32_t shadow_size,
                                    bool shows_backs, const EnvironmentImages& environment) {
    LODE_CHECK(input.views.size() <= LODE_MOST_VIEWS, input.views.size());
    gpu::FrameConstants c{};
    c.shadow_view = LODE_MOST_VIEWS;
    for (uint32_t v = 0; v < input.views.size(); ++v) {
        const View& view = input.views[v];
        const bool camera = view.kind == View::Kind::camera;
        c.views[v].world_to_clip = view.world_to_clip();
        c.views[v].clip_to_world =
            glm::mat4(glm::inverse(glm::dmat4(view.view_to_clip) * glm::dmat4(view.world_to_view)));
        c.views[v].eye = glm::vec4(view.eye, camera ? 1.0f : 0.0f);
        c.views[v].forward = glm::vec4(view.forward(), view.corner_cosine());
        c.views[v].pixel_angle = view.focal_px > 0 ? 1 / view.focal_px : 0.0f;
        c.views[v].target_width = static_cast<float>(camera ? view.width : shadow_size);
        c.views[v].target_height = static_cast<float>(camera ? view.height : shadow_size);
        if (camera || shadow_size == 0) continue;
        c.shadow_view = v;
        const glm::mat3 rows = glm::transpose(glm::mat3(c.views[v].world_to_clip));
        c.shadow_texel = 2.0f / (glm::length(rows[0]) * static_cast<float>(shadow_size));
    }
    c.to_light = glm::vec4(glm::normalize(-look.light_direction), 0);
    c.light_colour = glm::vec4(look.light_colour, 0);
    c.sky_colour = glm::vec4(look.sky_colour, 0);
    c.ground_colour = glm::vec4(look.ground_colour, 0);
    c.debug_view = static_cast<uint32_t>(look.debug);
    c.double_sided = look.double_sided ? 1 : 0;
    c.shows_backs = look.double_sided || shows_backs ? 1 : 0;
    c.environment_levels = lit_by(environment, look) ? static_cast<float>(environment.levels) : 0;
    std::ranges::copy(environment.matte, c.environment_matte);
    return c;
}

}  // namespace lodestone
