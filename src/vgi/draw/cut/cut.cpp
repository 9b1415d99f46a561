#include "vgi/draw/cut/cut.h"

#include <algorithm>

#include "base/threads.h"

namespace lodestone::vgi {

void CutParts::add(std::span<const CutParts* const> others) {
    for (const CutParts* other : others) {
        for (const auto& part : other->parts_) {
            if (!part.second.empty()) list(part.first);
        }
    }
    parallel_for(parts_.size(), 1, [&](size_t begin, size_t end) {
        for (size_t p = begin; p < end; ++p) {
            auto& [mask, to] = parts_[p];
            size_t words = to.size();
            for (const CutParts* other : others) {
                if (const auto* from = other->find(mask)) words += from->size();
            }
            to.reserve(words);
            for (const CutParts* other : others) {
                if (const auto* from = other->find(mask)) to.insert(to.end(), from->begin(), from->end());
            }
        }
    });
}

std::vector<std::pair<uint32_t, std::vector<uint32_t>>> CutParts::take() {
    std::ranges::sort(parts_, {}, [](const auto& part) { return part.first; });
    return std::move(parts_);
}

}  // namespace lodestone::vgi
