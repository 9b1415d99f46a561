#include "render/instance_table.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "base/random.h"

namespace lodestone {
namespace {

TEST(InstanceTable, SendsEachBufferWhatItLacks) {
    Random random(9);
    InstanceSet instances(std::vector<Instance>(300));
    InstanceTable table;
    std::vector<std::vector<gpu::InstanceConstants>> buffers(3);
    std::vector<uint64_t> versions(buffers.size(), 0);
    uint64_t sent = 0;
    for (int frame = 0; frame < 400; ++frame) {
        for (uint32_t k = random.below(4); k > 0; --k) {
            Instance& i = instances.edit(random.below(300));
            i.object_to_world[3].x += 1;
            i.object_to_world[0].x *= random.below(2) == 0 ? 1.0f : -1.0f;
        }
        if (frame == 200) instances.push_back(Instance{});
        table.update(instances);
        const size_t b = frame < 20 ? 0 : random.below(3);
        buffers[b].resize(instances.size());
        size_t after = 0;
        for (const InstanceTable::Range& range : table.stale(versions[b])) {
            ASSERT_TRUE(range.first == 0 || range.first > after);
            after = range.first + range.count;
            ASSERT_LE(after, instances.size());
            for (size_t i = range.first; i < after; ++i) buffers[b][i] = table.all()[i];
            sent += range.count;
        }
        versions[b] = table.version();
        bool mirrored = false;
        for (size_t i = 0; i < instances.size(); ++i) {
            ASSERT_EQ(buffers[b][i].object_to_world, instances[i].object_to_world) << frame;
            mirrored = mirrored || instances[i].object_to_world[0].x < 0;
        }
        ASSERT_EQ(table.any_mirrored(), mirrored);
    }
    EXPECT_LT(sent, 400u * 20) << "and little else";
}

}  // namespace
}  // namespace lodestone
