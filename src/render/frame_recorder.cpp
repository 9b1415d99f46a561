#include "render/frame_recorder.h"

#include <algorithm>

#include "base/check.h"
#include "render/frame_set.h"
#include "shaders/shared/draw_constants.h"
#include "shaders/shared/frame_constants.h"

namespace lodestone {

namespace {

constexpr VkPipelineStageFlags2 shader_stages =
    VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_2_TESSELLATION_CONTROL_SHADER_BIT |
    VK_PIPELINE_STAGE_2_TESSELLATION_EVALUATION_SHADER_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT |
    VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;

VkPipelineStageFlags2 stages_of(const PipelineSpec& spec) {
    if (spec.kind == PipelineKind::compute) return VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
    VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT;
    if (!spec.tessellation_control.empty()) {
        stages |= VK_PIPELINE_STAGE_2_TESSELLATION_CONTROL_SHADER_BIT |
                  VK_PIPELINE_STAGE_2_TESSELLATION_EVALUATION_SHADER_BIT;
    }
    return stages;
}

const DrawIndirect* indirect_draw(const Command& command) { return std::get_if<DrawIndirect>(&command.what); }
static_assert(TriangleMarks::no_marks == LODE_NO_MARKS);

}  // namespace

FrameRecorder::FrameRecorder(const FrameContext& context, const RecordedPlan& backend, const RecordedPlan* effect,
                             const FrameInput& input, const ShadingOptions& look)
    : c_(context),
      backend_(backend),
      effect_(effect),
      p_(&backend),
      input_(input),
      look_(look),
      commands_(context.slot.commands) {
    for (const RecordedPlan* each : {&backend_, effect_}) {
        if (each == nullptr) continue;
        LODE_CHECK(each->plan.generation == each->recipe.generation, each->plan.generation, each->recipe.generation);
    }
    has_shadow_ = c_.shadow_size > 0 && std::any_of(input.views.begin(), input.views.end(),
                                                    [](const View& v) { return v.kind == View::Kind::shadow; });
    wire_ = drawn_as(look, context.device, effect != nullptr).wire;
    visibility_targets_ = backend_.recipe.visibility_targets();
    cull_back_ = !look.double_sided && !c_.looks.two_sided() && !c_.instances.any_mirrored();
}

DrawnAs drawn_as(const ShadingOptions& look, const Device& device, bool with_effect) {
    return {look.debug != DebugView::none, look.wireframe && device.draws_lines(), with_effect};
}

void FrameRecorder::record() {
    if (c_.device.has_statistics()) vkCmdResetQueryPool(commands_, c_.slot.statistics.get(), 0, stage_count);
    if (c_.device.has_timestamps()) {
        vkCmdResetQueryPool(commands_, c_.slot.timestamps.get(), 0, stage_count + 1);
        vkCmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, c_.slot.timestamps.get(), 0);
    }
    c_.slot.effect_timed.clear();
    if (effect_ != nullptr && c_.device.has_timestamps())
        vkCmdResetQueryPool(commands_, c_.slot.effect_timestamps.get(), 0, most_effect_timestamps);
    upload_frame_data();
    for (uint32_t s = 0; s < stage_count; ++s) {
        // The update stage may submit and begin anew, and a label must end in the commands it began in.
        const bool labelled = static_cast<Stage>(s) != Stage::update;
        if (labelled) c_.device.begin_label(commands_, name_of(static_cast<Stage>(s)));
        record_stage(static_cast<Stage>(s));
        if (labelled) c_.device.end_label(commands_);
        if (c_.device.has_timestamps())
            vkCmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, c_.slot.timestamps.get(), s + 1);
    }
    if (!c_.slot.readbacks.empty() || !c_.slot.effect_readbacks.empty()) {
        memory_barrier(commands_, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                       VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
    }
}

template <class Target>
void FrameRecorder::stage_bytes(const std::byte* data, uint64_t bytes, Target&& place) {
    Staging& staging = c_.slot.staging;
    for (uint64_t done = 0; done < bytes;) {
        if (staging.free_bytes() < 16) {
            flush_uploads();
            c_.pool.submit(commands_, VK_NULL_HANDLE);
            LODE_VK(vkQueueWaitIdle(c_.device.queue()));
            staging.reset();
            CommandPool::begin(commands_);
            forget_bound();
        }
        const uint64_t length = std::min<uint64_t>(bytes - done, staging.free_bytes());
        place(staging.put(data + done, length), done, length);
        done += length;
    }
}

void FrameRecorder::forget_bound() {
    bound_pipeline_ = VK_NULL_HANDLE;
    bound_vertices_ = bound_indices_ = VK_NULL_HANDLE;
}

void FrameRecorder::upload_frame_data() {
    const bool shows_backs = c_.instances.any_mirrored() && !c_.looks.mirrors();
    const gpu::FrameConstants constants = frame_constants(input_, look_, c_.shadow_size, shows_backs, c_.environment);
    const auto put = [&](const Buffer& buffer, const void* data, uint64_t bytes, uint64_t offset = 0) {
        stage_bytes(static_cast<const std::byte*>(data), bytes,
                    [&](VkDeviceSize staged, uint64_t done, uint64_t length) {
                        const VkBufferCopy region{staged, offset + done, length};
                        vkCmdCopyBuffer(commands_, c_.slot.staging.get(), buffer.get(), 1, &region);
                    });
    };
    put(c_.slot.constants, &constants, sizeof constants);
    constexpr size_t each = sizeof(gpu::InstanceConstants);
    for (const InstanceTable::Range& range : c_.instances.stale(c_.slot.instances_version))
        put(c_.slot.instances.buffer, c_.instances.all().data() + range.first, range.count * each, range.first * each);
    c_.slot.instances_version = c_.instances.version();
    put(c_.slot.instance_ids.buffer, p_->plan.instance_ids.data(),
        p_->plan.instance_ids.size() * sizeof p_->plan.instance_ids[0]);
    if (look_.marks != nullptr) put(c_.slot.marks, look_.marks->of_triangles.data(), look_.marks->of_triangles.size());
    memory_barrier(commands_, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, shader_stages,
                   VK_ACCESS_2_UNIFORM_READ_BIT | VK_ACCESS_2_SHADER_READ_BIT);
}

void FrameRecorder::upload(const Upload& command) {
    LODE_CHECK(command.buffer < p_->built.buffers.size(), command.buffer);
    const uint64_t end = command.offset + command.blob.size();
    LODE_CHECK(end <= p_->recipe.buffers[command.buffer].bytes, end, p_->recipe.buffers[command.buffer].bytes);
    // Copies of one batch run in any order, so ranges that overlap go into batches of their own.
    const auto after = pending_ranges_.lower_bound({command.buffer, command.offset});
    bool overlaps = after != pending_ranges_.end() && after->first.first == command.buffer && after->first.second < end;
    if (after != pending_ranges_.begin()) {
        const auto before = std::prev(after);
        overlaps = overlaps || (before->first.first == command.buffer && before->second > command.offset);
    }
    if (overlaps) flush_uploads();
    pending_ranges_[{command.buffer, command.offset}] = end;
    stage_bytes(command.blob.data(), command.blob.size(), [&](VkDeviceSize staged, uint64_t done, uint64_t length) {
        for (const SplitBuffer::Part& part : p_->built.buffers[command.buffer].parts(command.offset + done, length)) {
            pending_.push_back({command.buffer, part.buffer, {staged + part.done, part.offset, part.bytes}});
        }
    });
}

void FrameRecorder::flush_uploads() {
    if (pending_.empty()) return;
    std::stable_sort(pending_.begin(), pending_.end(),
                     [](const PendingUpload& a, const PendingUpload& b) { return a.buffer < b.buffer; });
    for (size_t i = 0; i < pending_.size(); ++i) {
        if (i == 0 || pending_[i].buffer != pending_[i - 1].buffer)
            p_->hazards.use(pending_[i].buffer, {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, true});
    }
    p_->hazards.flush(commands_);
    std::vector<VkBufferCopy> regions;
    for (size_t i = 0; i < pending_.size(); ++i) {
        regions.push_back(pending_[i].region);
        if (i + 1 < pending_.size() && pending_[i + 1].destination == pending_[i].destination) continue;
        vkCmdCopyBuffer(commands_, c_.slot.staging.get(), pending_[i].destination,
                        static_cast<uint32_t>(regions.size()), regions.data());
        regions.clear();
    }
    pending_.clear();
    pending_ranges_.clear();
}

void FrameRecorder::copy(const Copy& command) {
    LODE_CHECK(command.source < p_->built.buffers.size() && command.destination < p_->built.buffers.size(),
               command.source, command.destination);
    p_->hazards.use(command.source, {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_READ_BIT, false});
    p_->hazards.use(command.destination, {VK_PIPELINE_STAGE_2_COPY_BIT,
                                          VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT, true});
    p_->hazards.flush(commands_);
    for (const auto& from : p_->built.buffers[command.source].parts(command.source_offset, command.bytes)) {
        for (const auto& to :
             p_->built.buffers[command.destination].parts(command.destination_offset + from.done, from.bytes)) {
            const VkBufferCopy region{from.offset + to.done, to.offset, to.bytes};
            vkCmdCopyBuffer(commands_, from.buffer, to.buffer, 1, &region);
        }
    }
}

void FrameRecorder::resize(const Resize& command) {
    LODE_CHECK(command.buffer < p_->built.buffers.size(), command.buffer);
    BufferSpec& spec = p_->recipe.buffers[command.buffer];
    LODE_CHECK(command.bytes > 0 && command.bytes <= spec.most_bytes && command.bytes % spec.stride == 0, spec.name,
               command.bytes, spec.most_bytes);
    LODE_CHECK(command.kept <= std::min(spec.bytes, command.bytes), spec.name, command.kept);
    p_->replaced.push_back(resize_buffer(c_.allocator, p_->recipe, command.buffer, command.bytes, p_->built));
    forget_bound();  // descriptor sets may be others
    spec.bytes = command.bytes;
    p_->hazards.use(command.buffer, {VK_PIPELINE_STAGE_2_COPY_BIT,
                                     VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT, true});
    p_->hazards.flush(commands_);
    for (const auto& from : p_->replaced.back().buffer.parts(0, command.kept)) {
        for (const auto& to : p_->built.buffers[command.buffer].parts(from.done, from.bytes)) {
            const VkBufferCopy region{from.offset + to.done, to.offset, to.bytes};
            vkCmdCopyBuffer(commands_, from.buffer, to.buffer, 1, &region);
        }
    }
}

void FrameRecorder::read_back(const Readback& command) {
    LODE_CHECK(command.buffer < p_->built.buffers.size() && command.bytes > 0, command.buffer, command.bytes);
    p_->hazards.use(command.buffer, {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_READ_BIT, false});
    p_->hazards.flush(commands_);
    Buffer landing(c_.allocator, command.bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::readback, "readback");
    for (const auto& from : p_->built.buffers[command.buffer].parts(command.offset, command.bytes)) {
        const VkBufferCopy region{from.offset, from.done, from.bytes};
        vkCmdCopyBuffer(commands_, from.buffer, landing.get(), 1, &region);
    }
    p_->readbacks.push_back({command.tag, std::move(landing)});
}

void FrameRecorder::use_storage(const PipelineSpec& spec, VkPipelineStageFlags2 stages) {
    // A buffer bound twice is used once, with all its accesses.
    for (size_t i = 0; i < spec.storage.size(); ++i) {
        const uint32_t buffer = spec.storage[i].buffer;
        bool writes = false, seen = false;
        VkAccessFlags2 access = 0;
        for (size_t k = 0; k < spec.storage.size(); ++k) {
            if (spec.storage[k].buffer != buffer) continue;
            seen = seen || k < i;
            const StorageBinding& binding = spec.storage[k];
            writes = writes || binding.access != Access::read;
            if (binding.access != Access::write)
                access |=
                    binding.texel_words > 0 ? VK_ACCESS_2_SHADER_SAMPLED_READ_BIT : VK_ACCESS_2_SHADER_STORAGE_READ_BIT;
        }
        if (seen) continue;
        if (writes) access |= VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;
        p_->hazards.use(buffer, {stages, access, writes});
    }
}

uint32_t FrameRecorder::first_mark_of(const Command& command) const {
    const auto number = static_cast<size_t>(&command - p_->plan.commands.data());
    return look_.marks != nullptr && number < look_.marks->first.size() ? look_.marks->first[number] : LODE_NO_MARKS;
}

void FrameRecorder::bind(uint32_t number, VkPipeline variant, uint32_t view, const Words& words, uint32_t first_mark) {
    const BuiltPipeline& pipeline = p_->built.pipelines[number];
    if (bound_pipeline_ != variant) {
        vkCmdBindPipeline(commands_, pipeline.bind_point, variant);
        const VkDescriptorSet sets[] = {c_.slot.frame_set, p_->built.sets.pipelines[number]};
        vkCmdBindDescriptorSets(commands_, pipeline.bind_point, pipeline.layout.get(), 0, 2, sets, 0, nullptr);
        bound_pipeline_ = variant;
        pushed_.reset();
    }
    DrawConstants constants{};
    constants.view = view;
    constants.first_mark = first_mark;
    std::copy(words.begin(), words.end(), constants.words);
    if (pushed_ == constants) return;
    pushed_ = constants;
    vkCmdPushConstants(commands_, pipeline.layout.get(), pipeline.stages, 0, sizeof constants, &constants);
}

void FrameRecorder::dispatch(const Dispatch& command) {
    const PipelineSpec& spec = p_->recipe.pipelines[command.pipeline];
    const bool indirect = command.arguments != no_buffer;
    // Before the storage: the pipeline itself may write its arguments' buffer, after they are read.
    if (indirect)
        p_->hazards.use(command.arguments,
                        {VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, false});
    use_storage(spec, stages_of(spec));
    p_->hazards.flush(commands_);
    bind(command.pipeline, p_->built.pipelines[command.pipeline].compute.get(), command.view, command.words);
    if (indirect) {
        vkCmdDispatchIndirect(commands_, p_->built.buffers[command.arguments].whole(), command.offset);
    } else {
        vkCmdDispatch(commands_, command.groups[0], command.groups[1], command.groups[2]);
    }
}

void FrameRecorder::begin_rendering(Stage stage, bool clear) {
    const Targets& targets = c_.targets;
    const bool composed = stage == Stage::composite;
    const TargetImage& depth = stage == Stage::shadow ? targets.shadow_depth : targets.depth;
    const VkExtent2D extent{depth.spec().width, depth.spec().height};
    VkRenderingAttachmentInfo depth_attachment{};
    depth_attachment.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO;
    depth_attachment.imageView = depth.view();
    const bool coloured = stage == Stage::colour, visible = stage == Stage::depth && visibility_targets_ > 0;
    depth_attachment.imageLayout = coloured ? as_depth_read.layout : as_depth_target.layout;
    depth_attachment.loadOp = clear && !coloured ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
    depth_attachment.storeOp = coloured ? VK_ATTACHMENT_STORE_OP_NONE : VK_ATTACHMENT_STORE_OP_STORE;
    depth_attachment.clearValue.depthStencil = {0, 0};
    std::array<VkRenderingAttachmentInfo, 2> attachments{};
    VkRenderingAttachmentInfo& colour_attachment = attachments[0];
    colour_attachment.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO;
    const TargetImage& coloured_target = effect_ != nullptr ? targets.radiance : targets.colour;
    colour_attachment.imageView = coloured || composed ? coloured_target.view() : targets.visibility[0].view();
    colour_attachment.imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    // 16 bytes to clear for each pixel can cost more than all that is drawn.
    const bool dropped = visible && backend_.recipe.writes_all_visible();
    colour_attachment.loadOp = !clear    ? VK_ATTACHMENT_LOAD_OP_LOAD
                               : dropped ? VK_ATTACHMENT_LOAD_OP_DONT_CARE
                                         : VK_ATTACHMENT_LOAD_OP_CLEAR;
    colour_attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    if (coloured) {
        colour_attachment.clearValue.color = {{look_.background.r, look_.background.g, look_.background.b, 0}};
    } else {
        std::ranges::fill(colour_attachment.clearValue.color.uint32, LODE_NOTHING_VISIBLE);
    }
    // Read only where the first tells of something.
    attachments[1] = colour_attachment;
    attachments[1].imageView = targets.visibility[1].view();
    if (clear) attachments[1].loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    VkRenderingInfo rendering{};
    rendering.sType = VK_STRUCTURE_TYPE_RENDERING_INFO;
    rendering.renderArea = {{0, 0}, extent};
    rendering.layerCount = 1;
    rendering.colorAttachmentCount = coloured || composed ? 1 : visible ? visibility_targets_ : 0;
    rendering.pColorAttachments = attachments.data();
    rendering.pDepthAttachment = composed ? nullptr : &depth_attachment;
    rendering.pStencilAttachment = composed || stage == Stage::shadow ? nullptr : &depth_attachment;
    vkCmdBeginRendering(commands_, &rendering);
    set_view(extent);
    vkCmdSetCullMode(commands_, cull_back_ && stage != Stage::shadow ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE);
}

void FrameRecorder::set_view(const VkExtent2D& extent) const {
    const VkViewport viewport{0, 0, static_cast<float>(extent.width), static_cast<float>(extent.height), 0, 1};
    const VkRect2D scissor{{0, 0}, extent};
    vkCmdSetViewport(commands_, 0, 1, &viewport);
    vkCmdSetScissor(commands_, 0, 1, &scissor);
}

void FrameRecorder::use_draw_buffers(const Draw& draw, const DrawIndirect* indirect) {
    const PipelineSpec& spec = p_->recipe.pipelines[draw.pipeline];
    if (spec.layout.stride > 0)
        p_->hazards.use(draw.vertex_buffer,
                        {VK_PIPELINE_STAGE_2_VERTEX_ATTRIBUTE_INPUT_BIT, VK_ACCESS_2_VERTEX_ATTRIBUTE_READ_BIT, false});
    if (draw.index_buffer != no_buffer)
        p_->hazards.use(draw.index_buffer, {VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT, VK_ACCESS_2_INDEX_READ_BIT, false});
    use_storage(spec, stages_of(spec));
    if (indirect == nullptr) return;
    p_->hazards.use(indirect->arguments,
                    {VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, false});
    if (indirect->count_buffer != no_buffer)
        p_->hazards.use(indirect->count_buffer,
                        {VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, false});
}

Variant FrameRecorder::variant_drawn(const Command& command, const PipelineSpec& spec) const {
    const DrawnAs as = drawn_as(look_, c_.device, effect_ != nullptr);
    return blending_ ? blended_variant_of(as) : variant_of(spec, command.stage, as);
}

void FrameRecorder::draw(const Command& command) {
    const Stage stage = command.stage;
    const DrawIndirect* indirect = indirect_draw(command);
    const Draw& d = *drawn_by(command);
    LODE_CHECK(d.view < input_.views.size(), d.view);
    LODE_CHECK(stage == Stage::shadow ? input_.views[d.view].kind == View::Kind::shadow : d.view == 0, d.view);
    if (indirect == nullptr && (d.count == 0 || d.instances == 0)) return;
    const Variant variant = variant_drawn(command, p_->recipe.pipelines[d.pipeline]);
    const VkPipeline built = p_->built.pipelines[d.pipeline].draw[static_cast<int>(variant)].get();
    LODE_CHECK(built != VK_NULL_HANDLE, p_->recipe.pipelines[d.pipeline].name, name_of(stage));
    bind(d.pipeline, built, d.view, d.words, first_mark_of(command));
    if (p_->recipe.pipelines[d.pipeline].layout.stride > 0) {
        const VkBuffer vertices = p_->built.buffers[d.vertex_buffer].whole();
        if (vertices != bound_vertices_ || d.vertex_offset != bound_vertex_offset_)
            vkCmdBindVertexBuffers(commands_, 0, 1, &vertices, &d.vertex_offset);
        bound_vertices_ = vertices;
        bound_vertex_offset_ = d.vertex_offset;
    }
    const bool indexed = d.index_buffer != no_buffer;
    // Where the first index is said by the draw, the buffer stays bound from draw to draw.
    const uint64_t first_index = indirect == nullptr ? d.index_offset / sizeof(uint32_t) : 0;
    if (indexed) {
        const VkBuffer indices = p_->built.buffers[d.index_buffer].whole();
        const uint64_t offset = d.index_offset - first_index * sizeof(uint32_t);
        if (indices != bound_indices_ || offset != bound_index_offset_)
            vkCmdBindIndexBuffer(commands_, indices, offset, VK_INDEX_TYPE_UINT32);
        bound_indices_ = indices;
        bound_index_offset_ = offset;
    }
    if (indirect == nullptr) {
        if (indexed) {
            vkCmdDrawIndexed(commands_, d.count, d.instances, static_cast<uint32_t>(first_index), 0, d.first_id);
        } else {
            vkCmdDraw(commands_, d.count, d.instances, d.first_vertex, d.first_id);
        }
        return;
    }
    const VkBuffer arguments = p_->built.buffers[indirect->arguments].whole();
    if (indirect->count_buffer != no_buffer) {
        LODE_CHECK(c_.device.has_draw_indirect_count());
        const VkBuffer count = p_->built.buffers[indirect->count_buffer].whole();
        const auto call = indexed ? vkCmdDrawIndexedIndirectCount : vkCmdDrawIndirectCount;
        call(commands_, arguments, indirect->offset, count, indirect->count_offset, indirect->draws, indirect->stride);
    } else {
        // One record a call: not every device takes more.
        const auto call = indexed ? vkCmdDrawIndexedIndirect : vkCmdDrawIndirect;
        for (uint32_t i = 0; i < indirect->draws; ++i)
            call(commands_, arguments, indirect->offset + uint64_t{i} * indirect->stride, 1, indirect->stride);
    }
}

// Images get ready for what the stage does with them.
void FrameRecorder::use_images(Stage stage) {
    constexpr ImageUse dropped_depth = {
        VK_IMAGE_LAYOUT_UNDEFINED,
        as_depth_target.stages | VK_PIPELINE_STAGE_2_COPY_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
        VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT};
    constexpr ImageUse dropped_image = {
        VK_IMAGE_LAYOUT_UNDEFINED,
        as_colour_target.stages | VK_PIPELINE_STAGE_2_COPY_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
        VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
    const Targets& targets = c_.targets;
    if (stage == Stage::shadow)
        change_use(commands_, targets.shadow_depth, dropped_depth, has_shadow_ ? as_depth_target : as_sampled);
    if (stage == Stage::depth) {
        change_use(commands_, targets.depth, dropped_depth, as_depth_target);
        // What shaders name must be ready to be read, even if they do not.
        for (uint32_t k = 0; k < targets.visibility.size() && visibility_targets_ > 0; ++k)
            change_use(commands_, targets.visibility[k], dropped_image,
                       k < visibility_targets_ ? as_colour_target : as_sampled);
    }
    if (stage == Stage::effect) change_use(commands_, targets.depth, as_depth_target, as_depth_read);
    if (stage == Stage::colour) {
        for (uint32_t k = 0; k < visibility_targets_; ++k)
            change_use(commands_, targets.visibility[k], as_colour_target, as_sampled);
        change_use(commands_, effect_ != nullptr ? targets.radiance : targets.colour, dropped_image, as_colour_target);
    }
}

// The picture as it is shown, from what the colour stage and the effect left.
void FrameRecorder::resolve() {
    constexpr ImageUse dropped = {
        VK_IMAGE_LAYOUT_UNDEFINED,
        as_colour_target.stages | VK_PIPELINE_STAGE_2_COPY_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
        VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
    const TargetImage& colour = c_.targets.colour;
    change_use(commands_, c_.targets.radiance, as_colour_target, as_sampled);
    change_use(commands_, colour, dropped, as_colour_target);
    const VkExtent2D extent{colour.spec().width, colour.spec().height};
    VkRenderingAttachmentInfo attachment{};
    attachment.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO;
    attachment.imageView = colour.view();
    attachment.imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    attachment.loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    VkRenderingInfo rendering{};
    rendering.sType = VK_STRUCTURE_TYPE_RENDERING_INFO;
    rendering.renderArea = {{0, 0}, extent};
    rendering.layerCount = 1;
    rendering.colorAttachmentCount = 1;
    rendering.pColorAttachments = &attachment;
    vkCmdBeginRendering(commands_, &rendering);
    set_view(extent);
    draw_over_view(c_.resolve, Variant::resolve);
    vkCmdEndRendering(commands_);
}

// By a pipeline of the renderer itself.
void FrameRecorder::draw_over_view(const BuiltPipeline& pipeline, Variant variant) {
    vkCmdSetCullMode(commands_, VK_CULL_MODE_NONE);
    vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.draw[static_cast<int>(variant)].get());
    vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.layout.get(), 0, 1, &c_.slot.frame_set,
                            0, nullptr);
    vkCmdDraw(commands_, 3, 1, 0, 0);
}

// Before a command of the effect, or after its last of a stage.
void FrameRecorder::time_effect(const Command* next) {
    if (p_ != effect_ || !c_.device.has_timestamps()) return;
    std::string name;
    if (next != nullptr) {
        const auto* dispatched = std::get_if<Dispatch>(&next->what);
        const Draw* drawn = std::get_if<Draw>(&next->what);
        if (dispatched == nullptr && drawn == nullptr) return;
        name = p_->recipe.pipelines[dispatched != nullptr ? dispatched->pipeline : drawn->pipeline].name;
    }
    std::vector<std::string>& timed = c_.slot.effect_timed;
    if (timed.size() == most_effect_timestamps || (timed.empty() ? name.empty() : timed.back() == name)) return;
    vkCmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, c_.slot.effect_timestamps.get(),
                         static_cast<uint32_t>(timed.size()));
    timed.push_back(std::move(name));
}

// Draws in a row, rendered together. Barriers come before rendering begins, for all of them.
void FrameRecorder::draw_all(Stage stage, std::span<const Command* const> commands, bool clear) {
    for (const Command* command : commands) use_draw_buffers(*drawn_by(*command), indirect_draw(*command));
    p_->hazards.flush(commands_);
    begin_rendering(stage, clear);
    for (const Command* command : commands) draw(*command);
    vkCmdEndRendering(commands_);
}

// A command that draws nothing.
void FrameRecorder::record_other(Stage stage, const Command& command) {
    if (const auto* u = std::get_if<Upload>(&command.what)) {
        LODE_CHECK(stage == Stage::update, name_of(stage));
        upload(*u);
        return;
    }
    flush_uploads();
    if (const auto* copied = std::get_if<Copy>(&command.what)) {
        LODE_CHECK(stage == Stage::update, name_of(stage));
        copy(*copied);
    } else if (const auto* resized = std::get_if<Resize>(&command.what)) {
        LODE_CHECK(stage == Stage::update, name_of(stage));
        resize(*resized);
    } else if (const auto* dispatched = std::get_if<Dispatch>(&command.what)) {
        dispatch(*dispatched);
    } else if (const auto* back = std::get_if<Readback>(&command.what)) {
        read_back(*back);
    }
}

void FrameRecorder::record_commands(Stage stage, const RecordedPlan& recorded) {
    p_ = &recorded;
    std::vector<const Command*> commands;
    for (const Command& c : p_->plan.commands) {
        if (c.stage == stage) commands.push_back(&c);
    }
    const bool is_effect = p_ == effect_;
    const bool renders =
        is_effect ? stage == Stage::composite
                  : (stage == Stage::shadow && has_shadow_) || stage == Stage::depth || stage == Stage::colour;
    bool clear = !is_effect;
    forget_bound();
    for (size_t i = 0; i < commands.size();) {
        time_effect(commands[i]);
        if (drawn_by(*commands[i]) == nullptr) {
            record_other(stage, *commands[i++]);
            continue;
        }
        LODE_CHECK(renders || stage == Stage::shadow, name_of(stage));
        const size_t first = i;
        while (i < commands.size() && drawn_by(*commands[i]) != nullptr) ++i;
        if (!renders) continue;  // shadows are off
        draw_all(stage, std::span(commands).subspan(first, i - first), clear);
        clear = false;
    }
    time_effect(nullptr);
    flush_uploads();
    if (renders && clear) {
        begin_rendering(stage, true);
        vkCmdEndRendering(commands_);
    }
}

// What is all around, where nothing opaque is. Lines show nothing but themselves.
void FrameRecorder::record_background() {
    if (!lit_by(c_.environment, look_) || wire_) return;
    begin_rendering(Stage::colour, false);
    draw_over_view(c_.background, effect_ != nullptr ? Variant::background_radiance : Variant::background);
    vkCmdEndRendering(commands_);
}

// What is blended: draws of the depth stage once more, over the colours that are there. Lines show everything as it is.
void FrameRecorder::record_blended() {
    if (!c_.looks.blends() || wire_) return;
    p_ = &backend_;
    std::vector<const Command*> commands;
    for (const Command& c : p_->plan.commands) {
        if (c.stage == Stage::depth && drawn_by(c) != nullptr) commands.push_back(&c);
    }
    if (commands.empty()) return;
    forget_bound();
    blending_ = true;
    draw_all(Stage::colour, commands, false);
    blending_ = false;
}

void FrameRecorder::record_stage(Stage stage) {
    use_images(stage);
    if (effect_ != nullptr && stage == Stage::colour && effect_->recipe.light_grid != no_light_grid) {
        effect_->hazards.use(effect_->recipe.light_grid,
                             {VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT, false});
        effect_->hazards.flush(commands_);
    }
    // A query cannot span command buffers, and uploads may submit: statistics of the update stage count nothing.
    const bool counts = c_.device.has_statistics();
    const auto begin_counting = [&] {
        vkCmdBeginQuery(commands_, c_.slot.statistics.get(), static_cast<uint32_t>(stage), 0);
    };
    if (counts && stage != Stage::update) begin_counting();
    record_commands(stage, backend_);
    if (stage == Stage::colour) {
        record_background();
        record_blended();
    }
    if (effect_ != nullptr) record_commands(stage, *effect_);
    if (effect_ != nullptr && stage == Stage::composite) resolve();
    if (counts && stage == Stage::update) begin_counting();
    if (counts) vkCmdEndQuery(commands_, c_.slot.statistics.get(), static_cast<uint32_t>(stage));
    if (stage == Stage::shadow && has_shadow_)
        change_use(commands_, c_.targets.shadow_depth, as_depth_target, as_sampled);
}

}  // namespace lodestone
