#include "frame/indexed_mesh.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"

namespace lodestone {

uint32_t FurtherBuffer::add(std::span<const FurtherAttributes> further) {
    if (further.empty()) return 0;
    const auto word = static_cast<uint32_t>(count_ + 1);
    count_ += further.size();
    has_tangents_ = has_tangents_ || std::ranges::any_of(further, [](const auto& f) { return f.tangent != 0; });
    return word;
}

BufferSpec FurtherBuffer::spec() const {
    LODE_CHECK(!empty());
    return {"further attributes", bytes(), use_storage, 4};
}

PipelineSpec indexed_mesh_pipeline(const FurtherBuffer& further, uint32_t buffer) {
    PipelineSpec spec;
    spec.name = "indexed mesh";
    spec.vertex = further.empty() ? "mesh/mesh.vert" : "mesh/further.vert";
    if (!further.empty()) spec.storage = {StorageBinding::pool(LODE_MESH_FURTHER, buffer, 1)};
    static_assert(LODE_MESH_TANGENTS_CONSTANT == 0);
    if (further.has_tangents()) spec.constants = {1};
    spec.fragment = spec.blended = "mesh/mesh.frag";
    spec.cutout = "mesh/cutout.frag";
    spec.layout.stride = sizeof(MeshVertex);
    spec.layout.attributes = {
        {LODE_MESH_POSITION, VertexFormat::f32x3, offsetof(MeshVertex, position)},
        {LODE_MESH_NORMAL, VertexFormat::snorm16x2, offsetof(MeshVertex, normal)},
        {LODE_MESH_UV, VertexFormat::f32x2, offsetof(MeshVertex, uv)},
        {LODE_MESH_COLOUR, VertexFormat::unorm8x4, offsetof(MeshVertex, colour)},
        {LODE_MESH_MATERIAL, VertexFormat::u32, offsetof(MeshVertex, material)},
    };
    return spec;
}

Words indexed_mesh_words(uint32_t level, uint32_t levels, float pixels) {
    return {level, levels, std::bit_cast<uint32_t>(pixels)};
}

Sphere bounding_sphere(std::span<const MeshVertex> vertices) {
    std::vector<glm::vec3> positions;
    positions.reserve(vertices.size());
    for (const MeshVertex& v : vertices) positions.emplace_back(v.position[0], v.position[1], v.position[2]);
    return bounding_sphere_of(positions);
}

std::vector<InstanceTree::Seen> seen_instances(const InstanceTree& tree, std::span<const View> views) {
    return tree.seen(frusta_of(views));
}

void draw_ranges(Plan& plan, const FrameInput& input, std::span<const IndexedRange> ranges) {
    for (uint32_t v = 0; v < input.views.size(); ++v) {
        const View& view = input.views[v];
        for (const IndexedRange& range : ranges) {
            Draw draw;
            draw.pipeline = range.pipeline;
            draw.view = v;
            draw.vertex_buffer = range.vertex_buffer;
            draw.index_buffer = range.index_buffer;
            draw.vertex_offset = range.vertex_offset;
            draw.index_offset = range.index_offset;
            draw.count = range.index_count;
            draw.first_id = static_cast<uint32_t>(plan.instance_ids.size());
            float scale = 0;
            for (const auto& [instance, views] : range.instances) {
                if ((views >> v & 1) == 0) continue;
                plan.instance_ids.push_back(instance);
                scale = std::max(scale, largest_scale(input.instances[instance].object_to_world));
            }
            draw.words = range.words;
            const Words own =
                indexed_mesh_words(range.level, range.levels, static_cast<float>(range.error) * scale * view.focal_px);
            std::copy_n(own.begin(), indexed_mesh_words_used, draw.words.begin());
            draw.instances = static_cast<uint32_t>(plan.instance_ids.size()) - draw.first_id;
            if (v == 0) plan.stats.instances_drawn += draw.instances;
            if (draw.instances == 0 || draw.count == 0) continue;
            if (view.kind == View::Kind::shadow) {
                plan.commands.push_back({Stage::shadow, draw});
                continue;
            }
            plan.commands.push_back({Stage::depth, draw});
            plan.commands.push_back({Stage::colour, draw});
            plan.stats.triangles += uint64_t{range.triangles} * draw.instances;
        }
    }
    plan.stats.instances_culled = static_cast<uint32_t>(input.instances.size()) - plan.stats.instances_drawn;
}

}  // namespace lodestone
