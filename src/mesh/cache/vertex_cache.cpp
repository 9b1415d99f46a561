#include "mesh/cache/vertex_cache.h"

#include <algorithm>
#include <charconv>

#include "base/check.h"

namespace lodestone {

namespace {

// The same vertices by their rank among those used.
std::vector<uint32_t> ranked(std::span<const uint32_t> indices) {
    std::vector<uint32_t> used(indices.begin(), indices.end()), ranks;
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    ranks.reserve(indices.size());
    for (const uint32_t index : indices)
        ranks.push_back(static_cast<uint32_t>(std::ranges::lower_bound(used, index) - used.begin()));
    return ranks;
}

bool degenerate(const uint32_t* t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// Cached while fewer than `size` other vertices entered since; a hit changes nothing.
class Fifo {
public:
    Fifo(uint32_t vertices, uint32_t size) : entered_(vertices, 0), size_(size), clock_(uint64_t{size} + 1) {}
    bool miss(uint32_t v) {
        if (clock_ - entered_[v] <= size_) return false;
        entered_[v] = clock_++;
        return true;
    }

private:
    std::vector<uint64_t> entered_;
    uint64_t size_, clock_;
};

// Least recently used: a hit makes the vertex the newest.
class Lru {
public:
    explicit Lru(uint32_t size) : size_(size) {}
    bool miss(uint32_t v) {
        const auto found = std::find(entries_.begin(), entries_.end(), v);
        const bool missed = found == entries_.end();
        if (!missed) entries_.erase(found);
        entries_.insert(entries_.begin(), v);
        if (entries_.size() > size_) entries_.pop_back();
        return missed;
    }

private:
    std::vector<uint32_t> entries_;
    size_t size_;
};

template <class Cache>
uint64_t run(Cache& cache, std::span<const uint32_t> indices, std::vector<uint8_t>* misses) {
    uint64_t transforms = 0;
    for (size_t i = 0; i < indices.size(); i += 3) {
        uint8_t missed = 0;
        for (size_t k = 0; k < 3; ++k) missed = static_cast<uint8_t>(missed + cache.miss(indices[i + k]));
        transforms += missed;
        if (misses != nullptr) (*misses)[i / 3] = missed;
    }
    return transforms;
}

// Batches: a small FIFO inside each, closed when the next triangle would pass a limit, or where the bits of `seen`, the
// indices as the device has them, do not agree.
uint64_t run_batches(const CacheModel& model, std::span<const uint32_t> indices, std::span<const uint32_t> seen,
                     uint32_t vertices, std::vector<uint8_t>* misses) {
    std::vector<uint64_t> entered(vertices, 0);
    const uint64_t size = model.size;
    uint64_t clock = size + 1, transforms = 0;
    uint32_t batch_vertices = 0, batch_triangles = 0;
    const uint32_t shift = model.batch_index_bits;
    uint32_t high_bits = shift > 0 ? seen[0] >> shift : 0;
    const auto close = [&] {
        batch_vertices = batch_triangles = 0;
        clock += size + 1;  // forget everything
    };
    const auto cached = [&](uint32_t v) { return clock - entered[v] <= size; };
    for (size_t i = 0; i < indices.size(); i += 3) {
        const uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
        const auto wanted = static_cast<uint32_t>(!cached(a)) + !cached(b) + !cached(c);
        if ((model.batch_triangles > 0 && batch_triangles == model.batch_triangles) ||
            (model.batch_vertices > 0 && batch_vertices + wanted > model.batch_vertices)) {
            close();
        }
        uint8_t missed = 0;
        for (size_t k = 0; k < 3; ++k) {
            if (shift > 0 && seen[i + k] >> shift != high_bits) {
                high_bits = seen[i + k] >> shift;
                close();
            }
            const uint32_t v = indices[i + k];
            if (cached(v)) continue;
            entered[v] = clock++;
            ++batch_vertices;
            ++missed;
        }
        ++batch_triangles;
        transforms += missed;
        if (misses != nullptr) (*misses)[i / 3] = missed;
    }
    return transforms;
}

uint64_t run_model(const CacheModel& model, std::span<const uint32_t> indices, std::span<const uint32_t> seen,
                   uint32_t vertices, std::vector<uint8_t>* misses) {
    switch (model.kind) {
        case CacheModel::Kind::fifo: {
            Fifo cache(vertices, model.size);
            return run(cache, indices, misses);
        }
        case CacheModel::Kind::lru: {
            Lru cache(model.size);
            return run(cache, indices, misses);
        }
        case CacheModel::Kind::batch:
            break;
    }
    return indices.empty() ? 0 : run_batches(model, indices, seen, vertices, misses);
}

constexpr CacheModel nvidia{CacheModel::Kind::batch, 32, 32, 32, 16};
constexpr CacheModel amd{CacheModel::Kind::batch, 14, 64, 128};
constexpr CacheModel intel{CacheModel::Kind::batch, 128, 0, 0};

}  // namespace

Result<CacheModel> cache_model_named(std::string_view name) {
    if (name == "nvidia") return nvidia;
    if (name == "amd") return amd;
    if (name == "intel") return intel;
    for (const auto& [prefix, kind] : {std::pair<std::string_view, CacheModel::Kind>("fifo", CacheModel::Kind::fifo),
                                       {"lru", CacheModel::Kind::lru}}) {
        if (name.substr(0, prefix.size()) != prefix) continue;
        uint32_t size = 0;
        const char* end = name.data() + name.size();
        if (std::from_chars(name.data() + prefix.size(), end, size).ptr == end && size >= 3 && size <= 1024)
            return CacheModel{kind, size, 0, 0};
    }
    return fail(Fault::usage, "cache '" + std::string(name) +
                                  "': no such model; choose fifoN or lruN with N from 3 to 1024, nvidia, amd or intel");
}

std::string name_of(const CacheModel& model) {
    if (model == nvidia) return "nvidia";
    if (model == amd) return "amd";
    if (model == intel) return "intel";
    switch (model.kind) {
        case CacheModel::Kind::fifo:
            return "fifo" + std::to_string(model.size);
        case CacheModel::Kind::lru:
            return "lru" + std::to_string(model.size);
        case CacheModel::Kind::batch:
            break;
    }
    return "batch(" + std::to_string(model.size) + "," + std::to_string(model.batch_vertices) + "," +
           std::to_string(model.batch_triangles) + "," + std::to_string(model.batch_index_bits) + ")";
}

CacheStatistics simulate(const CacheModel& model, std::span<const uint32_t> indices, std::vector<uint8_t>* misses) {
    LODE_CHECK(indices.size() % 3 == 0 && model.size >= 3, indices.size(), model.size);
    CacheStatistics statistics;
    if (misses != nullptr) misses->assign(indices.size() / 3, 0);
    if (indices.empty()) return statistics;
    // A cache has room for every number up to the largest.
    std::vector<uint32_t> ranks;
    const std::span<const uint32_t> seen = indices;
    if (std::ranges::max(indices) / 4 >= indices.size()) indices = ranks = ranked(indices);
    const uint32_t vertices = std::ranges::max(indices) + 1;
    statistics.transforms = run_model(model, indices, seen, vertices, misses);
    std::vector<bool> used(vertices, false);
    for (size_t i = 0; i < indices.size(); i += 3) {
        if (degenerate(&indices[i])) continue;
        ++statistics.triangles;
        for (size_t k = 0; k < 3; ++k) {
            statistics.vertices += !used[indices[i + k]];
            used[indices[i + k]] = true;
        }
    }
    return statistics;
}

uint64_t count_transforms(const CacheModel& model, std::span<const uint32_t> indices, uint32_t vertices) {
    LODE_CHECK(indices.size() % 3 == 0 && model.size >= 3, indices.size(), model.size);
    return run_model(model, indices, indices, vertices, nullptr);
}

}  // namespace lodestone
