// Reads back what a tile's glb says of its triangles: for checks, so nothing in it is taken on trust.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <vector>

#include "base/result.h"

namespace lodestone::tiles {

struct TileContent {
    // As stored, before any matrix: equal places are equal bit for bit.
    std::vector<std::array<float, 3>> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
    std::array<double, 16> matrix{};     // of the node, column by column
    std::array<float, 3> low{}, high{};  // as the file says
    uint64_t bytes = 0;                  // of the file

    // From the file to axes of tiles: the node's matrix, then glTF's y to z.
    glm::dmat4 to_tile() const;
    // In axes of tiles.
    glm::dvec3 point(uint32_t vertex) const;
};

// Binary glTF 2.0 of one node with one mesh of triangles, compressed by EXT_meshopt_compression or not.
// Fault::format names file and place: numbers out of range, views past the end, accessors that lie.
Result<TileContent> read_tile_content(const std::filesystem::path& path);

}  // namespace lodestone::tiles
