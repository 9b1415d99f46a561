// What is read back of a tile's glb.
#pragma once

#include <filesystem>
#include <fstream>
#include <span>

#include "tiles/check/tile_content.h"

namespace lodestone::tiles {

// folder: where tile.glb is written.
inline Result<TileContent> read_back(std::span<const std::byte> glb, const std::filesystem::path& folder) {
    const std::filesystem::path path = folder / "tile.glb";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(glb.data()), static_cast<std::streamsize>(glb.size()));
    return read_tile_content(path);
}

}  // namespace lodestone::tiles
