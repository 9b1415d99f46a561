#include "vgi/draw/cut/vertex_kinds.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace lodestone::vgi {

namespace {

// Triangles one after another of a kind that are worth a place of their own where there are others: they no longer
// share vertices with those between which they were.
constexpr size_t shortest_run = 16;

constexpr size_t chunk_words = 3 * 8192;

// Groups of triangles, in the order in which they come.
enum Group : uint8_t { samples, any_samples, leaves, moving_leaves, corners, others };
constexpr uint32_t kinds_of_groups[] = {LODE_VGI_KIND_SAMPLES,       kinds_of_samples,      LODE_VGI_KIND_LEAVES,
                                        LODE_VGI_KIND_MOVING_LEAVES, LODE_VGI_KIND_CORNERS, every_kind};
// The last that a triangle of these kinds may be in but for `others`.
Group group_of(uint32_t kinds) {
    if ((kinds & ~kinds_of_samples) == 0) return any_samples;
    return static_cast<Group>(std::ranges::find(kinds_of_groups + leaves, kinds_of_groups + others, kinds) -
                              kinds_of_groups);
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

TrianglesByKind::TrianglesByKind(std::span<const uint32_t> triangles, std::vector<Run> runs)
    : TrianglesByKind(triangles, 0) {
    known_ = std::move(runs);
}

std::span<const uint32_t> TrianglesByKind::of(size_t chunk) const {
    const size_t begin = chunk * chunk_words;
    return triangles_.subspan(begin, std::min(chunk_words, triangles_.size() - begin));
}

void TrianglesByKind::look_at(size_t chunk) {
    if (!known_.empty()) return;
    const std::span<const uint32_t> triangles = of(chunk);
    Chunk& found = chunks_[chunk];
    if (!told_apart_) {
        found.add(triangles.size(), others);
        return;
    }
    // Runs of triangles that are the same by `of`: add(begin, end, what they are, whether they are long).
    const auto for_runs = [&](size_t begin, size_t last, auto&& of, auto&& add) {
        for (size_t end = begin; begin < last; begin = end) {
            const auto its = of(begin);
            for (end = begin + 3; end < last && of(end) == its;) end += 3;
            // What a chunk's end cuts off goes on in the next; what is all there is is worth a place of its own.
            const bool cut_off = (begin == 0 && chunk > 0) || (end == triangles.size() && chunk + 1 < chunks_.size());
            const bool alone = begin == 0 && end == triangles.size();
            add(begin, end, its, end - begin >= 3 * shortest_run || cut_off || alone);
        }
    };
    const auto group = [&](size_t at) { return group_of(kinds_of(triangles, at, cells_)); };
    const auto of_samples_alone = [&](size_t at) {
        return kinds_of(triangles, at, cells_) == LODE_VGI_KIND_SAMPLES ? samples : any_samples;
    };
    for_runs(0, triangles.size(), group, [&](size_t begin, size_t end, Group its, bool is_long) {
        if (its != any_samples || !is_long) return found.add(end, is_long ? its : others);
        for_runs(begin, end, of_samples_alone,
                 [&](size_t, size_t to, Group kind, bool long_too) { found.add(to, long_too ? kind : any_samples); });
    });
}

void TrianglesByKind::Chunk::add(size_t end, uint8_t group) {
    const auto to = static_cast<uint32_t>(end);
    words[group] += to - (ends.empty() ? 0 : ends.back().first);
    if (!ends.empty() && ends.back().second == group) {
        ends.back().first = to;
    } else {
        ends.emplace_back(to, group);
    }
}

std::vector<TrianglesByKind::Run> TrianglesByKind::runs() {
    static_assert(std::size(kinds_of_groups) == groups);
    if (!known_.empty()) return known_;
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
    if (!known_.empty()) {
        std::ranges::copy(triangles, to + chunk * chunk_words);
        return;
    }
    std::array<uint32_t, groups> next = chunks_[chunk].first;
    uint32_t begin = 0;
    for (const auto& [end, group] : chunks_[chunk].ends) {
        std::copy(triangles.begin() + begin, triangles.begin() + end, to + next[group]);
        next[group] += end - begin;
        begin = end;
    }
}

}  // namespace lodestone::vgi
