// An atlas in an asset file: a description, the gluing, and compressed pages.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "mesh/limits.h"
#include "vgi/asset/atlas.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

struct LeafPart;   // leaves.h
class PageFamily;  // codec/page_family.h

// Chunks vgi/atlas, vgi/sides, vgi/clusters, vgi/left_out, vgi/errors, vgi/bounds, vgi/corners,
// vgi/chart_corners, the materials, and for both layers
// vgi/geometry_ends, vgi/geometry_sums, vgi/geometry_pages; and, where it has leaves, vgi/leaves, vgi/leaf_ends,
// vgi/leaf_sums, vgi/leaf_parts.
Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer);

// An atlas whose pages stay in the file until they are asked for.
class AtlasFile {
public:
    // Checks everything but the pages. Errors name file and chunk; Fault::format. limits: charts, pages, samples.
    static Result<AtlasFile> open(const ChunkFile& file, const Limits& limits = {});

    // Everything but the images, whose vectors are empty.
    const Atlas& about() const { return about_; }
    const ChunkFile& file() const { return file_; }  // as given

    // A part of a chunk.
    struct ByteRange {
        const char* chunk;       // its name
        uint64_t offset, bytes;  // in bytes
    };
    // Where the bytes of the family lie that a page of a chart is in, which has it.
    ByteRange place(Layer layer, uint32_t chart, uint32_t page) const;
    // Whether the chart has the page, or leaves it out.
    bool has(Layer layer, uint32_t chart, uint32_t page) const;

    // A page of a chart that has it. Errors name chart and page, not the file; Fault::format, Fault::machine where
    // reading fails.
    struct PageName {
        Layer layer;           // positions or attributes
        uint32_t chart, page;  // page: of the chart's tree
    };
    // The bytes of its family, as they lie in the file.
    Result<std::vector<std::byte>> read(const PageName& name) const;
    // The family, if its checksum is right; this must outlive it.
    Result<PageFamily> unpack(const PageName& name, std::span<const std::byte> bytes) const;
    // The page out of its family, if the materials it names exist. parent: of every page but 0.
    Result<Page> decode(const PageName& name, const PageFamily& family, const Page* parent) const;

    // Where the bytes of a part of a leaf lie, of those that about() has.
    ByteRange leaf_place(uint32_t part) const;
    // Of all leaves; counted from their beginnings when it is first asked for. Fault::machine where reading fails.
    Result<uint64_t> leaf_triangles() const;
    // The bytes of a part, and what is coded in them if their checksum is right. Errors name the part, not the file.
    Result<std::vector<std::byte>> read_leaf(uint32_t part) const;
    // As read_leaf, of bytes that were read.
    Result<LeafPart> decode_leaf(uint32_t part, std::span<const std::byte> bytes) const;

private:
    explicit AtlasFile(const ChunkFile& file) : file_(file) {}
    Result<void> find_pages(Layer layer);
    Result<void> find_leaves(const Limits& limits);
    Result<uint64_t> count_leaf_triangles() const;

    ChunkFile file_;
    Atlas about_;
    // Of a layer's pages of a chart.
    std::span<const Channel> channels(Layer layer, uint32_t chart) const {
        return channels_[static_cast<size_t>(layer)][about_.dense[chart]];
    }
    std::array<std::array<std::vector<Channel>, 2>, 2>
        channels_;  // by layer; of charts that are not dense, and that are
    size_t number(Layer layer, uint32_t chart, uint32_t page) const;  // of a page's family, among those of all charts
    std::array<std::vector<size_t>, 2> first_;       // by layer: per chart, and the end, the number of its first family
    std::array<std::span<const uint64_t>, 2> ends_;  // by layer, per family
    std::array<std::span<const uint32_t>, 2> sums_;
    std::span<const uint64_t> leaf_ends_;  // per part
    std::span<const uint32_t> leaf_sums_;
    struct LeafCount {
        std::mutex mutex;
        std::optional<uint64_t> triangles;  // once they are counted
    };
    std::shared_ptr<LeafCount> leaf_count_ = std::make_shared<LeafCount>();  // of copies, too: the file is one
};

// Decodes every page. Errors name file and chunk; Fault::format.
Result<Atlas> open_atlas(const ChunkFile& file);

}  // namespace lodestone::vgi
