// Density grids as volumes: what they hold, where they stand, and which blocks of the lattice they reach.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "base/random.h"
#include "base/threads.h"
#include "frame/plan_mirror.h"
#include "shaders/shared/volume.h"
#include "volume/grids.h"
#include "volume/grids/placed_grid.h"
#include "volume/volume_source.h"

namespace lodestone::volume {
namespace {

// Specks at random places of a box, and what is between them is empty.
std::shared_ptr<const DensityGrid> specks(Random& random, const glm::uvec3& size, double share) {
    glm::mat4 map(1);
    for (int k = 0; k < 9; ++k) map[k / 3][k % 3] += 0.4f * static_cast<float>(random.uniform(-1, 1));
    map = glm::scale(glm::translate(glm::mat4(1), glm::vec3(random.uniform(-5, 5), 1, 2)), glm::vec3(0.05f)) * map;
    return std::make_shared<DensityGrid>(grid_of(size, map, [&](const glm::uvec3& v) {
        const bool corner = v == glm::uvec3(0) || v == size - 1u;
        return corner || random.unit() < share ? static_cast<float>(random.uniform(0.5, 2)) : 0.0f;
    }));
}

Emitter emitter_of(std::shared_ptr<const DensityGrid> grid) {
    Emitter e;
    e.grid = std::move(grid);
    e.particles = 1;
    e.position = {0.3f, -0.2f, 0.5f};
    e.grid_scale = 1.7f;
    e.grid_turn = glm::angleAxis(0.7f, glm::normalize(glm::vec3(1, 2, -0.5f)));
    return e;
}

TEST(DensityGrid, IsTrilinearBetweenVoxelsAndNothingOutside) {
    const auto value = [](const glm::uvec3& v) { return static_cast<float>(1 + v.x + 2 * v.y + 4 * v.z); };
    const DensityGrid grid = grid_of({11, 9, 10}, glm::mat4(1), value);
    ASSERT_TRUE(grid.validate()) << grid.validate().error().message;
    EXPECT_EQ(grid.blocks, glm::uvec3(2));
    EXPECT_EQ(grid.last, glm::uvec3(10, 8, 9));
    Random random(3);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 p(random.uniform(0, 10), random.uniform(0, 8), random.uniform(0, 9));
        EXPECT_NEAR(grid.at(p), 1 + p.x + 2 * p.y + 4 * p.z, grid.most / 60000);
    }
    EXPECT_NEAR(grid.at({-0.5f, 4, 4}), 0.5f * value({0, 4, 4}), grid.most / 60000) << "half of what is next to it";
    for (const glm::vec3& far : {glm::vec3(-1, 4, 4), glm::vec3(11, 4, 4), glm::vec3(1e30f, 0, 0), glm::vec3(-1e30f)})
        EXPECT_EQ(grid.at(far), 0);
}

TEST(DensityGrid, SaysWhatIsWrongWithIt) {
    const DensityGrid good = grid_of({20, 9, 10}, glm::mat4(1), [](const glm::uvec3&) { return 1.0f; });
    const auto wrong = [&](auto&& change) {
        DensityGrid bad = good;
        change(bad);
        EXPECT_FALSE(bad.validate());
    };
    ASSERT_TRUE(good.validate());
    wrong([](DensityGrid& g) { g.index.pop_back(); });
    wrong([](DensityGrid& g) { g.index[1] = g.index[0]; });
    wrong([](DensityGrid& g) { g.index[1] = 1000; });
    wrong([](DensityGrid& g) { g.index[1] = DensityGrid::no_block; });
    wrong([](DensityGrid& g) { g.shares.pop_back(); });
    wrong([](DensityGrid& g) { g.most = 0; });
    wrong([](DensityGrid& g) { g.last.x = 24; });
    wrong([](DensityGrid& g) { g.voxel_to_object = glm::mat4(0); });
}

// Every sample of the lattice at which the grid is not 0 lies in a block that has the grid, whatever the maps are.
TEST(GridBins, MissNothing) {
    Random random(7);
    for (int turn = 0; turn < 12; ++turn) {
        const glm::uvec3 size(8 + random.uniform(0, 50), 8 + random.uniform(0, 50), 8 + random.uniform(0, 50));
        const std::vector<Emitter> emitters{emitter_of(specks(random, size, turn % 2 != 0 ? 0.0005 : 0.01))};
        const glm::vec3 light(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const Lattice lattice =
            lattice_around(emitters, light, 2 + static_cast<uint32_t>(turn) % 4, 8 + 6 * (turn % 3));
        const auto particles = particles_at(emitters, turn);
        ASSERT_EQ(particles.size(), 1u);
        const Bins bins = bin_particles(lattice, particles);
        ASSERT_TRUE(bins.validate(lattice)) << bins.validate(lattice).error().message;
        std::vector<const Brick*> at(lattice.metavoxel_count(), nullptr);
        for (const Brick& b : bins.bricks)
            at[(b.at.z * lattice.metavoxels.y + b.at.y) * lattice.metavoxels.x + b.at.x] = &b;
        const glm::mat4 to_voxel = glm::inverse(lattice.world_to_lattice() * voxel_to_world(emitters[0]));
        const glm::uvec3 samples = lattice.metavoxels * lattice.voxels;
        size_t found = 0;
        for (uint32_t i = 0; i < samples.x * samples.y * samples.z; ++i) {
            const glm::uvec3 s(i % samples.x, i / samples.x % samples.y, i / samples.x / samples.y);
            if (!(emitters[0].grid->at(glm::vec3(to_voxel * glm::vec4(s, 1))) > 0)) continue;
            ++found;
            const glm::uvec3 m = s / lattice.voxels, block = s % lattice.voxels / block_side;
            const Brick* brick = at[(m.z * lattice.metavoxels.y + m.y) * lattice.metavoxels.x + m.x];
            ASSERT_NE(brick, nullptr);
            ASSERT_TRUE(brick->occupied >> ((block.z * 4 + block.y) * 4 + block.x) & 1);
        }
        EXPECT_GT(found, 0u);
    }
}

// Two balls far apart in one grid.
std::shared_ptr<const DensityGrid> two_balls() {
    const glm::mat4 map = glm::scale(glm::mat4(1), glm::vec3(0.01f));
    return std::make_shared<DensityGrid>(grid_of({200, 40, 40}, map, [](const glm::uvec3& v) {
        const float near = glm::distance(glm::vec3(v), glm::vec3(20)), far = glm::distance(glm::vec3(v), {180, 20, 20});
        return std::min(near, far) < 16 ? 1.0f : 0.0f;
    }));
}

TEST(GridBins, AreEmptyWhereTheGridIs) {
    const std::vector<Emitter> emitters{emitter_of(two_balls())};
    const Lattice lattice = lattice_around(emitters, {0.4f, -1, 0.2f}, 16, 16);
    const Bins bins = bin_particles(lattice, particles_at(emitters, 0));
    EXPECT_EQ(count_bricks(lattice, particles_at(emitters, 0)), bins.bricks.size());
    ASSERT_GT(bins.bricks.size(), 4u);
    const glm::mat4 to_lattice = lattice.world_to_lattice() * voxel_to_world(emitters[0]);
    const auto centre = [&](float x) { return glm::vec3(to_lattice * glm::vec4(x, 20, 20, 1)); };
    const float across = glm::length(glm::vec3(to_lattice[0])), half = 0.5f * static_cast<float>(lattice.voxels);
    int near[2] = {};
    for (const Brick& brick : bins.bricks) {
        const glm::vec3 middle = glm::vec3(brick.at) * 2.0f * half + half;
        const float away[2] = {glm::distance(middle, centre(20)), glm::distance(middle, centre(180))};
        // A ball of 16 voxels, a voxel around, blocks of 8, all of it as seen by a metavoxel.
        EXPECT_LT(std::min(away[0], away[1]), (16 + 1 + 8 * 1.8f) * across + 1.8f * half);
        ++near[away[0] < away[1] ? 0 : 1];
    }
    EXPECT_GT(near[0], 2);
    EXPECT_GT(near[1], 2);
}

TEST(GridBins, AreTheSameForAnyNumberOfThreadsAndAtAnyTime) {
    const std::vector<Emitter> emitters{emitter_of(two_balls()), Emitter{}};
    const Lattice lattice = lattice_around(emitters, {0, -1, 0}, 16, 16);
    set_thread_count(1);
    const Bins one = bin_particles(lattice, particles_at(emitters, 0));
    set_thread_count(4);
    EXPECT_EQ(bin_particles(lattice, particles_at(emitters, 0)), one);
    set_thread_count(0);
    const std::vector<Emitter> alone{emitters[0]};
    EXPECT_EQ(bin_particles(lattice, particles_at(alone, 0)), bin_particles(lattice, particles_at(alone, 123.4)));
}

FrameInput input_at(uint64_t frame) {
    Camera camera;
    camera.eye = {0, 1, 5};
    FrameInput input;
    input.views = {view_of(camera, 64, 48)};
    input.frame = frame;
    return input;
}

// The bytes that a plan sends to a buffer.
uint64_t sent(const Plan& plan, uint32_t buffer) {
    uint64_t bytes = 0;
    for (const Command& command : plan.commands) {
        if (const auto* upload = std::get_if<Upload>(&command.what); upload != nullptr && upload->buffer == buffer)
            bytes += upload->blob.size();
    }
    return bytes;
}

TEST(GridSource, SendsValuesOnceHoweverManyEmittersHaveThem) {
    const auto grid = two_balls();
    std::vector<Emitter> emitters(3, emitter_of(grid));
    emitters[1].position.x += 1;
    auto source = VolumeSource::open(emitters, {.metavoxels = 8, .voxels = 16});
    ASSERT_TRUE(source) << source.error().message;
    PlanMirror mirror((*source)->recipe());
    for (uint64_t f = 0; f < 3; ++f) {
        const Plan plan = (*source)->plan(input_at(f));
        const auto good = mirror.execute(plan, input_at(f));
        EXPECT_TRUE(good) << good.error().message;
        EXPECT_TRUE((*source)->validate());
        EXPECT_EQ(sent(plan, LODE_VOLUME_GRID_VALUES), f == 0 ? 2 * grid->shares.size() : 0);
        EXPECT_EQ(sent(plan, LODE_VOLUME_GRID_INDEX), f == 0 ? 4 * grid->index.size() : 0);
    }
    auto without = VolumeSource::open({Emitter{}}, {.metavoxels = 8, .voxels = 16});
    ASSERT_TRUE(without);
    const Plan plan = (*without)->plan(input_at(0));
    for (const uint32_t b : {LODE_VOLUME_GRIDS, LODE_VOLUME_GRID_INDEX, LODE_VOLUME_GRID_VALUES}) {
        EXPECT_EQ(sent(plan, b), 0u);
        EXPECT_LE((*without)->recipe().buffers[b].bytes, 80u);
    }
}

TEST(GridSource, RefusesMoreThanABufferTakes) {
    // Of each only two specks are there, at the ends of a box of 2048^3 voxels.
    DensityGrid wide = grid_of({8, 8, 8}, glm::mat4(1), [](const glm::uvec3&) { return 1.0f; });
    wide.blocks = glm::uvec3(256);
    wide.index.assign(size_t{1} << 24, DensityGrid::no_block);
    wide.index[0] = 0;
    std::vector<Emitter> emitters;
    for (int i = 0; i < 3; ++i) emitters.push_back(emitter_of(std::make_shared<DensityGrid>(wide)));
    const auto refused = VolumeSource::open(emitters, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, Fault::format);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("boxes of all grids take 192 MiB; the limit is 128"));
    emitters.pop_back();
    EXPECT_TRUE(VolumeSource::open(emitters, {}));
}

}  // namespace
}  // namespace lodestone::volume
