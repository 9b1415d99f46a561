#include "mesh/cache/cache_probe.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace lodestone {

namespace {

// A grid of `columns` by `rows` quads, drawn in bands of `band` columns, row after row within a band.
std::vector<uint32_t> banded_grid(uint32_t columns, uint32_t rows, uint32_t band) {
    std::vector<uint32_t> indices;
    const uint32_t pitch = columns + 1;
    for (uint32_t first = 0; first < columns; first += band) {
        for (uint32_t y = 0; y < rows; ++y) {
            for (uint32_t x = first; x < std::min(columns, first + band); ++x) {
                const uint32_t v = y * pitch + x;
                indices.insert(indices.end(), {v, v + 1, v + pitch, v + pitch, v + 1, v + pitch + 1});
            }
        }
    }
    return indices;
}

// Triangles of vertices of their own; each comes back once, after `gap` others.
std::vector<uint32_t> returning(uint32_t gap) {
    constexpr uint32_t triangles = 2048;
    std::vector<uint32_t> indices;
    const auto put = [&](uint32_t t) { indices.insert(indices.end(), {t * 3, t * 3 + 1, t * 3 + 2}); };
    for (uint32_t t = 0; t < triangles; ++t) {
        put(t);
        if (t >= gap) put(t - gap);
    }
    return indices;
}

// One vertex in every triangle, the others new: kept for ever by a cache that renews what it finds, and lost now and
// then by one that does not.
std::vector<uint32_t> hub() {
    std::vector<uint32_t> indices;
    for (uint32_t t = 0; t < 2048; ++t) indices.insert(indices.end(), {0, t * 2 + 1, t * 2 + 2});
    return indices;
}

// The same indices with every second vertex so much further on.
std::vector<uint32_t> apart(std::vector<uint32_t> indices, uint32_t distance) {
    for (uint32_t& index : indices) index += index % 2 * distance;
    return indices;
}

std::vector<CacheModel> candidates() {
    std::vector<CacheModel> models;
    for (const char* name : {"nvidia", "amd", "intel"}) models.push_back(*cache_model_named(name));
    // No FIFO of 128: that is what intel is.
    for (const CacheModel::Kind kind : {CacheModel::Kind::fifo, CacheModel::Kind::lru}) {
        for (const uint32_t size :
             {3, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 28, 32, 40, 48, 64, 96, 192, 256, 384, 512, 1024})
            models.push_back({kind, size, 0, 0});
    }
    return models;
}

}  // namespace

std::vector<ProbePattern> probe_patterns() {
    std::vector<ProbePattern> patterns;
    for (const uint32_t gap : {0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 10u, 12u, 16u, 24u, 32u, 42u, 64u, 100u, 160u})
        patterns.push_back({"returning after " + std::to_string(gap), returning(gap)});
    for (const uint32_t band : {2u, 4u, 6u, 8u, 10u, 12u, 14u, 16u, 20u, 24u, 32u, 48u, 80u})
        patterns.push_back({"grid in bands of " + std::to_string(band), banded_grid(80, 80, band)});
    patterns.push_back({"hub", hub()});
    for (const uint32_t distance : {1u << 12, 1u << 15, 1u << 16})
        patterns.push_back(
            {"every second vertex " + std::to_string(distance) + " on", apart(banded_grid(80, 80, 6), distance)});
    std::vector<uint32_t> shuffled = banded_grid(80, 80, 80);
    Random random(1);
    for (size_t t = shuffled.size() / 3; t > 1; --t) {
        const size_t other = random.below(static_cast<uint32_t>(t));
        std::swap_ranges(shuffled.begin() + static_cast<ptrdiff_t>((t - 1) * 3),
                         shuffled.begin() + static_cast<ptrdiff_t>((t - 1) * 3 + (other == t - 1 ? 0 : 3)),
                         shuffled.begin() + static_cast<ptrdiff_t>(other * 3));
    }
    patterns.push_back({"grid in random order", std::move(shuffled)});
    return patterns;
}

Result<ProbeResult> probe_cache(const std::function<Result<uint64_t>(std::span<const uint32_t>)>& count) {
    ProbeResult result;
    const std::vector<ProbePattern> patterns = probe_patterns();
    for (const ProbePattern& pattern : patterns) {
        const auto counted = count(pattern.indices);
        if (!counted) return tl::unexpected(counted.error());
        if (*counted == 0)
            return fail(Fault::machine, "the device counts no vertex shader runs; name a model with --cache instead");
        result.counts.push_back({pattern.name, pattern.indices.size() / 3, *counted, 0});
    }
    for (const CacheModel& model : candidates()) {
        double sum = 0;
        for (size_t p = 0; p < patterns.size(); ++p) {
            const auto predicted = static_cast<double>(simulate(model, patterns[p].indices).transforms);
            const double off = std::log(predicted / static_cast<double>(result.counts[p].counted));
            sum += off * off;
        }
        result.candidates.push_back({model, std::sqrt(sum / static_cast<double>(patterns.size()))});
    }
    std::ranges::stable_sort(result.candidates, {}, &ProbeResult::Candidate::error);
    result.model = result.candidates[0].model;
    result.error = result.candidates[0].error;
    for (size_t p = 0; p < patterns.size(); ++p)
        result.counts[p].predicted = simulate(result.model, patterns[p].indices).transforms;
    return result;
}

}  // namespace lodestone
