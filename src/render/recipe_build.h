// A recipe made real: its buffers (split into segments where they must be), pipelines and descriptor sets.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "frame/plan.h"
#include "frame/recipe.h"
#include "render/vulkan/memory.h"

namespace lodestone {

// A buffer of the recipe. Segment i holds bytes i * segment_bytes .. of it; all but the last are full. As many bytes as
// it may ever have take most_segments.
struct SplitBuffer {
    std::vector<Buffer> segments;
    uint64_t segment_bytes = 0;
    uint32_t most_segments = 1;

    struct Part {  // of a range: within one segment
        VkBuffer buffer;
        uint64_t offset, bytes;
        uint64_t done;  // bytes of the range before this part
    };
    std::vector<Part> parts(uint64_t offset, uint64_t bytes) const;
    VkBuffer whole() const { return segments[0].get(); }  // of a buffer that is not split
};

// Where a draw pipeline is used decides what of it runs.
// debug: for a debug view; lines: that of wireframes; radiance: beside an effect; blended: what is blended, drawn by
// itself; composite: of an effect; background and resolve: of the renderer itself.
enum class Variant {
    shadow,
    depth,
    depth_debug,
    depth_lines,
    colour,
    colour_debug,
    colour_lines,
    background,
    radiance,
    radiance_debug,
    radiance_lines,
    background_radiance,
    blended,
    blended_debug,
    blended_radiance,
    blended_radiance_debug,
    composite,
    resolve,
};
inline constexpr int variant_count = 18;

struct BuiltPipeline {
    OwnedPipelineLayout layout;
    OwnedSetLayout storage_layout;
    std::array<OwnedPipeline, variant_count> draw;  // by Variant; empty for compute pipelines, and what is not made yet
    OwnedPipeline compute;                          // the same
    VkPipelineBindPoint bind_point = VK_PIPELINE_BIND_POINT_GRAPHICS;
    VkShaderStageFlags stages = 0;  // that see the push constants
};

// How a frame is drawn, as far as pipelines depend on it. wire: lines, on a device that draws them.
struct DrawnAs {
    bool debug = false, wire = false, beside_effect = false;
    bool operator==(const DrawnAs&) const = default;
};
// What a pipeline runs in a stage that draws.
Variant variant_of(const PipelineSpec& spec, Stage stage, const DrawnAs& as);
// What it runs to draw what is blended. as: without lines, which show all triangles alike.
Variant blended_variant_of(const DrawnAs& as);

// What shaders see buffers by, which goes with the buffers it was made of.
struct StorageSets {
    OwnedDescriptorPool pool;
    std::vector<OwnedBufferView> texels;     // of all bindings of texels
    std::vector<VkDescriptorSet> pipelines;  // descriptor set 1 of each
};

struct BuiltRecipe {
    std::vector<SplitBuffer> buffers;
    std::vector<BuiltPipeline> pipelines;
    StorageSets sets;
};

// What a change of a buffer's size leaves behind: frames under way may still read it.
struct Replaced {
    SplitBuffer buffer;
    StorageSets sets;  // empty where no shader sees the buffer
};

// A shader of the library; throws VulkanFailure, naming it, where there is none.
OwnedShader make_shader(const Device& device, const std::string& name);

// Gives buffer `number` of the recipe another size, and shaders sight of it. Its bytes are undefined. The recipe has
// the size that it had. Throws VulkanFailure where memory is short; everything is then as it was.
Replaced resize_buffer(BlockAllocator& allocator, const Recipe& recipe, uint32_t number, uint64_t bytes,
                       BuiltRecipe& built);

// What the materials of a scene ask of pipelines.
struct SceneLooks {
    uint32_t looks = 0;           // LODE_LOOKS_... bits
    uint32_t texture_arrays = 1;  // that are looked up in
    bool cuts() const;            // whether something of a surface is not there, or is blended
    bool blends() const;          // whether something is blended
    bool two_sided() const;       // whether something is shown from behind
    bool mirrors() const;         // whether fragments know of mirrored instances
};

// Without pipelines, which are made as they are used. frame_layout: of descriptor set 0. segment_limit: bytes a storage
// buffer may have before it is split, or fewer where the device says so.
// Throws VulkanFailure; a shader that is not in the library is named.
BuiltRecipe build_recipe(BlockAllocator& allocator, const Recipe& recipe, VkDescriptorSetLayout frame_layout,
                         uint64_t segment_limit);

// A pipeline of a recipe, and what it runs as. variant: of what computes, always composite.
struct PipelineUse {
    size_t pipeline;
    Variant variant;
    auto operator<=>(const PipelineUse&) const = default;
};
// All that frames drawn so may have.
std::vector<PipelineUse> uses_of(const Recipe& recipe, const SceneLooks& looks, const DrawnAs& as);
// What the frame of a plan has; some of it may be told more than once. The plan's pipelines are of the recipe, and draw
// or compute as its commands say.
std::vector<PipelineUse> uses_of(const Plan& plan, const Recipe& recipe, const SceneLooks& looks, const DrawnAs& as);
// Makes the pipelines of these that are not there. Throws VulkanFailure; what was there is there.
void build_pipelines(const Device& device, const Recipe& recipe, const SceneLooks& looks, std::vector<PipelineUse> uses,
                     BuiltRecipe& built);

// The renderer's own pipelines. Variant::resolve: from Targets::radiance to Targets::colour. Variant::background and
// background_radiance: what is all around.
BuiltPipeline build_resolve(const Device& device, VkDescriptorSetLayout frame_layout);
BuiltPipeline build_background(const Device& device, VkDescriptorSetLayout frame_layout);

}  // namespace lodestone
