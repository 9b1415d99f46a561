// What volumes do on the CPU: particles, noise, the lattice, binning, plans.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <set>

#include "base/random.h"
#include "base/threads.h"
#include "frame/plan_mirror.h"
#include "volume/eye_order.h"
#include "volume/noise_cube.h"
#include "volume/volume_source.h"

namespace lodestone::volume {
namespace {

Emitter plume() {
    Emitter e;
    e.velocity = {0.1f, 0.6f, 0};
    e.acceleration = {0.05f, 0.02f, -0.1f};
    e.velocity_spread = 0.15f;
    e.particles = 40;
    return e;
}

glm::vec3 direction_of(Random& random) {
    for (;;) {
        const glm::vec3 d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        if (glm::length(d) > 0.1f && glm::length(d) < 1) return glm::normalize(d);
    }
}

TEST(Particles, StandWhereTheTimeSaysWhateverWasBefore) {
    const std::vector<Emitter> emitters{plume()};
    const auto at_seven = particles_at(emitters, 7);
    particles_at(emitters, 3);
    const auto again = particles_at(emitters, 7);
    ASSERT_EQ(at_seven.size(), 40u);
    for (size_t i = 0; i < again.size(); ++i) EXPECT_EQ(at_seven[i].centre, again[i].centre);
}

TEST(Particles, MoveWithoutJumpsWhileTheyLiveAndAreGoneWhenTheyJump) {
    const std::vector<Emitter> emitters{plume()};
    auto before = particles_at(emitters, 0);
    size_t born = 0;
    for (int step = 1; step < 400; ++step) {
        const auto now = particles_at(emitters, step * 0.02);
        for (size_t i = 0; i < now.size(); ++i) {
            if (now[i].age < before[i].age) {
                ++born;
                EXPECT_LT(now[i].density, 0.1f) << "appears out of nothing";
                EXPECT_LT(before[i].density, 0.1f) << "vanishes into nothing";
            } else {
                EXPECT_LT(glm::distance(now[i].centre, before[i].centre), 0.05f);
            }
        }
        before = now;
    }
    EXPECT_GT(born, 40u);
}

TEST(Particles, NeverLeaveTheirBounds) {
    Random random(3);
    for (int turn = 0; turn < 20; ++turn) {
        const glm::vec3 z = direction_of(random);
        const Lattice lattice = lattice_around({plume()}, z, 16, 16);
        for (int step = 0; step < 60; ++step) {
            for (const Particle& p : particles_at({plume()}, step * 0.13 - 3)) {
                const glm::vec3 place(lattice.world_to_lattice() * glm::vec4(p.centre, 1));
                const float radius = p.radius / lattice.voxel;
                const glm::vec3 size(lattice.metavoxels * lattice.voxels);
                for (int k = 0; k < 3; ++k) {
                    ASSERT_GE(place[k] - radius, 1) << "a voxel of nothing is left on every side";
                    ASSERT_LE(place[k] + radius, size[k] - 1);
                }
            }
        }
    }
}

TEST(NoiseCube, IsSmoothAcrossEdgesOfItsFaces) {
    const NoiseCube cube = make_noise_cube(1);
    Random random(5);
    for (int i = 0; i < 2000; ++i) {
        glm::vec3 d = direction_of(random);
        d.y = d.x;  // on an edge
        const float one = cube.at(d * glm::vec3(1.00001f, 1, 1)), other = cube.at(d * glm::vec3(1, 1.00001f, 1));
        EXPECT_NEAR(one, other, 0.002f);
    }
    EXPECT_GT(*std::ranges::max_element(cube.values) - *std::ranges::min_element(cube.values), 100);
}

TEST(Lattice, IsTheWorldTurnedSoThatLightShinesAlongZ) {
    Random random(7);
    for (int i = 0; i < 50; ++i) {
        const glm::vec3 light = direction_of(random);
        const Lattice lattice = lattice_around({plume()}, light, 12, 20);
        const glm::mat4 there = lattice.world_to_lattice();
        EXPECT_NEAR(glm::distance(glm::normalize(glm::vec3(there * glm::vec4(light, 0))), {0, 0, 1}), 0, 1e-5f);
        const glm::vec3 p(0.3f, 0.7f, -0.2f);
        EXPECT_NEAR(glm::distance(glm::vec3(lattice.lattice_to_world() * (there * glm::vec4(p, 1))), p), 0, 1e-4f);
        EXPECT_EQ(std::max({lattice.metavoxels.x, lattice.metavoxels.y, lattice.metavoxels.z}), 12u);
    }
}

// The defect of borders inside of a metavoxel: 32 samples of which 30 are its own count lengths twice. Here a metavoxel
// spans as many voxels as it has.
TEST(Lattice, ItsMetavoxelsSpanItWithoutOverlap) {
    for (const uint32_t voxels : {8u, 30u, 32u}) {
        const Lattice lattice = lattice_around({plume()}, {0, -1, 0}, 6, voxels);
        const glm::vec3 far(lattice.lattice_to_world() * glm::vec4(glm::vec3(lattice.metavoxels * voxels), 1));
        const glm::vec3 near(lattice.lattice_to_world() * glm::vec4(0, 0, 0, 1));
        const glm::vec3 size = glm::abs(lattice.turned * (far - near));
        EXPECT_NEAR(size.y, static_cast<float>(lattice.metavoxels.y * voxels) * lattice.voxel, 1e-4f);
    }
}

TEST(Bins, HoldEveryParticleWhereItReachesAndNothingElse) {
    const auto particles = particles_at({plume()}, 1.5);
    const Lattice lattice = lattice_around({plume()}, {0.3f, -1, 0.2f}, 10, 20);
    const Bins bins = bin_particles(lattice, particles);
    ASSERT_TRUE(bins.validate(lattice)) << bins.validate(lattice).error().message;
    EXPECT_EQ(bins.bricks.size(), count_bricks(lattice, particles));
    EXPECT_LT(bins.bricks.size(), lattice.metavoxel_count() / 3) << "most of a plume's lattice is empty";
    // Places in particles, found by hand.
    Random random(11);
    const uint32_t across = blocks_across(20), along = blocks_along(20);
    for (uint32_t i = 0; i < particles.size(); ++i) {
        for (int k = 0; k < 50; ++k) {
            const glm::vec3 world = particles[i].centre + direction_of(random) * particles[i].radius * 0.999f;
            const glm::uvec3 sample(glm::vec3(lattice.world_to_lattice() * glm::vec4(world, 1)));
            const auto brick = std::ranges::find(bins.bricks, sample / 20u, &Brick::at);
            ASSERT_NE(brick, bins.bricks.end());
            const glm::uvec3 block = sample % 20u / block_side;
            const size_t number = static_cast<size_t>(brick - bins.bricks.begin()) * across * across * along +
                                  (block.y * across + block.x) * along + block.z;
            const auto first = bins.particles.begin() + bins.first_particle[number];
            EXPECT_NE(std::find(first, first + bins.particle_count[number], i), first + bins.particle_count[number]);
            EXPECT_TRUE(brick->occupied >> ((block.z * 4 + block.y) * 4 + block.x) & 1);
        }
    }
}

TEST(Bins, AreTheSameForAnyNumberOfThreads) {
    const auto particles = particles_at({plume()}, 1.5);
    const Lattice lattice = lattice_around({plume()}, {0, -1, 0}, 32, 32);
    set_thread_count(1);
    const Bins one = bin_particles(lattice, particles);
    set_thread_count(4);
    EXPECT_EQ(bin_particles(lattice, particles), one);
    set_thread_count(0);
}

TEST(Bins, TellHowFarItIsToTheNextBrickOfAColumn) {
    Emitter above, below;
    for (Emitter* e : {&above, &below}) {
        e->velocity = glm::vec3(0);
        e->velocity_spread = e->spread = 0;
        e->particles = 1;
        e->radius_from = e->radius_to = 0.2f;
    }
    above.position = {0, 2, 0};
    const std::vector<Emitter> emitters{above, below};
    const Lattice lattice = lattice_around(emitters, {0, -1, 0}, 12, 8);
    const Bins bins = bin_particles(lattice, particles_at(emitters, 0));
    ASSERT_TRUE(bins.validate(lattice));
    for (const Brick& brick : bins.bricks) {
        uint32_t next = lattice.metavoxels.z;
        bool first = true;
        for (const Brick& other : bins.bricks) {
            if (other.at.x != brick.at.x || other.at.y != brick.at.y) continue;
            if (other.at.z > brick.at.z) next = std::min(next, other.at.z);
            first = first && other.at.z >= brick.at.z;
        }
        EXPECT_EQ(brick.at.z + 1 + brick.gap_after, next);
        EXPECT_EQ(brick.first, first);
        if (first) { EXPECT_EQ(brick.gap_before, brick.at.z); }
    }
}

FrameInput input_at(double time, uint64_t frame, const glm::vec3& eye = {0, 1, 5}) {
    Camera camera;
    camera.eye = eye;
    FrameInput input;
    input.views = {view_of(camera, 64, 48)};
    input.time = time;
    input.frame = frame;
    return input;
}

std::unique_ptr<VolumeSource> opened(std::vector<Emitter> emitters, const VolumeOptions& options = {}) {
    auto source = VolumeSource::open(std::move(emitters), options);
    EXPECT_TRUE(source) << source.error().message;
    return std::move(*source);
}

double figure(const Plan& plan, const std::string& name) {
    for (const auto& [key, value] : plan.stats.more) {
        if (key == name) return value;
    }
    return -1;
}

TEST(VolumeSource, EqualInputsGiveEqualPlansThatKeepTheContract) {
    auto one = opened({plume()}, {.metavoxels = 8, .voxels = 16}),
         other = opened({plume()}, {.metavoxels = 8, .voxels = 16});
    PlanMirror mirror(one->recipe());
    for (uint64_t f = 0; f < 6; ++f) {
        one->quality.divisor = other->quality.divisor = 1 + f % 3;
        const FrameInput input = input_at(0.3 * static_cast<double>(f), f);
        const Plan plan = one->plan(input);
        EXPECT_EQ(plan, other->plan(input));
        EXPECT_FALSE(plan.commands.empty());
        const auto good = mirror.execute(plan, input);
        EXPECT_TRUE(good) << good.error().message;
        EXPECT_TRUE(one->validate());
    }
}

TEST(VolumeSource, AVolumeWithNothingInItCostsNothing) {
    Emitter nothing = plume();
    nothing.look.density_from = nothing.look.density_to = 0;
    EXPECT_TRUE(opened({nothing})->plan(input_at(0, 0)).commands.empty());
}

TEST(VolumeSource, GetsCoarserWhereThePoolIsTooSmallAndSaysSo) {
    auto rich = opened({plume()}, {.metavoxels = 32, .voxels = 16});
    const Plan fine = rich->plan(input_at(2, 0));
    EXPECT_THAT(fine.warnings, testing::IsEmpty());
    const auto bytes = static_cast<uint64_t>(figure(fine, "brick_bytes"));
    auto poor = opened({plume()}, {.metavoxels = 32, .voxels = 16, .pool_bytes = bytes / 4});
    PlanMirror mirror(poor->recipe());
    const FrameInput input = input_at(2, 0);
    const Plan coarse = poor->plan(input);
    ASSERT_THAT(coarse.warnings, testing::SizeIs(1));
    EXPECT_THAT(coarse.warnings[0],
                testing::AllOf(testing::HasSubstr("in place of 32"), testing::HasSubstr("pool_mib")));
    EXPECT_LT(figure(coarse, "across"), 32);
    EXPECT_LE(figure(coarse, "brick_bytes"), static_cast<double>(bytes) / 4);
    EXPECT_TRUE(mirror.execute(coarse, input));
    EXPECT_THAT(poor->plan(input_at(2.1, 1)).warnings, testing::IsEmpty()) << "said once";
    const auto none = VolumeSource::open({plume()}, {.pool_bytes = 1000});
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, testing::HasSubstr("raise the budget"));
}

TEST(VolumeSource, FillsWhenItIsDue) {
    for (const uint32_t refresh : {0u, 1u, 3u}) {
        auto source = opened({plume()}, {.metavoxels = 6, .voxels = 8});
        source->quality.refresh = refresh;
        double in_round = 0;
        for (uint64_t f = 0; f < 10; ++f) {
            const Plan plan = source->plan(input_at(0.1 * static_cast<double>(f), f));
            const double filled = figure(plan, "filled"), bricks = figure(plan, "bricks");
            if (f == 0 || refresh == 1) {
                EXPECT_EQ(filled, bricks) << f;
            } else if (refresh == 0) {
                EXPECT_EQ(filled, 0) << f;
            } else {
                // About a third of the work in each, whose bricks are seen with the last.
                in_round += filled;
                EXPECT_GT(filled, 0.1 * bricks) << f;
                EXPECT_LT(filled, 0.6 * bricks) << f;
                if (f % refresh == 0) {
                    EXPECT_EQ(in_round, bricks) << f;
                    in_round = 0;
                }
            }
        }
    }
}

// Bricks that a ray meets come out near to far, however they are laid over and under each other.
TEST(EyeOrder, LaysWhatIsNearerBefore) {
    Random random(13);
    const Lattice lattice = lattice_around({plume()}, {0.3f, -1, 0.2f}, 8, 8);
    const Bins bins = bin_particles(lattice, particles_at({plume()}, 1.5));
    const glm::vec3 size(lattice.metavoxels * lattice.voxels);
    const auto anywhere = [&](double margin) {
        glm::vec3 p;
        for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(random.uniform(-margin, double(size[k]) + margin));
        return p;
    };
    size_t long_rays = 0;
    for (int i = 0; i < 300; ++i) {
        const glm::vec3 eye = anywhere(i % 2 == 0 ? 0 : 60);
        const auto order = eye_order(lattice, bins, eye);
        ASSERT_EQ(order.size(), bins.bricks.size());
        for (size_t k = 0; k + 1 < order.size(); ++k)
            ASSERT_LE(bins.bricks[order[k].brick].at.z, bins.bricks[order[k + 1].brick].at.z)
                << "light comes by layers";
        for (int ray = 0; ray < 20; ++ray) {
            const glm::vec3 along = glm::normalize(anywhere(0) - eye);
            // Where the ray enters each brick that it meets, in the order in which they then lie.
            std::vector<float> lying;
            for (const EyeOrdered& o : order) {
                const glm::vec3 low = glm::vec3(bins.bricks[o.brick].at * lattice.voxels);
                const glm::vec3 a = (low - eye) / along, b = (low + float(lattice.voxels) - eye) / along;
                const glm::vec3 near3 = glm::min(a, b), far3 = glm::max(a, b);
                const float enters = std::max({near3.x, near3.y, near3.z, 0.0f});
                const float leaves = std::min({far3.x, far3.y, far3.z});
                if (!(leaves - enters > 0.01f)) continue;
                lying.insert(o.under ? lying.end() : lying.begin(), enters);
            }
            ASSERT_TRUE(std::ranges::is_sorted(lying)) << i;
            long_rays += lying.size() > 2 ? 1 : 0;
        }
    }
    EXPECT_GT(long_rays, 500u);
}

TEST(Quality, CostsLessFromLevelToLevelAndIsWholeAtTheHighest) {
    Quality of_scene;
    of_scene.density = 3;
    of_scene.absorption = Absorption::rational;
    of_scene.divisor = 4;
    const auto cost = [](const Quality& q) { return q.steps / static_cast<float>(q.divisor * q.divisor * q.refresh); };
    for (uint32_t level = lowest_level; level <= highest_level; ++level) {
        const Quality quality = at_level(of_scene, level);
        EXPECT_EQ(quality.density, 3);
        EXPECT_EQ(quality.absorption, Absorption::rational);
        if (level > lowest_level) { EXPECT_GT(cost(quality), cost(at_level(of_scene, level - 1))) << level; }
    }
    EXPECT_EQ(cost(at_level(of_scene, highest_level)), 1);
}

TEST(VolumeSource, IsNotMarchedWhereTheEyeDoesNotSeeItButShadowsStill) {
    auto source = opened({plume()}, {.metavoxels = 6, .voxels = 8});
    FrameInput away = input_at(0, 0, {0, 1, 30});
    Camera camera;
    camera.eye = {0, 1, 30};
    camera.target = {0, 1, 60};
    away.views = {view_of(camera, 64, 48)};
    const Plan plan = source->plan(away);
    EXPECT_FALSE(plan.commands.empty());
    for (const Command& command : plan.commands) EXPECT_NE(command.stage, Stage::composite);
}

}  // namespace
}  // namespace lodestone::volume
