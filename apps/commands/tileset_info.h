// `info` and `verify` of tilesets.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"

namespace lodestone {

// Whether a path is that of a tileset: a folder, or a file called *.json.
bool is_tileset(const std::string& path);

Result<int> info_of_tileset(const std::string& path, bool json);

struct TilesetVerification {
    uint32_t cuts = 100;   // random ones, of each surface
    bool measure = false;  // errors of tiles, too
};
Result<int> verify_tileset(const std::string& path, const TilesetVerification& how, bool json);

}  // namespace lodestone
