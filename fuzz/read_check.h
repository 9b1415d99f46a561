// What every reader promises of any bytes: a mesh that is valid, or one line that says what is wrong; little memory,
// little time, nothing else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mesh/io/read.h"
#include "mesh/limits.h"

namespace lodestone::fuzz {

// Files of one folder, of which the first is read.
struct File {
    std::string name;
    std::string content;
};

// Limits under which everything is read, so that a run takes milliseconds and 64 MiB.
Limits small_limits();

// Reads the first file as the program would, whole, piece by piece, and for its hash alone, with the others beside it,
// and ends the program where a promise is broken. options: but for the limits.
void check_mesh(const std::vector<File>& files, ReadOptions options = {});
// Likewise for textures.
void check_image(const uint8_t* data, size_t size);

}  // namespace lodestone::fuzz
