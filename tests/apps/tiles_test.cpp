// `tile`, and `info` and `verify` of tilesets, as scripts see them.
#include "apps/program.h"

#include <array>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "fixtures/real_data.h"
#include "tiles/reference_system.h"

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

class TileProjectedTest : public TileProgramTest {
protected:
    void SetUp() override {
        TileProgramTest::SetUp();
        if (!tiles::ReferenceSystem::is_built_in()) GTEST_SKIP() << "built without PROJ";
    }
    // 300 to the east, 200 to the north and 100 up from `at`, with z or y up.
    void make_corner(const std::string& name, std::array<int, 3> at, bool y_up) const {
        std::ofstream file(folder_ / name);
        for (const std::array<int, 3> v : {std::array{0, 0, 0}, {300, 0, 0}, {0, 200, 0}, {0, 0, 100}}) {
            const int x = at[0] + v[0], y = at[1] + v[1], z = at[2] + v[2];
            file << "v " << x << " " << (y_up ? z : y) << " " << (y_up ? -y : z) << "\n";
        }
        file << "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    }
    // Where the corners of the root's box are on the Earth, at -1 or 1 each way.
    glm::dvec3 corner_of(const std::string& folder, const glm::dvec3& way) const {
        const json root = tileset(folder)["root"];
        const auto transform = root["transform"].get<std::array<double, 16>>();
        const auto box = root["boundingVolume"]["box"].get<std::array<double, 12>>();
        glm::dmat4 matrix(1);
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = transform[static_cast<size_t>(i)];
        return {matrix * glm::dvec4(box[0] + way.x * box[3], box[1] + way.y * box[7], box[2] + way.z * box[11], 1)};
    }
};

// A mesh stands at the same place with its coordinates in the file, or with those of its origin given; with y or z up.
TEST_F(TileProjectedTest, StandsWhereItsReferenceSystemSays) {
    make_corner("far.obj", {650000, 5250000, 400}, false);
    make_corner("near.obj", {0, 0, 0}, false);
    make_corner("up.obj", {0, 0, 0}, true);
    const json far = printed("tile far.obj -o far --epsg 32632 --json");
    const json near = printed("tile near.obj -o near --epsg 32632 --epsg-origin 650000,5250000,400 --json");
    succeeds("tile up.obj -o up --up y --epsg 32632 --epsg-origin 650000,5250000,400");
    const auto system = tiles::ReferenceSystem::of(32632);
    ASSERT_TRUE(system);
    const auto placement = system->place({{650150, 5250100, 450}, {150, 100, 50}});
    ASSERT_TRUE(placement);
    for (const glm::dvec3 way :
         {glm::dvec3(-1, -1, -1), glm::dvec3(1, -1, -1), glm::dvec3(-1, 1, -1), glm::dvec3(1, 1, 1)}) {
        const glm::dvec3 at = glm::dvec3(650150, 5250100, 450) + way * glm::dvec3(150, 100, 50);
        const glm::dvec3 wanted(placement->to_earth * glm::dvec4(at, 1));
        for (const char* folder : {"near", "up"})
            EXPECT_LT(glm::distance(corner_of(folder, way), wanted), 0.05) << folder;
        EXPECT_LT(glm::distance(corner_of("far", way), wanted), 0.6);  // floats are half a metre apart there
    }
    for (const json& made : {far, near}) {
        EXPECT_EQ(made["place"]["epsg"], 32632);
        EXPECT_EQ(made["place"]["system"], "WGS 84 / UTM zone 32N");
        EXPECT_NEAR(made["place"]["flat_off_metres"].get<double>(), placement->off, 0.02 * placement->off);
        EXPECT_NEAR(made["place"]["longitude"].get<double>(), placement->longitude, 1e-5);
        EXPECT_NEAR(made["place"]["latitude"].get<double>(), placement->latitude, 1e-5);
        EXPECT_NEAR(made["place"]["height"].get<double>(), 450, 0.5);
        EXPECT_EQ(made["place"]["accuracy_metres"], 0);
    }
    for (const char* folder : {"far", "near", "up"}) succeeds(std::string("verify ") + folder);
}

// glTF has y up, so that need not be said.
TEST_F(TileProjectedTest, KnowsWhichAxisOfAFormatIsUp) {
    succeeds("generate terrain --triangles 800 --seed 2 -o t.glb");
    succeeds("tile t.glb -o t --epsg 2056 --epsg-origin 2600000,1200000");
    const json box = tileset("t")["root"]["boundingVolume"]["box"];
    EXPECT_NEAR(box[7].get<double>(), 1, 0.01);
    EXPECT_LT(box[11].get<double>(), 0.6);
    succeeds("bake t.glb -o t.lode --backends vgi");
    fails("tile t.lode -o x --epsg 2056 --epsg-origin 2600000,1200000", 2, "give --up y or --up z");
}

TEST_F(TileProjectedTest, SaysWhatIsLost) {
    make_corner("far.obj", {650000, 5250000, 400}, false);
    const Ended far = run("tile far.obj -o far --epsg 25832");
    EXPECT_THAT(far.err, HasSubstr("rounded by up to 0.25; take a round number off"));
    EXPECT_THAT(far.out, HasSubstr("EPSG:25832 (ETRS89 / UTM zone 32N), heights above the ellipsoid of WGS 84"));
    EXPECT_THAT(far.out, HasSubstr("is good to 1 m"));
    make_corner("near.obj", {0, 0, 0}, false);
    EXPECT_EQ(run("tile near.obj -o near --epsg 25832 --epsg-origin 650000,5250000").err, "");
    // Ten kilometres of the Earth's curve; and a place in the next zone.
    std::ofstream(folder_ / "large.obj") << "v -10000 0 0\nv 10000 0 0\nv 0 100 0\nf 1 2 3\n";
    const Ended large = run("tile large.obj -o large --epsg 32632 --epsg-origin 794328,5546440");
    EXPECT_THAT(large.err, HasSubstr("up to 7.8"));
    EXPECT_THAT(large.err, HasSubstr("1.1 degrees outside"));
    EXPECT_THAT(large.out, HasSubstr("a flat frame is off by 7.8"));
}

TEST_F(TileProjectedTest, ASceneIsPlacedAsAWhole) {
    make_corner("a.obj", {0, 0, 0}, true);
    std::ofstream(folder_ / "two.json")
        << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "file": "a.obj"}],
        "instances": [{"asset": "a"}, {"asset": "a", "position": [1000, 0, -500]}]})";
    fails("tile two.json -o two --epsg 2056", 2, "give --up y or --up z");
    const json made = printed("tile two.json -o two --up y --epsg 2056 --epsg-origin 2600000,1200000 --json");
    const auto placement = tiles::ReferenceSystem::of(2056)->place({{2600650, 1200350, 50}, {650, 350, 50}});
    ASSERT_TRUE(placement);
    const glm::dvec3 wanted(placement->to_earth * glm::dvec4(2601300, 1200700, 100, 1));
    EXPECT_LT(glm::distance(corner_of("two", glm::dvec3(1)), wanted), 0.05);
    EXPECT_NEAR(made["place"]["flat_off_metres"].get<double>(), placement->off, 0.02 * placement->off);
    succeeds("verify two");
}

TEST_F(TileProjectedTest, WhatCannotBePlacedIsRefusedInALine) {
    make_corner("a.obj", {0, 0, 0}, false);
    fails("tile a.obj -o x --epsg 4326", 2, "is geographic, in degrees");
    fails("tile a.obj -o x --epsg 99999", 2, "PROJ knows no reference system of this code");
    fails("tile a.obj -o x --epsg 0", 2, "--epsg");
    fails("tile a.obj -o x --epsg 2056 --lon 7 --lat 47", 2, "leave out --lon");
    fails("tile a.obj -o x --epsg 2056 --height 7", 2, "leave out --lon");
    fails("tile a.obj -o x --epsg-origin 1,2", 2, "give --epsg with it");
    for (const char* origin : {"1", "1,", "1,2,3,4", "1,b", "nan,1", "1:2", "''"})
        fails(std::string("tile a.obj -o x --epsg 2056 --epsg-origin ") + origin, 2, "--epsg-origin");
    fails("tile a.obj -o x --epsg 2056", 3, "not where it is used (5.96 to 10.49 degrees east, 45.82 to 47.81 north)");
    fails("tile a.obj -o x --epsg 2056", 4, "proj.db", "PROJ_DATA=/nowhere PROJ_LIB=/nowhere ");
    fails("tile a.obj -o x --epsg 5555 --epsg-origin 500000,5700000", 4, "give --epsg 25832");
    EXPECT_FALSE(fs::exists(folder_ / "x"));
}

// EPSG 6893 is World Mercator with heights above a geoid. Its grid is asked for and not fetched; with a geoid that is
// 40 m above the ellipsoid everywhere, a mesh stands 40 m higher.
TEST_F(TileProjectedTest, HeightsOfACompoundSystemNeedTheirGrid) {
    const fs::path database = "/usr/share/proj/proj.db";
    if (!fs::exists(database)) GTEST_SKIP() << "where PROJ has its database is not known";
    make_corner("a.obj", {0, 0, 0}, false);
    const std::string folder = (folder_ / "grids").string(),
                      with = "PROJ_NETWORK=ON PROJ_DATA='" + folder + "' PROJ_LIB='" + folder + "' ";
    fs::create_directories(folder);
    fs::create_symlink(database, folder + "/proj.db");
    const std::string tiled = "tile a.obj -o a --json --epsg 6893 --epsg-origin 1000000,6000000";
    fails(tiled, 4, "needs us_nga_egm08_25.tif, which PROJ does not find", with);
    // NOAA's format: south, west, steps, rows and columns, and floats, all with the high byte first.
    std::ofstream grid(folder + "/egm08_25.gtx", std::ios::binary);
    const auto put = [&](auto value) {
        std::array<char, sizeof value> bytes{};
        std::memcpy(bytes.data(), &value, sizeof value);
        std::reverse(bytes.begin(), bytes.end());
        grid.write(bytes.data(), sizeof value);
    };
    for (const double value : {-90.0, -180.0, 10.0, 10.0}) put(value);
    put(int32_t{19});
    put(int32_t{37});
    for (int i = 0; i < 19 * 37; ++i) put(40.0F);
    grid.close();
    const Ended made = run(tiled, with);
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_NEAR(json::parse(made.out)["place"]["height"].get<double>(), 50 + 40, 0.01);
}

TEST_F(TileProgramTest, WithoutProjItSaysSo) {
    if (tiles::ReferenceSystem::is_built_in()) GTEST_SKIP() << "built with PROJ";
    std::ofstream(folder_ / "p.obj") << "v 0 0 0\nv 3 0 0\nv 0 0 -2\nf 1 3 2\n";
    fails("tile p.obj -o x --epsg 2056", 4, "made without PROJ");
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
    const Ended baked =
        run("bake '" + fox->string() + "' -o fox.lode --backends vgi --keep-uv --clusters 20 --resolution 17");
    ASSERT_EQ(baked.code, 0) << baked.err;
    const json made = printed("tile fox.lode -o fox --tile-triangles 256 --json");
    EXPECT_GT(made["bytes"]["images"], 0);
    EXPECT_GT(fs::file_size(folder_ / "fox/i/0-0.png"), fs::file_size(folder_ / "fox/i/0-1.png"));
    EXPECT_THAT(content_of(folder_ / "fox/t/0.glb"), HasSubstr("KHR_texture_transform"));
    EXPECT_EQ(printed("verify fox --cuts 20 --json")["unmatched_edges"], 0);
}

}  // namespace
}  // namespace lodestone
