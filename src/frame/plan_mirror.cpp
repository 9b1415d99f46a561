#include "frame/plan_mirror.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "base/check.h"

namespace lodestone {

namespace {

tl::unexpected<Error> wrong(const std::string& what) { return fail(Fault::invariant, what); }

}  // namespace

PlanMirror::PlanMirror(Recipe recipe, Puller puller)
    : recipe_(std::move(recipe)), puller_(std::move(puller)), buffers_(recipe_.buffers.size()) {
    for (size_t i = 0; i < buffers_.size(); ++i) {
        const BufferSpec& spec = recipe_.buffers[i];
        LODE_CHECK(spec.bytes > 0 && spec.bytes % 4 == 0 && spec.stride > 0 && spec.bytes % spec.stride == 0, spec.name,
                   spec.bytes, spec.stride);
        buffers_[i].bytes.resize(spec.bytes);
        buffers_[i].written.assign(spec.bytes / 4, false);
    }
}

Result<void> PlanMirror::check_range(uint32_t buffer, uint64_t offset, uint64_t bytes, uint32_t use, bool read) const {
    if (buffer >= buffers_.size()) return wrong("buffer " + std::to_string(buffer) + " is not in the recipe");
    const BufferSpec& spec = recipe_.buffers[buffer];
    if (offset % 4 != 0 || bytes % 4 != 0) return wrong("range of buffer '" + spec.name + "' is not in whole words");
    if (offset > spec.bytes || bytes > spec.bytes - offset) {
        return wrong("bytes " + std::to_string(offset) + "+" + std::to_string(bytes) + " lie outside buffer '" +
                     spec.name + "' of " + std::to_string(spec.bytes));
    }
    if ((spec.use & use) != use) return wrong("buffer '" + spec.name + "' is not made for this use");
    if (!read || buffers_[buffer].gpu_written) return {};
    const auto& written = buffers_[buffer].written;
    const auto begin = written.begin() + static_cast<ptrdiff_t>(offset / 4);
    const auto end = begin + static_cast<ptrdiff_t>(bytes / 4);
    const auto hole = std::find(begin, end, false);
    if (hole != end) {
        return wrong("byte " + std::to_string((hole - written.begin()) * 4) + " of buffer '" + spec.name +
                     "' is read before anything was written there");
    }
    return {};
}

Result<void> PlanMirror::check_draw(Stage stage, const Draw& draw, bool indirect, const Plan& plan,
                                    const FrameInput& input) const {
    if (stage == Stage::update) return wrong("a draw stands in the update stage");
    if (draw.pipeline >= recipe_.pipelines.size())
        return wrong("pipeline " + std::to_string(draw.pipeline) + " is not in the recipe");
    const PipelineSpec& pipeline = recipe_.pipelines[draw.pipeline];
    if (pipeline.kind != PipelineKind::draw) return wrong("pipeline '" + pipeline.name + "' does not draw");
    if (draw.view >= input.views.size()) return wrong("view " + std::to_string(draw.view) + " is not in the frame");
    if ((input.views[draw.view].kind == View::Kind::shadow) != (stage == Stage::shadow))
        return wrong("a view is drawn in a stage of the other kind");
    if (stage == Stage::effect) return wrong("a draw stands in the effect stage");
    const bool blends = pipeline.blend != Blend::replace;
    if (blends != (stage == Stage::composite))
        return wrong("'" + pipeline.name + "' is drawn in the " + name_of(stage) + " stage; " +
                     (blends ? "what blends belongs into the composite stage" : "there only what blends is drawn"));
    if ((draw.vertex_buffer != no_buffer) != (pipeline.layout.stride > 0))
        return wrong("vertex buffer and layout of '" + pipeline.name + "' disagree");
    if (blends && !pipeline.whole_view) return wrong("'" + pipeline.name + "' blends and does not cover the view");
    if (pipeline.whole_view && ((stage != Stage::colour && stage != Stage::composite) || indirect || draw.count != 3 ||
                                draw.index_buffer != no_buffer))
        return wrong("'" + pipeline.name + "' covers the view: three vertices, in the colour or composite stage");
    if (!pipeline.visibility.empty() && stage == Stage::colour)
        return wrong("'" + pipeline.name + "' only tells what is visible, which the colour stage is too late for");
    if (draw.vertex_buffer != no_buffer) {
        if (auto done = check_range(draw.vertex_buffer, draw.vertex_offset, 0, use_vertex, false); !done) return done;
    }
    if (indirect)
        return draw.index_buffer == no_buffer ? Result<void>{}
                                              : check_range(draw.index_buffer, draw.index_offset, 0, use_index, false);
    if (pipeline.whole_view) return {};  // of no instance
    if (uint64_t{draw.first_id} + draw.instances > plan.instance_ids.size())
        return wrong("instances lie outside instance_ids");
    for (uint32_t i = 0; i < draw.instances; ++i) {
        if (plan.instance_ids[draw.first_id + i] >= input.instances.size())
            return wrong("an instance is not in the frame");
    }
    if (draw.index_buffer == no_buffer) return {};
    return check_range(draw.index_buffer, draw.index_offset, uint64_t{draw.count} * 4, use_index, true);
}

Result<void> PlanMirror::check_dispatch(const Dispatch& dispatch, const FrameInput& input) const {
    if (dispatch.pipeline >= recipe_.pipelines.size() ||
        recipe_.pipelines[dispatch.pipeline].kind != PipelineKind::compute) {
        return wrong("pipeline " + std::to_string(dispatch.pipeline) + " does not compute");
    }
    if (dispatch.view >= input.views.size())
        return wrong("view " + std::to_string(dispatch.view) + " is not in the frame");
    if (dispatch.arguments != no_buffer)
        return check_range(dispatch.arguments, dispatch.offset, 3 * sizeof(uint32_t), use_indirect, true);
    if (std::ranges::any_of(dispatch.groups, [](uint32_t groups) { return groups > most_groups; }))
        return wrong("a dispatch has more groups in a row than every device takes");
    return {};
}

Result<void> PlanMirror::check_resize(Stage stage, const Resize& resize) const {
    if (stage != Stage::update) return wrong("a change of size stands outside the update stage");
    if (auto done = check_range(resize.buffer, 0, resize.kept, 0, false); !done) return done;
    const BufferSpec& spec = recipe_.buffers[resize.buffer];
    if (resize.bytes == 0 || resize.bytes > spec.most_bytes || resize.bytes % spec.stride != 0)
        return wrong("buffer '" + spec.name + "' cannot have " + std::to_string(resize.bytes) + " bytes");
    return resize.kept <= resize.bytes ? Result<void>{}
                                       : wrong("buffer '" + spec.name + "' cannot keep more than it then has");
}

Result<void> PlanMirror::check(const Command& command, const Plan& plan, const FrameInput& input) const {
    if (const auto* upload = std::get_if<Upload>(&command.what)) {
        if (command.stage != Stage::update) return wrong("an upload stands outside the update stage");
        return check_range(upload->buffer, upload->offset, upload->blob.size(), 0, false);
    }
    if (const auto* copy = std::get_if<Copy>(&command.what)) {
        if (command.stage != Stage::update) return wrong("a copy stands outside the update stage");
        if (auto done = check_range(copy->source, copy->source_offset, copy->bytes, 0, true); !done) return done;
        const uint64_t distance = std::max(copy->source_offset, copy->destination_offset) -
                                  std::min(copy->source_offset, copy->destination_offset);
        if (copy->source == copy->destination && distance < copy->bytes) return wrong("a copy overlaps itself");
        return check_range(copy->destination, copy->destination_offset, copy->bytes, 0, false);
    }
    if (const auto* resize = std::get_if<Resize>(&command.what)) return check_resize(command.stage, *resize);
    if (const auto* dispatch = std::get_if<Dispatch>(&command.what)) return check_dispatch(*dispatch, input);
    if (const auto* draw = std::get_if<Draw>(&command.what))
        return check_draw(command.stage, *draw, false, plan, input);
    if (const auto* draw = std::get_if<DrawIndirect>(&command.what)) {
        if (auto done = check_draw(command.stage, draw->draw, true, plan, input); !done) return done;
        if (draw->count_buffer != no_buffer) {
            if (auto done = check_range(draw->count_buffer, draw->count_offset, 4, use_indirect, true); !done)
                return done;
        }
        return check_range(draw->arguments, draw->offset, uint64_t{draw->stride} * draw->draws, use_indirect, true);
    }
    const auto& readback = std::get<Readback>(command.what);
    return check_range(readback.buffer, readback.offset, readback.bytes, 0, true);
}

void PlanMirror::apply(const Command& command) {
    const auto mark = [&](Buffer& buffer, uint64_t offset, uint64_t bytes) {
        const auto begin = buffer.written.begin() + static_cast<ptrdiff_t>(offset / 4);
        std::fill(begin, begin + static_cast<ptrdiff_t>(bytes / 4), true);
    };
    if (const auto* upload = std::get_if<Upload>(&command.what)) {
        Buffer& buffer = buffers_[upload->buffer];
        if (upload->blob.size() > 0)
            std::memcpy(buffer.bytes.data() + upload->offset, upload->blob.data(), upload->blob.size());
        mark(buffer, upload->offset, upload->blob.size());
    } else if (const auto* copy = std::get_if<Copy>(&command.what)) {
        Buffer& to = buffers_[copy->destination];
        std::memcpy(to.bytes.data() + copy->destination_offset,
                    buffers_[copy->source].bytes.data() + copy->source_offset, copy->bytes);
        mark(to, copy->destination_offset, copy->bytes);
        to.gpu_written |= buffers_[copy->source].gpu_written;
    } else if (const auto* resize = std::get_if<Resize>(&command.what)) {
        Buffer& buffer = buffers_[resize->buffer];
        for (const uint64_t bytes : {resize->kept, resize->bytes}) {  // what is not kept was never written
            buffer.bytes.resize(bytes);
            buffer.written.resize(bytes / 4, false);
        }
        recipe_.buffers[resize->buffer].bytes = resize->bytes;
    } else if (const auto* dispatch = std::get_if<Dispatch>(&command.what)) {
        for (const StorageBinding& binding : recipe_.pipelines[dispatch->pipeline].storage) {
            if (binding.access != Access::read) buffers_[binding.buffer].gpu_written = true;
        }
    }
}

std::vector<uint32_t> PlanMirror::read_by(const DrawIndirect& draw) const {
    std::vector<uint32_t> buffers{draw.arguments};
    if (draw.count_buffer != no_buffer) buffers.push_back(draw.count_buffer);
    if (draw.draw.index_buffer != no_buffer) buffers.push_back(draw.draw.index_buffer);
    if (draw.draw.vertex_buffer != no_buffer) buffers.push_back(draw.draw.vertex_buffer);
    for (const StorageBinding& binding : recipe_.pipelines[draw.draw.pipeline].storage)
        buffers.push_back(binding.buffer);
    std::erase_if(buffers, [&](uint32_t b) { return !buffers_[b].gpu_written; });
    return buffers;
}

std::vector<uint32_t> PlanMirror::computed_for_draws(const Plan& plan) const {
    std::vector<uint32_t> buffers;
    for (const Command& command : plan.commands) {
        if (const auto* draw = std::get_if<DrawIndirect>(&command.what)) {
            const auto read = read_by(*draw);
            buffers.insert(buffers.end(), read.begin(), read.end());
        }
    }
    std::ranges::sort(buffers);
    buffers.erase(std::unique(buffers.begin(), buffers.end()), buffers.end());
    return buffers;
}

void PlanMirror::learn(uint32_t buffer, std::span<const std::byte> bytes) {
    LODE_CHECK(buffer < buffers_.size() && bytes.size() == buffers_[buffer].bytes.size(), buffer, bytes.size());
    std::copy(bytes.begin(), bytes.end(), buffers_[buffer].bytes.begin());
    buffers_[buffer].learnt = true;
    mirror_draws();
}

void PlanMirror::mirror(size_t command, Stage stage, const Draw& draw) {
    MirroredDraw mirrored{command, stage, draw, {}, {}, {}};
    if (!recipe_.pipelines[draw.pipeline].whole_view) {
        LODE_CHECK(uint64_t{draw.first_id} + draw.instances <= instance_ids_.size(), draw.first_id, draw.instances);
        mirrored.instances = std::span(instance_ids_).subspan(draw.first_id, draw.instances);
    }
    if (draw.index_buffer != no_buffer) {
        const std::byte* bytes = buffers_[draw.index_buffer].bytes.data() + draw.index_offset;
        mirrored.indices = {reinterpret_cast<const uint32_t*>(bytes), draw.count};
    }
    if (draw.index_buffer == no_buffer && puller_.indices) {
        pulled_indices_.push_back(puller_.indices(*this, draw));
        mirrored.indices = pulled_indices_.back();
    }
    if (draw.vertex_buffer != no_buffer)
        mirrored.vertices = std::span(buffers_[draw.vertex_buffer].bytes).subspan(draw.vertex_offset);
    draws_.push_back(mirrored);
}

void PlanMirror::mirror_draws() {
    draws_.clear();
    pulled_indices_.clear();
    for (const auto& [number, command] : drawing_) {
        if (const auto* draw = std::get_if<Draw>(&command.what)) mirror(number, command.stage, *draw);
        const auto* indirect = std::get_if<DrawIndirect>(&command.what);
        if (indirect == nullptr) continue;
        const auto read = read_by(*indirect);
        const bool known = std::ranges::all_of(read, [&](uint32_t b) { return buffers_[b].learnt; });
        const auto word = [&](uint32_t buffer, uint64_t offset) {
            uint32_t value;
            std::memcpy(&value, buffers_[buffer].bytes.data() + offset, sizeof value);
            return value;
        };
        uint32_t records = known ? indirect->draws : 0;
        if (known && indirect->count_buffer != no_buffer)
            records = std::min(records, word(indirect->count_buffer, indirect->count_offset));
        for (uint32_t r = 0; r < records; ++r) {
            const uint64_t at = indirect->offset + uint64_t{r} * indirect->stride;
            const bool indexed = indirect->draw.index_buffer != no_buffer;
            Draw draw = indirect->draw;
            draw.count = word(indirect->arguments, at);
            draw.instances = word(indirect->arguments, at + 4);
            const uint32_t first = word(indirect->arguments, at + 8);
            draw.first_id = word(indirect->arguments, at + (indexed ? 16 : 12));
            if (indexed) {
                draw.index_offset += uint64_t{first} * 4;
            } else {
                draw.first_vertex = first;
            }
            if (draw.count > 0 && draw.instances > 0) mirror(number, command.stage, draw);
        }
    }
}

Result<void> PlanMirror::execute(const Plan& plan, const FrameInput& input) {
    if (plan.generation != recipe_.generation) return wrong("the plan belongs to another generation of the recipe");
    for (int stage = 0; stage < stage_count; ++stage) {
        for (size_t i = 0; i < plan.commands.size(); ++i) {
            const Command& command = plan.commands[i];
            if (static_cast<int>(command.stage) != stage) continue;
            const auto at = [&] { return "command " + std::to_string(i) + " (" + name_of(command.stage) + ")"; };
            if (auto done = check(command, plan, input); !done) return fail_at(at(), done.error());
            apply(command);
        }
    }
    instance_ids_ = plan.instance_ids;
    drawing_.clear();
    for (size_t i = 0; i < plan.commands.size(); ++i) {
        const auto& what = plan.commands[i].what;
        if (std::holds_alternative<Draw>(what) || std::holds_alternative<DrawIndirect>(what))
            drawing_.emplace_back(i, plan.commands[i]);
    }
    for (Buffer& buffer : buffers_) buffer.learnt = false;
    mirror_draws();
    input_.views = input.views;
    input_.instances = input.instances;
    for (const MirroredDraw& draw : draws_) {
        if (draw.indices.empty() || draw.vertices.empty() || buffers_[draw.draw.index_buffer].gpu_written) continue;
        const uint32_t stride = recipe_.pipelines[draw.draw.pipeline].layout.stride;
        const uint32_t largest = *std::max_element(draw.indices.begin(), draw.indices.end());
        if ((uint64_t{largest} + 1) * stride > draw.vertices.size()) {
            return wrong("index " + std::to_string(largest) + " lies past the vertices of '" +
                         recipe_.buffers[draw.draw.vertex_buffer].name + "'");
        }
        // Every vertex used must have been written.
        const auto& written = buffers_[draw.draw.vertex_buffer].written;
        for (const uint32_t index : draw.indices) {
            if (!written[(draw.draw.vertex_offset + uint64_t{index} * stride) / 4]) {
                return wrong("vertex " + std::to_string(index) + " of '" +
                             recipe_.buffers[draw.draw.vertex_buffer].name + "' is drawn before it was written");
            }
        }
    }
    return {};
}

std::vector<std::array<glm::vec3, 3>> PlanMirror::triangles_of(uint32_t instance) const {
    std::vector<std::array<glm::vec3, 3>> triangles;
    for (const MirroredDraw& draw : draws_) {
        if (!is_shown(draw)) continue;
        if (std::find(draw.instances.begin(), draw.instances.end(), instance) == draw.instances.end()) continue;
        const VertexLayout& layout = recipe_.pipelines[draw.draw.pipeline].layout;
        const bool pulled = layout.stride == 0;
        if (pulled ? !puller_.position : draw.vertices.empty()) continue;
        const auto position = std::find_if(layout.attributes.begin(), layout.attributes.end(),
                                           [](const VertexAttribute& a) { return a.location == 0; });
        if (!pulled && (position == layout.attributes.end() || position->format != VertexFormat::f32x3)) continue;
        const auto corner = [&](uint32_t index) {
            if (pulled) return puller_.position(*this, draw.draw, input_, instance, index);
            glm::vec3 p;
            std::memcpy(&p, draw.vertices.data() + uint64_t{index} * layout.stride + position->offset, sizeof p);
            return p;
        };
        for (size_t i = 0; i + 2 < draw.indices.size(); i += 3) {
            const uint32_t a = draw.indices[i], b = draw.indices[i + 1], c = draw.indices[i + 2];
            if (a != b && b != c && c != a) triangles.push_back({corner(a), corner(b), corner(c)});
        }
    }
    return triangles;
}

}  // namespace lodestone
