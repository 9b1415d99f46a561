// Volumes of scenes: what is read of them, and how bad ones are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "apps/scene/scene.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

class SceneVolumesTest : public testing::Test {
protected:
    // Tests run side by side, each in a process of its own.
    SceneVolumesTest()
        : path_(fs::path(testing::TempDir()) / ("volumes-" + std::to_string(getpid()) + ".scene.json")) {}
    ~SceneVolumesTest() override { fs::remove(path_); }

    // members: of the scene, beside one asset.
    Result<Scene> read(const std::string& members) {
        std::ofstream(path_)
            << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "generate": {"shape": "grid"}}], )"
            << members << "}";
        return read_scene(path_);
    }

    fs::path path_;
};

TEST_F(SceneVolumesTest, AreReadAsTheyStand) {
    const auto scene = read(R"("volumes": [{"look": "fire", "position": [1, 2, 3], "density": [7, 2], "radius": 0.5},
        {"scatter": {"count": 5, "area": [4, 4]}, "colour": [0.1, 0.2, 0.3], "particles": 3}],
        "volume_options": {"metavoxels": 12, "voxels": 20, "pool_mib": 64, "divisor": 2, "refresh": 3, "cache": 9, "absorption": "rational"})");
    ASSERT_TRUE(scene) << scene.error().message;
    const SceneVolumes& volumes = scene->volumes;
    ASSERT_EQ(volumes.emitters.size(), 6u);
    EXPECT_GT(volumes.emitters[0].look.emission, 0);
    EXPECT_EQ(volumes.emitters[0].position, glm::vec3(1, 2, 3));
    EXPECT_EQ(volumes.emitters[0].look.density_from, 7);
    EXPECT_EQ(volumes.emitters[0].look.density_to, 2);
    EXPECT_EQ(volumes.emitters[0].radius_to, 0.5f);
    EXPECT_EQ(volumes.emitters[3].look.colour_to, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_NE(volumes.emitters[3].position, volumes.emitters[4].position);
    EXPECT_NE(volumes.emitters[3].seed, volumes.emitters[4].seed);
    EXPECT_EQ(volumes.options.metavoxels, 12u);
    EXPECT_EQ(volumes.options.pool_bytes, uint64_t{64} << 20);
    EXPECT_EQ(volumes.quality.divisor, 2u);
    EXPECT_EQ(volumes.quality.refresh, 3u);
    EXPECT_EQ(volumes.quality.cache, 9u);
    EXPECT_EQ(volumes.quality.absorption, volume::Absorption::rational);
}

// Grids are named, not read: a scene is also read to be baked.
TEST_F(SceneVolumesTest, GridsAreNamedBesideTheScene) {
    const auto scene = read(R"("volumes": [{},
        {"grid": {"file": "sub/a.vdb", "name": "soot"}, "scatter": {"count": 3, "area": [4, 4]}, "scale": 0.5, "density": 7},
        {"grid": "b.vdb", "axis": [1, 0, 0], "angle_degrees": 90, "density": [3, 1], "position": [1, 2, 3]}])");
    ASSERT_TRUE(scene) << scene.error().message;
    const SceneVolumes& volumes = scene->volumes;
    ASSERT_EQ(volumes.emitters.size(), 5u);
    const fs::path folder = path_.parent_path();
    EXPECT_THAT(volumes.grids, testing::ElementsAre(SceneGrid{folder / "sub/a.vdb", "soot", 1, 3},
                                                    SceneGrid{folder / "b.vdb", "", 4, 1}));
    EXPECT_EQ(volumes.emitters[1].grid_scale, 0.5f);
    EXPECT_EQ(volumes.emitters[1].look.density_to, 7);
    EXPECT_EQ(volumes.emitters[4].look.density_to, 1);
    EXPECT_EQ(volumes.emitters[4].position, glm::vec3(1, 2, 3));
    EXPECT_NEAR(glm::distance(volumes.emitters[4].grid_turn * glm::vec3(0, 1, 0), {0, 0, 1}), 0, 1e-6f);
}

TEST_F(SceneVolumesTest, BadOnesAreRefusedByTheNameOfTheMember) {
    const std::pair<const char*, const char*> bad[] = {
        {R"("volumes": [])", "volumes must be an array"},
        {R"("volumes": [{}, 3])", "volumes[1]: must be an object"},
        {R"("volumes": [{"densty": 3}])", "volumes[0]: has no member 'densty'"},
        {R"("volumes": [{"look": "fog"}])", "volumes[0]: look 'fog' is not known"},
        {R"("volumes": [{"colour_by": "age"}])", "volumes[0]: colour_by 'age'"},
        {R"("volumes": [{"density": -1}])", "volumes[0]: density must be a number"},
        {R"("volumes": [{"density": [1, 2, 3]}])", "volumes[0]: density must be a number"},
        {R"("volumes": [{"radius": 0}])", "volumes[0]: radius must be a number"},
        {R"("volumes": [{"colour": [1, 2, 3]}])", "volumes[0]: colour must have numbers from 0 to 1"},
        {R"("volumes": [{"colour": [[1, 0, 0]]}])", "volumes[0]: colour must be three numbers"},
        {R"("volumes": [{"particles": 0}])", "volumes[0]: particles must be a whole number"},
        {R"("volumes": [{"lifetime": 0}])", "volumes[0]: lifetime"},
        {R"("volumes": [{"displacement": 1}])", "volumes[0]: displacement"},
        {R"("volumes": [{"velocity": [0, 1]}])", "volumes[0]: velocity must be three numbers"},
        {R"("volumes": [{"table": [[1, 1, 1, 1]]}])", "volumes[0]: table must be 2 to 256 times"},
        {R"("volumes": [{"table": [[1, 1, 1, 1], [1, 1, 1, 2]]}])", "volumes[0]: table must be"},
        {R"("volumes": [{"scatter": {"area": [1, 1]}}])", "volumes[0].scatter: count is missing"},
        {R"("volumes": [{"scatter": {"count": 4}}])", "volumes[0].scatter: area is missing"},
        {R"("volumes": [{"particles": 4096, "scatter": {"count": 17, "area": [1, 1]}}])",
         "volumes[0]: with it there are"},
        {R"("volumes": [{"grid": 3}])", "volumes[0].grid: must be the name of a file"},
        {R"("volumes": [{"grid": ""}])", "volumes[0].grid: file is missing"},
        {R"("volumes": [{"grid": {"name": "density"}}])", "volumes[0].grid: file is missing"},
        {R"("volumes": [{"grid": {"file": "a.vdb", "grid": "b"}}])", "volumes[0].grid: has no member 'grid'"},
        {R"("volumes": [{"grid": "../a.vdb"}])", "--allow-outside"},
        {R"("volumes": [{"grid": "/elsewhere/a.vdb"}])", "--allow-outside"},
        {R"("volumes": [{"grid": "a.vdb", "velocity": [0, 1, 0]}])", "volumes[0]: velocity is of particles"},
        {R"("volumes": [{"grid": "a.vdb", "particles": 3}])", "volumes[0]: particles is of particles"},
        {R"("volumes": [{"grid": "a.vdb", "colour_by": "heat"}])", "volumes[0]: colour_by is of particles"},
        {R"("volumes": [{"grid": "a.vdb", "scale": 0}])", "volumes[0]: scale must be"},
        {R"("volumes": [{"grid": "a.vdb", "axis": [0, 0, 0]}])", "volumes[0]: axis must not be zero"},
        {R"("volumes": [{"scale": 2}])", "volumes[0]: scale is of grids"},
        {R"("volume_options": {})", "volume_options need volumes"},
        {R"("volumes": [{}], "volume_options": {"metavoxels": 65})", "volume_options: metavoxels must be"},
        {R"("volumes": [{}], "volume_options": {"voxels": 33})", "volume_options: voxels must be"},
        {R"("volumes": [{}], "volume_options": {"cache": -1})", "volume_options: cache must be"},
        {R"("volumes": [{}], "volume_options": {"absorption": "linear"})", "volume_options: absorption 'linear'"},
        {R"("volumes": [{}], "volume_options": {"quality": 1})", "volume_options: has no member 'quality'"}};
    for (const auto& [members, message] : bad) {
        const auto scene = read(members);
        ASSERT_FALSE(scene) << members;
        EXPECT_THAT(scene.error().message, testing::HasSubstr(message));
        EXPECT_EQ(scene.error().fault, Fault::format);
    }
}

TEST_F(SceneVolumesTest, ThoseThatComeWithTheProgramAreWhole) {
    for (const char* name : {"smoke", "fire-field"}) {
        const auto scene = read_scene(fs::path(LODESTONE_SOURCE_DIR) / "assets" / (std::string(name) + ".scene.json"));
        ASSERT_TRUE(scene) << scene.error().message;
        EXPECT_FALSE(scene->volumes.emitters.empty());
        const auto source = volume::VolumeSource::open(scene->volumes.emitters, scene->volumes.options);
        ASSERT_TRUE(source) << source.error().message;
        FrameInput input;
        input.views = {view_of(scene->camera->at(0.5), 320, 180)};
        input.light_direction = *scene->light_direction;
        for (uint64_t f = 0; f < 4; ++f) {
            input.frame = f;
            input.time = static_cast<double>(f) * 0.7;
            EXPECT_TRUE((*source)->plan(input).warnings.empty()) << name << " fits its pool";
        }
    }
}

}  // namespace
}  // namespace lodestone
