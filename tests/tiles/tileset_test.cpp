// Tilesets on disk: what is written can be read back, is checked, and is the same however it was made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/threads.h"
#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "fixtures/written_glbs.h"
#include "mesh/distance/distance.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"
#include "tiles/check/check.h"
#include "tiles/check/tile_content.h"
#include "tiles/cut_surface.h"
#include "tiles/errors/farthest.h"
#include "tiles/tile_errors.h"
#include "tiles/tile_file.h"
#include "tiles/tileset.h"

namespace lodestone::tiles {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

std::string content_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}
std::map<std::string, std::string> files_in(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = content_of(entry.path());
    }
    return files;
}

class TilesetTest : public testing::Test {
protected:
    static const vgi::Atlas& rock() {
        static const vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 32);
        return atlas;
    }
    void SetUp() override { folder_ = fs::temp_directory_path() / ("lodestone_tiles_" + std::to_string(getpid())); }
    void TearDown() override {
        written_.check();
        fs::remove_all(folder_);
    }

    fs::path write(const vgi::Atlas& atlas, const std::string& name, TilesetOptions options = {},
                   uint32_t tile_triangles = 256) {
        options.tile_triangles = tile_triangles;
        fs::create_directories(folder_ / name);
        const auto report = write_tileset(atlas, folder_ / name, options, {});
        EXPECT_TRUE(report) << report.error().message;
        if (report) report_ = *report;
        return folder_ / name;
    }
    static TilesetCheck checked(const fs::path& path, bool measure = false) {
        CheckOptions options;
        options.cuts = 20;
        options.measure = measure;
        auto check = check_tileset(path, options, {});
        EXPECT_TRUE(check) << check.error().message;
        return check ? *check : TilesetCheck{};
    }
    static std::string faults(const TilesetCheck& check) {
        std::string text;
        for (const CheckedPoint& point : check.points) {
            if (!point.passed) text += point.name + ": " + point.message + "\n";
        }
        return text;
    }
    // Changes the JSON of a tileset.
    template <class Change>
    static void change(const fs::path& path, Change&& change) {
        json set = json::parse(content_of(path / "tileset.json"));
        change(set);
        std::ofstream(path / "tileset.json") << set.dump();
    }
    fs::path folder_;
    fixtures::WrittenGlbs written_;  // other tests write the same tiles
    TilesetReport report_;
};

TEST_F(TilesetTest, PassesItsChecksInEveryEncoding) {
    for (const Encoding encoding : {Encoding::meshopt, Encoding::quantised, Encoding::plain}) {
        TilesetOptions options;
        options.encoding = encoding;
        const fs::path path = write(rock(), std::to_string(static_cast<int>(encoding)), options);
        written_.keep(path);
        const TilesetCheck check = checked(path);
        EXPECT_EQ(faults(check), "");
        EXPECT_EQ(check.cuts, 20u);
        EXPECT_EQ(check.unmatched_edges, 0u);
        EXPECT_GE(check.largest_step, 2u);
        EXPECT_GT(report_.closing_triangles, 0u);
        const auto facts = tileset_facts(path);
        ASSERT_TRUE(facts);
        EXPECT_EQ(facts->tiles, report_.tiles);
        EXPECT_EQ(facts->triangles, report_.triangles);
        EXPECT_EQ(facts->closing_triangles, report_.closing_triangles);
        EXPECT_EQ(facts->tile_bytes, report_.glb_bytes);
        EXPECT_EQ(facts->depth, report_.depth);
    }
}

TEST_F(TilesetTest, MaterialsAreWrittenWhole) {
    vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::vase, 2000), 32);
    ASSERT_FALSE(atlas.uvs.empty());
    Material all = fixtures::every_material()[1];
    for (Texture* texture : all.textures()) texture->second = false;  // an atlas has one set
    atlas.material_table = {all};
    atlas.images = fixtures::role_images();
    const TileTree tree = make_tile_tree(atlas, 256);
    fs::create_directories(folder_);
    GlbOptions options;
    for (size_t i = 0; i < atlas.images.size(); ++i) {
        options.image_uris.push_back(std::to_string(i) + ".png");
        ASSERT_TRUE(write_png(atlas.images[i], folder_ / options.image_uris.back()));
    }
    for (const Encoding encoding : {Encoding::meshopt, Encoding::quantised, Encoding::plain}) {
        options.encoding = encoding;
        const TileMesh tile = make_tile_mesh(atlas, tree, 0);
        const auto bytes = encode_glb(atlas, tile, options);
        std::ofstream(folder_ / "tile.glb", std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        written_.keep(folder_);
        ReadReport told;
        const auto read = read_mesh(folder_ / "tile.glb", {}, &told);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_THAT(told.warnings, testing::IsEmpty());
        ASSERT_EQ(read->material_table.size(), 2u);
        const Material& found = read->material_table[1];
        EXPECT_EQ(found.emission, all.emission);
        EXPECT_EQ(found.alpha_mode, all.alpha_mode);
        for (size_t k = 0; k < texture_names.size(); ++k) {
            const Texture &a = *all.textures()[k], &b = *found.textures()[k];
            ASSERT_TRUE(b.there()) << texture_names[k];
            EXPECT_EQ(a.wrap, b.wrap) << texture_names[k];
            for (int c = 0; c < 3; ++c) EXPECT_LT(glm::length(a.place[c] - b.place[c]), 1e-4f) << texture_names[k];
        }
        // Coordinates are those of the mesh again.
        const glm::vec2 high = atlas.uv_low + atlas.uv_step * 65535.0f;
        for (const glm::vec2& uv : read->uvs) {
            EXPECT_TRUE(glm::all(glm::greaterThanEqual(uv, atlas.uv_low - 1e-4f)));
            EXPECT_TRUE(glm::all(glm::lessThanEqual(uv, high + 1e-4f)));
        }
    }
}

TEST_F(TilesetTest, EncodingsHoldTheSameTriangles) {
    const TileTree tree = make_tile_tree(rock(), 256);
    for (const uint32_t tile : {0u, 1u, static_cast<uint32_t>(tree.nodes.size() - 1)}) {
        const TileMesh mesh = make_tile_mesh(rock(), tree, tile);
        Places places;
        auto wanted = border_of(corners_of(mesh, mesh.surface_triangles, places));
        fs::create_directories(folder_);
        for (const Encoding encoding : {Encoding::meshopt, Encoding::quantised, Encoding::plain}) {
            const auto bytes = encode_glb(rock(), mesh, {encoding, UpAxis::y, {}});
            const auto content = read_back(bytes, folder_);
            ASSERT_TRUE(content) << content.error().message;
            EXPECT_EQ(content->triangles.size(), mesh.triangles.size());
            EXPECT_EQ(content->positions.size(), mesh.vertices.size());
            std::multiset<std::array<uint32_t, 3>> read, made;
            const auto add = [](std::multiset<std::array<uint32_t, 3>>& to, std::array<uint32_t, 3> t) {
                std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
                to.insert(t);
            };
            for (const auto& t : content->triangles) {
                add(read, {places.number(content->positions[t[0]]), places.number(content->positions[t[1]]),
                           places.number(content->positions[t[2]])});
            }
            const std::vector<uint32_t> corners = corners_of(mesh, places);
            for (size_t i = 0; i < corners.size(); i += 3) add(made, {corners[i], corners[i + 1], corners[i + 2]});
            EXPECT_EQ(read, made);
        }
    }
}

TEST_F(TilesetTest, HasTheSameBytesForAnyNumberOfThreads) {
    for (const unsigned threads : {1u, 5u}) {
        set_thread_count(threads);
        write(rock(), std::to_string(threads));
    }
    set_thread_count(0);
    const auto one = files_in(folder_ / "1");
    EXPECT_GT(one.size(), 20u);
    EXPECT_EQ(one, files_in(folder_ / "5"));
}

TEST_F(TilesetTest, ManyTilesAreInTilesetsOfTheirOwn) {
    TilesetOptions options;
    options.external = 40;
    const fs::path path = write(rock(), "external", options);
    EXPECT_GT(report_.tilesets, 4u);
    const TilesetCheck check = checked(path);
    EXPECT_EQ(faults(check), "");
    const auto facts = tileset_facts(path);
    ASSERT_TRUE(facts);
    EXPECT_EQ(facts->files, report_.tilesets);
    EXPECT_EQ(facts->tiles, report_.tiles);
    EXPECT_EQ(facts->parts, 1u);
    // The same tiles.
    const fs::path whole = write(rock(), "whole");
    EXPECT_EQ(report_.tilesets, 1u);
    EXPECT_EQ(content_of(path / "t/7.glb"), content_of(whole / "t/7.glb"));
}

TEST_F(TilesetTest, ErrorsAreWhatIsMeasured) {
    for (const auto& [mesh, tile_triangles] : {std::pair(fixtures::repaired(Shape::rock, 4000), 2048u),
                                               std::pair(fixtures::repaired(Shape::terrain, 4000), 1024u)}) {
        const fs::path path = write(vgi::small_atlas(mesh, 32), "measured", {}, tile_triangles);
        const TilesetCheck check = checked(path, true);
        EXPECT_EQ(faults(check), "");
        EXPECT_GE(check.least_ratio, 0.999);
        EXPECT_LE(check.largest_ratio, 1.5);
        fs::remove_all(path);
    }
}

// A chart of 32 x 32 cells, flat but for one sample if `bump`.
vgi::Atlas one_chart(bool bump) {
    vgi::Atlas atlas;
    atlas.cells = atlas.attribute_cells = 32;
    atlas.lay_out({0}, {0});
    atlas.make_room();
    atlas.sides.resize(4);
    for (uint32_t y = 0; y <= 32; ++y) {
        for (uint32_t x = 0; x <= 32; ++x) {
            atlas.positions[atlas.texel(0, x, y)] = {static_cast<uint16_t>(100 * x), static_cast<uint16_t>(100 * y),
                                                     static_cast<uint16_t>(bump && x == 5 && y == 7 ? 10 : 0)};
        }
    }
    return atlas;
}

TEST_F(TilesetTest, WhereNothingIsGainedNothingIsRefined) {
    const fs::path flat = write(one_chart(false), "flat");
    EXPECT_EQ(report_.tiles, 1u);
    EXPECT_EQ(report_.root_error, 0);
    EXPECT_EQ(faults(checked(flat)), "");
    const fs::path bumpy = write(one_chart(true), "bumpy");
    EXPECT_GT(report_.tiles, 2u);
    EXPECT_NEAR(report_.root_error, 10, 0.2);
    EXPECT_EQ(faults(checked(bumpy)), "");
}

TEST_F(TilesetTest, WhatIsWrongIsFound) {
    const fs::path path = write(rock(), "rock");
    const std::string good = content_of(path / "tileset.json");
    const auto finds = [&](const char* what, auto&& change_of) {
        change(path, change_of);
        EXPECT_THAT(faults(checked(path)), HasSubstr(what));
        std::ofstream(path / "tileset.json") << good;
    };
    finds("errors fall",
          [](json& set) { set["root"]["children"][0]["geometricError"] = set["root"]["geometricError"]; });
    finds("errors fall", [](json& set) { set["geometricError"] = 0; });
    finds("stands out of its parent's", [](json& set) { set["root"]["boundingVolume"]["box"][3] = 1e-3; });
    // A child that is left out leaves a hole.
    finds("do not match", [](json& set) { set["root"]["children"].erase(0); });
    const auto refuses = [&](const char* what, auto&& change_of) {
        change(path, change_of);
        const auto check = check_tileset(path, {}, {});
        ASSERT_FALSE(check);
        EXPECT_EQ(check.error().fault, Fault::format);
        EXPECT_THAT(check.error().message, HasSubstr(what));
        std::ofstream(path / "tileset.json") << good;
    };
    refuses("asset.version", [](json& set) { set["asset"]["version"] = "2"; });
    refuses("is not there", [](json& set) { set["root"]["content"]["uri"] = "t/none.glb"; });
    refuses("outside", [](json& set) { set["root"]["content"]["uri"] = "../rock.glb"; });
    refuses("refers to itself", [](json& set) { set["root"]["content"]["uri"] = "tileset.json"; });
    refuses("refine", [](json& set) { set["root"].erase("refine"); });
    refuses("geometricError", [](json& set) { set["root"].erase("geometricError"); });
    refuses("bounding volume", [](json& set) { set["root"]["boundingVolume"] = json::object(); });
    // Extras that other programs write say nothing.
    change(path, [](json& set) {
        set["root"]["extras"] = {{"level", -1}, {"closingTriangles", 0.5}, {"sourceError", "x"}};
    });
    EXPECT_TRUE(tileset_facts(path));
}

TEST_F(TilesetTest, DamagedTilesAreFound) {
    const fs::path path = write(rock(), "rock");
    const std::string good = content_of(path / "t/0.glb");
    Random random(3);
    int found = 0;
    for (int i = 0; i < 200; ++i) {
        std::string bad = good;
        bad[random.below(static_cast<uint32_t>(bad.size()))] ^= static_cast<char>(1u << random.below(8));
        if (i % 4 == 0) bad.resize(random.below(static_cast<uint32_t>(bad.size())));
        std::ofstream(path / "t/0.glb", std::ios::binary) << bad;
        const auto content = read_tile_content(path / "t/0.glb");
        found += content ? 0 : 1;
        EXPECT_TRUE(content || content.error().fault == Fault::format);
    }
    EXPECT_GT(found, 50) << "no bytes at all are looked at";
}

// Found by fuzzing: a double was cast to the type of an accessor's components, whatever it was.
TEST_F(TilesetTest, NumbersThatTheirTypesDoNotHoldAreFound) {
    const fs::path path = write(rock(), "rock");
    std::string bad = content_of(path / "t/0.glb");
    const size_t at = bad.find("\"componentType\":5");
    ASSERT_NE(at, std::string::npos);
    bad.replace(at + 16, 4, "5e+9");
    std::ofstream(path / "t/0.glb", std::ios::binary) << bad;
    const auto content = read_tile_content(path / "t/0.glb");
    ASSERT_FALSE(content);
    EXPECT_EQ(content.error().fault, Fault::format);
    EXPECT_THAT(content.error().message, HasSubstr("5000000000.0 is no whole number"));
}

// A few bytes could ask for 16 GiB: 2^26 values of 256 bytes.
TEST_F(TilesetTest, ViewsThatPromiseMoreThanTheyHoldGetNoMemory) {
    const fs::path path = write(rock(), "rock");
    const std::string good = content_of(path / "t/0.glb");
    const auto word = [](uint32_t value) { return std::string(reinterpret_cast<const char*>(&value), 4); };
    uint32_t bytes = 0;
    std::memcpy(&bytes, good.data() + 12, 4);
    json description = json::parse(good.substr(20, bytes));
    for (json& view : description["bufferViews"]) view["extensions"]["EXT_meshopt_compression"]["count"] = 1 << 23;
    std::string text = description.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::string rest = good.substr(20 + bytes);
    const auto length = static_cast<uint32_t>(text.size());
    std::ofstream(path / "t/0.glb", std::ios::binary)
        << good.substr(0, 8) << word(static_cast<uint32_t>(20 + text.size() + rest.size())) << word(length)
        << good.substr(16, 4) << text << rest;
    const auto content = read_tile_content(path / "t/0.glb");
    ASSERT_FALSE(content);
    EXPECT_EQ(content.error().fault, Fault::format);
    EXPECT_THAT(content.error().message, HasSubstr("promises more than its bytes can hold"));
}

TEST_F(TilesetTest, ATileOnALatticeOfItsOwnIsFound) {
    const fs::path path = write(rock(), "rock");
    vgi::Atlas other = rock();
    other.step *= 1 + 1e-12;
    const TileTree tree = make_tile_tree(other, 256);
    const auto bytes = encode_glb(other, make_tile_mesh(other, tree, 1), {});
    std::ofstream(path / "t/1.glb", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    EXPECT_THAT(faults(checked(path)), HasSubstr("matrix"));
}

TEST(TileTree, ShowsAllChartsFirstAndThenPartsOfAboutTheSizeAskedFor) {
    const vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 64);
    for (const uint32_t triangles : {128u, 500u, 4096u, 1u << 20}) {
        const TileTree tree = make_tile_tree(atlas, triangles);
        const auto valid = tree.validate(atlas);
        ASSERT_TRUE(valid) << valid.error().message;
        uint64_t leaves = 0;
        for (const TileNode& node : tree.nodes) {
            uint64_t count = 0;
            for (const ChartSquare& s : node.squares) count += triangles_of(atlas, s, node.level);
            EXPECT_LE(count, triangles);
            EXPECT_NE(node.children.size(), 1u);
            if (node.children.empty()) leaves += count;
        }
        EXPECT_EQ(leaves, atlas.triangles_at(0));
        EXPECT_EQ(tree.nodes.size() == 1, triangles >= atlas.triangles_at(0));
        EXPECT_TRUE(closing_sides(atlas, tree, 0).empty());
    }
}

TEST(TileErrors, FallFromParentToChildAndBoxesHoldEverySample) {
    const vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 32);
    TileTree tree = make_tile_tree(atlas, 128);
    const auto measures = measure_tiles(atlas, tree, {});
    ASSERT_TRUE(measures);
    for (uint32_t t = 0; t < tree.nodes.size(); ++t) {
        const TileMeasure& m = (*measures)[t];
        for (const uint32_t child : tree.nodes[t].children) EXPECT_LT((*measures)[child].error, m.error);
        EXPECT_EQ(tree.nodes[t].children.empty(), m.error == 0);
        EXPECT_GT(m.source_error, 0);
        for (const TileVertex& v : make_tile_mesh(atlas, tree, t).vertices) {
            for (size_t k = 0; k < 3; ++k) {
                EXPECT_GE(v.position[k], m.box.low[k]);
                EXPECT_LE(v.position[k], m.box.high[k]);
            }
        }
    }
}

// Halves of a slanted square along either diagonal, with a corner that is off by `off`. Were pieces that reach across a
// diagonal quartered until they do not, this would take tens of millions of them.
double farthest_of_halves(double off) {
    const std::array<glm::vec3, 4> corners = {
        glm::vec3(0, 0, 0), {60000, 0, 20000}, {60000, 60000, 50000}, {0, 60000, 30000}};
    const TargetSurface target({corners.begin(), corners.end()}, {0, 1, 2, 0, 2, 3});
    std::vector<SurfacePiece> pieces;
    for (const auto& t : {std::array{0, 1, 3}, std::array{1, 2, 3}}) {
        SurfacePiece piece;
        for (size_t k = 0; k < 3; ++k) {
            piece.corners[k] = corners[static_cast<size_t>(t[k])];
            if (t[k] == 2) piece.corners[k] += off * glm::normalize(glm::dvec3(-1, -1.5, 3));
        }
        piece.bound = 1e9;
        pieces.push_back(piece);
    }
    return farthest_of(std::move(pieces), target, 0, 1e-3);
}
TEST(Farthest, HowFlatFacesAreDividedDoesNotMatter) {
    EXPECT_LE(farthest_of_halves(0), 2e-3);
    EXPECT_NEAR(farthest_of_halves(10), 10, 0.2);
}

TEST(Placement, StandsWhereLongitudeAndLatitudeSay) {
    // Where the equator and the meridian of Greenwich cross, east is y, north is z, up is x.
    const glm::dmat4 here = east_north_up(0, 0, 10);
    EXPECT_NEAR(here[3].x, 6378147, 1e-6);
    EXPECT_NEAR(here[0].y, 1, 1e-12);
    EXPECT_NEAR(here[1].z, 1, 1e-12);
    EXPECT_NEAR(here[2].x, 1, 1e-12);
    // At the pole the distance to the centre is the semi-minor axis.
    EXPECT_NEAR(east_north_up(0, 90, 0)[3].z, 6356752.314245, 1e-5);
    // From EPSG Guidance Note 7-2, method 9602's own example.
    const glm::dmat4 there = east_north_up(2 + 7 / 60.0 + 46.38 / 3600, 53 + 48 / 60.0 + 33.82 / 3600, 73);
    EXPECT_NEAR(there[3].x, 3771793.97, 0.01);
    EXPECT_NEAR(there[3].y, 140253.34, 0.01);
    EXPECT_NEAR(there[3].z, 5124304.35, 0.01);
}

TEST(Placement, AMeshsUpIsUp) {
    EXPECT_EQ(to_tile_axes(UpAxis::y) * glm::dvec4(0, 1, 0, 1), glm::dvec4(0, 0, 1, 1));
    EXPECT_EQ(to_tile_axes(UpAxis::y) * glm::dvec4(0, 0, -1, 1), glm::dvec4(0, 1, 0, 1)) << "north";
    EXPECT_EQ(to_tile_axes(UpAxis::z) * glm::dvec4(1, 2, 3, 1), glm::dvec4(1, 2, 3, 1));
}

}  // namespace
}  // namespace lodestone::tiles
