// Records plans into the commands of a frame slot: uploads, barriers, passes, draws, readbacks, queries. In each stage
// a backend's commands come first, and then those of the effect beside it.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/environment_images.h"
#include "render/frame_slot.h"
#include "render/hazards.h"
#include "render/instance_table.h"
#include "render/recipe_build.h"
#include "render/targets.h"
#include "render/vulkan/commands.h"
#include "shaders/shared/draw_constants.h"

namespace lodestone {

// What a frame is recorded with. The slot is the frame's own; the rest is shared by all frames.
struct FrameContext {
    const Device& device;
    const CommandPool& pool;
    BlockAllocator& allocator;
    const Targets& targets;
    uint32_t shadow_size;
    FrameSlot& slot;
    const InstanceTable& instances;  // of the frame
    const BuiltPipeline& resolve;    // Variant::resolve
    const BuiltPipeline&
        background;           // Variant::background and background_radiance; empty where there is no environment
    const SceneLooks& looks;  // of the scene's materials
    const EnvironmentImages& environment;
};
// A plan, and what its numbers refer to.
struct RecordedPlan {
    const Plan& plan;
    Recipe& recipe;  // with the sizes that buffers have now
    BuiltRecipe& built;
    BufferHazards& hazards;
    std::vector<Replaced>& replaced;                     // what changes of size leave behind is added here
    std::vector<FrameSlot::PendingReadback>& readbacks;  // that are to be landed
};

// How a frame of that look is drawn.
DrawnAs drawn_as(const ShadingOptions& look, const Device& device, bool with_effect);

class FrameRecorder {
public:
    // effect: null where there is none.
    FrameRecorder(const FrameContext& context, const RecordedPlan& backend, const RecordedPlan* effect,
                  const FrameInput& input, const ShadingOptions& look);
    // Records everything; the slot's commands have begun and are left for the caller to submit. Commands that break the
    // contract fail a CHECK.
    void record();

private:
    void upload_frame_data();
    void upload(const Upload& command);
    void copy(const Copy& command);
    void resize(const Resize& command);
    void dispatch(const Dispatch& command);
    void read_back(const Readback& command);
    void flush_uploads();
    // Stages bytes for a buffer, submitting what is recorded so far whenever the staging memory is full.
    template <class Target>
    void stage_bytes(const std::byte* data, uint64_t bytes, Target&& place);

    void record_stage(Stage stage);
    void use_images(Stage stage);
    void record_commands(Stage stage, const RecordedPlan& plan);
    void record_blended();
    void record_background();
    void draw_over_view(const BuiltPipeline& pipeline, Variant variant);
    void resolve();
    void time_effect(const Command* next);
    void record_other(Stage stage, const Command& command);
    void draw_all(Stage stage, std::span<const Command* const> commands, bool clear);
    void begin_rendering(Stage stage, bool clear);
    void set_view(const VkExtent2D& extent) const;
    void use_draw_buffers(const Draw& draw, const DrawIndirect* indirect);
    void draw(const Command& command);
    Variant variant_drawn(const Command& command, const PipelineSpec& spec) const;
    void use_storage(const PipelineSpec& spec, VkPipelineStageFlags2 stages);
    void bind(uint32_t number, VkPipeline variant, uint32_t view, const Words& words,
              uint32_t first_mark = LODE_NO_MARKS);
    uint32_t first_mark_of(const Command& command) const;
    // What is bound, and what is pushed for it: other commands are recorded from here on, or it is not the same any
    // more.
    void forget_bound();

    FrameContext c_;
    const RecordedPlan& backend_;
    const RecordedPlan* effect_;
    const RecordedPlan* p_;  // of the two, whose commands are being recorded
    const FrameInput& input_;
    const ShadingOptions& look_;
    VkCommandBuffer commands_;
    bool has_shadow_ = false;
    bool cull_back_ = true;
    bool wire_ = false;
    uint32_t visibility_targets_ = 0;
    bool blending_ = false;  // draws of the depth stage are being drawn once more, to be blended

    struct PendingUpload {
        uint32_t buffer;
        VkBuffer destination;
        VkBufferCopy region;
    };
    std::vector<PendingUpload> pending_;
    std::map<std::pair<uint32_t, uint64_t>, uint64_t> pending_ranges_;  // buffer and first byte to end

    VkPipeline bound_pipeline_ = VK_NULL_HANDLE;
    std::optional<DrawConstants> pushed_;  // for it
    VkBuffer bound_vertices_ = VK_NULL_HANDLE, bound_indices_ = VK_NULL_HANDLE;
    uint64_t bound_vertex_offset_ = 0, bound_index_offset_ = 0;
};

}  // namespace lodestone
