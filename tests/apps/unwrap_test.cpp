// `unwrap` and `bake --retexture` as a user has them.
#include <gtest/gtest.h>

#include <cstdio>

#include "apps/drawn_scene.h"
#include "mesh/io/read.h"
#include "report/image_metrics.h"

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
    for (const char* name : {"new.glb --texture-format jpeg", "new.obj", "new.obj --texture-format jpeg --textures 2",
                             "new.glb --texture-format webp --webp-quality 100", "new.obj --texture-format webp"}) {
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
    fails("unwrap grid.ply -o grid.glb --bake --texture-format webp --resolution 16384", 2, "WebP holds 16383 texels");
    fails("unwrap gone.ply -o grid.glb", 3, "gone.ply");
    EXPECT_FALSE(fs::exists(folder_ / "grid.glb"));
}

// A scan whose texture lies in fragments gets one in few charts, and so is simplified further.
class RetextureTest : public DrawnSceneTest {
protected:
    // Of an asset, by a backend, without light.
    Picture drawn(const std::string& file, const char* backend) {
        constexpr uint32_t side = 301;
        make_ready(file, side, side);
        auto session = DrawSession::open(scene_, *renderer_, {backend, "", ""}, false, {});
        EXPECT_TRUE(session);
        (*session)->look.debug = DebugView::base_colour;
        Camera camera;
        camera.eye = {1.2f, 1.3f, 2.4f};
        EXPECT_TRUE((*session)->settle(camera, {.pixel_error = 0.25}, side, side));
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture);
        return std::move(*picture);
    }
};

TEST_F(RetextureTest, FragmentsNoLongerStopTheSimplifier) {
    succeeds("generate scan --triangles 12000 --seed 3 -o scan.glb");
    const json plain = printed("bake scan.glb -o plain.lode --json"),
               anew = printed("bake scan.glb -o anew.lode --retexture --json");
    EXPECT_FALSE(plain.contains("retexture"));
    EXPECT_GT(plain["lod"]["base_triangles"], 1500);
    EXPECT_LT(anew["lod"]["base_triangles"], plain["lod"]["base_triangles"].get<int>() / 10);
    EXPECT_EQ(anew["retexture"]["resolution"], 2048);
    EXPECT_LT(anew["retexture"]["charts"], 60);
    EXPECT_EQ(anew["input"], plain["input"]) << "told of the source";
}

TEST_F(RetextureTest, LooksAsTheSourceDoes) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    succeeds("generate scan --triangles 6000 --seed 3 -o scan.glb");
    succeeds("bake scan.glb --backends full,lod,discrete,vgi -o plain.lode");
    succeeds("bake scan.glb --backends lod,discrete,vgi -o anew.lode --retexture");
    const Picture full = drawn("plain.lode", "full");
    for (const char* backend : {"lod", "discrete", "vgi"}) {
        const Picture other = drawn("anew.lode", backend);
        const double psnr = psnr_db(other, full, covered_union(other, full));
        std::printf("%s: %.1f dB\n", backend, psnr);
        EXPECT_GT(psnr, 30) << backend;
    }
}

TEST_F(RetextureTest, WithoutTexturesThereIsNothingToLayOut) {
    succeeds("generate rock --triangles 300 -o rock.ply");
    const Ended ended = run("bake rock.ply -o rock.lode --retexture");
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("no texture that --retexture could lay out anew"));
}

}  // namespace
}  // namespace lodestone
