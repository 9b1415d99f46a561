// Height maps as tiles: the right way up, voids filled or left as holes, the rim open and nothing else.
#include "apps/program.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "fixtures/real_data.h"
#include "tiles/check/closed_cuts.h"
#include "tiles/check/tile_content.h"
#include "tiles/check/tileset_reader.h"

namespace lodestone {
namespace {

constexpr int16_t no_data = -9999;

template <class Number>
void put(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

// A GeoTIFF of 16-bit heights, rows north to south, whose samples are `spacing` metres apart.
std::string geotiff(uint32_t width, uint32_t height, double spacing, const std::vector<int16_t>& samples) {
    constexpr uint16_t of_shorts = 3, of_longs = 4, of_doubles = 12, of_text = 2;
    constexpr uint32_t entries = 12, after = 8 + 2 + 12 * entries + 4;
    const std::string marks = std::to_string(no_data) + '\0';
    const uint32_t at_text = after + 24, at_samples = at_text + static_cast<uint32_t>(marks.size());
    std::string bytes("II*\0\x08\0\0\0", 8);
    put(bytes, static_cast<uint16_t>(entries));
    const auto entry = [&](uint16_t tag, uint16_t type, uint32_t count, uint32_t value) {
        put(bytes, tag), put(bytes, type), put(bytes, count), put(bytes, value);
    };
    entry(256, of_longs, 1, width);
    entry(257, of_longs, 1, height);
    entry(258, of_shorts, 1, 16);
    entry(259, of_shorts, 1, 1);  // not compressed
    entry(262, of_shorts, 1, 1);  // black is low
    entry(273, of_longs, 1, at_samples);
    entry(277, of_shorts, 1, 1);
    entry(278, of_longs, 1, height);
    entry(279, of_longs, 1, 2 * width * height);
    entry(339, of_shorts, 1, 2);  // with signs
    entry(33550, of_doubles, 3, after);
    entry(42113, of_text, static_cast<uint32_t>(marks.size()), at_text);
    put(bytes, uint32_t{0});
    for (const double scale : {spacing, spacing, 0.0}) put(bytes, scale);
    bytes += marks;
    for (const int16_t sample : samples) put(bytes, sample);
    return bytes;
}

class TerrainTilesTest : public ProgramTest {
protected:
    static constexpr int width = 49, height = 33;
    static constexpr double spacing = 10, peak_east = 160, peak_north = 100;  // metres from the middle

    // Hills, a peak in the north-east, and a void of 9 x 7 samples in the middle.
    void make_map() const {
        std::vector<int16_t> samples;
        for (int row = 0; row < height; ++row) {
            for (int column = 0; column < width; ++column) {
                const double east = (column - width / 2) * spacing, north = (height / 2 - row) * spacing;
                const double away = std::hypot(east - peak_east, north - peak_north);
                const double metres =
                    200 * std::exp(-away * away / 3000) + 20 * std::sin(east / 40) * std::cos(north / 50);
                const bool known = std::abs(column - width / 2) > 4 || std::abs(row - height / 2) > 3;
                samples.push_back(known ? static_cast<int16_t>(std::lround(metres)) : no_data);
            }
        }
        std::ofstream(folder_ / "dem.tif", std::ios::binary) << geotiff(width, height, spacing, samples);
    }

    // Calls visit(content) for every leaf.
    void for_leaves(const std::string& folder, const std::function<void(const tiles::TileContent&)>& visit) const {
        const auto set = tiles::read_tileset(folder_ / folder);
        ASSERT_TRUE(set) << set.error().message;
        for (const tiles::ReadTile& tile : set->tiles) {
            if (!tile.children.empty()) continue;
            const auto content = tiles::read_tile_content(tile.content);
            ASSERT_TRUE(content) << content.error().message;
            visit(*content);
        }
    }

    // Places of the rim of the finest tiles, in axes of tiles.
    std::vector<glm::dvec3> rim(const std::string& folder) const {
        tiles::Places places;
        std::vector<glm::dvec3> points;
        tiles::EdgeSum sum;
        for_leaves(folder, [&](const tiles::TileContent& content) {
            std::vector<uint32_t> corners;
            for (const auto& triangle : content.triangles) {
                for (const uint32_t v : triangle) {
                    corners.push_back(places.number(content.positions[v]));
                    if (corners.back() == points.size()) points.push_back(content.point(v));
                }
            }
            sum.add(tiles::border_of(corners));
        });
        std::vector<glm::dvec3> on_rim;
        for (const tiles::BorderEdge& edge : sum.left()) on_rim.push_back(points[tiles::ends_of(edge)[0]]);
        return on_rim;
    }

    // How many of them lie inside of the map, more than a sample from where it ends.
    static size_t inside(const std::vector<glm::dvec3>& places) {
        return static_cast<size_t>(std::ranges::count_if(places, [](const glm::dvec3& p) {
            return std::abs(p.x) < (width / 2 - 1) * spacing && std::abs(p.y) < (height / 2 - 1) * spacing;
        }));
    }
};

TEST_F(TerrainTilesTest, AreTheRightWayUpAndOpenAtTheRimAlone) {
    make_map();
    const json made = printed("tile dem.tif --fill-voids -o terrain --tile-triangles 512 --json");
    EXPECT_GT(made["tiles"], 4);
    const json verified = printed("verify terrain --cuts 100 --measure --json");
    EXPECT_EQ(verified["passed"], true);
    EXPECT_EQ(verified["unmatched_edges"], 0);
    EXPECT_GT(verified["rim_edges"], 50);
    EXPECT_GE(verified["largest_step"], 1);

    glm::dvec3 highest(0, 0, -1e9);
    size_t upwards = 0, all = 0;
    for_leaves("terrain", [&](const tiles::TileContent& content) {
        for (const auto& t : content.triangles) {
            const glm::dvec3 a = content.point(t[0]), b = content.point(t[1]), c = content.point(t[2]);
            upwards += glm::cross(b - a, c - a).z > 0;
            ++all;
            for (const glm::dvec3& p : {a, b, c}) {
                if (p.z > highest.z) highest = p;
            }
        }
    });
    EXPECT_GT(all, 2000u);
    EXPECT_EQ(upwards, all) << "every triangle is seen from the sky";
    EXPECT_NEAR(highest.x, peak_east, spacing);
    EXPECT_NEAR(highest.y, peak_north, spacing);
    EXPECT_NEAR(highest.z, 200, 25);

    const std::vector<glm::dvec3> ends = rim("terrain");
    EXPECT_GT(ends.size(), 100u);
    EXPECT_EQ(inside(ends), 0u) << "the void is filled";
}

TEST_F(TerrainTilesTest, HaveAHoleWhereAVoidIsNotFilled) {
    make_map();
    succeeds("tile dem.tif -o holed --tile-triangles 512");
    EXPECT_EQ(printed("verify holed --cuts 100 --json")["unmatched_edges"], 0);
    EXPECT_GT(inside(rim("holed")), 20u);
}

TEST_F(TerrainTilesTest, StandOnTheEarthWithEastToTheEast) {
    make_map();
    succeeds("tile dem.tif --fill-voids -o terrain --lon 8.5 --lat 46.5 --height 400");
    const json root = json::parse(content_of(folder_ / "terrain/tileset.json"))["root"];
    const auto transform = root["transform"].get<std::array<double, 16>>();
    const auto box = root["boundingVolume"]["box"].get<std::array<double, 12>>();
    EXPECT_NEAR(box[3], width / 2 * spacing, 1);
    EXPECT_NEAR(box[7], height / 2 * spacing, 1);
    // From the Earth's centre, the peak is farther up than the middle of the map is.
    const auto on_earth = [&](double x, double y, double z) {
        glm::dvec3 p(transform[12], transform[13], transform[14]);
        for (size_t k = 0; k < 3; ++k)
            p += glm::dvec3(transform[4 * k], transform[4 * k + 1], transform[4 * k + 2]) * (k == 0   ? x
                                                                                             : k == 1 ? y
                                                                                                      : z);
        return p;
    };
    const glm::dvec3 middle = on_earth(0, 0, 0), peak = on_earth(peak_east, peak_north, 200);
    EXPECT_GT(glm::length(peak) - glm::length(middle), 150);
    EXPECT_GT(std::atan2(peak.y, peak.x), std::atan2(middle.y, middle.x)) << "east";
    EXPECT_GT(peak.z, middle.z) << "north";
}

// The same with real terrain of some three million triangles.
class TerrainTilesLong : public TerrainTilesTest {};

TEST_F(TerrainTilesLong, OfRealHeightsAreClosed) {
    const std::string name = "dem/N46E008.tif";
    const auto map = fixtures::real_data(name);
    if (!map) GTEST_SKIP() << fixtures::missing_data_note(name);
    const Ended made = run("tile '" + map->string() + "' --fill-voids -o terrain");
    ASSERT_EQ(made.code, 0) << made.err;
    const json verified = printed("verify terrain --cuts 1000 --json");
    EXPECT_EQ(verified["passed"], true);
    EXPECT_EQ(verified["unmatched_edges"], 0);
}

}  // namespace
}  // namespace lodestone
