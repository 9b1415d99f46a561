// `unwrap` as a user has it.
#include <gtest/gtest.h>

#include "apps/program.h"
#include "mesh/io/read.h"

namespace lodestone {
namespace {

TEST_F(ProgramTest, UnwrapWritesASquareAndReportsIt) {
    succeeds("generate rock --triangles 3000 --seed 2 -o rock.ply");
    const json report = printed("unwrap rock.ply -o rock.glb --resolution 512 --json --report report.json");
    EXPECT_EQ(report, json::parse(content_of(folder_ / "report.json")));
    EXPECT_EQ(report["flipped_triangles"], 0);
    EXPECT_EQ(report["overlapping_pairs"], 0);
    EXPECT_GT(report["coverage"], 0.7);
    EXPECT_LE(report["cut_share"], 0.05);
    const auto mesh = read_mesh(folder_ / "rock.glb");
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangle_count(), report["triangles"]);
    EXPECT_EQ(mesh->uvs.size(), mesh->wedge_count());
}

TEST_F(ProgramTest, UnwrapBakesTexturesIntoEveryFormat) {
    succeeds("generate vase --triangles 3000 -o vase.glb");
    for (const char* name :
         {"new.glb --texture-format jpeg", "new.obj", "new.obj --texture-format jpeg --textures 2"}) {
        SCOPED_TRACE(name);
        succeeds("unwrap vase.glb --bake --resolution 256 -o " + std::string(name));
        ReadReport told;
        const auto mesh = read_mesh(folder_ / std::string(name).substr(0, 7), {}, &told);
        ASSERT_TRUE(mesh) << mesh.error().message;
        EXPECT_EQ(told.warnings, std::vector<std::string>{});
        ASSERT_FALSE(mesh->images.empty());
        EXPECT_EQ(mesh->images[0].width, 256u);
    }
}

TEST_F(ProgramTest, UnwrapRefusesInOneLine) {
    succeeds("generate grid --triangles 200 -o grid.ply");
    fails("unwrap grid.ply -o grid.png", 2, "the name must end in .ply, .obj or .glb");
    fails("unwrap grid.ply -o grid.glb --resolution 16 --gutter 16", 2, "leave no room");
    fails("unwrap gone.ply -o grid.glb", 3, "gone.ply");
    EXPECT_FALSE(fs::exists(folder_ / "grid.glb"));
}

}  // namespace
}  // namespace lodestone
