// Random plans through PlanMirror: carried out or refused, never past the end of a buffer, whatever the numbers are.
#include "frame/plan_mirror.h"
#include "fuzz/random_mesh.h"
#include "fuzz/watch.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

// Small numbers, most often; sometimes any.
uint64_t number(FuzzedDataProvider& from) {
    switch (from.ConsumeIntegralInRange<int>(0, 5)) {
        case 0:
            return from.ConsumeIntegral<uint64_t>();
        case 1:
            return ~uint64_t{0} - from.ConsumeIntegralInRange<uint32_t>(0, 64);
        case 2:
            return from.ConsumeIntegral<uint32_t>();
        default:
            return from.ConsumeIntegralInRange<uint32_t>(0, 32) * 4;
    }
}
uint32_t few(FuzzedDataProvider& from) {
    return from.ConsumeIntegralInRange<int>(0, 15) == 0 ? from.ConsumeIntegral<uint32_t>()
                                                        : from.ConsumeIntegralInRange<uint32_t>(0, 5);
}

// As the renderer takes it: buffers that are not empty, storage that names buffers.
Recipe random_recipe(FuzzedDataProvider& from) {
    Recipe recipe;
    const auto buffers = from.ConsumeIntegralInRange<uint32_t>(1, 5);
    for (uint32_t b = 0; b < buffers; ++b) {
        const uint32_t stride = 4 * from.ConsumeIntegralInRange<uint32_t>(1, 8);
        recipe.buffers.push_back({"b", uint64_t{stride} * from.ConsumeIntegralInRange<uint32_t>(1, 40),
                                  from.ConsumeIntegralInRange<uint32_t>(0, 15), stride});
        recipe.buffers.back().most_bytes = recipe.buffers.back().bytes * from.ConsumeIntegralInRange<uint32_t>(1, 3);
    }
    const auto pipelines = from.ConsumeIntegralInRange<uint32_t>(0, 4);
    for (uint32_t p = 0; p < pipelines; ++p) {
        PipelineSpec pipeline;
        pipeline.kind = from.ConsumeBool() ? PipelineKind::draw : PipelineKind::compute;
        pipeline.whole_view = from.ConsumeBool();
        if (from.ConsumeBool()) pipeline.visibility = "v";
        if (from.ConsumeBool()) pipeline.fragment = "f";
        if (from.ConsumeBool()) {
            pipeline.layout.stride = 4 * from.ConsumeIntegralInRange<uint32_t>(3, 8);
            pipeline.layout.attributes = {{0, VertexFormat::f32x3, 0}};
        }
        if (from.ConsumeBool()) pipeline.patch_vertices = 1;
        for (uint32_t s = from.ConsumeIntegralInRange<uint32_t>(0, 2); s > 0; --s) {
            pipeline.storage.push_back({s, from.ConsumeIntegralInRange<uint32_t>(0, buffers - 1),
                                        static_cast<Access>(from.ConsumeIntegralInRange<int>(0, 2))});
        }
        recipe.pipelines.push_back(pipeline);
    }
    return recipe;
}

Draw random_draw(FuzzedDataProvider& from) {
    Draw draw;
    draw.pipeline = few(from);
    draw.view = few(from);
    draw.vertex_buffer = from.ConsumeBool() ? few(from) : no_buffer;
    draw.index_buffer = from.ConsumeBool() ? few(from) : no_buffer;
    draw.vertex_offset = number(from);
    draw.index_offset = number(from);
    draw.first_vertex = static_cast<uint32_t>(number(from));
    draw.count = static_cast<uint32_t>(number(from));
    draw.first_id = few(from);
    draw.instances = few(from);
    return draw;
}

Command random_command(FuzzedDataProvider& from) {
    Command command;
    command.stage = static_cast<Stage>(from.ConsumeIntegralInRange<int>(0, stage_count - 1));
    switch (from.ConsumeIntegralInRange<int>(0, 6)) {
        case 0: {
            std::vector<uint32_t> words(from.ConsumeIntegralInRange<uint32_t>(0, 40));
            for (uint32_t& word : words) word = from.ConsumeIntegralInRange<uint32_t>(0, 20);
            command.what = Upload{few(from), number(from), Blob::copy_of(words.data(), words.size())};
            break;
        }
        case 1:
            command.what = Copy{few(from), few(from), number(from), number(from), number(from)};
            break;
        case 2: {
            Dispatch dispatch;
            dispatch.pipeline = few(from);
            dispatch.groups = {few(from), few(from), few(from)};
            dispatch.view = few(from);
            if (from.ConsumeBool()) dispatch.arguments = few(from);
            dispatch.offset = number(from);
            command.what = dispatch;
            break;
        }
        case 3:
            command.what = random_draw(from);
            break;
        case 4: {
            DrawIndirect draw;
            draw.draw = random_draw(from);
            draw.arguments = few(from);
            draw.offset = number(from);
            draw.draws = few(from);
            draw.stride = static_cast<uint32_t>(number(from));
            draw.count_buffer = from.ConsumeBool() ? few(from) : no_buffer;
            draw.count_offset = number(from);
            command.what = draw;
            break;
        }
        case 5:
            command.what = Resize{few(from), number(from), number(from)};
            break;
        default:
            command.what = Readback{few(from), number(from), number(from), few(from)};
    }
    return command;
}

// What its buffers may grow to.
size_t bytes_of(const Recipe& recipe) {
    size_t bytes = 0;
    for (const BufferSpec& buffer : recipe.buffers) bytes += buffer.most_bytes;
    return bytes;
}

size_t bytes_of(const Plan& plan) {
    return plan.commands.size() * sizeof(Command) + plan.instance_ids.size() * sizeof plan.instance_ids[0];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    FuzzedDataProvider from(data, size);
    const Watch watch;
    PlanMirror mirror(random_recipe(from));
    size_t bytes = size + bytes_of(mirror.recipe());  // of all that is stated; numbers in it may be far larger
    FrameInput input;
    input.views.assign(from.ConsumeIntegralInRange<size_t>(1, 3), view_of(Camera{}, 16, 16));
    if (input.views.size() > 1) input.views[1].kind = View::Kind::shadow;
    input.instances.resize(from.ConsumeIntegralInRange<size_t>(0, 4));
    for (int frame = 0; frame < 3; ++frame) {
        Plan plan;
        for (auto commands = from.ConsumeIntegralInRange<int>(0, 12); commands > 0; --commands)
            plan.commands.push_back(random_command(from));
        for (auto ids = from.ConsumeIntegralInRange<int>(0, 6); ids > 0; --ids) plan.instance_ids.push_back(few(from));
        bytes += bytes_of(plan);
        hash_of_plan(plan);
        require(!dump(plan).empty() || plan.commands.empty(), "every command has a line");
        if (!mirror.execute(plan, input)) continue;
        for (const uint32_t buffer : mirror.computed_for_draws(plan)) {
            const std::vector<std::byte> bytes(mirror.buffer(buffer).size(),
                                               std::byte{from.ConsumeIntegral<uint8_t>()});
            mirror.learn(buffer, bytes);
        }
        for (const PlanMirror::MirroredDraw& draw : mirror.draws()) mirror.is_shown(draw);
        for (uint32_t i = 0; i < input.instances.size(); ++i) mirror.triangles_of(i);
    }
    watch.check(bytes);
    return 0;
}
