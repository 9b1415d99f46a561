// Triangles of a cut by what their vertices are, so that each is drawn by shaders that know no more than they need.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

inline constexpr uint32_t kinds_of_samples = LODE_VGI_KIND_SAMPLES | LODE_VGI_KIND_CORNER_SAMPLES;
inline constexpr uint32_t kinds_of_leaves = LODE_VGI_KINDS_OF_LEAVES;
static_assert(kinds_of_leaves == (LODE_VGI_KIND_LEAVES | LODE_VGI_KIND_MOVING_LEAVES));
inline constexpr uint32_t every_kind = LODE_VGI_EVERY_KIND;

// LODE_VGI_KIND_... of a vertex. index: as Cut::parts has it. cells: along a side of a page of positions.
inline uint32_t kind_of(uint32_t index, uint32_t cells) {
    if ((index & LODE_VGI_CORNER) != 0) return LODE_VGI_KIND_CORNERS;
    if ((index & LODE_VGI_LEAF) != 0)
        return (index & LODE_VGI_LEAF_MOVES) != 0 ? LODE_VGI_KIND_MOVING_LEAVES : LODE_VGI_KIND_LEAVES;
    const uint32_t place = index % LODE_VGI_PAGE_TEXELS(cells), row = cells + 1;
    const bool corner = place == 0 || place == cells || place == cells * row || place == row * row - 1;
    return corner ? LODE_VGI_KIND_CORNER_SAMPLES : LODE_VGI_KIND_SAMPLES;
}

// A list of triangles in another order: long runs of samples apart from pages' corners, those of any samples, of
// leaves, of leaves that may move, of corners, and all others, each in the order they had. It is looked at and copied
// chunk by chunk, by any threads.
class TrianglesByKind {
public:
    // triangles: must outlive this. cells: along a side of a page of positions. told_apart: if not, all are of every
    // kind (patches that are to be tessellated, say).
    TrianglesByKind(std::span<const uint32_t> triangles, uint32_t cells, bool told_apart = true);
    struct Run {
        uint32_t kinds, words;  // LODE_VGI_KIND_... there may be; indices, > 0
    };
    // Of triangles that are in that order already, in these runs.
    TrianglesByKind(std::span<const uint32_t> triangles, std::vector<Run> runs);

    size_t chunks() const { return chunks_.size(); }
    void look_at(size_t chunk);
    // In their order. Call it when all chunks have been looked at; then they can be copied.
    std::vector<Run> runs();
    // to: of the whole list.
    void copy(size_t chunk, uint32_t* to) const;

private:
    static constexpr size_t groups = 6;  // of kinds
    struct Chunk {
        std::vector<std::pair<uint32_t, uint8_t>> ends;  // of its runs, in triangles_; and the group of each
        std::array<uint32_t, groups> words{}, first{};   // of each group; where they go
        void add(size_t end, uint8_t group);             // what lies between the last end and this one
    };
    std::span<const uint32_t> of(size_t chunk) const;

    std::span<const uint32_t> triangles_;
    uint32_t cells_ = 0;
    bool told_apart_ = true;
    std::vector<Run> known_;  // where they are in order
    std::vector<Chunk> chunks_;
};

}  // namespace lodestone::vgi
