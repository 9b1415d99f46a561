#include "mesh/cache/tipsify.h"

#include <numeric>

#include "base/check.h"

namespace lodestone {

std::vector<uint32_t> tipsify(std::span<const uint32_t> indices, uint32_t vertex_count, uint32_t cache_size) {
    LODE_CHECK(indices.size() % 3 == 0 && cache_size >= 3, indices.size(), cache_size);
    constexpr uint32_t none = ~0u;
    const auto triangles = static_cast<uint32_t>(indices.size() / 3);
    std::vector<uint32_t> first(vertex_count + 1, 0), around(indices.size()), live(vertex_count, 0);
    for (const uint32_t v : indices) ++first[v + 1];
    for (uint32_t v = 0; v < vertex_count; ++v) live[v] = first[v + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> fill(first.begin(), first.end() - 1);
    for (uint32_t i = 0; i < indices.size(); ++i) around[fill[indices[i]]++] = i / 3;

    std::vector<uint32_t> out, dead_ends, candidates, entered(vertex_count, 0);
    out.reserve(indices.size());
    std::vector<bool> emitted(triangles, false);
    uint32_t clock = cache_size + 1, cursor = 0;  // a vertex is cached while clock - entered <= cache_size

    const auto after_dead_end = [&]() -> uint32_t {
        while (!dead_ends.empty()) {
            const uint32_t v = dead_ends.back();
            dead_ends.pop_back();
            if (live[v] > 0) return v;
        }
        while (cursor < vertex_count && live[cursor] == 0) ++cursor;
        return cursor < vertex_count ? cursor : none;
    };
    const auto best_candidate = [&]() -> uint32_t {
        uint32_t best = none;
        int64_t best_priority = -1;
        for (const uint32_t v : candidates) {
            if (live[v] == 0) continue;
            // A vertex that stays cached while its fan is emitted is worth the more the longer it has been there.
            const uint32_t age = clock - entered[v];
            const int64_t priority = age + 2 * live[v] <= cache_size ? age : 0;
            if (priority > best_priority) {
                best_priority = priority;
                best = v;
            }
        }
        return best != none ? best : after_dead_end();
    };

    for (uint32_t fan = after_dead_end(); fan != none; fan = best_candidate()) {
        candidates.clear();
        for (uint32_t k = first[fan]; k < first[fan + 1]; ++k) {
            const uint32_t t = around[k];
            if (emitted[t]) continue;
            emitted[t] = true;
            for (uint32_t c = 0; c < 3; ++c) {
                const uint32_t v = indices[t * 3 + c];
                out.push_back(v);
                dead_ends.push_back(v);
                candidates.push_back(v);
                --live[v];
                if (clock - entered[v] > cache_size) entered[v] = clock++;
            }
        }
    }
    return out;
}

}  // namespace lodestone
