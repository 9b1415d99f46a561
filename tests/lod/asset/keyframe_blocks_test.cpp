#include "lod/asset/keyframe_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"

namespace lodestone {
namespace {

bool same(const DeadFace& a, const DeadFace& b) {
    return a.slot == b.slot && a.neighbour == b.neighbour && a.literal == b.literal &&
           (a.literal ? a.wedges == b.wedges : a.corners == b.corners);
}

TEST(KeyframeBlock, ReadsWhatWasWrittenAndRefusesEveryCut) {
    Random random(5);
    for (int round = 0; round < 200; ++round) {
        constexpr uint32_t before = 100000, wedges = 70000;
        std::vector<uint32_t> sources(1 + random.below(keyframe_block_slots));
        for (uint32_t& s : sources) s = random.below(before);
        std::vector<DeadFace> dead(random.below(40));
        for (DeadFace& face : dead) {
            face.slot = random.below(before);
            face.neighbour = static_cast<uint8_t>(random.below(static_cast<uint32_t>(sources.size())));
            face.literal = random.below(4) == 0;
            for (uint32_t k = 0; k < 3; ++k) {
                if (face.literal) face.wedges[k] = random.below(wedges);
                if (!face.literal) face.corners[k] = static_cast<uint8_t>(random.below(3));
            }
        }
        std::ranges::stable_sort(dead, {}, &DeadFace::neighbour);
        std::vector<uint8_t> bytes;
        write_keyframe_block(sources, dead, bytes);
        uint32_t dead_faces = 0;
        const auto slots = static_cast<uint32_t>(sources.size());
        ASSERT_TRUE(check_keyframe_block(bytes, slots, before, wedges, dead_faces));
        EXPECT_EQ(dead_faces, dead.size());
        std::vector<uint32_t> read;
        std::vector<DeadFace> read_dead;
        read_keyframe_block(
            bytes.data(), slots, [&](uint32_t, uint32_t source) { read.push_back(source); },
            [&](const DeadFace& face) { read_dead.push_back(face); });
        EXPECT_EQ(read, sources);
        ASSERT_EQ(read_dead.size(), dead.size());
        for (size_t i = 0; i < dead.size(); ++i) EXPECT_TRUE(same(read_dead[i], dead[i])) << i;
        for (size_t cut = 0; cut < bytes.size(); ++cut)
            EXPECT_FALSE(check_keyframe_block(std::span(bytes).first(cut), slots, before, wedges, dead_faces));
        bytes.push_back(0);
        EXPECT_FALSE(check_keyframe_block(bytes, slots, before, wedges, dead_faces));
        bytes.pop_back();
        EXPECT_FALSE(check_keyframe_block(bytes, slots, *std::ranges::max_element(sources), wedges, dead_faces));
    }
}

}  // namespace
}  // namespace lodestone
