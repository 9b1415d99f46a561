#include "vgi/draw/cut/vertex_kinds.h"

#include <algorithm>
#include <iterator>

namespace lodestone::vgi {

namespace {

// Triangles one after another of a kind that are worth a place of their own: they no longer share vertices with those
// between which they were.
constexpr size_t shortest_run = 16;

constexpr size_t chunk_words = 3 * 8192;

// Groups of triangles, in the order in which they come.
constexpr uint32_t kinds_of_groups[] = {LODE_VGI_KIND_SAMPLES, LODE_VGI_KIND_LEAVES, LODE_VGI_KIND_MOVING_LEAVES,
                                        every_kind};
constexpr uint8_t others = 3;
uint8_t group_of(uint32_t kinds) {
    return static_cast<uint8_t>(std::ranges::find(kinds_of_groups, kinds_of_groups + others, kinds) - kinds_of_groups);
}

uint32_t kinds_of(std::span<const uint32_t> triangles, size_t first, uint32_t cells) {
    uint32_t kinds = 0;
    for (size_t k = first; k < first + 3; ++k) kinds |= kind_of(triangles[k], cells);
    return kinds;
}

}  // namespace

TrianglesByKind::TrianglesByKind(std::span<const uint32_t> triangles, uint32_t cells, bool told_apart)
    : triangles_(triangles),
      cells_(cells),
      told_apart_(told_apart),
      chunks_((triangles.size() + chunk_words - 1) / chunk_words) {}

std::span<const uint32_t> TrianglesByKind::of(size_t chunk) const {
    const size_t begin = chunk * chunk_words;
    return triangles_.subspan(begin, std::min(chunk_words, triangles_.size() - begin));
}

void TrianglesByKind::look_at(size_t chunk) {
    const std::span<const uint32_t> triangles = of(chunk);
    Chunk& found = chunks_[chunk];
    if (!told_apart_) {
        found.words[others] = static_cast<uint32_t>(triangles.size());
        found.ends.emplace_back(found.words[others], others);
        return;
    }
    for (size_t begin = 0, end = 0; begin < triangles.size(); begin = end) {
        const uint32_t kinds = kinds_of(triangles, begin, cells_);
        for (end = begin + 3; end < triangles.size() && kinds_of(triangles, end, cells_) == kinds;) end += 3;
        // What a chunk's end cuts off goes on in the next.
        const bool cut_off = (begin == 0 && chunk > 0) || (end == triangles.size() && chunk + 1 < chunks_.size());
        const uint8_t group = end - begin < 3 * shortest_run && !cut_off ? others : group_of(kinds);
        found.words[group] += static_cast<uint32_t>(end - begin);
        if (!found.ends.empty() && found.ends.back().second == group) {
            found.ends.back().first = static_cast<uint32_t>(end);
        } else {
            found.ends.emplace_back(static_cast<uint32_t>(end), group);
        }
    }
}

std::vector<TrianglesByKind::Run> TrianglesByKind::runs() {
    static_assert(std::size(kinds_of_groups) == groups);
    std::vector<Run> runs;
    uint32_t words = 0;
    for (size_t group = 0; group < groups; ++group) {
        const uint32_t before = words;
        for (Chunk& chunk : chunks_) {
            chunk.first[group] = words;
            words += chunk.words[group];
        }
        if (words > before) runs.push_back({kinds_of_groups[group], words - before});
    }
    return runs;
}

void TrianglesByKind::copy(size_t chunk, uint32_t* to) const {
    const std::span<const uint32_t> triangles = of(chunk);
    std::array<uint32_t, groups> next = chunks_[chunk].first;
    uint32_t begin = 0;
    for (const auto& [end, group] : chunks_[chunk].ends) {
        std::copy(triangles.begin() + begin, triangles.begin() + end, to + next[group]);
        next[group] += end - begin;
        begin = end;
    }
}

}  // namespace lodestone::vgi
