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
    // They are megabytes: copied by all threads.
    struct Copy {
        const std::vector<uint32_t>* from;
        size_t part, at;
    };
    std::vector<Copy> copies;
    for (size_t p = 0; p < parts_.size(); ++p) {
        auto& [mask, to] = parts_[p];
        size_t words = to.size();
        for (const CutParts* other : others) {
            const auto* from = other->find(mask);
            if (from == nullptr || from->empty()) continue;
            copies.push_back({from, p, words});
            words += from->size();
        }
        to.resize(words);
    }
    parallel_for(copies.size(), 1 + copies.size() / 64, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            const auto& [from, part, at] = copies[c];
            std::ranges::copy(*from, parts_[part].second.begin() + static_cast<ptrdiff_t>(at));
        }
    });
}

std::vector<std::pair<uint32_t, std::vector<uint32_t>>> CutParts::take() {
    std::ranges::sort(parts_, {}, [](const auto& part) { return part.first; });
    return std::move(parts_);
}

}  // namespace lodestone::vgi
