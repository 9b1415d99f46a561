// lodestone-vdb-reader PATH NAME BLOCKS SIDE: the one file that knows OpenVDB, a program of its own that vdb_file.cpp
// starts. Reads the grid of that name ("" for the usual one) under GridLimits of BLOCKS and SIDE.
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/util/logging.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "base/process/confined.h"
#include "volume/vdb/vdb_leaves.h"

namespace lodestone::volume {

namespace {

constexpr int side = DensityGrid::side;
static_assert(openvdb::FloatTree::LeafNodeType::DIM == DensityGrid::side);

// The grid of that name, or why there is none. Reads that grid alone.
std::string find_grid(openvdb::io::File& file, std::string name, openvdb::GridBase::Ptr& into) {
    std::string first, names;
    const auto all = file.readAllGridMetadata();  // types, names and maps, without values
    const auto named = [&](const std::string& wanted) {
        return std::ranges::any_of(*all, [&](const auto& grid) { return grid->getName() == wanted; });
    };
    for (const auto& grid : *all) {
        if (first.empty() && grid->template isType<openvdb::FloatGrid>()) first = grid->getName();
        names += (names.empty() ? "" : ", ") + grid->getName();
    }
    if (names.size() > 200) names = names.substr(0, 200) + "...";
    if (name.empty()) name = named("density") ? "density" : first;
    if (name.empty()) return "has no grid of floats; it has: " + (names.empty() ? "none" : names);
    if (!named(name)) return "has no grid '" + name + "'; it has: " + names;
    const auto head = file.readGridMetadata(name);
    const std::string the_grid = "grid '" + name + "'";
    if (!head->isType<openvdb::FloatGrid>())
        return the_grid + " has values of type " + head->valueType() + "; densities are floats";
    if (head->getGridClass() == openvdb::GRID_LEVEL_SET)
        return the_grid + " is a level set, not a fog volume; convert it (sdfToFogVolume)";
    if (!head->transform().isLinear()) return the_grid + " has a frustum for a map; resample it to one that is affine";
    into = file.readGrid(name);
    return into && into->isType<openvdb::FloatGrid>() ? "" : the_grid + " is not what its head says";
}

// A block of 8^3 values, or of one value.
struct Leaf {
    openvdb::Coord at;  // in blocks
    const float* values = nullptr;
    float value = 0;
    float of(int z, int y, int x) const { return values != nullptr ? values[(x * side + y) * side + z] : value; }
};

// Calls visit(leaf) for every block that is not of the background, without order.
template <class Visit>
std::string for_each_leaf(const openvdb::FloatTree& tree, Visit&& visit) {
    std::string wrong;
    for (auto leaf = tree.cbeginLeaf(); leaf && wrong.empty(); ++leaf) {
        const openvdb::Coord& origin = leaf->origin();
        wrong = visit(Leaf{{origin.x() / side, origin.y() / side, origin.z() / side}, leaf->buffer().data(), 0});
    }
    // Tiles: larger cubes of one value.
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile && wrong.empty(); ++tile) {
        if (tile.getValue() == 0) continue;
        const openvdb::CoordBBox box = tile.getBoundingBox();
        const openvdb::Coord low(box.min().x() / side, box.min().y() / side, box.min().z() / side);
        const int across = box.dim().x() / side;
        for (int k = 0; k < across * across * across && wrong.empty(); ++k)
            wrong = visit(
                Leaf{low.offsetBy(k % across, k / across % across, k / across / across), nullptr, tile.getValue()});
    }
    return wrong;
}

// What a first look finds out.
struct Extent {
    openvdb::CoordBBox blocks;
    float most = 0;
    uint64_t count = 0;
};

std::string measure(const Leaf& leaf, const GridLimits& limits, Extent& extent) {
    float most = 0;
    for (int k = 0; k < side * side * side; ++k) {
        const float value = leaf.values != nullptr ? leaf.values[k] : leaf.value;
        if (!std::isfinite(value)) return "has values that are no numbers";
        if (value < 0) return "has values below 0; a fog volume has none";
        most = std::max(most, value);
    }
    if (most == 0) return "";
    extent.most = std::max(extent.most, most);
    extent.blocks.expand(leaf.at);
    const auto whole = [](const std::string& what, uint64_t number, uint64_t limit) {
        return "has " + std::to_string(number) + " " + what + "; the limit is " + std::to_string(limit) +
               "; resample it to larger voxels";
    };
    if (++extent.count > limits.blocks) return whole("or more blocks of 8^3 voxels", extent.count, limits.blocks);
    for (int k = 0; k < 3; ++k) {
        const int64_t across = (int64_t{extent.blocks.max()[k]} - extent.blocks.min()[k] + 1) * side;
        if (across > limits.side) return whole("or more voxels across", static_cast<uint64_t>(across), limits.side);
    }
    return "";
}

void put(const Leaf& leaf, float most, VdbHead& head, std::span<std::byte> memory) {
    VdbBlock block;
    bool any = false;
    for (int k = 0; k < 3; ++k) block.at[k] = leaf.at[k];
    uint16_t* share = block.shares;
    for (int z = 0; z < side; ++z) {
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                *share = static_cast<uint16_t>(std::lround(65535.0 * double{leaf.of(z, y, x)} / double{most}));
                any = any || *share != 0;
                ++share;
            }
        }
    }
    if (any) std::memcpy(memory.data() + sizeof head + sizeof block * head.blocks++, &block, sizeof block);
}

std::string read(const std::filesystem::path& path, const std::string& name, const GridLimits& limits,
                 std::span<std::byte> memory) {
    const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
    openvdb::logging::setLevel(openvdb::logging::Level::Fatal);  // what is wrong is an error, told once
    openvdb::initialize();
    openvdb::io::File file(path.string());
    file.setCopyMaxBytes(0);
    file.open(false);  // values are read at once, not when they are looked at
    openvdb::GridBase::Ptr base;
    if (std::string wrong = find_grid(file, name, base); !wrong.empty()) return wrong;
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(base);
    const std::string the_grid = "grid '" + grid->getName() + "' ";
    if (grid->background() != 0)
        return the_grid + "is " + std::to_string(grid->background()) + " outside; a fog volume is 0 there";
    Extent extent;
    std::string wrong =
        for_each_leaf(grid->constTree(), [&](const Leaf& leaf) { return measure(leaf, limits, extent); });
    if (!wrong.empty()) return the_grid + wrong;
    if (extent.count == 0) return the_grid + "is empty";
    VdbHead head;
    head.most = extent.most;
    for (int k = 0; k < 3; ++k) {
        head.low[k] = extent.blocks.min()[k];
        head.high[k] = extent.blocks.max()[k];
    }
    // OpenVDB's matrices map rows: its rows are columns here.
    const openvdb::Mat4R map = grid->transform().baseMap()->getAffineMap()->getMat4();
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) head.voxel_to_object[column][row] = map(column, row);
    }
    for_each_leaf(grid->constTree(), [&](const Leaf& leaf) {
        put(leaf, extent.most, head, memory);
        return std::string();
    });
    std::memcpy(memory.data(), &head, sizeof head);
    return "";
}

}  // namespace

}  // namespace lodestone::volume

int main(int argc, char** argv) {
    return lodestone::confined_main(argc, argv, [](std::span<char* const> words, std::span<std::byte> memory) {
        if (words.size() != 4) return std::string("lodestone-vdb-reader PATH NAME BLOCKS SIDE");
        lodestone::volume::GridLimits limits;
        limits.blocks = static_cast<decltype(limits.blocks)>(std::stoull(words[2]));
        limits.side = static_cast<decltype(limits.side)>(std::stoull(words[3]));
        return lodestone::volume::read(words[0], words[1], limits, memory);
    });
}
