// `tile`, and `info` and `verify` of tilesets, as scripts see them.
#include "apps/program.h"

#include "fixtures/real_data.h"

namespace lodestone {
namespace {

class TileProgramTest : public ProgramTest {
protected:
    void make_rock() const {
        succeeds("generate rock --triangles 3000 --seed 2 -o rock.ply");
        succeeds("bake rock.ply -o rock.lode --backends vgi --clusters 8 --resolution 33");
    }
    json tileset(const std::string& folder) const { return json::parse(content_of(folder_ / folder / "tileset.json")); }
};

TEST_F(TileProgramTest, FromAnAssetToAClosedTileset) {
    make_rock();
    const json made = printed("tile rock.lode -o rock --tile-triangles 512 --json");
    const json info = printed("info rock --json");
    EXPECT_EQ(info["tiles"], made["tiles"]);
    EXPECT_EQ(info["triangles"], made["triangles"]);
    EXPECT_EQ(info["bytes"], json({{"tiles", made["bytes"]["tiles"]}, {"tilesets", made["bytes"]["tilesets"]}}));
    EXPECT_GT(made["closing_triangles"], 0);
    const json verified = printed("verify rock --cuts 50 --json");
    EXPECT_EQ(verified["passed"], true);
    EXPECT_EQ(verified["cuts"], 50);
    EXPECT_EQ(verified["unmatched_edges"], 0);
    EXPECT_EQ(verified["rim_edges"], 0);
    EXPECT_GT(verified["largest_step"], 1);
    EXPECT_EQ(content_of(folder_ / "rock/tileset.json").find(folder_.string()), std::string::npos);
    EXPECT_THAT(content_of(folder_ / "rock/view.html"), HasSubstr("<title>rock</title>"));

    // Whatever the threads and the memory, and again over what is there.
    const std::string before = content_of(folder_ / "rock/t/1.glb");
    succeeds("tile rock.lode -o rock --tile-triangles 512 --threads 1 --memory 256");
    EXPECT_EQ(content_of(folder_ / "rock/t/1.glb"), before);
    // A leaf that is gone is noticed, as is a damaged one.
    fs::remove(folder_ / "rock/t/1.glb");
    fails("verify rock", 3, "t/1.glb is not there");
    std::ofstream(folder_ / "rock/t/1.glb") << before.substr(0, before.size() / 2);
    const Ended damaged = run("verify rock");
    EXPECT_EQ(damaged.code, 1);
    EXPECT_THAT(damaged.out, HasSubstr("FAILED contents"));
}

TEST_F(TileProgramTest, NothingElseIsOverwritten) {
    make_rock();
    fs::create_directories(folder_ / "mine");
    std::ofstream(folder_ / "mine/thesis.txt") << "years of work";
    fails("tile rock.lode -o mine", 2, "holds thesis.txt");
    EXPECT_EQ(content_of(folder_ / "mine/thesis.txt"), "years of work");
    fails("tile rock.ply -o rock.ply", 2, "is a file");
    fails("tile rock.lode -o x --lon 3", 2, "both of --lon and --lat");
    fails("tile rock.lode -o x --height 3", 2, "--lon and --lat");
    fails("tile rock.lode -o x --memory 10", 2, "at least 192");
    fails("tile none.ply -o x", 3, "none.ply");
    succeeds("bake rock.ply -o lod.lode --backends lod --order static");
    fails("tile lod.lode -o x", 3, "holds no atlas");
    EXPECT_FALSE(fs::exists(folder_ / "x"));
    EXPECT_FALSE(fs::exists(folder_ / ".x.part"));
}

TEST_F(TileProgramTest, StandsWhereItIsPutWithItsUpUp) {
    std::ofstream(folder_ / "p.obj") << "v 0 0 0\nv 3 0 0\nv 0 0 -2\nv 0 1 0\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    succeeds("bake p.obj -o p.lode --backends vgi --clusters 1 --resolution 5");
    succeeds("tile p.lode -o y --lon 0 --lat 0 --height 10");
    const auto near = [](const json& is, std::vector<double> wanted, double within) {
        for (size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(is[i].get<double>(), wanted[i], within) << i;
    };
    near(tileset("y")["root"]["transform"], {0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 6378147, 0, 0, 1}, 1e-6);
    // East, north, up: 3, 2 and 1 from the origin.
    near(tileset("y")["root"]["boundingVolume"]["box"], {1.5, 1, 0.5, 1.5, 0, 0, 0, 1, 0, 0, 0, 0.5}, 1e-3);
    succeeds("tile p.lode -o z --up z");
    near(tileset("z")["root"]["boundingVolume"]["box"], {1.5, 0.5, -1, 1.5, 0, 0, 0, 0.5, 0, 0, 0, 1}, 1e-3);
    EXPECT_FALSE(tileset("z")["root"].contains("transform"));
    for (const char* folder : {"y", "z"}) succeeds(std::string("verify ") + folder);
}

TEST_F(TileProgramTest, ASceneIsEachAssetOnceAndPlacedAsOftenAsItStands) {
    make_rock();
    std::ofstream(folder_ / "two.json")
        << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "rock", "file": "rock.lode"}],
        "instances": [{"asset": "rock"}, {"asset": "rock", "position": [5, 1, 0]}]})";
    const Ended made = run("tile two.json -o two --tile-triangles 512");
    ASSERT_EQ(made.code, 0) << made.err;
    const json root = tileset("two")["root"];
    ASSERT_EQ(root["children"].size(), 2u);
    EXPECT_FALSE(root["children"][0].contains("transform"));
    EXPECT_EQ(root["children"][1]["transform"], json({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 1, 1}));
    EXPECT_EQ(root["children"][1]["content"]["uri"], "a/0/tileset.json");
    const json verified = printed("verify two --cuts 20 --json");
    EXPECT_EQ(verified["unmatched_edges"], 0);
}

// A transform scales the errors below it: those of a tileset that is placed an eighth as large are larger than the
// root's.
TEST_F(TileProgramTest, ErrorsFallWhateverTheScale) {
    make_rock();
    std::ofstream(folder_ / "small.json")
        << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "rock", "file": "rock.lode"}],
        "instances": [{"asset": "rock", "scale": 0.125}, {"asset": "rock", "position": [0.5, 0, 0], "scale": 0.125}]})";
    const Ended made = run("tile small.json -o small --tile-triangles 512");
    ASSERT_EQ(made.code, 0) << made.err;
    const json root = tileset("small")["root"];
    EXPECT_GT(root["children"][0]["geometricError"], root["geometricError"]);
    EXPECT_EQ(run("verify small --cuts 5").code, 0);
}

TEST_F(TileProgramTest, AHeightMapsRimIsLeftOpenAndNothingElse) {
    succeeds("generate terrain --triangles 3000 --seed 2 -o t.ply");
    succeeds("bake t.ply -o t.lode --backends vgi --clusters 8 --resolution 33");
    succeeds("tile t.lode -o t --tile-triangles 512");
    const json verified = printed("verify t --cuts 50 --json");
    EXPECT_EQ(verified["unmatched_edges"], 0);
    EXPECT_GT(verified["rim_edges"], 50);
}

TEST_F(TileProgramTest, TexturesAreHalvedForCoarserTiles) {
    const auto fox = fixtures::real_data("gltf/Fox/Fox.glb");
    if (!fox) GTEST_SKIP() << fixtures::missing_data_note("gltf/Fox/Fox.glb");
    const Ended baked = run("bake '" + fox->string() + "' -o fox.lode --backends vgi --clusters 20 --resolution 17");
    ASSERT_EQ(baked.code, 0) << baked.err;
    const json made = printed("tile fox.lode -o fox --tile-triangles 256 --json");
    EXPECT_GT(made["bytes"]["images"], 0);
    EXPECT_GT(fs::file_size(folder_ / "fox/i/0-0.png"), fs::file_size(folder_ / "fox/i/0-1.png"));
    EXPECT_THAT(content_of(folder_ / "fox/t/0.glb"), HasSubstr("KHR_texture_transform"));
    EXPECT_EQ(printed("verify fox --cuts 20 --json")["unmatched_edges"], 0);
}

}  // namespace
}  // namespace lodestone
