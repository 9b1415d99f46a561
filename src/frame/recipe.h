// What a backend needs before it can answer with plans: buffers, pools of pages, pipelines. A recipe is a value; the
// renderer builds it once per generation.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace lodestone {

// What a buffer is for; bits.
enum BufferUse : uint32_t {
    use_vertex = 1,    // vertex attributes
    use_index = 2,     // 32-bit indices
    use_storage = 4,   // read or written by shaders, as blocks or texels
    use_indirect = 8,  // arguments of indirect draws and dispatches
};

// A buffer. Uploads, copies and readbacks need no bit of BufferUse.
struct BufferSpec {
    std::string name;    // for messages and the debugger
    uint64_t bytes = 0;  // > 0, a multiple of 4 and of `stride`
    uint32_t use = 0;    // BufferUse bits
    // Storage buffers only: size of one element (a page of a pool). Where the buffer is larger than a device can bind
    // at once, the renderer splits it between elements into segments, and shaders choose the segment by element number
    // (shaders/shared/texels.glsl). At most StorageBinding::segments segments are bound.
    uint32_t stride = 4;
    uint64_t most_bytes = 0;  // that Resize may make of it, a multiple of `stride`; 0: it keeps its size
    bool operator==(const BufferSpec&) const = default;
};
inline constexpr uint32_t no_light_grid = ~0u;    // in place of a buffer number where there is none
inline constexpr uint32_t max_pool_segments = 8;  // most segments of a split buffer, as LODE_MOST_SEGMENTS

// How an attribute lies in a vertex: components and their type.
enum class VertexFormat : uint8_t {
    f32x2,      // two floats
    f32x3,      // three floats
    snorm16x2,  // two signed 16-bit numbers, read as -1 .. 1
    unorm8x4,   // four bytes, read as 0 .. 1
    u32,        // an unsigned number
};
// A number of a vertex that shaders read.
struct VertexAttribute {
    uint32_t location = 0;                      // of the input in the vertex shader
    VertexFormat format = VertexFormat::f32x3;  // what is stored
    uint32_t offset = 0;                        // bytes from the start of a vertex
    bool operator==(const VertexAttribute&) const = default;
};
// What vertices of a vertex buffer consist of.
struct VertexLayout {
    uint32_t stride = 0;  // bytes per vertex; 0 for pipelines that pull their vertices from storage buffers
    std::vector<VertexAttribute> attributes;  // in any order
    bool operator==(const VertexLayout&) const = default;
};

// What shaders do with a buffer; barriers follow from it.
enum class Access : uint8_t {
    read,        // they read it
    write,       // they write it and need nothing of what was there
    read_write,  // both
};
// A storage buffer as the shaders of a pipeline see it.
struct StorageBinding {
    uint32_t binding = 0;          // in descriptor set 1
    uint32_t buffer = 0;           // into Recipe::buffers
    Access access = Access::read;  // what the shaders do
    // 1, 2 or 4: shaders read it as texels of so many 32-bit words (shaders/shared/texels.glsl); 0: it is one plain
    // block.
    uint32_t texel_words = 0;
    uint32_t segments = 1;  // bound at most

    // Texels of 1, 2 or 4 words, as LODE_TEXELS and LODE_POOL declare them.
    static StorageBinding texels(uint32_t binding, uint32_t buffer, uint32_t words) {
        return {binding, buffer, Access::read, words, 1};
    }
    // The same of a buffer that may be split into segments.
    static StorageBinding pool(uint32_t binding, uint32_t buffer, uint32_t words) {
        return {binding, buffer, Access::read, words, max_pool_segments};
    }
    // Plain words of a buffer that may be split into segments, to read and to write (LODE_STORED_POOL).
    static StorageBinding stored_pool(uint32_t binding, uint32_t buffer, Access access) {
        return {binding, buffer, access, 0, max_pool_segments};
    }
    bool operator==(const StorageBinding&) const = default;
};

// How what a pipeline draws is mixed with what is there.
enum class Blend : uint8_t {
    replace,  // what is there goes
    over,     // there * alpha + drawn: drawn is premultiplied, and alpha is what shines through. Coverage stays
};

// What a pipeline does.
enum class PipelineKind : uint8_t {
    draw,     // Draw and DrawIndirect
    compute,  // Dispatch
};

// Shaders are named "folder/file.stage" as in shaders/, e.g. "mesh/mesh.vert". A draw pipeline serves every stage it is
// drawn in: the shadow stage runs its vertex part alone, the depth stage `visibility` too, where there is one, and the
// colour stage `fragment`. Where materials of the scene are masked or blended, the shadow stage runs `cutout`, too, and
// so does the depth stage where there is no `visibility`; it discards what is not there. Where some are blended, what
// the depth stage draws is drawn once more at the end of the colour stage, by `blended`, over what is there.
//
// A backend can light its triangles while it draws them, in depth and colour stage by one pipeline with `fragment`. Or
// it draws them in the depth stage alone, by one whose `visibility` writes four words about what is seen to the target
// of that name (shaders/shared/frame.glsl), or eight, the others to `further_visibility`, and lights that in the colour
// stage by a pipeline that covers the view.
struct PipelineSpec {
    std::string name;                          // for messages and the debugger
    PipelineKind kind = PipelineKind::draw;    // which of the members below count
    std::string vertex, fragment, visibility;  // draw
    uint32_t visibility_targets = 1;           // that `visibility` writes to, 1 or 2; all of a recipe alike
    std::string cutout, blended;               // draw; empty where nothing of the scene is to be
    std::string tessellation_control, tessellation_evaluation;  // draw, both or neither
    std::string compute;                                        // compute
    VertexLayout layout;                                        // draw
    std::vector<StorageBinding> storage;                        // what its shaders bind
    uint32_t patch_vertices = 0;                                // tessellation: control points per patch
    // draw: covers the view, in the colour stage alone, wherever the depth stage left something; or, where it blends,
    // in the composite stage alone, everywhere.
    bool whole_view = false;
    Blend blend = Blend::replace;  // draw: other than replace of an effect's whole_view alone
    // draw, below 256: the depth stage leaves it in the stencil of the picture. Where any of a recipe has one, a
    // pipeline that covers the view draws only what its own stencil was left at, so that lighting does no more than
    // what is seen needs.
    uint32_t stencil = 0;
    std::vector<uint32_t> constants;  // specialisation constants 0, 1, ... of all its shaders; fewer than 10
    bool operator==(const PipelineSpec&) const = default;
};

// All that the plans of a backend refer to by number.
struct Recipe {
    uint64_t generation = 0;              // raised whenever anything below changes; buffers then start empty
    std::vector<BufferSpec> buffers;      // by buffer number
    std::vector<PipelineSpec> pipelines;  // by pipeline number
    // Of an effect: the storage buffer that tells how much light reaches a place (shaders/shared/light_grid.glsl), or
    // no_light_grid. What backends draw is lit by it. It keeps its size.
    uint32_t light_grid = no_light_grid;
    // Targets of what is visible that pipelines write to.
    uint32_t visibility_targets() const {
        uint32_t targets = 0;
        for (const PipelineSpec& p : pipelines)
            targets = std::max(targets, p.visibility.empty() ? 0 : p.visibility_targets);
        return targets;
    }
    // Whether any pipeline has a stencil.
    bool has_stencils() const {
        return std::ranges::any_of(pipelines, [](const PipelineSpec& p) { return p.stencil != 0; });
    }
    // Whether all do that are drawn in the depth stage: then what it left something of is told there, and all else is
    // looked at by nobody.
    bool writes_all_visible() const {
        return std::ranges::none_of(pipelines, [](const PipelineSpec& p) {
            return p.kind == PipelineKind::draw && !p.whole_view && p.visibility.empty();
        });
    }
    bool operator==(const Recipe&) const = default;
};

}  // namespace lodestone
