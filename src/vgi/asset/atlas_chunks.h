// An atlas in an asset file: a description, the gluing, and compressed pages.
#pragma once

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "vgi/asset/atlas.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Chunks vgi/atlas, vgi/sides, vgi/clusters, vgi/errors, vgi/bounds, vgi/geometry_ends, vgi/geometry_pages,
// vgi/attribute_ends, vgi/attribute_pages, and the materials.
Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer);

// An atlas whose pages stay in the file until they are asked for.
class AtlasFile {
public:
    // Checks everything but the pages. Errors name file and chunk; Fault::format.
    static Result<AtlasFile> open(const ChunkFile& file);

    // Everything but the images, whose vectors are empty.
    const Atlas& about() const { return about_; }
    const ChunkFile& file() const { return file_; }  // as given

    // A part of a chunk.
    struct ByteRange {
        const char* chunk;       // its name
        uint64_t offset, bytes;  // in bytes
    };
    // Where the bytes of a page's family lie.
    ByteRange place(Layer layer, uint32_t chart, uint32_t page) const;
    // Whether the chart has the page, or leaves it out.
    bool has(Layer layer, uint32_t chart, uint32_t page) const;
    // The bytes of a page's family, mapped and not checked: PageFamily::unpack() does that.
    std::span<const std::byte> bytes(Layer layer, uint32_t chart, uint32_t page) const;

private:
    explicit AtlasFile(const ChunkFile& file) : file_(file) {}
    // ends_chunk, bytes_chunk: the layer's chunks.
    Result<void> find_pages(Layer layer, const char* ends_chunk, const char* bytes_chunk);

    ChunkFile file_;
    Atlas about_;
    std::array<std::span<const uint64_t>, 2> ends_;  // by layer
    std::array<std::span<const std::byte>, 2> pages_;
};

// Decodes every page. Errors name file and chunk; Fault::format.
Result<Atlas> open_atlas(const ChunkFile& file);

}  // namespace lodestone::vgi
