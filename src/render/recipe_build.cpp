#include "render/recipe_build.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "base/check.h"
#include "base/threads.h"
#include "render/shader_library.h"
#include "render/targets.h"
#include "shaders/shared/draw_constants.h"
#include "shaders/shared/frame_constants.h"
#include "shaders/shared/materials.h"

namespace lodestone {

std::vector<SplitBuffer::Part> SplitBuffer::parts(uint64_t offset, uint64_t bytes) const {
    std::vector<Part> all;
    for (uint64_t done = 0; done < bytes;) {
        const uint64_t at = offset + done, segment = at / segment_bytes, place = at % segment_bytes;
        const uint64_t length = std::min(bytes - done, segment_bytes - place);
        LODE_CHECK(segment < segments.size(), offset, bytes);
        all.push_back({segments[segment].get(), place, length, done});
        done += length;
    }
    return all;
}

Variant variant_of(const PipelineSpec& spec, Stage stage, const DrawnAs& as) {
    const bool lines = as.wire && !spec.whole_view, debug = as.debug || as.wire;
    if (stage == Stage::shadow) return Variant::shadow;
    if (stage == Stage::composite) return Variant::composite;
    if (stage == Stage::colour && as.beside_effect)
        return lines ? Variant::radiance_lines : debug ? Variant::radiance_debug : Variant::radiance;
    if (stage == Stage::colour) return lines ? Variant::colour_lines : debug ? Variant::colour_debug : Variant::colour;
    return lines ? Variant::depth_lines : as.debug && !spec.visibility.empty() ? Variant::depth_debug : Variant::depth;
}

Variant blended_variant_of(const DrawnAs& as) {
    if (as.beside_effect) return as.debug ? Variant::blended_radiance_debug : Variant::blended_radiance;
    return as.debug ? Variant::blended_debug : Variant::blended;
}

bool SceneLooks::cuts() const {
    const bool sides = (looks & LODE_LOOKS_ONE_SIDED) != 0 && (two_sided() || mirrors());
    return (looks & (LODE_LOOKS_MASK | LODE_LOOKS_BLEND)) != 0 || sides;
}
bool SceneLooks::two_sided() const { return (looks & LODE_LOOKS_TWO_SIDED) != 0; }
bool SceneLooks::mirrors() const { return (looks & LODE_LOOKS_MIRRORS) != 0; }
bool SceneLooks::blends() const { return (looks & LODE_LOOKS_BLEND) != 0; }

namespace {

bool in_colour_stage(Variant variant) { return variant >= Variant::colour && variant < Variant::composite; }
bool in_depth_stage(Variant variant) { return variant > Variant::shadow && variant < Variant::colour; }
// Without depths to test against.
bool over_all(Variant variant) { return variant >= Variant::composite; }
bool is_blended(Variant variant) { return variant >= Variant::blended && variant < Variant::composite; }
bool beside_effect(Variant variant) {
    return (variant >= Variant::radiance && variant < Variant::blended) || variant == Variant::blended_radiance ||
           variant == Variant::blended_radiance_debug;
}
bool is_background(Variant variant) {
    return variant == Variant::background || variant == Variant::background_radiance;
}
bool as_lines(Variant variant) {
    return variant == Variant::depth_lines || variant == Variant::colour_lines || variant == Variant::radiance_lines;
}
bool shows_debug_views(Variant variant) {
    return as_lines(variant) || variant == Variant::depth_debug || variant == Variant::colour_debug ||
           variant == Variant::radiance_debug || variant == Variant::blended_debug ||
           variant == Variant::blended_radiance_debug;
}
VkFormat format_drawn_to(Variant variant) {
    if (in_depth_stage(variant)) return visibility_format;
    return beside_effect(variant) || variant == Variant::composite ? radiance_format : colour_format;
}
// Lines show all triangles, whatever their materials. Shadows are thrown by either side.
SceneLooks looks_in(const SceneLooks& scene, Variant variant) {
    SceneLooks looks = scene;
    if (variant == Variant::shadow) looks.looks &= ~uint32_t{LODE_LOOKS_ONE_SIDED};
    if (as_lines(variant)) looks.looks &= ~uint32_t{LODE_LOOKS_MASK | LODE_LOOKS_BLEND | LODE_LOOKS_ONE_SIDED};
    return looks;
}
// looks: of the scene.
const std::string& fragment_of(const PipelineSpec& spec, Variant variant, const SceneLooks& looks) {
    static const std::string none;
    if (is_blended(variant)) return spec.blended;
    if (in_colour_stage(variant) || over_all(variant)) return spec.fragment;
    if (in_depth_stage(variant) && !spec.visibility.empty()) return spec.visibility;
    return looks_in(looks, variant).cuts() ? spec.cutout : none;
}

// Of so many bytes, in segments of which all but the last have segment_bytes.
std::vector<Buffer> make_segments(BlockAllocator& allocator, const BufferSpec& spec, uint64_t bytes,
                                  uint64_t segment_bytes) {
    VkBufferUsageFlags usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    if (spec.use & use_vertex) usage |= VK_BUFFER_USAGE_VERTEX_BUFFER_BIT;
    if (spec.use & use_index) usage |= VK_BUFFER_USAGE_INDEX_BUFFER_BIT;
    if (spec.use & use_storage) usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
    if (spec.use & use_indirect) usage |= VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
    std::vector<Buffer> segments;
    for (uint64_t done = 0; done < bytes; done += segment_bytes) {
        segments.emplace_back(allocator, std::min(segment_bytes, bytes - done), usage, MemoryKind::device_local,
                              spec.name + "[" + std::to_string(segments.size()) + "]");
    }
    return segments;
}

SplitBuffer make_buffer(BlockAllocator& allocator, const BufferSpec& spec, uint64_t segment_limit) {
    const uint64_t most = std::max(spec.bytes, spec.most_bytes);
    SplitBuffer buffer;
    buffer.segment_bytes = most;
    const bool only_storage = (spec.use & ~use_storage) == 0;
    if ((spec.use & use_storage) && most > segment_limit) {
        if (!only_storage)
            throw VulkanFailure(
                "buffer '" + spec.name +
                "' is too large to be bound as storage and is put to other uses, so it cannot be split");
        buffer.segment_bytes = segment_limit / spec.stride * spec.stride;
        if (buffer.segment_bytes == 0 || most > buffer.segment_bytes * max_pool_segments) {
            throw VulkanFailure("buffer '" + spec.name + "' of " + std::to_string(most) + " bytes does not fit " +
                                std::to_string(max_pool_segments) + " bindings of " + std::to_string(segment_limit) +
                                " bytes; lower the budget");
        }
        buffer.most_segments = static_cast<uint32_t>((most + buffer.segment_bytes - 1) / buffer.segment_bytes);
    }
    buffer.segments = make_segments(allocator, spec, spec.bytes, buffer.segment_bytes);
    return buffer;
}

VkDescriptorType descriptor_of(const StorageBinding& s) {
    return s.texel_words > 0 ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}
// Bytes that a buffer may have and still be bound at once by all pipelines; no more than asked, where all take pieces.
uint64_t segment_limit_of(const Device& device, const Recipe& recipe, uint32_t buffer, uint64_t asked) {
    const VkPhysicalDeviceLimits& limits = device.limits();
    uint64_t bytes = asked;
    for (const PipelineSpec& spec : recipe.pipelines) {
        for (const StorageBinding& s : spec.storage) {
            if (s.buffer == buffer && s.segments == 1) bytes = ~uint64_t{0};
        }
    }
    for (const PipelineSpec& spec : recipe.pipelines) {
        for (const StorageBinding& s : spec.storage) {
            if (s.buffer != buffer) continue;
            const uint64_t texel_bytes = s.texel_words * sizeof(uint32_t);
            bytes = std::min(
                bytes, s.texel_words == 0 ? limits.maxStorageBufferRange : limits.maxTexelBufferElements * texel_bytes);
        }
    }
    return bytes;
}

VkFormat format_of(VertexFormat format) {
    switch (format) {
        case VertexFormat::f32x2:
            return VK_FORMAT_R32G32_SFLOAT;
        case VertexFormat::f32x3:
            return VK_FORMAT_R32G32B32_SFLOAT;
        case VertexFormat::snorm16x2:
            return VK_FORMAT_R16G16_SNORM;
        case VertexFormat::unorm8x4:
            return VK_FORMAT_R8G8B8A8_UNORM;
        case VertexFormat::u32:
            return VK_FORMAT_R32_UINT;
    }
    return VK_FORMAT_UNDEFINED;
}

// The pipeline's own constants, and those that tell shaders how a split buffer is laid out
// (shaders/shared/texels.glsl).
class ShaderConstants {
public:
    // Of what runs on no surface.
    ShaderConstants(const PipelineSpec& spec, const std::vector<SplitBuffer>& buffers)
        : ShaderConstants(spec, buffers, Variant::resolve, {}) {}
    ShaderConstants(const PipelineSpec& spec, const std::vector<SplitBuffer>& buffers, Variant variant,
                    const SceneLooks& scene) {
        constexpr uint32_t first_words = 16,
                           first_count = 48;  // LODE_FIRST_SEGMENT_CONSTANT, LODE_FIRST_COUNT_CONSTANT
        const auto add = [&](uint32_t id, uint64_t value) {
            entries_.push_back({id, static_cast<uint32_t>(words_.size() * sizeof(uint32_t)), sizeof(uint32_t)});
            words_.push_back(static_cast<uint32_t>(value));
        };
        LODE_CHECK(spec.constants.size() <= LODE_BLENDING_CONSTANT, spec.name);
        for (uint32_t id = 0; id < spec.constants.size(); ++id) add(id, spec.constants[id]);
        add(LODE_BLENDING_CONSTANT, is_blended(variant) ? 1 : 0);
        add(LODE_TEXTURE_ARRAYS_CONSTANT, scene.texture_arrays);
        add(LODE_LOOKS_CONSTANT, looks_in(scene, variant).looks);
        add(LODE_EFFECT_CONSTANT, beside_effect(variant) ? 1 : 0);
        add(LODE_FRAGMENTS_CONSTANT, fragment_of(spec, variant, scene).empty() ? 0 : 1);
        add(LODE_DEBUG_CONSTANT, shows_debug_views(variant) ? 1 : 0);
        for (const StorageBinding& s : spec.storage) {
            add(first_words + s.binding, buffers[s.buffer].segment_bytes / sizeof(uint32_t));
            add(first_count + s.binding, buffers[s.buffer].most_segments);
        }
        info_ = {static_cast<uint32_t>(entries_.size()), entries_.data(), words_.size() * sizeof(uint32_t),
                 words_.data()};
    }
    ShaderConstants(const ShaderConstants&) = delete;
    ShaderConstants& operator=(const ShaderConstants&) = delete;
    const VkSpecializationInfo* get() const { return &info_; }

private:
    std::vector<VkSpecializationMapEntry> entries_;
    std::vector<uint32_t> words_;
    VkSpecializationInfo info_{};
};

// Throws VulkanFailure, naming the shader, where there is none.
std::span<const uint32_t> present_words(const std::string& name) {
    const auto words = shader_words(name);
    if (words.empty()) throw VulkanFailure("shader '" + name + "' is not part of this program");
    return words;
}

struct ShaderStages {
    const VkSpecializationInfo* constants;
    std::vector<OwnedShader> modules;
    std::vector<VkPipelineShaderStageCreateInfo> infos;
    void add(const Device& device, VkShaderStageFlagBits stage, const std::string& name) {
        if (name.empty()) return;
        modules.push_back(make_shader(device, name));
        VkPipelineShaderStageCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        info.stage = stage;
        info.module = modules.back().get();
        info.pName = "main";
        info.pSpecializationInfo = constants;
        infos.push_back(info);
    }
};

// What the depth stage of a recipe leaves beside depths: Recipe::visibility_targets and has_stencils.
struct RecipeTargets {
    uint32_t visibility = 0;
    bool stencils = false;
};

// The fixed state of a pipeline that draws: what Vulkan points to, so it must not be moved.
class DrawState {
public:
    // of: of the recipe.
    DrawState(const PipelineSpec& spec, Variant variant, const RecipeTargets& of) {
        set_input(spec);
        set_raster(variant);
        set_depth(spec, variant);
        if (of.stencils) set_stencil(spec, variant);
        set_targets(spec, variant, of.visibility);
        set_blend(spec, variant);
    }
    DrawState(const DrawState&) = delete;
    DrawState& operator=(const DrawState&) = delete;

    VkGraphicsPipelineCreateInfo info(const ShaderStages& stages, VkPipelineLayout layout) const {
        VkGraphicsPipelineCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
        info.pNext = &rendering_;
        info.stageCount = static_cast<uint32_t>(stages.infos.size());
        info.pStages = stages.infos.data();
        info.pVertexInputState = &input_;
        info.pInputAssemblyState = &assembly_;
        info.pTessellationState = patches_ ? &tessellation_ : nullptr;
        info.pViewportState = &viewport_;
        info.pRasterizationState = &raster_;
        info.pMultisampleState = &multisample_;
        info.pDepthStencilState = &depth_;
        info.pColorBlendState = &blend_;
        info.pDynamicState = &dynamic_;
        info.layout = layout;
        return info;
    }

private:
    void set_input(const PipelineSpec& spec) {
        for (const VertexAttribute& a : spec.layout.attributes)
            attributes_.push_back({a.location, 0, format_of(a.format), a.offset});
        binding_ = {0, spec.layout.stride, VK_VERTEX_INPUT_RATE_VERTEX};
        input_.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
        input_.vertexBindingDescriptionCount = spec.layout.stride > 0 ? 1 : 0;
        input_.pVertexBindingDescriptions = &binding_;
        input_.vertexAttributeDescriptionCount = static_cast<uint32_t>(attributes_.size());
        input_.pVertexAttributeDescriptions = attributes_.data();
        patches_ = !spec.tessellation_control.empty();
        assembly_.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
        assembly_.topology = patches_ ? VK_PRIMITIVE_TOPOLOGY_PATCH_LIST : VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
        tessellation_.sType = VK_STRUCTURE_TYPE_PIPELINE_TESSELLATION_STATE_CREATE_INFO;
        tessellation_.patchControlPoints = spec.patch_vertices;
    }
    void set_raster(Variant variant) {
        viewport_.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
        viewport_.viewportCount = viewport_.scissorCount = 1;
        raster_.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
        raster_.polygonMode = as_lines(variant) ? VK_POLYGON_MODE_LINE : VK_POLYGON_MODE_FILL;
        raster_.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
        raster_.lineWidth = 1;
        multisample_.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
        multisample_.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
        dynamic_.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
        dynamic_.dynamicStateCount = static_cast<uint32_t>(dynamic_states.size());
        dynamic_.pDynamicStates = dynamic_states.data();
    }
    void set_depth(const PipelineSpec& spec, Variant variant) {
        const bool coloured = in_colour_stage(variant);
        depth_.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
        depth_.depthTestEnable = over_all(variant) ? VK_FALSE : VK_TRUE;
        depth_.depthWriteEnable = !coloured && !over_all(variant);
        // Reversed depth; what the depth stage left is drawn once. What covers the view lies behind it all.
        depth_.depthCompareOp = spec.whole_view && !is_background(variant) ? VK_COMPARE_OP_LESS
                                : coloured && !is_blended(variant)         ? VK_COMPARE_OP_EQUAL
                                                                           : VK_COMPARE_OP_GREATER_OR_EQUAL;
    }
    // Of the camera's picture: the depth stage leaves it, what covers the view looks for its own.
    void set_stencil(const PipelineSpec& spec, Variant variant) {
        const bool left = in_depth_stage(variant), looked_for = spec.whole_view && in_colour_stage(variant);
        if (!left && !looked_for) return;
        LODE_CHECK(spec.stencil < 256, spec.name, spec.stencil);
        depth_.stencilTestEnable = VK_TRUE;
        depth_.front = {VK_STENCIL_OP_KEEP,
                        left ? VK_STENCIL_OP_REPLACE : VK_STENCIL_OP_KEEP,
                        VK_STENCIL_OP_KEEP,
                        left ? VK_COMPARE_OP_ALWAYS : VK_COMPARE_OP_EQUAL,
                        0xff,
                        left ? 0xffu : 0u,
                        spec.stencil};
        depth_.back = depth_.front;
    }
    void set_targets(const PipelineSpec& spec, Variant variant, uint32_t visibility_targets) {
        const bool coloured = in_colour_stage(variant) || over_all(variant);
        const uint32_t images = coloured                  ? 1
                                : in_depth_stage(variant) ? visibility_targets
                                                          : 0,
                       written = coloured                  ? 1
                                 : spec.visibility.empty() ? 0
                                                           : spec.visibility_targets;
        // All alike: what differs from target to target, not every device can mask.
        LODE_CHECK(written == 0 || coloured || written == visibility_targets, spec.name, written, visibility_targets);
        LODE_CHECK(images <= blend_attachments_.size(), spec.name, images);
        for (uint32_t k = 0; k < written; ++k) blend_attachments_[k].colorWriteMask = 0xf;
        formats_.fill(format_drawn_to(variant));
        blend_.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
        blend_.attachmentCount = images;
        blend_.pAttachments = blend_attachments_.data();
        rendering_.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO;
        rendering_.colorAttachmentCount = images;
        rendering_.pColorAttachmentFormats = formats_.data();
        rendering_.depthAttachmentFormat = over_all(variant)            ? VK_FORMAT_UNDEFINED
                                           : variant == Variant::shadow ? shadow_format
                                                                        : depth_format;
        rendering_.stencilAttachmentFormat =
            over_all(variant) || variant == Variant::shadow ? VK_FORMAT_UNDEFINED : depth_format;
    }

    void set_blend(const PipelineSpec& spec, Variant variant) {
        if (spec.blend == Blend::replace && !is_blended(variant)) return;
        VkPipelineColorBlendAttachmentState& attachment = blend_attachments_[0];
        attachment.blendEnable = VK_TRUE;
        if (spec.blend == Blend::over) {
            attachment.srcColorBlendFactor = VK_BLEND_FACTOR_ONE;
            attachment.dstColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
            attachment.srcAlphaBlendFactor = VK_BLEND_FACTOR_ZERO;
            attachment.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
        } else {
            attachment.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
            attachment.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
            attachment.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
            attachment.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
        }
    }

    static constexpr std::array<VkDynamicState, 3> dynamic_states = {
        VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR, VK_DYNAMIC_STATE_CULL_MODE};
    bool patches_ = false;
    std::vector<VkVertexInputAttributeDescription> attributes_;
    VkVertexInputBindingDescription binding_{};
    VkPipelineVertexInputStateCreateInfo input_{};
    VkPipelineInputAssemblyStateCreateInfo assembly_{};
    VkPipelineTessellationStateCreateInfo tessellation_{};
    VkPipelineViewportStateCreateInfo viewport_{};
    VkPipelineRasterizationStateCreateInfo raster_{};
    VkPipelineMultisampleStateCreateInfo multisample_{};
    VkPipelineDepthStencilStateCreateInfo depth_{};
    std::array<VkPipelineColorBlendAttachmentState, 2> blend_attachments_{};
    std::array<VkFormat, 2> formats_{};
    VkPipelineColorBlendStateCreateInfo blend_{};
    VkPipelineDynamicStateCreateInfo dynamic_{};
    VkPipelineRenderingCreateInfo rendering_{};
};

// fragment: its shader, or empty. of: of the recipe.
OwnedPipeline make_draw_pipeline(const Device& device, const PipelineSpec& spec, VkPipelineLayout layout,
                                 const VkSpecializationInfo* constants, Variant variant, const std::string& fragment,
                                 const RecipeTargets& of) {
    ShaderStages stages{constants, {}, {}};
    stages.add(device, VK_SHADER_STAGE_VERTEX_BIT, spec.vertex);
    stages.add(device, VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT, spec.tessellation_control);
    stages.add(device, VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT, spec.tessellation_evaluation);
    stages.add(device, VK_SHADER_STAGE_FRAGMENT_BIT, fragment);
    const DrawState state(spec, variant, of);
    const VkGraphicsPipelineCreateInfo info = state.info(stages, layout);
    VkPipeline pipeline = VK_NULL_HANDLE;
    LODE_VK(vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
    device.name(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<uint64_t>(pipeline), spec.name);
    return {device.handle(), pipeline};
}

OwnedPipeline make_compute_pipeline(const Device& device, const PipelineSpec& spec, VkPipelineLayout layout,
                                    const VkSpecializationInfo* constants) {
    ShaderStages stages{constants, {}, {}};
    stages.add(device, VK_SHADER_STAGE_COMPUTE_BIT, spec.compute);
    LODE_CHECK(stages.infos.size() == 1, spec.name);
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.stage = stages.infos[0];
    info.layout = layout;
    VkPipeline pipeline = VK_NULL_HANDLE;
    LODE_VK(vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
    device.name(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<uint64_t>(pipeline), spec.name);
    return {device.handle(), pipeline};
}

// What is not part of the program is told of before anything is drawn by it.
void check_shaders(const PipelineSpec& spec) {
    for (const std::string* name : {&spec.vertex, &spec.tessellation_control, &spec.tessellation_evaluation,
                                    &spec.fragment, &spec.visibility, &spec.cutout, &spec.blended, &spec.compute}) {
        if (!name->empty()) present_words(*name);
    }
}

// Every buffer must be bound at once, and be read only where it is read as texels.
void check_bindings(const PipelineSpec& spec, const std::vector<SplitBuffer>& buffers) {
    for (const StorageBinding& s : spec.storage) {
        LODE_CHECK(s.buffer < buffers.size() && s.segments >= 1 && s.segments <= max_pool_segments, s.buffer);
        LODE_CHECK(s.texel_words == 0 || s.access == Access::read, s.buffer);
        if (buffers[s.buffer].most_segments > s.segments)
            throw VulkanFailure("a buffer of pipeline '" + spec.name + "' is too large to be bound at once");
    }
}

OwnedSetLayout make_storage_layout(const Device& device, const PipelineSpec& spec, VkShaderStageFlags stages) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const StorageBinding& s : spec.storage)
        bindings.push_back({s.binding, descriptor_of(s), s.segments, stages, nullptr});
    VkDescriptorSetLayoutCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    info.bindingCount = static_cast<uint32_t>(bindings.size());
    info.pBindings = bindings.data();
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorSetLayout(device.handle(), &info, nullptr, &layout));
    return {device.handle(), layout};
}

OwnedPipelineLayout make_pipeline_layout(const Device& device, VkDescriptorSetLayout frame_layout,
                                         VkDescriptorSetLayout storage_layout, VkShaderStageFlags stages) {
    const VkPushConstantRange push_range{stages, 0, sizeof(DrawConstants)};
    const VkDescriptorSetLayout sets[] = {frame_layout, storage_layout};
    VkPipelineLayoutCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    info.setLayoutCount = 2;
    info.pSetLayouts = sets;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &push_range;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    LODE_VK(vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout));
    return {device.handle(), layout};
}

// Its layouts, and nothing that draws yet.
BuiltPipeline make_layouts(const Device& device, const PipelineSpec& spec, const std::vector<SplitBuffer>& buffers,
                           VkDescriptorSetLayout frame_layout) {
    check_bindings(spec, buffers);
    BuiltPipeline built;
    const bool compute = spec.kind == PipelineKind::compute;
    built.bind_point = compute ? VK_PIPELINE_BIND_POINT_COMPUTE : VK_PIPELINE_BIND_POINT_GRAPHICS;
    built.stages = compute ? VK_SHADER_STAGE_COMPUTE_BIT : VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
    if (!spec.tessellation_control.empty())
        built.stages |= VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT | VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT;
    built.storage_layout = make_storage_layout(device, spec, built.stages);
    built.layout = make_pipeline_layout(device, frame_layout, built.storage_layout.get(), built.stages);
    return built;
}

// Points the set at the segments of a binding. Those past the last are bound to the first, so that every descriptor is
// valid.
void write_binding(const Device& device, const StorageBinding& storage, std::span<const Buffer> segments,
                   VkDescriptorSet set, std::vector<OwnedBufferView>& texels) {
    std::vector<VkDescriptorBufferInfo> infos;
    std::vector<VkBufferView> views;
    for (uint32_t s = 0; s < storage.segments; ++s) {
        infos.push_back({segments[s < segments.size() ? s : 0].get(), 0, VK_WHOLE_SIZE});
        if (storage.texel_words == 0) continue;
        if (s < segments.size()) texels.push_back(make_texel_view(device, infos[s].buffer, storage.texel_words));
        views.push_back(s < segments.size() ? texels.back().get() : views[0]);
    }
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set;
    write.dstBinding = storage.binding;
    write.descriptorCount = storage.segments;
    write.descriptorType = descriptor_of(storage);
    write.pBufferInfo = infos.data();
    write.pTexelBufferView = views.data();
    vkUpdateDescriptorSets(device.handle(), 1, &write, 0, nullptr);
}

StorageSets make_storage_sets(const Device& device, const Recipe& recipe, const BuiltRecipe& built) {
    StorageSets sets;
    if (recipe.pipelines.empty()) return sets;
    VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1},
                                    {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1}};
    for (const PipelineSpec& spec : recipe.pipelines) {
        for (const StorageBinding& s : spec.storage) sizes[s.texel_words > 0 ? 1 : 0].descriptorCount += s.segments;
    }
    VkDescriptorPoolCreateInfo pool_info{};
    pool_info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    pool_info.maxSets = static_cast<uint32_t>(recipe.pipelines.size());
    pool_info.poolSizeCount = 2;
    pool_info.pPoolSizes = sizes;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    LODE_VK(vkCreateDescriptorPool(device.handle(), &pool_info, nullptr, &pool));
    sets.pool = OwnedDescriptorPool(device.handle(), pool);
    for (size_t p = 0; p < recipe.pipelines.size(); ++p) {
        const VkDescriptorSetLayout layout = built.pipelines[p].storage_layout.get();
        VkDescriptorSetAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &layout;
        LODE_VK(vkAllocateDescriptorSets(device.handle(), &allocate, &sets.pipelines.emplace_back()));
        for (const StorageBinding& storage : recipe.pipelines[p].storage)
            write_binding(device, storage, built.buffers[storage.buffer].segments, sets.pipelines[p], sets.texels);
    }
    return sets;
}

// Of the renderer itself, by shaders/frame/NAME.frag.
BuiltPipeline build_whole_view(const Device& device, VkDescriptorSetLayout frame_layout, const std::string& name,
                               std::initializer_list<Variant> variants) {
    PipelineSpec spec;
    spec.name = name;
    spec.vertex = "frame/whole_view.vert";
    spec.fragment = "frame/" + name + ".frag";
    spec.whole_view = true;
    BuiltPipeline built;
    built.stages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
    built.storage_layout = make_storage_layout(device, spec, built.stages);
    built.layout = make_pipeline_layout(device, frame_layout, built.storage_layout.get(), built.stages);
    for (const Variant variant : variants) {
        const ShaderConstants constants(spec, {}, variant, {});
        built.draw[static_cast<int>(variant)] =
            make_draw_pipeline(device, spec, built.layout.get(), constants.get(), variant, spec.fragment, {});
    }
    return built;
}

}  // namespace

OwnedShader make_shader(const Device& device, const std::string& name) {
    const auto words = present_words(name);
    VkShaderModuleCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    info.codeSize = words.size_bytes();
    info.pCode = words.data();
    VkShaderModule module = VK_NULL_HANDLE;
    LODE_VK(vkCreateShaderModule(device.handle(), &info, nullptr, &module));
    return {device.handle(), module};
}

BuiltRecipe build_recipe(BlockAllocator& allocator, const Recipe& recipe, VkDescriptorSetLayout frame_layout,
                         uint64_t segment_limit) {
    BuiltRecipe built;
    for (uint32_t b = 0; b < recipe.buffers.size(); ++b) {
        built.buffers.push_back(
            make_buffer(allocator, recipe.buffers[b], segment_limit_of(allocator.device(), recipe, b, segment_limit)));
    }
    for (const PipelineSpec& spec : recipe.pipelines) {
        check_shaders(spec);
        built.pipelines.push_back(make_layouts(allocator.device(), spec, built.buffers, frame_layout));
    }
    built.sets = make_storage_sets(allocator.device(), recipe, built);
    return built;
}

std::vector<PipelineUse> uses_of(const Recipe& recipe, const SceneLooks& looks, const DrawnAs& as) {
    std::vector<PipelineUse> uses;
    for (size_t p = 0; p < recipe.pipelines.size(); ++p) {
        const PipelineSpec& spec = recipe.pipelines[p];
        const auto add = [&](Stage stage) { uses.push_back({p, variant_of(spec, stage, as)}); };
        if (spec.kind == PipelineKind::compute || spec.blend != Blend::replace) {
            add(Stage::composite);
            continue;
        }
        if (!spec.whole_view) {
            add(Stage::shadow);
            add(Stage::depth);
        }
        if (spec.visibility.empty()) add(Stage::colour);
        if (looks.blends() && !spec.blended.empty()) uses.push_back({p, blended_variant_of(as)});
    }
    return uses;
}

std::vector<PipelineUse> uses_of(const Plan& plan, const Recipe& recipe, const SceneLooks& looks, const DrawnAs& as) {
    std::vector<PipelineUse> uses;
    const auto add = [&](const PipelineUse& use) {
        if (uses.empty() || uses.back() != use) uses.push_back(use);
    };
    const auto spec_of = [&](uint32_t pipeline, PipelineKind kind) -> const PipelineSpec& {
        LODE_CHECK(pipeline < recipe.pipelines.size(), pipeline);
        const PipelineSpec& spec = recipe.pipelines[pipeline];
        LODE_CHECK(spec.kind == kind, spec.name);
        return spec;
    };
    for (const Command& command : plan.commands) {
        if (const auto* dispatched = std::get_if<Dispatch>(&command.what)) {
            spec_of(dispatched->pipeline, PipelineKind::compute);
            add({dispatched->pipeline, Variant::composite});
        } else if (const Draw* draw = drawn_by(command)) {
            add({draw->pipeline, variant_of(spec_of(draw->pipeline, PipelineKind::draw), command.stage, as)});
        }
    }
    if (!looks.blends() || as.wire) return uses;
    // What is blended is drawn by the depth stage's draws.
    for (const Command& command : plan.commands) {
        const Draw* draw = drawn_by(command);
        if (draw != nullptr && command.stage == Stage::depth) add({draw->pipeline, blended_variant_of(as)});
    }
    return uses;
}

void build_pipelines(const Device& device, const Recipe& recipe, const SceneLooks& looks, std::vector<PipelineUse> uses,
                     BuiltRecipe& built) {
    const auto made = [&](const PipelineUse& use) -> OwnedPipeline& {
        BuiltPipeline& of = built.pipelines[use.pipeline];
        const bool computes = recipe.pipelines[use.pipeline].kind == PipelineKind::compute;
        return computes ? of.compute : of.draw[static_cast<size_t>(use.variant)];
    };
    std::erase_if(uses, [&](const PipelineUse& use) { return made(use).get() != VK_NULL_HANDLE; });
    std::ranges::sort(uses);
    uses.erase(std::unique(uses.begin(), uses.end()), uses.end());
    // Drivers compile them: each by itself, side by side.
    parallel_for(uses.size(), 1, [&](size_t begin, size_t end) {
        for (size_t u = begin; u < end; ++u) {
            const auto [pipeline, variant] = uses[u];
            const PipelineSpec& spec = recipe.pipelines[pipeline];
            const VkPipelineLayout layout = built.pipelines[pipeline].layout.get();
            if (spec.kind == PipelineKind::compute) {
                const ShaderConstants constants(spec, built.buffers);
                made(uses[u]) = make_compute_pipeline(device, spec, layout, constants.get());
                continue;
            }
            const ShaderConstants constants(spec, built.buffers, variant, looks);
            made(uses[u]) =
                make_draw_pipeline(device, spec, layout, constants.get(), variant, fragment_of(spec, variant, looks),
                                   {recipe.visibility_targets(), recipe.has_stencils()});
        }
    });
}

BuiltPipeline build_resolve(const Device& device, VkDescriptorSetLayout frame_layout) {
    return build_whole_view(device, frame_layout, "resolve", {Variant::resolve});
}

BuiltPipeline build_background(const Device& device, VkDescriptorSetLayout frame_layout) {
    return build_whole_view(device, frame_layout, "environment", {Variant::background, Variant::background_radiance});
}

Replaced resize_buffer(BlockAllocator& allocator, const Recipe& recipe, uint32_t number, uint64_t bytes,
                       BuiltRecipe& built) {
    SplitBuffer& buffer = built.buffers[number];
    SplitBuffer made{{}, buffer.segment_bytes, buffer.most_segments};
    made.segments = make_segments(allocator, recipe.buffers[number], bytes, buffer.segment_bytes);
    Replaced before{std::exchange(buffer, std::move(made)), {}};
    const bool seen = std::ranges::any_of(recipe.pipelines, [&](const PipelineSpec& pipeline) {
        return std::ranges::find(pipeline.storage, number, &StorageBinding::buffer) != pipeline.storage.end();
    });
    if (!seen) return before;
    try {
        before.sets = std::exchange(built.sets, make_storage_sets(allocator.device(), recipe, built));
    } catch (const VulkanFailure&) {
        buffer = std::move(before.buffer);
        throw;
    }
    return before;
}

}  // namespace lodestone
