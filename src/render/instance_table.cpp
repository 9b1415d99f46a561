#include "render/instance_table.h"

#include <algorithm>
#include <glm/matrix.hpp>

#include "frame/screen_error.h"

namespace lodestone {

void InstanceTable::convert(size_t i, const Instance& instance) {
    const glm::mat3 normal = glm::transpose(glm::inverse(glm::mat3(instance.object_to_world)));
    const uint8_t mirrored = glm::determinant(glm::mat3(instance.object_to_world)) < 0 ? 1 : 0;
    all_[i] = {instance.object_to_world,
               glm::mat4(normal),
               instance.first_material,
               instance.asset,
               largest_scale(instance.object_to_world),
               mirrored};
    mirrored_ += size_t{mirrored} - is_mirrored_[i];
    is_mirrored_[i] = mirrored;
}

void InstanceTable::update(const InstanceSet& instances) {
    if (generation_ == instances.generation()) return;
    const auto changed = instances.size() == all_.size() ? instances.changed_since(generation_) : std::nullopt;
    generation_ = instances.generation();
    ++version_;
    if (changed && changed->size() < all_.size()) {
        for (const uint32_t i : *changed) {
            convert(i, instances[i]);
            log_.emplace_back(version_, i);
        }
        // A slot that is that far behind is sent all of them.
        while (log_.size() > all_.size()) {
            since_ = log_.front().first;
            log_.pop_front();
        }
        return;
    }
    all_.resize(instances.size());
    is_mirrored_.assign(instances.size(), 0);
    mirrored_ = 0;
    for (size_t i = 0; i < all_.size(); ++i) convert(i, instances[i]);
    log_.clear();
    since_ = version_;
}

std::vector<InstanceTable::Range> InstanceTable::stale(uint64_t version) const {
    if (version == version_) return {};
    if (version < since_ || version == 0) return {{0, all_.size()}};
    const auto first = std::ranges::upper_bound(log_, version, {}, &std::pair<uint64_t, uint32_t>::first);
    std::vector<uint32_t> numbers;
    for (auto it = first; it != log_.end(); ++it) numbers.push_back(it->second);
    std::ranges::sort(numbers);
    std::vector<Range> ranges;
    for (const uint32_t i : numbers) {
        if (ranges.empty() || i > ranges.back().first + ranges.back().count) {
            ranges.push_back({i, 1});
        } else {
            ranges.back().count = std::max(ranges.back().count, size_t{i} + 1 - ranges.back().first);
        }
    }
    return ranges;
}

}  // namespace lodestone
