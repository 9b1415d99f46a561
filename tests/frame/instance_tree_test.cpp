#include "frame/instance_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace lodestone {
namespace {

InstanceTree tree_of_balls() { return InstanceTree(std::vector<Sphere>{{{0, 0, 0}, 1}}); }

void put(Instance& instance, Random& random, double extent) {
    const auto at = [&] { return static_cast<float>(random.uniform(-extent, extent)); };
    instance.object_to_world = glm::mat4(static_cast<float>(random.uniform(0.1, 2)));
    instance.object_to_world[3] = {at(), at(), at(), 1};
}

TEST(InstanceTree, FindsWhatEachViewSeesHoweverInstancesMove) {
    Random random(7);
    InstanceSet instances;
    instances.resize(3000);
    for (size_t i = 0; i < instances.size(); ++i) put(instances.edit(i), random, 40);
    InstanceTree tree = tree_of_balls();
    size_t found = 0;
    for (int frame = 0; frame < 150; ++frame) {
        const uint32_t moves = frame % 10 == 0 ? 500 : random.below(30);
        for (uint32_t k = 0; k < moves; ++k) put(instances.edit(random.below(3000)), random, 60);
        if (frame == 70) instances.push_back(Instance{});
        tree.update(instances);
        const auto sound = tree.validate();
        ASSERT_TRUE(sound) << sound.error().message;
        Camera camera;
        camera.eye = {40 * std::sin(0.1f * static_cast<float>(frame)), 3, 40};
        camera.far_plane = 60;
        const Frustum frusta[2] = {frustum_of(view_of(camera, 640, 360)),
                                   frustum_of(shadow_view({0, -1, 0.2f}, {5, 0, 0}, 15, 64))};
        std::vector<InstanceTree::Seen> expected;
        for (uint32_t i = 0; i < instances.size(); ++i) {
            const Sphere s = to_world({{0, 0, 0}, 1}, instances[i].object_to_world);
            const uint32_t views =
                (frusta[0].touches(s.centre, s.radius) ? 1u : 0u) | (frusta[1].touches(s.centre, s.radius) ? 2u : 0u);
            if (views != 0) expected.push_back({i, views});
        }
        ASSERT_EQ(tree.seen(frusta), expected) << frame;
        found += expected.size();
    }
    EXPECT_GT(found, 10000u);
}

TEST(InstanceSet, TellsWhatChangedSinceTheSetBefore) {
    InstanceSet set(std::vector<Instance>(5));
    const InstanceSet before = set;
    const uint64_t generation = before.generation();
    EXPECT_EQ(set.generation(), generation);
    set.edit(3).asset = 1;
    set.edit(1).asset = 2;
    EXPECT_NE(set.generation(), generation);
    EXPECT_EQ(before[3].asset, 0u) << "who holds the set before sees it as it was";
    const auto changed = set.changed_since(generation);
    ASSERT_TRUE(changed);
    EXPECT_EQ(std::vector<uint32_t>(changed->begin(), changed->end()), (std::vector<uint32_t>{3, 1}));
    EXPECT_TRUE(set.changed_since(set.generation())->empty());
    const uint64_t second = set.generation();
    set.edit(0).asset = 4;
    EXPECT_FALSE(set.changed_since(generation)) << "two sets ago: not known";
    EXPECT_EQ(set.changed_since(second)->size(), 1u);
    set.push_back(Instance{});
    EXPECT_FALSE(set.changed_since(set.generation() - 1));
    EXPECT_NE(set, before);
    EXPECT_EQ(InstanceSet(std::vector<Instance>(5)), before);
}

// Instances that drift a little each frame leave their nodes again and again.
TEST(InstanceTree, FollowsWhatDrifts) {
    Random random(9);
    InstanceSet instances;
    instances.resize(300);
    for (size_t i = 0; i < instances.size(); ++i) put(instances.edit(i), random, 40);
    InstanceTree tree = tree_of_balls();
    for (int frame = 0; frame < 200; ++frame) {
        for (size_t i = 0; i < instances.size(); i += 3)
            instances.edit(i).object_to_world[3] += glm::vec4(0.2f, 0, 0.1f * static_cast<float>(i % 2), 0);
        tree.update(instances);
        const auto sound = tree.validate();
        ASSERT_TRUE(sound) << sound.error().message;
    }
}

TEST(InstanceSet, SharesWhatIsNotWrittenTo) {
    InstanceSet set(std::vector<Instance>(100));
    for (uint32_t i = 0; i < 100; ++i) set.edit(i).asset = i;
    const InstanceSet before = set;
    set.edit(37).asset = 1000;
    for (uint32_t i = 0; i < 100; ++i) {
        EXPECT_EQ(before[i].asset, i);
        EXPECT_EQ(set[i].asset, i == 37 ? 1000 : i);
        EXPECT_EQ(&before[i] == &set[i], i / 16 != 37 / 16) << i;
    }
    set.resize(50);
    set.resize(60);
    EXPECT_EQ(set[49].asset, 49u);
    EXPECT_EQ(set[55], Instance{}) << "what a smaller set left is not seen again";
    EXPECT_EQ(std::distance(set.begin(), set.end()), 60);
}

}  // namespace
}  // namespace lodestone
