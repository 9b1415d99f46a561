#include "vgi/draw/cut/cut.h"

#include <algorithm>

namespace lodestone::vgi {

void CutParts::add(const CutParts& other) {
    for (const auto& [mask, words] : other.parts_) {
        if (words.empty()) continue;
        auto& to = list(mask);
        to.insert(to.end(), words.begin(), words.end());
    }
}

std::vector<std::pair<uint32_t, std::vector<uint32_t>>> CutParts::take() {
    std::ranges::sort(parts_, {}, [](const auto& part) { return part.first; });
    return std::move(parts_);
}

}  // namespace lodestone::vgi
