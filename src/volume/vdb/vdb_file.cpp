#ifdef LODESTONE_WITH_OPENVDB
#include "volume/vdb/vdb_file.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <glm/common.hpp>
#include <vector>

#include "base/files/file.h"
#include "base/process/confined.h"
#include "base/process/process.h"
#include "base/text.h"
#include "volume/vdb/vdb_leaves.h"

namespace lodestone::volume {

namespace {

constexpr double bytes_per_second = 5e6;                                // of a file, at least
constexpr uint64_t bytes_per_block = 4 * DensityGrid::per_block + 512;  // while OpenVDB has it
constexpr uint64_t spare_bytes = uint64_t{128} << 20;
constexpr size_t most_name = 4096;  // bytes

ConfinedWork work_of(uint64_t file_bytes, const GridLimits& limits) {
    ConfinedWork work;
    work.library = "OpenVDB";
    work.result_bytes = sizeof(VdbHead) + limits.blocks * sizeof(VdbBlock);
    // A grid may have blocks that hold nothing: as many again.
    work.memory_bytes = spare_bytes + 2 * bytes_per_block * limits.blocks;
    work.seconds = 10 + static_cast<double>(file_bytes) / bytes_per_second;
    return work;
}

// The map of the grid's own voxels, which begin at block `low`.
glm::mat4 map_from(const VdbHead& head) {
    glm::mat4 map;
    for (int row = 0; row < 4; ++row) {
        double moved = head.voxel_to_object[3][row];
        for (int k = 0; k < 3; ++k) moved += head.voxel_to_object[k][row] * DensityGrid::side * head.low[k];
        for (int k = 0; k < 3; ++k) map[k][row] = static_cast<float>(head.voxel_to_object[k][row]);
        map[3][row] = static_cast<float>(moved);
    }
    return map;
}

// Checks everything: a file may have had the process write anything.
Result<DensityGrid> grid_from(std::span<const std::byte> memory, const GridLimits& limits) {
    const auto damaged = [] {
        return fail(Fault::format, "OpenVDB's blocks contradict each other; the file is damaged");
    };
    VdbHead head;
    std::memcpy(&head, memory.data(), sizeof head);
    if (head.blocks == 0 || head.blocks > limits.blocks) return damaged();
    DensityGrid grid;
    for (int k = 0; k < 3; ++k) {
        const int64_t blocks = int64_t{head.high[k]} - head.low[k] + 1;
        if (blocks < 1 || blocks > limits.side / DensityGrid::side + 1) return damaged();
        grid.blocks[k] = static_cast<uint32_t>(blocks);
    }
    grid.most = head.most;
    grid.voxel_to_object = map_from(head);
    grid.index.assign(size_t{grid.blocks.x} * grid.blocks.y * grid.blocks.z, DensityGrid::no_block);
    grid.shares.reserve(head.blocks * DensityGrid::per_block);
    VdbBlock block;
    for (uint32_t b = 0; b < head.blocks; ++b) {
        std::memcpy(&block, memory.data() + sizeof head + b * sizeof block, sizeof block);
        size_t at = 0;
        for (int k = 2; k >= 0; --k) {
            const int64_t place = int64_t{block.at[k]} - head.low[k];
            if (place < 0 || place >= grid.blocks[k]) return damaged();
            at = at * grid.blocks[k] + static_cast<size_t>(place);
        }
        if (grid.index[at] != DensityGrid::no_block) return damaged();
        grid.index[at] = b;
        grid.shares.insert(grid.shares.end(), std::begin(block.shares), std::end(block.shares));
    }
    if (auto some = grid.find_extent(); !some) return tl::unexpected(some.error());
    if (auto whole = grid.validate(); !whole) return fail(Fault::format, whole.error().message);
    return grid;
}

// Where it lies beside this program, or is installed.
Result<std::filesystem::path> find_reader() {
    const auto program = this_program();
    if (!program) return tl::unexpected(program.error());
    const std::filesystem::path here = program->parent_path();
    std::error_code failed;
    const std::string name = "lodestone-vdb-reader";
    for (const std::filesystem::path folder : {"", LODESTONE_PROGRAMS}) {
        if (const auto reader = here / folder / name; std::filesystem::exists(reader, failed)) return reader;
    }
    return fail(Fault::machine, "OpenVDB cannot be loaded: there is no " + name + " beside the program or in " +
                                    (here / LODESTONE_PROGRAMS).lexically_normal().string());
}

Result<DensityGrid> read(const std::filesystem::path& path, const std::string& name, const GridLimits& limits,
                         uint64_t file_bytes) {
    const auto reader = find_reader();
    if (!reader) return tl::unexpected(reader.error());
    const auto left = run_confined(work_of(file_bytes, limits), *reader,
                                   {path.string(), name, std::to_string(limits.blocks), std::to_string(limits.side)});
    return left ? grid_from((*left)->bytes(), limits) : tl::unexpected(left.error());
}

}  // namespace

bool reads_vdb() { return true; }

Result<DensityGrid> read_vdb(const std::filesystem::path& path, const std::string& name, const GridLimits& limits) {
    const auto file = InputFile::open(path);
    if (!file) return tl::unexpected(file.error());
    if ((*file)->size() > limits.file_bytes)
        return fail(Fault::format, path.string() + ": has " + std::to_string((*file)->size()) +
                                       " bytes; the limit is " + std::to_string(limits.file_bytes) +
                                       "; write the grid alone into a file");
    if (name.size() > most_name || name.find('\0') != name.npos)
        return fail_at(path.string(), {Fault::format, "has no grid of such a name: it has " +
                                                          std::to_string(name.size()) + " bytes, or one that is 0"});
    auto grid = read(path, name, limits, (*file)->size());
    if (!grid) return fail_at(path.string(), {grid.error().fault, printable(grid.error().message)});
    return grid;
}

}  // namespace lodestone::volume
#endif
