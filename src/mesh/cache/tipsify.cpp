#include "mesh/cache/tipsify.h"

#include <numeric>

#include "base/check.h"
#include "base/none.h"

namespace lodestone {

namespace {

// Triangles around each vertex: those of v are around[first[v]] .. around[first[v + 1] - 1].
struct Fans {
    std::vector<uint32_t> first, around;

    Fans(std::span<const uint32_t> indices, uint32_t vertex_count)
        : first(vertex_count + 1, 0), around(indices.size()) {
        for (const uint32_t v : indices) ++first[v + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<uint32_t> fill(first.begin(), first.end() - 1);
        for (uint32_t i = 0; i < indices.size(); ++i) around[fill[indices[i]]++] = i / 3;
    }
};

// Where to go on when no vertex near by has triangles left.
struct DeadEnds {
    std::vector<uint32_t> met;  // vertices, the last on top
    uint32_t cursor = 0;        // vertices before have none left

    // live: per vertex, its triangles left. None where none has any.
    uint32_t leave(const std::vector<uint32_t>& live) {
        while (!met.empty()) {
            const uint32_t v = met.back();
            met.pop_back();
            if (live[v] > 0) return v;
        }
        while (cursor < live.size() && live[cursor] == 0) ++cursor;
        return cursor < live.size() ? cursor : none;
    }
};

}  // namespace

std::vector<uint32_t> tipsify(std::span<const uint32_t> indices, uint32_t vertex_count, uint32_t cache_size) {
    LODE_CHECK(indices.size() % 3 == 0 && cache_size >= 3, indices.size(), cache_size);
    const Fans fans(indices, vertex_count);
    std::vector<uint32_t> live(vertex_count);
    for (uint32_t v = 0; v < vertex_count; ++v) live[v] = fans.first[v + 1] - fans.first[v];

    DeadEnds dead_ends;
    std::vector<uint32_t> out, candidates, entered(vertex_count, 0);
    out.reserve(indices.size());
    std::vector<bool> emitted(indices.size() / 3, false);
    uint32_t clock = cache_size + 1;  // a vertex is cached while clock - entered <= cache_size

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
        return best != none ? best : dead_ends.leave(live);
    };

    for (uint32_t fan = dead_ends.leave(live); fan != none; fan = best_candidate()) {
        candidates.clear();
        for (uint32_t k = fans.first[fan]; k < fans.first[fan + 1]; ++k) {
            const uint32_t t = fans.around[k];
            if (emitted[t]) continue;
            emitted[t] = true;
            for (uint32_t c = 0; c < 3; ++c) {
                const uint32_t v = indices[t * 3 + c];
                out.push_back(v);
                dead_ends.met.push_back(v);
                candidates.push_back(v);
                --live[v];
                if (clock - entered[v] > cache_size) entered[v] = clock++;
            }
        }
    }
    return out;
}

}  // namespace lodestone
