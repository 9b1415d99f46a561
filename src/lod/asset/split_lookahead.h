// Splits are told from coarse to fine, and each lies anywhere in the mesh: nearly all that it reads has to come from
// memory. The parents of those to come can be read ahead, for they are bits by themselves; the faces around them are
// fetched, one face of each at every split, before their turn. What is read ahead may be wrong (a large fan has bits in
// between): nothing but the time depends on it.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "base/none.h"
#include "lod/asset/number_streams.h"
#include "lod/asset/split_mesh.h"
#include "mesh/packed_vertices.h"

namespace lodestone {

class SplitLookahead {
public:
    // A split of this parent was just read from the bits of a stream; the mesh has no vertex of it yet.
    void split(const NumberReader& io, size_t bit_stream, const SplitMesh& mesh,
               const std::vector<MeshVertex>& vertices, uint32_t parent) {
        Look& now = looks_[turn_ % ahead];
        if (turn_ < end_ && now.parent == parent) {
            offset_ -= now.bits;
        } else {
            offset_ = 0;
            end_ = turn_ + 1;
        }
        ++turn_;
        for (uint32_t more = 0; more < 2 && end_ < turn_ + ahead; ++more) read(io, bit_stream, mesh);
        for (uint32_t i = turn_; i < end_; ++i) go_on(looks_[i % ahead], mesh, vertices);
    }

private:
    static constexpr uint32_t ahead = 8;  // splits: about as many as a fan has faces
    struct Look {
        uint32_t parent = none;
        uint32_t bits = 0;       // that it takes
        uint32_t corner = none;  // the code of the one around it that is fetched
    };

    // As SplitCoder::below() does.
    void read(const NumberReader& io, size_t bit_stream, const SplitMesh& mesh) {
        const uint32_t below = mesh.vertices() + 1 + (end_ - turn_);
        const auto width = static_cast<uint32_t>(std::bit_width(below - 1));
        const auto shorter = static_cast<uint32_t>((uint64_t{1} << width) - below);
        const uint32_t all = io.peek(bit_stream, offset_, width), low = all & ((uint32_t{1} << (width - 1)) - 1);
        Look& look = looks_[end_++ % ahead];
        look = low < shorter ? Look{low, width - 1, none} : Look{low * 2 + (all >> (width - 1)) - shorter, width, none};
        offset_ += look.bits;
        if (look.parent < mesh.vertices()) mesh.fetch_home(look.parent);
    }

    static void go_on(Look& look, const SplitMesh& mesh, const std::vector<MeshVertex>& vertices) {
        SplitMesh::Corner next;
        if (look.corner == none) {
            if (look.parent < mesh.vertices()) next = mesh.home(look.parent);
        } else {
            const auto at = SplitMesh::Corner::of(look.corner);
            __builtin_prefetch(&vertices[mesh.first_wedge(mesh.vertex({at.face, SplitMesh::next(at.k)}))]);
            next = mesh.counter_clockwise(at);
        }
        look.corner = next.face == none ? none : next.code();
        if (next.face != none) mesh.fetch_face(next.face);
    }

    std::array<Look, ahead> looks_;
    uint32_t turn_ = 0, end_ = 0;  // looks_ from the one to the other are of splits to come
    uint32_t offset_ = 0;          // bits from those read next to those of the first that is not read ahead
};

}  // namespace lodestone
