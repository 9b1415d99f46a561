// `tile --clip`: tilesets of pieces of one mesh, each made by itself, close with each other.
#include "apps/program.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/random.h"
#include "fixtures/real_data.h"
#include "mesh/topology.h"
#include "tiles/check/closed_cuts.h"
#include "tiles/check/tile_content.h"
#include "tiles/check/tileset_reader.h"

namespace lodestone {
namespace {

// Several tilesets shown together, each edge told by the numbers of its places in metres, to the last bit.
class Together {
public:
    explicit Together(const std::vector<fs::path>& folders) {
        for (const fs::path& folder : folders) read(folder);
        tiles::EdgeSum leaves;
        for (const Set& set : sets_) {
            for (size_t i = 0; i < set.tiles.size(); ++i) {
                if (set.tiles[i].children.empty()) leaves.add(set.borders[i]);
            }
        }
        rim_ = leaves.left();
    }

    struct Found {
        uint64_t unmatched = 0;
        uint32_t largest_step = 0;  // levels between tiles of a cut
    };
    // Random cuts of all tilesets at once.
    Found of_random_cuts(int cuts) const {
        Found found;
        Random random(3);
        for (int i = 0; i < cuts; ++i) {
            tiles::EdgeSum sum;
            uint32_t finest = ~0u, coarsest = 0;
            for (const Set& set : sets_) {
                std::vector<uint32_t> cut;
                random_cut(set, 0, random.uniform(0.1, 0.95), random, cut);
                for (const uint32_t tile : cut) {
                    sum.add(set.borders[tile]);
                    finest = std::min(finest, set.tiles[tile].level);
                    coarsest = std::max(coarsest, set.tiles[tile].level);
                }
            }
            sum.take(rim_);
            found.unmatched += sum.left().size();
            found.largest_step = std::max(found.largest_step, coarsest - finest);
        }
        return found;
    }
    // Edges that the leaves of all leave over.
    size_t rim_edges() const { return rim_.size(); }
    // Of these, those with both ends where `on` holds.
    template <class On>
    size_t rim_edges_where(On&& on) const {
        return static_cast<size_t>(std::ranges::count_if(rim_, [&](const tiles::BorderEdge& edge) {
            const auto [a, b] = tiles::ends_of(edge);
            return on(points_[a]) && on(points_[b]);
        }));
    }
    // The longest of those with both ends where `on` holds.
    template <class On>
    double longest_rim_edge_where(On&& on) const {
        double longest = 0;
        for (const tiles::BorderEdge& edge : rim_) {
            const auto [a, b] = tiles::ends_of(edge);
            if (on(points_[a]) && on(points_[b])) longest = std::max(longest, glm::distance(points_[a], points_[b]));
        }
        return longest;
    }
    // How many matrices of nodes there are.
    size_t matrices() const { return matrices_.size(); }

private:
    struct Set {
        std::vector<tiles::ReadTile> tiles;
        std::vector<std::vector<tiles::BorderEdge>> borders;
    };
    void read(const fs::path& folder) {
        const auto set = tiles::read_tileset(folder);
        ASSERT_TRUE(set) << set.error().message;
        Set& into = sets_.emplace_back();
        into.tiles = set->tiles;
        for (const tiles::ReadTile& tile : into.tiles) {
            into.borders.emplace_back();
            if (tile.content.empty()) continue;
            const auto content = tiles::read_tile_content(tile.content);
            ASSERT_TRUE(content) << content.error().message;
            matrices_.insert(content->matrix);
            std::vector<uint32_t> corners;
            for (const auto& triangle : content->triangles) {
                for (const uint32_t v : triangle) corners.push_back(number(content->point(v)));
            }
            into.borders.back() = tiles::border_of(corners);
        }
    }
    uint32_t number(const glm::dvec3& p) {
        const auto [at, fresh] = numbers_.try_emplace(std::array{p.x, p.y, p.z}, static_cast<uint32_t>(points_.size()));
        if (fresh) points_.push_back(p);
        return at->second;
    }
    static void random_cut(const Set& set, uint32_t tile, double share, Random& random, std::vector<uint32_t>& cut) {
        const tiles::ReadTile& t = set.tiles[tile];
        if (t.children.empty() || (!t.content.empty() && random.unit() >= share)) {
            cut.push_back(tile);
            return;
        }
        for (const uint32_t child : t.children) random_cut(set, child, share, random, cut);
    }

    std::vector<Set> sets_;
    std::vector<glm::dvec3> points_;
    std::map<std::array<double, 3>, uint32_t> numbers_;
    std::set<std::array<double, 16>> matrices_;
    std::vector<tiles::BorderEdge> rim_;
};

class ClipTest : public ProgramTest {
protected:
    // Tiles a mesh in pieces, one for each text of options, each checked by itself.
    Together tiled(const std::string& mesh, const std::vector<std::string>& pieces,
                   const std::string& options = "--tile-triangles 128",
                   const std::string& checks = "--cuts 20 --measure") const {
        std::vector<fs::path> folders;
        for (size_t i = 0; i < pieces.size(); ++i) {
            const std::string name = "piece" + std::to_string(i);
            const Ended made = run("tile " + mesh + " -o " + name + " " + options + " " + pieces[i]);
            EXPECT_EQ(made.code, 0) << pieces[i] << ": " << made.err;
            const json verified = printed("verify " + name + " " + checks + " --json");
            EXPECT_EQ(verified["passed"], true) << pieces[i] << verified.dump(1);
            folders.push_back(folder_ / name);
        }
        return Together(folders);
    }
};

TEST_F(ClipTest, TwoPiecesOfAClosedSurfaceAreClosed) {
    succeeds("generate rock --triangles 6000 --seed 2 -o rock.ply");
    const Together both = tiled("rock.ply", {"--clip 'x<0.1'", "--clip 'x>0.1'"});
    EXPECT_EQ(both.rim_edges(), 0u);
    const auto found = both.of_random_cuts(200);
    EXPECT_EQ(found.unmatched, 0u);
    EXPECT_GE(found.largest_step, 2u);
}

// The line ends where the rim does, which has samples of its own there.
bool at_line(const glm::dvec3& p) { return std::abs(p.x - 0.1) < 1e-3 && std::abs(p.y) < 0.97; }

TEST_F(ClipTest, PiecesOfTerrainAreOpenAtItsOwnRimAlone) {
    succeeds("generate terrain --triangles 6000 --seed 2 -o t.ply");
    const Together both = tiled("t.ply", {"--clip 'x<0.1'", "--clip 'x>0.1'"});
    EXPECT_EQ(both.of_random_cuts(200).unmatched, 0u);
    EXPECT_GT(both.rim_edges(), 100u);
    EXPECT_EQ(both.rim_edges_where(at_line), 0u);
    EXPECT_GT(Together({folder_ / "piece0"}).rim_edges_where(at_line), 50u) << "one piece alone ends there";
}

// Four pieces meet in a point, and lines are slanted.
TEST_F(ClipTest, FourPiecesMeetInAPoint) {
    succeeds("generate rock --triangles 2000 --seed 5 -o rock.ply");
    for (const auto& [a, b] :
         {std::pair<std::string, std::string>("-1,-0.9,1,1.1", "1,1.1,-1,-0.9"), {"x<0.05", "x>0.05"}}) {
        const std::string north = " --clip=-1,0.3,1,-0.2", south = " --clip=1,-0.2,-1,0.3";
        const Together four = tiled("rock.ply", {"--clip='" + a + "'" + north, "--clip='" + b + "'" + north,
                                                 "--clip='" + a + "'" + south, "--clip='" + b + "'" + south});
        EXPECT_EQ(four.rim_edges(), 0u) << a;
        EXPECT_EQ(four.of_random_cuts(100).unmatched, 0u) << a;
    }
}

// The plane goes through vertices, along edges and through whole triangles.
TEST_F(ClipTest, PlanesThroughVerticesAndFacesCutAsWell) {
    std::ofstream obj(folder_ / "box.obj");
    for (const int z : {0, 1}) {
        for (const int y : {0, 1}) {
            for (const int x : {0, 1, 2}) obj << "v " << x << " " << y << " " << z << "\n";
        }
    }
    // Vertex 1 + x + 3 y + 6 z. At x = 1 there are vertices, and edges along the plane.
    const auto quad = [&](int a, int b, int c, int d) {
        obj << "f " << a << " " << b << " " << c << "\nf " << a << " " << c << " " << d << "\n";
    };
    quad(1, 4, 5, 2), quad(2, 5, 6, 3);      // z = 0, seen from below
    quad(7, 8, 11, 10), quad(8, 9, 12, 11);  // z = 1
    quad(1, 2, 8, 7), quad(2, 3, 9, 8);      // y = 0
    quad(4, 10, 11, 5), quad(5, 11, 12, 6);  // y = 1
    quad(1, 7, 10, 4), quad(3, 6, 12, 9);    // x = 0 and x = 2
    obj.close();
    const Together both = tiled("box.obj", {"--clip 'x<1'", "--clip 'x>1'"}, "--tile-triangles 128", "--cuts 20");
    EXPECT_EQ(both.rim_edges(), 0u);
    EXPECT_EQ(both.of_random_cuts(20).unmatched, 0u);
    EXPECT_EQ(run("tile box.obj -o all --clip 'x<2'").code, 0) << "all of it, with the face in the plane";
    EXPECT_EQ(Together({folder_ / "all"}).rim_edges(), 0u);
    fails("tile box.obj -o none --clip 'x>2'", 3, "nothing of the mesh is left");
}

TEST_F(ClipTest, HolesAcrossTheLineStayHoles) {
    succeeds("generate terrain --triangles 6000 --seed 3 -o whole.obj");
    // Without the triangles of two discs, one on the line.
    std::ifstream in(folder_ / "whole.obj");
    std::ofstream out(folder_ / "holed.obj");
    std::vector<glm::dvec3> points(1);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string what;
        words >> what;
        if (what == "v") {
            glm::dvec3 p(0);
            words >> p.x >> p.y >> p.z;
            points.push_back(p);
        }
        bool dropped = false;
        if (what == "f") {
            for (std::string corner; words >> corner;) {
                const glm::dvec3& p = points[std::stoul(corner)];
                dropped |= std::hypot(p.x - 0.12, p.z - 0.1) < 0.15 || std::hypot(p.x + 0.5, p.z + 0.5) < 0.1;
            }
        }
        if (!dropped) out << line << "\n";
    }
    out.close();
    const Together both = tiled("holed.obj", {"--up y --clip 'x<0.1'", "--up y --clip 'x>0.1'"});
    EXPECT_EQ(both.of_random_cuts(100).unmatched, 0u);
    EXPECT_EQ(both.rim_edges_where(
                  [](const glm::dvec3& p) { return at_line(p) && std::hypot(p.x - 0.12, p.y + 0.1) > 0.17; }),
              0u);
}

// Where the lattice of the whole is fine enough, all pieces have one matrix, so that a viewer rounds them alike; where
// it is not, places on the line are the same numbers nevertheless.
TEST_F(ClipTest, PiecesHaveOneLatticeAsLongAsThatIsFineEnough) {
    succeeds("generate rock --triangles 1500 --seed 2 -o rock.ply");
    EXPECT_EQ(tiled("rock.ply", {"--clip 'x<0.1'", "--clip 'x>0.1'"}).matrices(), 1u);
    // A rock a thousandth of the whole, cut in the middle.
    succeeds("generate rock --triangles 1500 --seed 2 -o small.obj");
    std::ofstream(folder_ / "small.obj", std::ios::app) << "v 2000 0 0\nv 2000 1 0\nv 2000 0 1\nf -3 -2 -1\n";
    const Together both = tiled("small.obj", {"--up y --clip 'x<0.1'", "--up y --clip 'x>0.1' --clip 'x<100'"});
    EXPECT_GE(both.matrices(), 2u);
    EXPECT_EQ(both.rim_edges(), 0u);
    EXPECT_EQ(both.of_random_cuts(50).unmatched, 0u);
}

TEST_F(ClipTest, PiecesStandInOneFrame) {
    succeeds("generate terrain --triangles 800 --seed 2 -o t.ply");
    const auto root = [&](const char* clip) {
        succeeds(std::string("tile t.ply -o t --lon 8 --lat 47 --clip ") + clip);
        return json::parse(content_of(folder_ / "t/tileset.json"))["root"];
    };
    const json west = root("'x<0'"), east = root("'x>0'");
    EXPECT_EQ(west["transform"], east["transform"]);
    EXPECT_NE(west["boundingVolume"], east["boundingVolume"]);
}

TEST_F(ClipTest, WhatCannotBeCutIsRefusedInOneLine) {
    succeeds("generate rock --triangles 800 --seed 2 -o rock.ply");
    succeeds("bake rock.ply -o rock.lode --backends vgi --clusters 8 --resolution 9");
    fails("tile rock.lode -o x --clip 'x<0'", 2, "give the file of the mesh");
    for (const char* wrong : {"x", "x<", "x<1,2", "w<1", "x=1", "1,2,3", "1,2,1,2", "x<nan", "1,2,3,4,5", "x<1e999"})
        fails("tile rock.ply -o x --clip='" + std::string(wrong) + "'", 2, "must be x<NUMBER");
    fails("tile rock.ply -o x --clip 'x<-50'", 3, "nothing of the mesh is left");
    fails("tile --clip 'x<0' --clip 'x>0' rock.ply -o x", 3, "nothing of the mesh is left");
    EXPECT_FALSE(fs::exists(folder_ / "x"));
}

class ClipLong : public ClipTest {
protected:
    // Cut in the middle, across the longest axis.
    void expect_pieces_close(const std::string& name, const std::string& options, int cuts) const {
        SCOPED_TRACE(name);
        const auto path = fixtures::real_data(name);
        if (!path) GTEST_SKIP() << fixtures::missing_data_note(name);
        const auto mesh = fixtures::repaired_real_mesh(name);
        ASSERT_TRUE(mesh) << mesh.error().message;
        const Box box = bounding_box(mesh->positions);
        const int axis = box.longest_axis();
        const std::string at = std::to_string(box.centre()[axis]), letter(1, static_cast<char>('x' + axis));
        const Together both =
            tiled("'" + path->string() + "' --up z",
                  {"--clip '" + letter + "<" + at + "'", "--clip '" + letter + ">" + at + "'"}, options, "--cuts 20");
        EXPECT_EQ(both.of_random_cuts(cuts).unmatched, 0u);
        if (topology_of(*mesh).closed()) { EXPECT_EQ(both.rim_edges(), 0u); }
        // Where the line ends at a rim of the source, samples of either piece are rounded otherwise than it is.
        const double within = 1e-4 * static_cast<double>(box.diagonal()), middle = std::stod(at);
        EXPECT_LT(both.longest_rim_edge_where([&](const glm::dvec3& p) { return std::abs(p[axis] - middle) < within; }),
                  8 * within);
        std::cout << name << " at " << letter << " = " << at << ": " << both.rim_edges() << " edges of rims, "
                  << both.rim_edges_where([&](const glm::dvec3& p) { return std::abs(p[axis] - middle) < within; })
                  << " of them at the line, the longest of these "
                  << both.longest_rim_edge_where([&](const glm::dvec3& p) {
                         return std::abs(p[axis] - middle) < within;
                     }) / static_cast<double>(box.diagonal())
                  << " of the diagonal\n";
    }
};

TEST_F(ClipLong, PiecesOfScansAreClosed) {
    for (const char* name :
         {"scans/armadillo.obj", "scans/horse.ply", "scans/igea.ply", "scans/laurana.ply", "scans/stanford-bunny.obj",
          "scans/falconstatue_boundary.obj", "scans/turbineblade.ply", "nasty/elephant-with-holes.off",
          "nasty/bun_zipper_res3.ply", "nasty/cow.off", "nasty/pig.stl", "nasty/brain.ply"})
        expect_pieces_close(name, "--tile-triangles 512", 200);
}

TEST_F(ClipLong, PiecesOfRealTerrainAreClosed) { expect_pieces_close("dem/N46E008.tif", "--fill-voids", 1000); }

}  // namespace
}  // namespace lodestone
