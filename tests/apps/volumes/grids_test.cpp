// Density grids that volumes of a scene name: files beside the scene, read where they are drawn.
#ifdef LODESTONE_WITH_RENDER
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "apps/drawing/grids.h"
#include "apps/scene/scene.h"
#ifdef LODESTONE_WITH_OPENVDB
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#endif

namespace lodestone {
namespace {

namespace fs = std::filesystem;

class SceneGridsTest : public testing::Test {
protected:
    // Tests run side by side, each in a process of its own.
    SceneGridsTest() : folder_(fs::path(testing::TempDir()) / ("grids-" + std::to_string(getpid()))) {
        fs::create_directories(folder_ / "sub");
    }
    ~SceneGridsTest() override { fs::remove_all(folder_); }

    SceneVolumes volumes(const std::string& text) const {
        const fs::path path = folder_ / "a.scene.json";
        std::ofstream(path) << R"({"lodestone": "scene", "version": 1, "assets": [)"
                            << R"({"name": "a", "generate": {"shape": "grid"}}], "volumes": )" << text << "}";
        const auto scene = read_scene(path);
        EXPECT_TRUE(scene) << scene.error().message;
        return scene->volumes;
    }

    fs::path folder_;
};

TEST_F(SceneGridsTest, AreRefusedByTheirPath) {
    SceneVolumes missing = volumes(R"([{"grid": "sub/none.vdb"}])");
    const auto read = read_grids(missing);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().fault, Fault::format);
    EXPECT_THAT(read.error().message, testing::StartsWith((folder_ / "sub/none.vdb").string() + ": "));
    SceneVolumes none = volumes("[{}]");
    EXPECT_TRUE(read_grids(none));
}

#ifdef LODESTONE_WITH_OPENVDB
TEST_F(SceneGridsTest, AreReadOnceForAllThatNameThem) {
    openvdb::initialize();
    openvdb::GridPtrVec grids;
    for (const char* name : {"density", "soot"}) {
        auto grid = openvdb::FloatGrid::create(0);
        grid->setName(name);
        grid->tree().setValue({1, 2, 3}, grids.empty() ? 5.0f : 7.0f);
        grids.push_back(grid);
    }
    openvdb::io::File((folder_ / "sub/a.vdb").string()).write(grids);
    SceneVolumes read = volumes(R"([{"grid": "sub/a.vdb", "scatter": {"count": 3, "area": [4, 4]}}, {},
        {"grid": {"file": "sub/a.vdb", "name": "soot"}}, {"grid": "sub/a.vdb"}])");
    const auto done = read_grids(read);
    ASSERT_TRUE(done) << done.error().message;
    ASSERT_EQ(read.emitters.size(), 6u);
    EXPECT_THAT(read.grids, testing::IsEmpty());
    EXPECT_EQ(read.emitters[0].grid->most, 5);
    for (const size_t same : {1u, 2u, 5u}) EXPECT_EQ(read.emitters[same].grid, read.emitters[0].grid);
    EXPECT_EQ(read.emitters[3].grid, nullptr);
    EXPECT_EQ(read.emitters[4].grid->most, 7);
}
#endif

}  // namespace
}  // namespace lodestone
#endif
