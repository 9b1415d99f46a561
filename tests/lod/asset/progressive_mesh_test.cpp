#include "lod/asset/progressive_mesh.h"
#include "lod/bake/simplify/simplifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "base/random.h"
#include "base/threads.h"
#include "fixtures/faces.h"
#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "mesh/generate.h"
#include "mesh/limits.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

using fixtures::Fixture;

const std::vector<std::string> all_orders = {"static", "classic", "keyframe", "greedy"};

ProgressiveMesh bake_in_memory(const TriMesh& mesh) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    EXPECT_TRUE(list) << list.error().message;
    auto pm = bake_progressive_mesh(mesh, *list, all_orders);
    EXPECT_TRUE(pm) << pm.error().message;
    return std::move(*pm);
}

std::vector<Fixture> meshes() {
    std::vector<Fixture> all = fixtures::manifold_meshes();
    all.push_back({"rock with texture seams", generate(Shape::rock, 3000, 5)});
    all.push_back({"terrain", generate(Shape::terrain, 2000, 6)});
    all.push_back({"grid", generate(Shape::grid, 1000, 1)});
    all.push_back({"sphere with texture seams", generate(Shape::sphere, 1500, 1)});
    all.push_back({"torus with texture seams", generate(Shape::torus, 1200, 1)});
    return all;
}

TEST(Tswap, RunsTheCycleForwardsAndItsInverseBackwards) {
    std::vector<uint32_t> indices = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3};
    const std::vector<uint32_t> before = indices, slots = {2, 0, 3};
    tswap(indices, slots);
    EXPECT_THAT(indices, testing::ElementsAre(3, 3, 3, 1, 1, 1, 0, 0, 0, 2, 2, 2));
    tswap_inverse(indices, slots);
    EXPECT_EQ(indices, before);
}

TEST(ProgressiveMesh, IsValidInEveryOrderForEveryMesh) {
    for (const Fixture& f : meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = bake_in_memory(f.mesh);
        const auto valid = pm.validate();
        EXPECT_TRUE(valid) << valid.error().message;
        EXPECT_EQ(pm.full_triangles(), f.mesh.triangle_count());
        EXPECT_EQ(pm.vertices.size(), f.mesh.wedge_count());
    }
}

TEST(PmCursor, TheIndexBufferIsTheSameSlotForSlotOnTheWayDownAndUp) {
    for (const Fixture& f : meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = bake_in_memory(f.mesh);
        for (uint32_t order = 0; order < pm.orders.size(); ++order) {
            PmCursor cursor(pm, order);
            std::vector<std::vector<uint32_t>> down;
            std::vector<uint32_t> slots;
            do {
                down.emplace_back(cursor.drawn_indices().begin(), cursor.drawn_indices().end());
                slots.push_back(cursor.slot_count());
            } while (cursor.ecol());
            ASSERT_EQ(down.size(), pm.levels());
            do {
                const uint32_t level = cursor.level();
                ASSERT_TRUE(std::ranges::equal(down[level], cursor.drawn_indices())) << "level " << level;
                ASSERT_EQ(slots[level], cursor.slot_count()) << "level " << level;
                ASSERT_EQ(slots[level], pm.orders[order].slots_at(level, pm.triangles_at(level)));
            } while (cursor.vsplit());
        }
    }
}

TEST(PmCursor, EveryOrderShowsTheSameFacesAtEveryLevel) {
    for (const Fixture& f : meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = bake_in_memory(f.mesh);
        std::vector<PmCursor> cursors;
        for (uint32_t order = 0; order < pm.orders.size(); ++order) cursors.emplace_back(pm, order);
        for (uint32_t level = 0; level < pm.levels(); level += 1 + pm.levels() / 37) {
            cursors[0].goto_level(level);
            const auto faces = fixtures::faces_of(cursors[0].drawn_indices());
            for (PmCursor& cursor : cursors) {
                SCOPED_TRACE(pm.orders[cursor.order()].name);
                cursor.goto_level(level);
                ASSERT_TRUE(cursor.validate()) << cursor.validate().error().message;
                ASSERT_EQ(fixtures::faces_of(cursor.drawn_indices()), faces) << "level " << level;
            }
        }
    }
}

TEST(PmCursor, ARandomWalkOfGotosEndsWhereADirectWalkDoes) {
    const ProgressiveMesh pm = bake_in_memory(generate(Shape::rock, 2000, 9));
    Random random(3);
    for (uint32_t order = 0; order < pm.orders.size(); ++order) {
        PmCursor walker(pm, order), jumper(pm, order);
        jumper.use(std::make_shared<PmSnapshots>(pm, order));
        for (int step = 0; step < 60; ++step) {
            const uint32_t level = random.below(pm.levels());
            walker.goto_level(level);
            jumper.goto_level(level);
            PmCursor direct(pm, order);
            direct.goto_level(level);
            ASSERT_TRUE(std::ranges::equal(walker.drawn_indices(), direct.drawn_indices())) << level;
            ASSERT_TRUE(std::ranges::equal(jumper.drawn_indices(), direct.drawn_indices())) << level;
        }
    }
}

TEST(PmCursor, DirtyRangesCoverEveryChangeAndNothingWhenTheLevelStays) {
    const ProgressiveMesh pm = bake_in_memory(generate(Shape::rock, 4000, 2));
    for (uint32_t order = 0; order < pm.orders.size(); ++order) {
        PmCursor cursor(pm, order);
        std::vector<uint32_t> copy(cursor.all_indices().size(), ~0u);
        Random random(8);
        for (int step = 0; step < 50; ++step) {
            cursor.goto_level(step == 0 ? 0 : random.below(pm.levels()));
            uint32_t end = 0;
            for (const IndexRange& range : cursor.take_dirty()) {
                ASSERT_GE(range.first, end);
                end = range.first + range.count;
                ASSERT_LE(end, copy.size());
                std::copy_n(cursor.all_indices().begin() + range.first, range.count, copy.begin() + range.first);
            }
            ASSERT_TRUE(std::equal(copy.begin(), copy.end(), cursor.all_indices().begin()));
            cursor.goto_level(cursor.level());
            EXPECT_TRUE(cursor.take_dirty().empty());
        }
        cursor.goto_level(10);
        cursor.take_dirty();
        cursor.goto_level(11);
        uint32_t dirty = 0;
        for (const IndexRange& range : cursor.take_dirty()) dirty += range.count;
        EXPECT_LE(dirty, 64 * PmCursor::dirty_block);  // a step of one level touches little
    }
}

TEST(PmCursor, ALimitedCopyPlaysTheLevelsItCanHoldLikeTheWholeOne) {
    const ProgressiveMesh pm = bake_in_memory(generate(Shape::rock, 4000, 2));
    for (uint32_t order = 0; order < pm.orders.size(); ++order) {
        PmCursor whole(pm, order);
        const uint32_t finest = pm.level_for_triangles(pm.full_triangles() / 3);
        whole.goto_level(finest);
        PmCursor limited(whole, finest);
        EXPECT_LT(limited.all_indices().size(), whole.all_indices().size());
        for (const uint32_t level : {pm.levels() - 1, finest, (finest + pm.levels()) / 2, finest}) {
            whole.goto_level(level);
            limited.goto_level(level);
            ASSERT_TRUE(std::equal(limited.drawn_indices().begin(), limited.drawn_indices().end(),
                                   whole.drawn_indices().begin()));
        }
        EXPECT_FALSE(limited.vsplit());
    }
}

TEST(PmCursor, ClassicDrawsNoDegenerateFaceAndStaticAtMostTwiceTheAlive) {
    const ProgressiveMesh pm = bake_in_memory(generate(Shape::rock, 4000, 2));
    PmCursor classic(pm, 1), fixed(pm, 0);
    for (uint32_t level = 0; level < pm.levels(); level += 50) {
        classic.goto_level(level);
        fixed.goto_level(level);
        EXPECT_EQ(classic.slot_count(), pm.triangles_at(level));
        EXPECT_LE(fixed.slot_count(), 2 * pm.triangles_at(level) + 2);
    }
}

TEST(ExtractLevel, LevelZeroIsTheSourceMesh) {
    for (const Fixture& f : meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = bake_in_memory(f.mesh);
        const TriMesh extracted = *extract_level(pm, 0);
        ASSERT_TRUE(extracted.validate());
        EXPECT_EQ(extracted.triangle_count(), f.mesh.triangle_count());
        EXPECT_EQ(extracted.vertex_count(), f.mesh.vertex_count());
        EXPECT_EQ(extracted.wedge_count(), f.mesh.wedge_count());
        const auto corners = [](const TriMesh& mesh) {
            std::multiset<std::array<float, 9>> all;
            for (size_t t = 0; t < mesh.triangle_count(); ++t) {
                std::array<std::array<float, 3>, 3> c;
                for (int k = 0; k < 3; ++k)
                    c[static_cast<size_t>(k)] = {mesh.position_of(t, k).x, mesh.position_of(t, k).y,
                                                 mesh.position_of(t, k).z};
                std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
                all.insert({c[0][0], c[0][1], c[0][2], c[1][0], c[1][1], c[1][2], c[2][0], c[2][1], c[2][2]});
            }
            return all;
        };
        EXPECT_EQ(corners(extracted), corners(f.mesh));
    }
}

TEST(ExtractLevel, EveryTenthLevelKeepsTheSurfaceWhatItIs) {
    for (const Fixture& f : meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = bake_in_memory(f.mesh);
        const Topology source = topology_of(f.mesh);
        for (uint32_t level = 0; level < pm.levels(); level += 10) {
            const Topology t = topology_of(*extract_level(pm, level));
            EXPECT_TRUE(t.manifold()) << level;
            EXPECT_EQ(t.inconsistent_edges, 0u) << level;
            EXPECT_EQ(t.components, source.components) << level;
            EXPECT_EQ(t.boundary_loops, source.boundary_loops) << level;
            EXPECT_EQ(t.genus, source.genus) << level;
        }
    }
}

class AssetFile : public testing::Test {
protected:
    void SetUp() override {
        path_ = std::filesystem::temp_directory_path() / ("lodestone-pm-test-" + std::to_string(getpid()) + ".lode");
    }
    void TearDown() override { std::filesystem::remove(path_); }
    void write(const ProgressiveMesh& pm) const {
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(pm.write_chunks(*writer));
        ASSERT_TRUE(writer->commit());
    }
    std::filesystem::path path_;
};

TEST_F(AssetFile, GivesBackTheSameProgressiveMesh) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.material_table.resize(1);
    mesh.material_table[0].name = "stone";
    mesh.material_table[0].base_colour = {0.5f, 0.25f, 0.125f, 1};
    mesh.material_table[0].base_colour_texture.image = 0;
    mesh.material_table[0].double_sided = true;
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.images = {{2, 1, {{1, 2, 3, 4}, {5, 6, 7, 8}}}};
    const ProgressiveMesh pm = bake_in_memory(mesh);
    write(pm);
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file);
    const auto read = ProgressiveMesh::open(*file);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(std::equal(pm.vertices.begin(), pm.vertices.end(), read->vertices.begin(), read->vertices.end()));
    EXPECT_EQ(read->material_table, mesh.material_table);
    EXPECT_EQ(read->images[0].texels, mesh.images[0].texels);
    EXPECT_TRUE(read->attributes == pm.attributes);
    ASSERT_EQ(read->orders.size(), pm.orders.size());
    for (size_t o = 0; o < pm.orders.size(); ++o) {
        EXPECT_THAT(read->orders[o].indices, testing::ElementsAreArray(pm.orders[o].indices));
        EXPECT_THAT(read->orders[o].cycle_slots, testing::ElementsAreArray(pm.orders[o].cycle_slots));
        EXPECT_THAT(read->orders[o].block_bytes, testing::ElementsAreArray(pm.orders[o].block_bytes));
    }
    EXPECT_TRUE(read->validate());
}

TEST_F(AssetFile, IsTheSameForAnyNumberOfThreads) {
    const TriMesh mesh = generate(Shape::rock, 3000, 4);
    std::string first;
    for (const unsigned threads : {1u, 2u, 8u}) {
        set_thread_count(threads);
        write(bake_in_memory(mesh));
        std::ifstream in(path_, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(in), {}};
        if (first.empty()) first = bytes;
        EXPECT_EQ(bytes, first) << threads << " threads";
    }
    set_thread_count(0);
}

TEST_F(AssetFile, OfAnOlderVersionIsRefusedByName) {
    auto writer = ChunkWriter::create(path_, {});
    // As version 1 had it, which did not name itself.
    ASSERT_TRUE(writer->add_text("lod/mesh", R"({"attributes": {"normals": false}, "orders": []})"));
    ASSERT_TRUE(writer->commit());
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file);
    const auto read = ProgressiveMesh::open(*file);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().fault, Fault::format);
    EXPECT_THAT(read.error().message, testing::HasSubstr("lod/mesh: version 1"));
    EXPECT_THAT(read.error().message, testing::HasSubstr("bake the asset again"));
}

// What a cursor plays is checked whoever made it.
TEST(ProgressiveMesh, ContentThatWouldLeaveTheBuffersIsRefused) {
    const ProgressiveMesh good = bake_in_memory(generate(Shape::rock, 500, 4));
    const auto refused = [&](const std::string& expect, auto&& spoil) {
        ProgressiveMesh bad = good;
        spoil(bad);
        const auto counted = bad.count_levels();
        ASSERT_FALSE(counted) << expect;
        EXPECT_EQ(counted.error().fault, Fault::format);
        EXPECT_THAT(counted.error().message, testing::HasSubstr(expect));
    };
    // A few bytes of text can name one order again and again.
    refused("has 65 face orders; the limit is 64",
            [&](ProgressiveMesh& pm) { pm.orders.resize(Limits{}.lod_orders + 1, good.orders[0]); });
    std::vector<uint32_t> corners(good.orders[0].corners.begin(), good.orders[0].corners.end());
    corners[0] = static_cast<uint32_t>(good.orders[0].indices.size()) + 3 * good.orders[0].slots_of(1);
    refused("lod/static/corners", [&](ProgressiveMesh& pm) { pm.orders[0].corners = corners; });
    std::vector<uint32_t> parents(good.parents.begin(), good.parents.end());
    parents.back() = static_cast<uint32_t>(good.vertices.size()) - 1;
    refused("lod/parents", [&](ProgressiveMesh& pm) { pm.parents = parents; });
    std::vector<Keyframe> keyframes(good.orders[0].keyframes.begin(), good.orders[0].keyframes.end());
    ASSERT_FALSE(keyframes.empty());
    keyframes[0].slots += 1;
    refused("lod/static/keyframes", [&](ProgressiveMesh& pm) { pm.orders[0].keyframes = keyframes; });
    keyframes[0] = good.orders[0].keyframes[0];
    keyframes[0].blocks_per_step = 0;
    refused("lod/static/keyframes", [&](ProgressiveMesh& pm) { pm.orders[0].keyframes = keyframes; });
    ASSERT_GT(keyframes.size(), 1u);
    keyframes[0] = good.orders[0].keyframes[0];
    keyframes[1].blocks_per_step = 0;  // of a later one, whose reach the check of the first asks for
    refused("lod/static/keyframes", [&](ProgressiveMesh& pm) { pm.orders[0].keyframes = keyframes; });
    keyframes[1] = good.orders[0].keyframes[1];
    keyframes[1].level = 1;
    refused("lod/static/keyframes", [&](ProgressiveMesh& pm) { pm.orders[0].keyframes = keyframes; });
    std::vector<uint8_t> bytes(good.orders[0].block_bytes.begin(), good.orders[0].block_bytes.end());
    for (size_t i = 0; i < 4; ++i) bytes[i] = 0xff;
    refused("lod/static/blocks", [&](ProgressiveMesh& pm) { pm.orders[0].block_bytes = bytes; });
    const FaceOrder& greedy = *good.order_named("greedy");
    std::vector<uint32_t> slots(greedy.cycle_slots.begin(), greedy.cycle_slots.end());
    slots[0] = 1u << 30;
    refused("lod/greedy/cycles", [&](ProgressiveMesh& pm) { pm.orders[3].cycle_slots = slots; });
    std::vector<TswapStep> steps(greedy.tswaps.begin(), greedy.tswaps.end());
    steps[0].slots_after = steps[0].slots_before + 1;
    refused("lod/greedy/tswaps", [&](ProgressiveMesh& pm) { pm.orders[3].tswaps = steps; });
    steps[0] = greedy.tswaps[0];
    steps.back().slots_after = 1;
    refused("draws fewer faces", [&](ProgressiveMesh& pm) { pm.orders[3].tswaps = steps; });
    // One face dies later than the orders have it.
    std::vector<Ecol> ecols(good.ecols.begin(), good.ecols.end());
    ASSERT_GT(ecols[0].faces, 0u);
    ecols[0].faces -= 1;
    refused("lod/static/keyframes: keyframe 0 draws fewer faces", [&](ProgressiveMesh& pm) { pm.ecols = ecols; });
    for (Ecol& step : ecols) step.faces = 0;  // steps of greedy have some faces to spare
    refused("draws fewer faces", [&](ProgressiveMesh& pm) {
        pm.ecols = ecols;
        pm.orders = {greedy};
    });
    std::vector<float> errors(good.errors.size(), 1.0f);
    refused("lod/errors", [&](ProgressiveMesh& pm) { pm.errors = errors; });
    errors.assign(good.errors.begin(), good.errors.end());
    errors[errors.size() / 2] = std::numeric_limits<float>::quiet_NaN();
    refused("lod/errors", [&](ProgressiveMesh& pm) { pm.errors = errors; });
    refused("lod/wedge_vertex", [&](ProgressiveMesh& pm) { pm.wedge_vertex = pm.wedge_vertex.first(3); });
    refused("face orders", [&](ProgressiveMesh& pm) {
        const FaceOrder again = pm.orders[0];
        for (size_t i = 0; i < 100; ++i) {
            pm.orders.push_back(again);
            pm.orders.back().name += std::to_string(i);
        }
    });
}

// Copies of a cursor for a limited depth keep only the slots of their level: a corner beyond them would be written
// outside of the buffer.
TEST(ProgressiveMesh, CornersBeyondTheSlotsOfTheirLevelAreRefused) {
    const ProgressiveMesh good = bake_in_memory(generate(Shape::rock, 500, 4));
    for (size_t o = 0; o < good.orders.size(); ++o) {
        const FaceOrder& order = good.orders[o];
        SCOPED_TRACE(order.name);
        std::vector<uint32_t> corners(order.corners.begin(), order.corners.end());
        // The last collapse's: of all levels' the fewest slots are there.
        ASSERT_LT(order.slots_at(good.levels() - 2, good.triangles_at(good.levels() - 2)), good.full_triangles());
        const auto full = static_cast<uint32_t>(order.indices.size());
        corners.back() = order.half_of(corners.back()) * full + full - 1;
        ProgressiveMesh bad = good;
        bad.orders[o].corners = corners;
        const auto counted = bad.count_levels();
        ASSERT_FALSE(counted);
        EXPECT_THAT(counted.error().message, testing::HasSubstr(order.name + "/corners"));
    }
}

// What is in range may still make no mesh; that shows when it is played.
TEST(ProgressiveMesh, ALevelThatDrawsWedgesItDoesNotHaveIsRefused) {
    const ProgressiveMesh good = bake_in_memory(generate(Shape::rock, 500, 4));
    ProgressiveMesh bad = good;
    // The corners of the first wedge that goes are rewritten somewhere else.
    std::vector<uint32_t> corners(good.orders[0].corners.begin(), good.orders[0].corners.end());
    const uint64_t first = bad.orders[0].first_corner[0], end = bad.orders[0].first_corner[1];
    ASSERT_LT(first, end);
    for (uint64_t c = first; c < end; ++c) corners[c] = static_cast<uint32_t>((corners[c] + 3 * (end - first)) % 300);
    bad.orders[0].corners = corners;
    ASSERT_TRUE(bad.count_levels());
    EXPECT_TRUE(extract_level(bad, 0));
    const auto level = extract_level(bad, 1);
    ASSERT_FALSE(level);
    EXPECT_EQ(level.error().fault, Fault::format);
    EXPECT_THAT(level.error().message, testing::HasSubstr("level 1"));
    EXPECT_FALSE(bad.validate());
}

}  // namespace
}  // namespace lodestone
