// Tiles of an atlas with leaves: the finest ones are the source's triangles.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <set>

#include "fixtures/meshes.h"
#include "fixtures/written_glbs.h"
#include "mesh/distance/distance.h"
#include "tiles/check/check.h"
#include "tiles/check/tile_content.h"
#include "tiles/check/tileset_reader.h"
#include "tiles/cut_surface.h"
#include "tiles/tile_errors.h"
#include "tiles/tile_file.h"
#include "tiles/tileset.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/extract/extract.h"

namespace lodestone::tiles {
namespace {

namespace fs = std::filesystem;

const vgi::Atlas& rock() {
    static const vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 32, 8, true);
    return atlas;
}

// Without the leaves of squares that `drop` names.
template <class Drop>
vgi::Atlas without(vgi::Atlas atlas, Drop&& drop) {
    ByteLists parts;
    uint32_t first = 0;
    for (uint32_t i = 0; i < atlas.leaves.size(); ++i) {
        vgi::Leaf& leaf = atlas.leaves[i];
        const uint32_t end = leaf.parts_end;
        for (uint32_t p = first; p < end && !drop(i); ++p) parts.add(atlas.leaf_parts[p]);
        if (drop(i)) leaf.error = 0;
        leaf.parts_end = static_cast<uint32_t>(parts.size());
        first = end;
    }
    atlas.leaf_parts = std::move(parts);
    return atlas;
}

using Corners = std::array<std::array<float, 3>, 3>;

// Triangles by where their corners are, each from the lowest one.
void add(std::multiset<Corners>& triangles, Corners corners) {
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    triangles.insert(corners);
}

// Those of leaf tiles; object units.
std::multiset<Corners> shown_by_leaves(const TiledSurface& surface) {
    std::multiset<Corners> shown;
    for (size_t t = 0; t < surface.meshes.size(); ++t) {
        if (!surface.tree.nodes[t].children.empty()) continue;
        const TileMesh& mesh = surface.meshes[t];
        EXPECT_EQ(mesh.surface_triangles, mesh.triangles.size()) << "nothing is left to be closed";
        for (const auto& triangle : mesh.triangles) {
            Corners corners;
            for (size_t k = 0; k < 3; ++k) {
                const glm::vec3 p(surface.atlas.leaf_point(mesh.vertices[triangle[k]].position));
                corners[k] = {p.x, p.y, p.z};
            }
            add(shown, corners);
        }
    }
    return shown;
}

void expect_leaves_are_the_source(const vgi::Atlas& atlas) {
    const TriMesh source = extract_leaves(atlas);
    std::multiset<Corners> wanted;
    for (const Triangle& t : source.triangles) {
        Corners corners;
        for (size_t k = 0; k < 3; ++k) {
            const glm::vec3& p = source.positions[source.wedge_vertex[t[k]]];
            corners[k] = {p.x, p.y, p.z};
        }
        add(wanted, corners);
    }
    EXPECT_EQ(shown_by_leaves(tiled(atlas)), wanted);
}

TEST(LeafTiles, ShowTheTrianglesOfTheSource) {
    EXPECT_EQ(std::ranges::count_if(rock().leaves, [](const vgi::Leaf& leaf) { return leaf.error == 0; }), 0);
    expect_leaves_are_the_source(rock());
}

// Beside samples they end in samples, as leaves that are drawn do.
TEST(LeafTiles, ShowSamplesWhereThereAreNoLeaves) {
    const auto drops = [](uint32_t i) { return i % 5 < 2; };
    const vgi::Atlas some = without(rock(), drops);
    expect_leaves_are_the_source(some);
    for (const vgi::Atlas& atlas : {some, without(rock(), [](uint32_t i) { return i < 7; })}) {
        const TiledSurface surface = tiled(atlas);
        Places places;
        Random random(5);
        for (int i = 0; i < 100; ++i) {
            EdgeSum sum;
            for (const uint32_t tile : random_cut(surface.tree, random))
                sum.add(border_of(corners_of(surface.meshes[tile], places)));
            EXPECT_EQ(sum.left().size(), 0u);
        }
    }
}

TEST(LeafTiles, HaveTheAttributesOfTheSource) {
    const vgi::Atlas atlas = vgi::small_atlas(fixtures::repaired(Shape::vase, 3000), 32, 8, true);
    ASSERT_FALSE(atlas.uvs.empty());
    std::set<std::pair<LatticePoint, std::array<uint16_t, 2>>> of_leaves;
    for (uint32_t p = 0; p < atlas.leaf_part_count(); ++p) {
        for (const vgi::LeafVertex& v : decoded_leaf(atlas, p).vertices)
            of_leaves.insert({v.position, v.attributes.uv});
    }
    const TiledSurface surface = tiled(atlas);
    size_t vertices = 0;
    for (size_t t = 0; t < surface.meshes.size(); ++t) {
        if (!surface.tree.nodes[t].children.empty()) continue;
        for (const TileVertex& v : surface.meshes[t].vertices) {
            EXPECT_TRUE(of_leaves.contains({v.position, v.uv}));
            ++vertices;
        }
    }
    EXPECT_GT(vertices, 1500u);
}

class LeafTilesOnDisk : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_leaf_tiles_" + std::to_string(getpid()));
    }
    void TearDown() override {
        written_.check();
        fs::remove_all(folder_);
    }
    // Khronos' validator sees it, too.
    fs::path write(const vgi::Atlas& atlas, TilesetOptions options) {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        const auto report = write_tileset(atlas, folder_, options, {});
        EXPECT_TRUE(report) << report.error().message;
        written_.keep(folder_);
        return folder_;
    }
    fs::path folder_;
    fixtures::WrittenGlbs written_;
};

// Places are what they are in memory, bit for bit, whatever else is in a tile.
TEST_F(LeafTilesOnDisk, EveryEncodingHoldsPlacesExactly) {
    const TileTree tree = make_tile_tree(rock(), 512);
    fs::create_directories(folder_);
    int whole = 0, fractions = 0;
    for (uint32_t tile = 0; tile < tree.nodes.size(); ++tile) {
        const TileMesh mesh = make_tile_mesh(rock(), tree, tile);
        std::multiset<std::array<float, 3>> wanted;
        for (const TileVertex& v : mesh.vertices) {
            const glm::vec3 p(in_steps(rock(), v.position));
            wanted.insert({p.x, p.y, p.z});
        }
        for (const Encoding encoding : {Encoding::meshopt, Encoding::quantised, Encoding::plain}) {
            const auto bytes = encode_glb(rock(), mesh, {encoding, UpAxis::y, {}});
            const auto content = read_back(bytes, folder_);
            ASSERT_TRUE(content) << content.error().message;
            EXPECT_EQ(std::multiset(content->positions.begin(), content->positions.end()), wanted);
            EXPECT_EQ(content->triangles.size(), mesh.triangles.size());
            const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
            (text.find("EXPONENTIAL") == std::string::npos ? whole : fractions) += encoding == Encoding::meshopt;
        }
    }
    EXPECT_GT(whole, 0) << "the root closes nothing";
    EXPECT_GT(fractions, 10);
}

TEST_F(LeafTilesOnDisk, ErrorsAreDistancesToTheSource) {
    for (const TriMesh& mesh : {fixtures::repaired(Shape::rock, 4000), fixtures::repaired(Shape::terrain, 4000)}) {
        const vgi::Atlas atlas = vgi::small_atlas(mesh, 32, 8, true);
        TilesetOptions options;
        options.tile_triangles = 1024;
        CheckOptions checks;
        checks.measure = true;
        const auto check = check_tileset(write(atlas, options), checks, {});
        ASSERT_TRUE(check);
        for (const CheckedPoint& point : check->points)
            EXPECT_TRUE(point.passed) << point.name << ": " << point.message;
        EXPECT_EQ(check->unmatched_edges, 0u);
        EXPECT_GE(check->least_ratio, 0.999);
        EXPECT_LE(check->largest_ratio, 1.5);
    }
}

// What leaf tiles show, as it is written.
TEST_F(LeafTilesOnDisk, LieOnTheSource) {
    const TriMesh source = fixtures::repaired(Shape::rock, 4000);
    const auto set = read_tileset(write(rock(), {}));
    ASSERT_TRUE(set);
    TriMesh shown;
    for (const ReadTile& tile : set->tiles) {
        if (!tile.children.empty()) continue;
        const auto content = read_tile_content(tile.content);
        ASSERT_TRUE(content);
        const auto first = static_cast<uint32_t>(shown.positions.size());
        for (uint32_t v = 0; v < content->positions.size(); ++v) {
            const glm::dvec3 p = content->point(v);
            shown.positions.emplace_back(p.x, p.z, -p.y);  // to the mesh's axes
        }
        for (const auto& t : content->triangles) shown.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
    shown.set_identity_wedges();
    const Box box = bounding_box(source.positions);
    EXPECT_LE(surface_distance(shown, source).max(), 1e-6 * glm::distance(box.low, box.high));
}

}  // namespace
}  // namespace lodestone::tiles
