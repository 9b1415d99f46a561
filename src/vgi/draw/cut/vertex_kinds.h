// Triangles of a cut by what their vertices are, so that each is drawn by shaders that know no more than they need.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

inline constexpr uint32_t kinds_of_leaves = LODE_VGI_KIND_LEAVES | LODE_VGI_KIND_MOVING_LEAVES;
inline constexpr uint32_t every_kind = LODE_VGI_KIND_SAMPLES | LODE_VGI_KIND_CORNERS | kinds_of_leaves;

// LODE_VGI_KIND_... of a vertex. index: as Cut::parts has it. cells: along a side of a page of positions.
inline uint32_t kind_of(uint32_t index, uint32_t cells) {
    if ((index & LODE_VGI_CORNER) != 0) return LODE_VGI_KIND_CORNERS;
    if ((index & LODE_VGI_LEAF) != 0)
        return (index & LODE_VGI_LEAF_MOVES) != 0 ? LODE_VGI_KIND_MOVING_LEAVES : LODE_VGI_KIND_LEAVES;
    const uint32_t place = index % LODE_VGI_PAGE_TEXELS, row = cells + 1;
    const bool corner = place == 0 || place == cells || place == cells * row || place == row * row - 1;
    return corner ? LODE_VGI_KIND_CORNERS : LODE_VGI_KIND_SAMPLES;
}

// The same triangles: long runs of samples alone, those of leaves alone, of leaves alone that may move, and all others,
// each in the order they had.
class TrianglesByKind {
public:
    struct Run {
        uint32_t kinds, words;  // LODE_VGI_KIND_... there may be; indices
    };
    // Appends them to a list. Valid until the next call.
    std::span<const Run> append(std::span<const uint32_t> triangles, uint32_t cells, std::vector<uint32_t>& list);

private:
    std::vector<uint32_t> leaves_, moving_, others_;
    std::vector<Run> runs_;
};

}  // namespace lodestone::vgi
