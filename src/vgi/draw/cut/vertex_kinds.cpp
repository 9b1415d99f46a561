#include "vgi/draw/cut/vertex_kinds.h"

namespace lodestone::vgi {

namespace {

// Triangles one after another of a kind that are worth a place of their own: they no longer share vertices with those
// between which they were.
constexpr size_t shortest_run = 16;

uint32_t kinds_of(std::span<const uint32_t> triangles, size_t first, uint32_t cells) {
    uint32_t kinds = 0;
    for (size_t k = first; k < first + 3; ++k) kinds |= kind_of(triangles[k], cells);
    return kinds;
}

}  // namespace

std::span<const TrianglesByKind::Run> TrianglesByKind::append(std::span<const uint32_t> triangles, uint32_t cells,
                                                              std::vector<uint32_t>& list) {
    leaves_.clear();
    moving_.clear();
    others_.clear();
    runs_.clear();
    const size_t before = list.size();
    for (size_t begin = 0, end = 0; begin < triangles.size(); begin = end) {
        const uint32_t kinds = kinds_of(triangles, begin, cells);
        for (end = begin + 3; end < triangles.size() && kinds_of(triangles, end, cells) == kinds;) end += 3;
        const bool alone = end - begin >= 3 * shortest_run;
        std::vector<uint32_t>& to = !alone                                 ? others_
                                    : kinds == LODE_VGI_KIND_SAMPLES       ? list
                                    : kinds == LODE_VGI_KIND_LEAVES        ? leaves_
                                    : kinds == LODE_VGI_KIND_MOVING_LEAVES ? moving_
                                                                           : others_;
        const auto run = triangles.subspan(begin, end - begin);
        to.insert(to.end(), run.begin(), run.end());
    }
    const auto add = [&](uint32_t kinds, size_t words) {
        if (words > 0) runs_.push_back({kinds, static_cast<uint32_t>(words)});
    };
    add(LODE_VGI_KIND_SAMPLES, list.size() - before);
    add(LODE_VGI_KIND_LEAVES, leaves_.size());
    add(LODE_VGI_KIND_MOVING_LEAVES, moving_.size());
    add(every_kind, others_.size());
    for (const auto* more : {&leaves_, &moving_, &others_}) list.insert(list.end(), more->begin(), more->end());
    return runs_;
}

}  // namespace lodestone::vgi
