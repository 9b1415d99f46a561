#include "mesh/cache/cache_probe.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lodestone {
namespace {

TEST(ProbeCache, KnowsEveryModelByItsCounts) {
    for (const char* name : {"nvidia", "amd", "intel", "fifo16", "fifo24", "fifo32", "lru16", "lru32"}) {
        SCOPED_TRACE(name);
        const CacheModel model = *cache_model_named(name);
        const auto probed = probe_cache(
            [&](std::span<const uint32_t> indices) -> Result<uint64_t> { return simulate(model, indices).transforms; });
        ASSERT_TRUE(probed);
        EXPECT_EQ(name_of(probed->model), name);
        EXPECT_EQ(probed->error, 0);
        EXPECT_GT(probed->candidates[1].error, 0.005);  // no other model would do
        for (const auto& c : probed->counts) EXPECT_EQ(c.counted, c.predicted) << c.pattern;
    }
}

TEST(ProbeCache, NamesTheNearestOfADeviceThatIsNoModel) {
    // A FIFO of 22 entries that forgets everything every 4000 triangles.
    const auto probed = probe_cache([&](std::span<const uint32_t> indices) -> Result<uint64_t> {
        uint64_t runs = 0;
        for (size_t i = 0; i < indices.size(); i += 12000)
            runs += simulate({CacheModel::Kind::fifo, 22, 0, 0},
                             indices.subspan(i, std::min<size_t>(12000, indices.size() - i)))
                        .transforms;
        return runs;
    });
    ASSERT_TRUE(probed);
    EXPECT_EQ(probed->model.kind, CacheModel::Kind::fifo);
    EXPECT_NEAR(probed->model.size, 22, 2);
    EXPECT_GT(probed->error, 0);
}

TEST(ProbeCache, ADeviceThatDoesNotCountIsAnError) {
    const auto probed = probe_cache([](std::span<const uint32_t>) -> Result<uint64_t> { return 0; });
    ASSERT_FALSE(probed);
    EXPECT_EQ(probed.error().fault, Fault::machine);
}

TEST(ProbePatterns, StayWithinTheVerticesThereAre) {
    for (const ProbePattern& p : probe_patterns()) {
        EXPECT_EQ(p.indices.size() % 3, 0u) << p.name;
        EXPECT_LT(*std::ranges::max_element(p.indices), probe_vertices) << p.name;
    }
}

}  // namespace
}  // namespace lodestone
