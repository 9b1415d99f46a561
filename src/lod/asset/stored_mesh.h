// A progressive mesh as it lies in a file: the base, then the vertex splits from coarse to fine in blocks, each packed
// and checked by itself. What a cursor needs besides follows from it (order_arrays.h), so that little is stored; and
// the beginning of it is a mesh of the coarser levels.
//
// A block has its splits with their vertices, and for each face order the faces slot by slot where a keyframe lies in
// it. The errors of its levels are packed beside it, for they are measured later.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "lod/asset/order_arrays.h"
#include "mesh/packed_vertices.h"

namespace lodestone {

// What is stored of a mesh, before it is packed. Wedges are numbered as in a ProgressiveMesh, faces as in a PlayedMesh.
struct MeshPlan {
    std::vector<MeshVertex> vertices;        // per wedge; those of one vertex at one position
    std::vector<FurtherAttributes> further;  // as ProgressiveMesh
    std::vector<uint32_t> wedge_vertex;      // per wedge, rising
    std::vector<Ecol> ecols;
    std::vector<uint32_t> parents;  // as ProgressiveMesh; a vertex' wedges become wedges of one vertex
    // Per face: its wedges at the level before it dies, that of the vertex removed there first; of faces of the base as
    // they are there.
    std::vector<uint32_t> born;
    // Per ecol: the corners (3 * face + k) of the vertex removed that live on, and which wedge each has before.
    std::vector<uint64_t> first_corner;  // one more at the end
    struct Corner {
        uint32_t corner, wedge;
    };
    std::vector<Corner> corners;
    PresentAttributes attributes;
    std::vector<PlannedOrder> orders;
};

// One block, as it is stored.
struct StoredBlock {
    uint32_t level = 0;        // the finest it leads to
    uint32_t wedges = 0;       // of that level
    uint32_t faces = 0;        // of that level
    uint32_t bytes = 0;        // of what mesh and orders are
    uint32_t error_bytes = 0;  // of the errors, behind them
    uint32_t sum = 0;          // checksum of both
    bool operator==(const StoredBlock&) const = default;
};
static_assert(sizeof(StoredBlock) == 24);

class StoredMesh {
public:
    // Packs a plan. Fault::invariant where a collapse is none of a manifold, so that it cannot be stored.
    static Result<StoredMesh> pack(const MeshPlan& plan);

    // What its blocks hold, level 0 the finest that is there.
    struct Unpacked {
        std::vector<MeshVertex> vertices;
        std::vector<FurtherAttributes> further;
        std::vector<uint32_t> wedge_vertex, parents;
        std::vector<Ecol> ecols;
        std::vector<PlannedOrder> orders;
        std::vector<uint32_t> indices, witnesses, arcs;  // as PlayedMesh
        std::vector<uint64_t> arc_ends;                  // as PlayedMesh
        uint32_t levels_missing = 0;                     // that are finer, and not there
        StoredParts parts;
    };
    Result<Unpacked> unpack() const;
    // Of the levels that are there; Fault::format where they are not as many.
    Result<std::vector<float>> unpack_errors() const;

    // Chunks lod/mesh, lod/table, lod/blocks. errors: of all levels. Those of a prefix cannot be written.
    Result<void> write(ChunkWriter& writer, std::span<const float> errors) const;
    // The chunks that write() wrote; of a file whose end is missing the blocks that are there, at least one.
    static Result<StoredMesh> read(const ChunkFile& file);

    const PresentAttributes& attributes() const { return attributes_; }
    uint32_t levels() const { return levels_; }  // of the whole
    // Finer than what is there.
    uint32_t levels_missing() const { return blocks_.empty() ? levels_ : blocks_.back().entry.level; }
    uint64_t stored_bytes() const;  // of all blocks that are there

private:
    struct Order {
        std::string name;
        bool drops_dead = false;               // by number of the faces
        bool keeps = false;                    // every keyframe has what is alive in the order before
        bool swaps = false;                    // changed by tswaps, which lie in the last block
        std::vector<uint32_t> keyframes;       // levels
        bool stored_at(uint32_t level) const;  // whether its faces are stored there, slot by slot
    };
    struct Block {
        StoredBlock entry;
        std::vector<std::byte> content, errors;  // errors: once they are known
    };
    class Packer;
    class Unpacker;

    double grid() const;           // 0 where there is none
    std::string describe() const;  // JSON
    Result<void> read_description(std::string_view text);
    uint32_t levels_ = 1, base_vertices_ = 0, base_faces_ = 0;
    std::optional<int> grid_exponent_;  // of the power of two that positions are multiples of
    PresentAttributes attributes_;
    std::vector<Order> orders_;
    std::vector<Block> blocks_;
};

}  // namespace lodestone
