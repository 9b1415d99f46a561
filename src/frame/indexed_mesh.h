// What backends that draw indexed meshes (full, discrete, lod) have in common: one vertex layout, one pipeline, and the
// commands that draw a range of an index buffer in every view.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "frame/frame_source.h"
#include "frame/instance_tree.h"
#include "frame/screen_error.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

// What lies beside the vertices of several assets, one behind another in a buffer that is there where some asset has
// something.
class FurtherBuffer {
public:
    // Adds those of an asset, and returns word LODE_MESH_WORD_FURTHER of its draws.
    uint32_t add(std::span<const FurtherAttributes> further);
    bool empty() const { return count_ == 0; }                             // whether no asset has something
    uint64_t bytes() const { return count_ * sizeof(FurtherAttributes); }  // of all
    bool has_tangents() const { return has_tangents_; }                    // whether some asset has any
    BufferSpec spec() const;                                               // where it is not empty
    static uint64_t offset(uint32_t word) { return (word - 1) * sizeof(FurtherAttributes); }  // of a word above 0

private:
    uint64_t count_ = 0;
    bool has_tangents_ = false;
};

// The pipeline over shaders/mesh, drawing MeshVertex (shaders/shared/mesh_vertex.h) vertices.
// buffer: the number of `further` in the recipe, where it is not empty.
PipelineSpec indexed_mesh_pipeline(const FurtherBuffer& further = {}, uint32_t buffer = no_buffer);

// Words of a draw with that pipeline, for the debug views: [0] the level, [1] the levels there are, [2] float bits of
// the pixels that the level is off by at distance 1.
Words indexed_mesh_words(uint32_t level, uint32_t levels, float pixels);
inline constexpr size_t indexed_mesh_words_used = 3;  // of a draw; the others are free

// A sphere around all vertices, centred in their box; of no vertices: a point at the origin.
Sphere bounding_sphere(std::span<const MeshVertex> vertices);

// One range of indices drawn for some instances.
struct IndexedRange {
    uint32_t pipeline = 0;                         // into Recipe::pipelines
    uint32_t vertex_buffer = 0, index_buffer = 0;  // vertex_buffer: no_buffer where the pipeline pulls
    uint64_t vertex_offset = 0, index_offset = 0;  // bytes
    uint32_t index_count = 0;                      // indices drawn, degenerate triangles included
    uint32_t triangles = 0;                        // of them not degenerate, for the statistics
    uint32_t level = 0, levels = 1;                // for the debug views: its number, and how many there are
    double error = 0;                              // of the level, object units
    std::vector<InstanceTree::Seen> instances;     // with the views that see them
    Words words{};                                 // of its draws; the first are indexed_mesh_words
};

// Adds draws of `ranges` to the plan: each shadow view in the shadow stage, views[0] and every other camera in depth
// and colour. An instance is drawn in the views that see it. Also counts stats.triangles over camera views, and
// instances_drawn and instances_culled of views[0].
void draw_ranges(Plan& plan, const FrameInput& input, std::span<const IndexedRange> ranges);

// The instances of the frame that its views see, rising.
std::vector<InstanceTree::Seen> seen_instances(const InstanceTree& tree, std::span<const View> views);

}  // namespace lodestone
