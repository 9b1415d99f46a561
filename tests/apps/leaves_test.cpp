// Atlases with leaves through the program: what is drawn near the eye is the source.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <nlohmann/json.hpp>

#include "apps/program.h"
#include "mesh/io/image_file.h"

namespace lodestone {
namespace {

class LeavesProgramTest : public ProgramTest {
protected:
    json row_of(const std::string& what, const std::string& picture) {
        succeeds("render " + what + " --size 320x240 --stats stats.json -o " + picture);
        return json::parse(content_of(folder_ / "stats.json"))["rows"][0];
    }
    // Share of pixels of which a channel differs by more than 8.
    double differs(const std::string& a, const std::string& b) {
        const auto one = read_image(folder_ / a), other = read_image(folder_ / b);
        EXPECT_TRUE(one && other && one->texels.size() == other->texels.size());
        size_t count = 0;
        for (size_t i = 0; i < one->texels.size(); ++i) {
            int most = 0;
            for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(one->texels[i][k] - other->texels[i][k]));
            count += most > 8;
        }
        return static_cast<double>(count) / static_cast<double>(one->texels.size());
    }
};

TEST_F(LeavesProgramTest, NearTheEyeTheSourceIsDrawn) {
    succeeds("generate cliff --triangles 20000 --seed 5 -o cliff.ply");
    succeeds("bake cliff.ply --backends full,vgi -o cliff.lode");
    succeeds("bake cliff.ply --backends vgi --no-leaves --resolution 17 -o samples.lode");
    succeeds("verify cliff.lode");
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const std::string near = " --camera @0.9 --pixel-error 0.1";
    row_of("cliff.lode --backend full" + near, "full.png");
    const json leaves = row_of("cliff.lode --backend vgi --validation" + near, "leaves.png");
    EXPECT_GT(leaves["backend_figures"]["leaf_parts_resident"], 0);
    EXPECT_EQ(leaves["backend_figures"]["leaf_parts_missing"], 0);
    EXPECT_EQ(leaves["backend_figures"]["pages_missing"], 0);
    const json samples = row_of("samples.lode --backend vgi" + near, "samples.png");
    EXPECT_EQ(samples["backend_figures"]["leaf_parts_resident"], 0);
    EXPECT_LT(differs("leaves.png", "full.png"), 0.01);
    EXPECT_GT(differs("samples.png", "full.png"), 2 * differs("leaves.png", "full.png"));
    // Far away samples do.
    const json far = row_of("cliff.lode --backend vgi --camera @0.9 --pixel-error 8", "far.png");
    EXPECT_LT(far["triangles"], leaves["triangles"].get<uint64_t>() / 4);
    EXPECT_GT(row_of("cliff.lode --backend vgi --debug leaf" + near, "debug.png")["triangles"], 0);
}

// Charts of a textured mesh end at different depths: pages that none of them has take no memory from leaves.
TEST_F(LeavesProgramTest, AreAllThereWhereMemoryHoldsThem) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    succeeds("generate vase --triangles 60000 -o vase.glb");
    succeeds("bake vase.glb --backends vgi -o vase.lode");
    for (const std::string mib : {"32", "1024"}) {
        const json row =
            row_of("vase.lode --backend vgi --camera @0.9 --pixel-error 0.1 --resident-mib " + mib, "vase.png");
        EXPECT_EQ(row["backend_figures"]["leaf_parts_missing"], 0) << mib;
        EXPECT_EQ(row["backend_figures"]["pages_missing"], 0) << mib;
        EXPECT_LE(row["buffer_bytes"], 32u << 20) << mib;
    }
}

TEST_F(LeavesProgramTest, AnAtlasIsAsDenseAsItsSource) {
    succeeds("generate rock --triangles 20000 --seed 5 -o rock.ply");
    const json by_default = printed("bake rock.ply --backends vgi -o rock.lode --json")["vgi"];
    EXPECT_LT(by_default["bytes"], 20000 * 40);
    const double triangles = printed("info rock.lode --json")["vgi"]["levels"][1]["triangles"].get<double>();
    EXPECT_LE(triangles, 2.0 * 20000);
    EXPECT_GE(triangles, 0.4 * 20000);
    EXPECT_LE(by_default["clusters"], 30);
    EXPECT_EQ(printed("bake rock.ply --backends vgi --resolution 33 -o fine.lode --json")["vgi"]["resolution"], 33);
    EXPECT_EQ(
        printed("bake rock.ply --backends vgi --no-leaves --clusters 9 -o plain.lode --json")["vgi"]["resolution"],
        129);
    fails("bake rock.ply --backends vgi --attribute-resolution 65 -o x.lode", 2, "give --resolution with it");
    // The source comes back, whatever the samples are.
    const json source = printed("extract rock.lode --backend vgi --level source -o back.ply --json");
    EXPECT_EQ(source["level"], 0);
    EXPECT_LT(source["error"], 1e-5);
}

}  // namespace
}  // namespace lodestone
