#include "vgi/draw/cut/cut.h"

#include <algorithm>

#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"

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

void prefetch(const Residency& residency, const CutRequest& request, std::span<const float> wanted_now,
              std::vector<float>& prefetched) {
    const Visibility visibility(request, residency.about());
    const RefinementTest wanted(request, residency.about());
    const uint32_t per_chart = residency.tree().pages();
    for (uint32_t number = 0; number < residency.pages(); ++number) {
        const uint32_t page = number % per_chart;
        if (residency.entry(number).texels != nullptr || wanted_now[number] > 0 ||
            residency.entry(number - page + residency.tree().parent(page)).texels == nullptr)
            continue;
        const PageBounds& bounds = residency.about().bounds[number];
        if (wanted.may_be(bounds) && visibility.seen(1, number) != 0)
            prefetched[number] = std::max(prefetched[number], std::min(wanted.excess(bounds) * 1e-3f, 1e-2f));
    }
}

}  // namespace lodestone::vgi
