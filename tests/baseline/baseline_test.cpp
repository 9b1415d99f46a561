#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "baseline/discrete.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

TriMesh rock(size_t triangles) {
    TriMesh mesh = generate(Shape::rock, triangles, 1);
    EXPECT_TRUE(repair(mesh));
    return mesh;
}

std::shared_ptr<const DiscreteChain> chain_of(const TriMesh& mesh) {
    auto chain = make_discrete_chain(mesh);
    EXPECT_TRUE(chain);
    return std::make_shared<const DiscreteChain>(std::move(*chain));
}

FrameInput seen_from(float distance) {
    Camera camera;
    camera.eye = {0, 0, distance};
    camera.far_plane = 2000;
    FrameInput input;
    input.views = {view_of(camera, 640, 480)};
    input.instances = {Instance{}};
    return input;
}

TEST(DiscreteChain, HalvesDownToSixtyFourTriangles) {
    const auto chain = chain_of(rock(10000));
    EXPECT_TRUE(chain->validate());
    ASSERT_GE(chain->levels.size(), 7u);
    EXPECT_EQ(chain->levels.front().max_error, 0);
    for (size_t i = 1; i + 1 < chain->levels.size(); ++i) {
        const double ratio = static_cast<double>(chain->levels[i].indices.size()) /
                             static_cast<double>(chain->levels[i - 1].indices.size());
        EXPECT_NEAR(ratio, 0.5, 0.05);
    }
    EXPECT_LE(chain->levels.back().indices.size() / 3, 64u);
}

TEST(DiscreteChain, ItsErrorsBoundADenserMeasurement) {
    const TriMesh mesh = rock(4000);
    const auto chain = chain_of(mesh);
    for (const DiscreteLevel& level : chain->levels) {
        TriMesh shown;
        for (const MeshVertex& v : chain->vertices)
            shown.positions.emplace_back(v.position[0], v.position[1], v.position[2]);
        shown.set_identity_wedges();
        for (size_t i = 0; i < level.indices.size(); i += 3)
            shown.triangles.push_back({level.indices[i], level.indices[i + 1], level.indices[i + 2]});
        drop_unreferenced(shown);
        DistanceOptions options;
        options.seed = 99;
        EXPECT_LE(surface_distance(mesh, shown, options).max(), level.max_error + 1e-6);
    }
}

TEST(DiscreteChain, SurvivesTheAssetFile) {
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone_chain_" + std::to_string(getpid()) + ".lode");
    const auto chain = chain_of(rock(2000));
    {
        auto writer = ChunkWriter::create(path, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(chain->write_chunks(*writer));
        ASSERT_TRUE(writer->commit());
    }
    auto file = ChunkFile::open(path);
    ASSERT_TRUE(file);
    const auto read = DiscreteChain::open(*file, 1);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->levels.size(), chain->levels.size());
    for (size_t i = 0; i < read->levels.size(); ++i) {
        EXPECT_TRUE(std::equal(read->levels[i].indices.begin(), read->levels[i].indices.end(),
                               chain->levels[i].indices.begin(), chain->levels[i].indices.end()));
        EXPECT_EQ(read->levels[i].max_error, chain->levels[i].max_error);
    }
    std::filesystem::remove(path);
}

TEST(DiscreteChain, SecondTextureCoordinatesAndTangentsGoWithTheirVertices) {
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone_chain_" + std::to_string(getpid()) + ".lode");
    TriMesh mesh = rock(2000);
    const auto second_at = [](const glm::vec3& p) { return glm::vec2(p.z, p.x + p.y); };
    const auto tangent_at = [](const glm::vec3& p) { return glm::vec4(1, 0, 0, p.y > 0 ? 1 : -1); };
    for (const uint32_t v : mesh.wedge_vertex) {
        mesh.second_uvs.push_back(second_at(mesh.positions[v]));
        mesh.tangents.push_back(tangent_at(mesh.positions[v]));
    }
    const auto written = [&](const DiscreteChain& chain) {
        auto writer = ChunkWriter::create(path, {});
        EXPECT_TRUE(chain.write_chunks(*writer));
        EXPECT_TRUE(writer->commit());
        return DiscreteChain::open(*ChunkFile::open(path), 1);
    };
    const auto chain = chain_of(mesh);
    const auto read = written(*chain);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->further.size(), read->vertices.size());
    for (size_t v = 0; v < read->vertices.size(); ++v) {
        const auto& p = read->vertices[v].position;
        const FurtherAttributes& f = read->further[v];
        EXPECT_EQ(glm::vec2(f.second_uv[0], f.second_uv[1]), second_at({p[0], p[1], p[2]}));
        EXPECT_EQ(unpack_tangent(f.tangent), tangent_at({p[0], p[1], p[2]}));
    }
    // Beside an asset without.
    auto source = open_fixed_levels({fixed_levels_of(chain_of(rock(500))), fixed_levels_of(chain)}, uint64_t{1} << 30);
    ASSERT_TRUE(source);
    FrameInput input = seen_from(3);
    input.instances = {Instance{}, Instance{.asset = 1}};
    PlanMirror mirror((*source)->recipe());
    const auto executed = mirror.execute((*source)->plan(input), input);
    EXPECT_TRUE(executed) << executed.error().message;
    DiscreteChain bad = *chain;
    bad.further = bad.further.first(7);
    const auto refused = written(bad);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("further attributes are not as many as vertices"));
    std::filesystem::remove(path);
}

// A file whose hashes are right but whose content is not.
TEST(DiscreteChain, ContentThatShadersWouldReadPastIsRefused) {
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone_chain_" + std::to_string(getpid()) + ".lode");
    const auto good = chain_of(rock(500));
    const auto refused = [&](const std::string& expect, auto&& spoil) {
        DiscreteChain bad = *good;
        spoil(bad);
        auto writer = ChunkWriter::create(path, {});
        ASSERT_TRUE(bad.write_chunks(*writer));
        ASSERT_TRUE(writer->commit());
        const auto read = DiscreteChain::open(*ChunkFile::open(path), 2);
        ASSERT_FALSE(read) << expect;
        EXPECT_EQ(read.error().fault, Fault::format);
        EXPECT_THAT(read.error().message, testing::HasSubstr(expect));
    };
    std::vector<MeshVertex> vertices(good->vertices.begin(), good->vertices.end());
    vertices[3].material = 2;
    refused("a material is out of range", [&](DiscreteChain& chain) { chain.vertices = vertices; });
    vertices[3].material = 1;
    vertices[3].position[2] = std::numeric_limits<float>::quiet_NaN();
    refused("no number", [&](DiscreteChain& chain) { chain.vertices = vertices; });
    refused("no number", [&](DiscreteChain& chain) { chain.levels[0].max_error = std::nan(""); });
    refused("index out of range", [&](DiscreteChain& chain) { chain.vertices = chain.vertices.first(3); });
    std::filesystem::remove(path);
}

TEST(FixedLevels, ChooseTheCoarsestLevelWithinThePixelError) {
    const auto chain = chain_of(rock(8000));
    auto source = open_fixed_levels({fixed_levels_of(chain)}, uint64_t{1} << 30);
    ASSERT_TRUE(source);
    PlanMirror mirror((*source)->recipe());
    uint64_t before = ~uint64_t{0};
    uint64_t frame = 0;
    for (const float distance : {2.0f, 5.0f, 20.0f, 100.0f, 900.0f}) {
        FrameInput input = seen_from(distance);
        input.frame = frame++;
        const Plan plan = (*source)->plan(input);
        const auto executed = mirror.execute(plan, input);
        ASSERT_TRUE(executed) << executed.error().message;
        EXPECT_LE(plan.stats.triangles, before);
        before = plan.stats.triangles;
    }
    EXPECT_LT(before, 200u);
    EXPECT_TRUE((*source)->validate());
}

TEST(FixedLevels, KeepToABudgetOfTrianglesOrDrawTheCoarsest) {
    const auto chain = chain_of(rock(8000));
    auto source = open_fixed_levels({fixed_levels_of(chain)}, uint64_t{1} << 30);
    ASSERT_TRUE(source);
    const uint64_t coarsest = chain->levels.back().indices.size() / 3;
    for (const uint64_t most : {uint64_t{8000}, uint64_t{2000}, coarsest, coarsest - 1, uint64_t{1}}) {
        FrameInput input = seen_from(2);
        input.budget.max_triangles = most;
        const uint64_t drawn = (*source)->plan(input).stats.triangles;
        EXPECT_TRUE(drawn <= most || drawn == coarsest) << most;
    }
}

TEST(FullLevel, DrawsEveryTriangleOnceWithoutDegenerateOnes) {
    TriMesh mesh = rock(1000);
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    indices.insert(indices.end(), {1, 1, 2});
    const FixedLevels full = full_level(pack_vertices(mesh), indices);
    EXPECT_EQ(full.levels.size(), 1u);
    EXPECT_EQ(full.levels[0].indices.size(), 3 * mesh.triangle_count());
}

TEST(FixedLevels, ABudgetThatIsTooSmallIsRefused) {
    const auto source = open_fixed_levels({fixed_levels_of(chain_of(rock(1000)))}, 1000);
    ASSERT_FALSE(source);
    EXPECT_EQ(source.error().fault, Fault::machine);
}

}  // namespace
}  // namespace lodestone
