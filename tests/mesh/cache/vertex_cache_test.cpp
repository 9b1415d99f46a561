#include "mesh/cache/vertex_cache.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <deque>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/cache/tipsify.h"

namespace lodestone {
namespace {

std::vector<uint32_t> indices_of(const TriMesh& mesh) {
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    return indices;
}

std::vector<uint32_t> shuffled_torus() {
    TriMesh mesh = fixtures::torus(40, 25);
    Random random(4);
    for (size_t i = mesh.triangles.size(); i > 1; --i)
        std::swap(mesh.triangles[i - 1], mesh.triangles[random.below(static_cast<uint32_t>(i))]);
    return indices_of(mesh);
}

uint64_t naive_misses(const std::vector<uint32_t>& indices, size_t size, bool lru) {
    std::deque<uint32_t> cache;
    uint64_t misses = 0;
    for (const uint32_t v : indices) {
        const auto found = std::find(cache.begin(), cache.end(), v);
        const bool hit = found != cache.end();
        misses += !hit;
        if (hit && lru) cache.erase(found);
        if (!hit || lru) cache.push_front(v);
        if (cache.size() > size) cache.pop_back();
    }
    return misses;
}

TEST(VertexCache, FifoAndLruEqualANaiveQueue) {
    for (const auto& indices :
         {shuffled_torus(), indices_of(fixtures::grid(30, 30)), indices_of(fixtures::torus(40, 25))}) {
        for (const uint32_t size : {3u, 16u, 24u, 32u}) {
            EXPECT_EQ(simulate({CacheModel::Kind::fifo, size, 0, 0}, indices).transforms,
                      naive_misses(indices, size, false));
            EXPECT_EQ(simulate({CacheModel::Kind::lru, size, 0, 0}, indices).transforms,
                      naive_misses(indices, size, true));
        }
    }
}

TEST(VertexCache, BatchModelsEqualMeshoptimizersAnalyzer) {
    for (const auto& indices :
         {shuffled_torus(), indices_of(fixtures::grid(30, 30)), indices_of(fixtures::torus(40, 25))}) {
        const size_t vertices = 1100;
        const auto expect = [&](const char* name, unsigned cache, unsigned warp, unsigned group) {
            const auto statistics =
                meshopt_analyzeVertexCache(indices.data(), indices.size(), vertices, cache, warp, group);
            EXPECT_EQ(simulate(*cache_model_named(name), indices).transforms, statistics.vertices_transformed) << name;
        };
        expect("nvidia", 32, 32, 32);
        expect("amd", 14, 64, 128);
        expect("intel", 128, 0, 0);
    }
}

TEST(VertexCache, AStripTransformsEveryVertexOnce) {
    std::vector<uint32_t> strip;
    for (uint32_t i = 0; i < 50; ++i) strip.insert(strip.end(), {i, i + 1, i + 2});
    const auto statistics = simulate(CacheModel{}, strip);
    EXPECT_EQ(statistics.transforms, 52u);
    EXPECT_EQ(statistics.vertices, 52u);
    EXPECT_DOUBLE_EQ(statistics.atvr(), 1);
}

TEST(VertexCache, DegenerateTrianglesCostButDoNotCount) {
    const std::vector<uint32_t> indices = {0, 1, 2, 7, 7, 8};
    std::vector<uint8_t> misses;
    const auto statistics = simulate(CacheModel{}, indices, &misses);
    EXPECT_EQ(statistics.transforms, 5u);
    EXPECT_EQ(statistics.triangles, 1u);
    EXPECT_EQ(statistics.vertices, 3u);
    EXPECT_EQ(misses, (std::vector<uint8_t>{3, 2}));
}

// A grid of 80 x 80 quads in bands of 10, its indices changed. What an NVIDIA H200 counted.
TEST(VertexCache, BatchesOfNvidiaHoldIndicesThatAgreeAbove16Bits) {
    const auto cost = [](auto&& changed) {
        std::vector<uint32_t> indices;
        for (uint32_t first = 0; first < 80; first += 10) {
            for (uint32_t y = 0; y < 80; ++y) {
                for (uint32_t x = first; x < first + 10; ++x) {
                    const uint32_t v = y * 81 + x;
                    for (const uint32_t corner : {v, v + 1, v + 81, v + 81, v + 1, v + 82})
                        indices.push_back(changed(corner));
                }
            }
        }
        return static_cast<double>(simulate(*cache_model_named("nvidia"), indices).transforms);
    };
    const double together = cost([](uint32_t v) { return v; });
    EXPECT_EQ(cost([](uint32_t v) { return v + v % 2 * 32768; }), together);
    EXPECT_EQ(cost([](uint32_t v) { return 9 * v; }), together);
    EXPECT_EQ(cost([](uint32_t v) { return v + v % 2 * 65536; }), 25600);
    // Near to each other, but on both sides of a border.
    EXPECT_EQ(cost([](uint32_t v) { return v % 2 ? 65536 + v / 2 : 65535 - v / 2; }), 25600);
    EXPECT_EQ(cost([](uint32_t v) { return v + v % 2 * (1u << 20); }), 25600);
    EXPECT_NEAR(cost([](uint32_t v) { return v / 81 % 2 * 65536 + v; }), 32000, 0.04 * 32000);
    EXPECT_NEAR(cost([](uint32_t v) { return v % 3 * 65536 + v / 3; }), 26880, 0.04 * 26880);
}

// Plans name vertices by numbers with marks in their highest bits.
TEST(VertexCache, CostsWhatTheCountOfIndicesAsksFor) {
    std::vector<uint32_t> indices, marked;
    for (uint32_t i = 0; i < 50; ++i) indices.insert(indices.end(), {i, i + 1, (7 * i) % 50});
    for (const uint32_t i : indices) marked.push_back(i % 2 == 0 ? i : ~uint32_t{0} - i);
    for (const char* name : {"fifo16", "lru16", "nvidia", "amd"}) {
        CacheModel model = *cache_model_named(name);
        model.batch_index_bits = 0;  // for which marks make a difference
        std::vector<uint8_t> misses, marked_misses;
        const auto a = simulate(model, indices, &misses);
        const auto b = simulate(model, marked, &marked_misses);
        EXPECT_EQ(a.transforms, b.transforms) << name;
        EXPECT_EQ(a.vertices, b.vertices) << name;
        EXPECT_EQ(a.triangles, b.triangles) << name;
        EXPECT_EQ(misses, marked_misses) << name;
    }
}

TEST(VertexCache, NamesAndModelsAreTheSameThing) {
    for (const char* name : {"fifo16", "fifo24", "lru32", "nvidia", "amd", "intel"})
        EXPECT_EQ(name_of(*cache_model_named(name)), name);
    for (const char* name : {"fifo", "fifo2", "fifo16x", "gpu", ""}) EXPECT_FALSE(cache_model_named(name)) << name;
}

TEST(Tipsify, KeepsTheTrianglesAndBeatsTheShuffle) {
    const auto indices = shuffled_torus();
    const auto ordered = tipsify(indices, 1000, 16);
    const auto sorted = [](const std::vector<uint32_t>& list) {
        std::vector<Triangle> triangles;
        for (size_t i = 0; i < list.size(); i += 3) triangles.push_back({list[i], list[i + 1], list[i + 2]});
        std::sort(triangles.begin(), triangles.end());
        return triangles;
    };
    EXPECT_EQ(sorted(indices), sorted(ordered));
    EXPECT_LT(simulate(CacheModel{}, ordered).atvr(), 1.6);
    EXPECT_GT(simulate(CacheModel{}, indices).atvr(), 4);
}

}  // namespace
}  // namespace lodestone
