// An atlas as it is read from a file.
#pragma once

#include <unistd.h>

#include <filesystem>

#include "fuzz/promise.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone::fuzz {

// The atlas in a file of its own, which stays open and is seen nowhere else.
inline ChunkFile in_a_file(const vgi::Atlas& atlas) {
    const std::filesystem::path path = "/dev/shm/lodestone-fuzz-atlas-" + std::to_string(getpid()) + ".lode";
    {
        auto writer = ChunkWriter::create(path, {});
        require_good(writer, "a file is begun");
        require_good(vgi::write_chunks(atlas, *writer), "an atlas is written");
        require_good(writer->commit(), "a file is ended");
    }
    auto file = ChunkFile::open(path);
    require_good(file, "what was written is opened");
    std::filesystem::remove(path);
    return std::move(*file);
}

}  // namespace lodestone::fuzz
