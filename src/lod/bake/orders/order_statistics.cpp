#include "lod/bake/orders/order_statistics.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/random.h"
#include "lod/asset/cursor.h"
#include "lod/asset/vertex_places.h"
#include "mesh/cache/tipsify.h"

namespace lodestone {

namespace {

bool degenerate(const uint32_t* t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

std::vector<uint32_t> alive_indices(std::span<const uint32_t> indices) {
    std::vector<uint32_t> alive;
    for (size_t i = 0; i < indices.size(); i += 3) {
        if (!degenerate(&indices[i])) alive.insert(alive.end(), {indices[i], indices[i + 1], indices[i + 2]});
    }
    return alive;
}

std::vector<uint32_t> shuffled(std::vector<uint32_t> indices) {
    Random random(1);
    for (auto left = static_cast<uint32_t>(indices.size() / 3); left > 1; --left) {
        const size_t other = random.below(left);
        std::swap_ranges(&indices[other * 3], &indices[other * 3] + 3, &indices[(size_t{left} - 1) * 3]);
    }
    return indices;
}

// Calls visit(level, alive indices) for each level, walking down from full detail.
template <class Visit>
void for_levels(const ProgressiveMesh& pm, uint32_t order, const std::vector<uint32_t>& levels, Visit&& visit) {
    PmCursor cursor(pm, order);
    for (size_t i = levels.size(); i-- > 0;) {
        cursor.goto_level(levels[i]);
        visit(cursor, alive_indices(cursor.drawn_indices()));
    }
}

// Distinct 64-byte lines written between full detail and the base, ecol by ecol.
uint64_t lines_written(const ProgressiveMesh& pm, const FaceOrder& order) {
    constexpr uint64_t indices_per_line = 16;
    std::vector<uint64_t> lines;  // one half after the other
    const uint64_t second_half = order.indices.size() + indices_per_line;
    const auto add = [&](uint32_t half, uint64_t position) {
        lines.push_back((half * second_half + position) / indices_per_line);
    };
    uint64_t total = 0;
    uint32_t r = 0, keyframe = 0;
    size_t next_tswap = 0, slot = 0;
    for (uint32_t i = 0; i < pm.ecols.size(); ++i) {
        lines.clear();
        for (uint32_t k = 0; k < pm.ecols[i].wedges; ++k, ++r) {
            for (uint64_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c)
                add(order.half_of(order.corners[c]), order.position_of(order.corners[c]));
        }
        if (next_tswap < order.tswaps.size() && order.tswaps[next_tswap].level == i + 1) {
            ++next_tswap;
            const size_t end =
                next_tswap < order.tswaps.size() ? order.tswaps[next_tswap].first_slot : order.cycle_slots.size();
            for (; slot < end; ++slot) {
                add(0, uint64_t{order.cycle_slots[slot]} * 3);
                add(0, uint64_t{order.cycle_slots[slot]} * 3 + 2);
            }
        }
        if (keyframe < order.keyframes.size()) {
            const Keyframe& next = order.keyframes[keyframe];
            const uint64_t begin = next.blocks_held(i);
            const uint64_t end = i + 1 < next.level ? next.blocks_held(i + 1) : 0;
            for (uint64_t p = begin * keyframe_block_slots * 3; p < end * keyframe_block_slots * 3; ++p)
                add((keyframe + 1) & 1, p);
            keyframe += i + 1 == next.level;
        }
        std::sort(lines.begin(), lines.end());
        total += static_cast<uint64_t>(std::unique(lines.begin(), lines.end()) - lines.begin());
    }
    return total;
}

}  // namespace

std::vector<uint32_t> sample_levels(const ProgressiveMesh& pm, uint32_t count, LevelSpacing spacing) {
    LODE_CHECK(count > 0);
    const double full = pm.triangles_at(0), base = pm.triangles_at(pm.levels() - 1);
    std::vector<uint32_t> levels;
    for (uint32_t i = 1; i <= count; ++i) {
        const double t = static_cast<double>(i) / count;
        const double triangles =
            spacing == LevelSpacing::uniform || base == 0 ? base + (full - base) * t : base * std::pow(full / base, t);
        levels.push_back(i == count ? 0 : pm.level_for_triangles(static_cast<uint64_t>(triangles)));
    }
    return levels;
}

OrderCost cost_of_order(const ProgressiveMesh& pm, uint32_t order, const CacheModel& model,
                        const std::vector<uint32_t>& levels) {
    OrderCost cost;
    const std::vector<uint32_t> places = vertex_places(pm, order);
    for_levels(pm, order, levels, [&](const PmCursor& cursor, const std::vector<uint32_t>&) {
        const CacheStatistics s = simulate(model, placed(cursor.drawn_indices(), places));
        cost.levels.push_back({cursor.level(), s.triangles, s.vertices, s.atvr(), s.acmr()});
    });
    std::reverse(cost.levels.begin(), cost.levels.end());
    for (const LevelCost& level : cost.levels) {
        cost.atvr_mean += level.atvr / static_cast<double>(cost.levels.size());
        cost.acmr_mean += level.acmr / static_cast<double>(cost.levels.size());
        cost.atvr_worst = std::max(cost.atvr_worst, level.atvr);
    }
    const FaceOrder& o = pm.orders[order];
    const auto ecols = static_cast<double>(std::max<size_t>(1, pm.ecols.size()));
    cost.moved_per_ecol = o.moved_per_ecol(pm.ecols.size());
    cost.cache_lines_per_ecol = static_cast<double>(lines_written(pm, o)) / ecols;
    cost.bytes_per_ecol = static_cast<double>(o.permutation_bytes()) / ecols;
    return cost;
}

double atvr_of_fresh_order(const ProgressiveMesh& pm, FreshOrder order, const CacheModel& model,
                           const std::vector<uint32_t>& levels) {
    double sum = 0;
    const std::vector<uint32_t> places = vertex_places(pm, 0);
    const uint32_t fifo = model.kind == CacheModel::Kind::batch ? 16 : model.size;
    for_levels(pm, 0, levels, [&](const PmCursor& cursor, const std::vector<uint32_t>& alive) {
        std::vector<uint32_t> ordered(alive.size());
        if (order == FreshOrder::meshoptimizer) {
            meshopt_optimizeVertexCache(ordered.data(), alive.data(), alive.size(), cursor.vertex_count());
        } else if (order == FreshOrder::meshoptimizer_fifo) {
            meshopt_optimizeVertexCacheFifo(ordered.data(), alive.data(), alive.size(), cursor.vertex_count(), fifo);
        } else if (order == FreshOrder::tipsify) {
            ordered = tipsify(alive, cursor.vertex_count(), fifo);
        } else {
            ordered = shuffled(alive);
        }
        sum += simulate(model, placed(ordered, places)).atvr();
    });
    return sum / static_cast<double>(levels.size());
}

double worst_atvr(const ProgressiveMesh& pm, const std::vector<uint32_t>& levels) {
    double sum = 0;
    for_levels(pm, 0, levels, [&](const PmCursor&, const std::vector<uint32_t>& alive) {
        std::vector<uint32_t> used = alive;
        std::ranges::sort(used);
        const auto distinct = std::unique(used.begin(), used.end()) - used.begin();
        if (distinct > 0) sum += static_cast<double>(alive.size()) / static_cast<double>(distinct);
    });
    return sum / static_cast<double>(levels.size());
}

double atvr_of_static_order(const ProgressiveMesh& pm, const CacheModel& model, const std::vector<uint32_t>& levels) {
    const FaceOrder* order = pm.order_named("static");
    if (order == nullptr) return 0;
    const auto number = static_cast<uint32_t>(order - pm.orders.data());
    const std::vector<uint32_t> places = vertex_places(pm, number);
    double sum = 0;
    for_levels(pm, number, levels, [&](const PmCursor&, const std::vector<uint32_t>& alive) {
        sum += simulate(model, placed(alive, places)).atvr();
    });
    return sum / static_cast<double>(levels.size());
}

}  // namespace lodestone
