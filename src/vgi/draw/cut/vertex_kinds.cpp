#include "vgi/draw/cut/vertex_kinds.h"

namespace lodestone::vgi {

std::span<const TrianglesByKind::Run> TrianglesByKind::append(std::span<const uint32_t> triangles, uint32_t page_cells,
                                                              std::vector<uint32_t>& list) {
    leaves_.clear();
    others_.clear();
    runs_.clear();
    const size_t before = list.size();
    for (size_t i = 0; i < triangles.size(); i += 3) {
        const auto triangle = triangles.subspan(i, 3);
        uint32_t kinds = 0;
        for (const uint32_t index : triangle) kinds |= kind_of(index, page_cells);
        std::vector<uint32_t>& to = kinds == LODE_VGI_KIND_SAMPLES  ? list
                                    : kinds == LODE_VGI_KIND_LEAVES ? leaves_
                                                                    : others_;
        to.insert(to.end(), triangle.begin(), triangle.end());
    }
    const auto add = [&](uint32_t kinds, size_t words) {
        if (words > 0) runs_.push_back({kinds, static_cast<uint32_t>(words)});
    };
    add(LODE_VGI_KIND_SAMPLES, list.size() - before);
    add(LODE_VGI_KIND_LEAVES, leaves_.size());
    add(every_kind, others_.size());
    list.insert(list.end(), leaves_.begin(), leaves_.end());
    list.insert(list.end(), others_.begin(), others_.end());
    return runs_;
}

}  // namespace lodestone::vgi
