// An atlas as it is read from a file, and how large it is.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <span>

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

// What the arrays and images of an atlas take.
inline size_t bytes_of(const vgi::Atlas& atlas) {
    size_t bytes = atlas.leaf_parts.bytes().size() + atlas.leaf_parts.ends().size_bytes();
    const auto add = [&](const auto&... arrays) { bytes += (std::span(arrays).size_bytes() + ...); };
    add(atlas.trimmed_levels, atlas.trimmed_attribute_levels, atlas.dense, atlas.sides, atlas.cluster,
        atlas.first_texel, atlas.first_attribute_texel, atlas.errors, atlas.bounds, atlas.corners, atlas.chart_corners,
        atlas.leaves, atlas.first_leaf);
    add(atlas.positions, atlas.sample_errors, atlas.sample_radii, atlas.normals, atlas.uvs, atlas.colours,
        atlas.surfaces, atlas.emissions, atlas.materials, atlas.material_table);
    for (const Image& image : atlas.images) bytes += std::span(image.texels).size_bytes();
    return bytes;
}

}  // namespace lodestone::fuzz
