// Density grids of .vdb files: what is read, and how what cannot be read is refused.
#include "volume/vdb/vdb_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>

#include "base/random.h"

#ifdef LODESTONE_WITH_OPENVDB
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#endif

namespace lodestone::volume {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

#ifndef LODESTONE_WITH_OPENVDB

TEST(Vdb, IsRefusedWhereTheProgramWasBuiltWithoutOpenVdb) {
    EXPECT_FALSE(reads_vdb());
    const auto grid = read_vdb("smoke.vdb");
    ASSERT_FALSE(grid);
    EXPECT_EQ(grid.error().fault, Fault::format);
    EXPECT_THAT(grid.error().message, HasSubstr("smoke.vdb: the program was built without OpenVDB"));
}

#else

using openvdb::Coord;
using openvdb::FloatGrid;

class VdbTest : public testing::Test {
protected:
    VdbTest() : path_(fs::path(testing::TempDir()) / ("vdb-test-" + std::to_string(getpid()) + ".vdb")) {
        openvdb::initialize();
    }
    ~VdbTest() override { fs::remove(path_); }

    void write(const openvdb::GridPtrVec& grids) const {
        openvdb::io::File file(path_.string());
        file.write(grids);
        file.close();
    }
    std::string content() const {
        std::ifstream in(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void write_text(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }

    // The grid, with the line that it is refused with.
    std::string refused(const openvdb::GridBase::Ptr& grid, const std::string& name = "",
                        const GridLimits& limits = {}) {
        write({grid});
        return refused(name, limits);
    }
    std::string refused(const std::string& name = "", const GridLimits& limits = {}) const {
        const auto read = read_vdb(path_, name, limits);
        EXPECT_FALSE(read) << "was read";
        if (read) return "";
        const std::string& line = read.error().message;
        EXPECT_EQ(read.error().fault, Fault::format) << line;
        EXPECT_TRUE(line.starts_with(path_.string() + ": ")) << line;
        EXPECT_EQ(line.find('\n'), std::string::npos) << line;
        return line.substr(std::min(line.size(), path_.string().size() + 2));
    }

    fs::path path_;
};

FloatGrid::Ptr fog(const char* name = "density") {
    auto grid = FloatGrid::create(0);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setName(name);
    return grid;
}

// Some voxels, all different, around a place.
FloatGrid::Ptr specks(const Coord& around, int count = 200) {
    auto grid = fog();
    auto into = grid->getAccessor();
    Random random(5);
    for (int i = 0; i < count; ++i) {
        const auto away = [&] { return static_cast<int>(random.uniform(-30, 30)); };
        into.setValue(around.offsetBy(away(), away(), away()), static_cast<float>(random.uniform(0.1, 3)));
    }
    return grid;
}

// At random places of object space, both are the same: OpenVDB's own sampling, by the grid's accessor, is the
// reference.
void expect_equal(const DensityGrid& ours, const FloatGrid& theirs, const openvdb::CoordBBox& box) {
    ASSERT_TRUE(ours.validate()) << ours.validate().error().message;
    const auto from = theirs.getConstAccessor();
    const glm::mat4 back = glm::inverse(ours.voxel_to_object);
    Random random(9);
    double sum = 0;
    for (int i = 0; i < 20000; ++i) {
        const openvdb::Vec3d index(random.uniform(box.min().x() - 3, box.max().x() + 3),
                                   random.uniform(box.min().y() - 3, box.max().y() + 3),
                                   random.uniform(box.min().z() - 3, box.max().z() + 3));
        const Coord low = Coord::floor(index);
        double expected = 0;
        for (int k = 0; k < 8; ++k) {
            double weight = 1;
            for (int a = 0; a < 3; ++a) {
                const double f = index[a] - low[a];
                weight *= (k >> a & 1) != 0 ? f : 1 - f;
            }
            expected += weight * double(from.getValue(low.offsetBy(k & 1, k >> 1 & 1, k >> 2)));
        }
        const openvdb::Vec3d world = theirs.transform().indexToWorld(index);
        const glm::vec3 place(back * glm::vec4(world.x(), world.y(), world.z(), 1));
        ASSERT_NEAR(ours.at(place), expected, 1e-3 * double(ours.most)) << index;
        sum += expected;
    }
    EXPECT_GT(sum, 0);
}

TEST_F(VdbTest, IsWhatOpenVdbSaysItIsWhereverItLies) {
    EXPECT_TRUE(reads_vdb());
    for (const Coord& around : {Coord(0, 0, 0), Coord(1000, -500, 77), Coord(-3, 5000, -4097)}) {
        const auto grid = specks(around);
        // No axis is as long as another, and none stays where it was.
        openvdb::math::Mat4d map(0.1, 0.02, 0.0, 0.0, 0.0, 0.01, 0.3, 0.0, -0.2, 0.0, 0.05, 0.0, 0.4, -0.2, 7.0, 1.0);
        grid->setTransform(openvdb::math::Transform::createLinearTransform(map));
        write({grid});
        const auto read = read_vdb(path_);
        ASSERT_TRUE(read) << read.error().message;
        expect_equal(*read, *grid, grid->evalActiveVoxelBoundingBox());
    }
}

// An arm along each axis, each of its own length and density: nothing is swapped or mirrored.
TEST_F(VdbTest, KeepsItsAxesApart) {
    auto grid = fog();
    auto into = grid->getAccessor();
    for (int i = 0; i < 40; ++i) into.setValue({i, 0, 0}, 1);
    for (int i = 1; i < 20; ++i) into.setValue({0, i, 0}, 2);
    for (int i = 1; i < 10; ++i) into.setValue({0, 0, -i}, 4);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    write({grid});
    const auto read = read_vdb(path_);
    ASSERT_TRUE(read) << read.error().message;
    const auto at = [&](const glm::vec3& place) {
        return read->at(glm::vec3(glm::inverse(read->voxel_to_object) * glm::vec4(place, 1)));
    };
    EXPECT_NEAR(at({19.5f, 0, 0}), 1, 1e-3f);
    EXPECT_NEAR(at({0, 9.5f, 0}), 2, 1e-3f);
    EXPECT_NEAR(at({0, 0, -4.5f}), 4, 1e-3f);
    for (const glm::vec3& empty : {glm::vec3(-1, 0, 0), glm::vec3(0, -1, 0), glm::vec3(0, 0, 1), glm::vec3(0, 12, 0)})
        EXPECT_EQ(at(empty), 0);
    EXPECT_EQ(read->last - read->first, glm::uvec3(39, 19, 9));
    EXPECT_EQ(read->most, 4);
}

TEST_F(VdbTest, OfTilesIsReadAsIfEachVoxelWereThere) {
    auto grid = fog();
    grid->fill({Coord(0, 0, 0), Coord(127, 127, 127)}, 0.5f);  // a tile of the level above leaves
    grid->tree().setValue(Coord(200, 5, 6), 1.0f);
    ASSERT_LT(grid->tree().leafCount(), 10u);
    write({grid});
    const auto read = read_vdb(path_);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->block_count(), 16u * 16 * 16 + 1);
    expect_equal(*read, *grid, grid->evalActiveVoxelBoundingBox());
}

TEST_F(VdbTest, IsChosenByItsName) {
    auto heat = fog("temperature"), density = fog(), nameless = fog("");
    heat->tree().setValue({0, 0, 0}, 7.0f);
    density->tree().setValue({0, 0, 0}, 3.0f);
    auto speed = openvdb::Vec3SGrid::create();
    speed->setName("v");
    speed->tree().setValue({0, 0, 0}, openvdb::Vec3s(1, 2, 3));
    write({speed, heat, density});
    EXPECT_EQ(read_vdb(path_)->most, 3);
    EXPECT_EQ(read_vdb(path_, "temperature")->most, 7);
    EXPECT_THAT(refused("smoke"), HasSubstr("has no grid 'smoke'; it has: density, temperature, v"));
    EXPECT_THAT(refused("v"), HasSubstr("grid 'v' has values of type vec3s; densities are floats"));
    write({speed, heat});
    EXPECT_EQ(read_vdb(path_)->most, 7) << "the first of floats where none is named density";
    write({speed});
    EXPECT_THAT(refused(), HasSubstr("has no grid of floats; it has: v"));
    auto evil = fog("a\nb\x1b[31m");
    write({evil});
    EXPECT_THAT(refused("density"), HasSubstr("has no grid 'density'; it has: a b"));
}

TEST_F(VdbTest, ThatIsNoFogIsRefusedByWhatItIs) {
    auto level = specks({0, 0, 0});
    level->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_THAT(refused(level), HasSubstr("is a level set, not a fog volume"));
    EXPECT_THAT(refused(fog()), HasSubstr("grid 'density' is empty"));
    auto zero = fog();
    zero->tree().setValue({1, 2, 3}, 0.0f);
    EXPECT_THAT(refused(zero), HasSubstr("is empty"));
    auto below = specks({0, 0, 0});
    below->tree().setValue({3, 2, 1}, -0.5f);
    EXPECT_THAT(refused(below), HasSubstr("has values below 0"));
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        auto bad = specks({0, 0, 0});
        bad->tree().setValue({3, 2, 1}, value);
        EXPECT_THAT(refused(bad), HasSubstr("has values that are no numbers"));
    }
    auto everywhere = FloatGrid::create(0.25f);
    everywhere->setName("density");
    everywhere->tree().setValue({1, 2, 3}, 1.0f);
    EXPECT_THAT(refused(everywhere), HasSubstr("is 0.250000 outside"));
    auto frustum = specks({0, 0, 0});
    frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(100)), 0.5, 10));
    EXPECT_THAT(refused(frustum), HasSubstr("has a frustum for a map"));
    auto whole = openvdb::Int32Grid::create();
    whole->setName("density");
    whole->tree().setValue({1, 2, 3}, 1);
    EXPECT_THAT(refused(whole), HasSubstr("grid 'density' has values of type int32; densities are floats"));
}

TEST_F(VdbTest, ThatIsTooLargeIsRefusedByTheLimit) {
    GridLimits few;
    few.blocks = 10;
    EXPECT_THAT(refused(specks({0, 0, 0}), "", few),
                HasSubstr("has 11 or more blocks of 8^3 voxels; the limit is 10; resample it"));
    GridLimits narrow;
    narrow.side = 32;
    EXPECT_THAT(refused(specks({0, 0, 0}), "", narrow), HasSubstr("voxels across; the limit is 32"));
    GridLimits small;
    small.file_bytes = 100;
    EXPECT_THAT(refused(specks({0, 0, 0}), "", small), HasSubstr("bytes; the limit is 100"));
    auto wide = fog();
    wide->tree().setValue({0, 0, 0}, 1.0f);
    wide->tree().setValue({0, 2000000000, 0}, 1.0f);
    EXPECT_THAT(refused(wide), HasSubstr("or more voxels across; the limit is 2048"));
    // A tile of 4096^3 voxels takes a few bytes of the file.
    auto huge = fog();
    huge->fill({Coord(0, 0, 0), Coord(4095, 4095, 4095)}, 1.0f);
    ASSERT_EQ(huge->tree().leafCount(), 0u);
    EXPECT_THAT(refused(huge), HasSubstr("the limit is"));
    EXPECT_LT(fs::file_size(path_), 100000u);
}

// A copy of a process that uses TBB has its locks as they are at that moment, held by threads that it does not have,
// and waits for ever.
TEST_F(VdbTest, IsReadWithoutACopyOfTheProcess) {
    static int copies = 0;
    ASSERT_EQ(pthread_atfork([] { ++copies; }, nullptr, nullptr), 0);
    write({specks({0, 0, 0})});
    EXPECT_TRUE(read_vdb(path_));
    EXPECT_EQ(copies, 0);
}

TEST_F(VdbTest, NamesThatNoGridHasAreRefused) {
    write({specks({0, 0, 0})});
    for (const std::string& name : {std::string("density\0x", 9), std::string(200000, 'x')})
        EXPECT_THAT(refused(name), HasSubstr("has no grid of such a name"));
}

// The limit is the caller's own; going beyond it would end the process.
TEST_F(VdbTest, IsRefusedWhereTheCallerMayNotHaveSuchFiles) {
    write({specks({0, 0, 0})});
    rlimit usual{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &usual), 0);
    const rlimit little{1000, usual.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
    const auto grid = read_vdb(path_);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &usual), 0);
    ASSERT_FALSE(grid);
    EXPECT_EQ(grid.error().fault, Fault::machine);
    EXPECT_THAT(grid.error().message, HasSubstr("there is no memory for what OpenVDB has compressed: File too large"));
}

TEST_F(VdbTest, ThatIsNoFileOrNotWholeIsRefused) {
    EXPECT_THAT(refused(), HasSubstr("No such file"));
    for (const char* text : {"", "x", "no grid at all, but some text that goes on for a while"}) {
        write_text(text);
        EXPECT_THAT(refused(), HasSubstr("OpenVDB"));
    }
    write({specks({0, 0, 0})});
    const std::string whole = content();
    for (size_t keep = 0; keep < whole.size(); keep += whole.size() / 23 + 1) {
        write_text(whole.substr(0, keep));
        EXPECT_NE(refused(), "") << keep;
    }
    fs::remove(path_);
    fs::create_directory(path_);
    EXPECT_NE(refused(), "");
    fs::remove(path_);
    ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
    EXPECT_NE(refused(), "") << "and does not wait for somebody to write";
}

// Whatever bytes are changed, there is a grid that is whole or a line. Returns how often OpenVDB's process died.
int damage(const std::string& whole, int count, const std::function<Result<DensityGrid>(const std::string&)>& read) {
    Random random(17);
    int died = 0;
    for (int i = 0; i < count; ++i) {
        std::string bytes = whole;
        const int changes = 1 + static_cast<int>(random.uniform(0, 8));
        for (int k = 0; k < changes; ++k) {
            // Half of them in the head, where sizes and names are.
            const double reach = random.unit() < 0.5 ? std::min(1000.0, double(bytes.size())) : double(bytes.size());
            bytes[static_cast<size_t>(random.unit() * reach * 0.999)] =
                static_cast<char>(static_cast<uint8_t>(random.uniform(0, 256)));
        }
        const auto grid = read(bytes);
        if (grid) {
            EXPECT_TRUE(grid->validate());
            continue;
        }
        EXPECT_NE(grid.error().fault, Fault::machine) << grid.error().message;
        EXPECT_EQ(grid.error().message.find('\n'), std::string::npos);
        if (grid.error().message.find("the decoder of OpenVDB") != std::string::npos) ++died;
    }
    return died;
}

class VdbLong : public VdbTest {
protected:
    void read_damaged(int count) {
        write({specks({0, 0, 0}, 20)});
        GridLimits few;  // so that files that ask for much memory are soon refused
        few.blocks = 100;
        const int died = damage(content(), count, [&](const std::string& bytes) {
            write_text(bytes);
            return read_vdb(path_, "", few);
        });
        std::printf("of %d damaged files, OpenVDB's process died of %d\n", count, died);
    }
};
using VdbDamaged = VdbLong;

TEST_F(VdbDamaged, IsAGridOrOneLine) { read_damaged(40); }
TEST_F(VdbLong, DamagedIsAGridOrOneLine) { read_damaged(2000); }

#endif

}  // namespace
}  // namespace lodestone::volume
