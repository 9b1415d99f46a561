// How vertex splits, and what their vertices look like, are written as numbers: one function for both directions.
//
//   Hoppe, "Efficient implementation of progressive meshes", 1998 (a split by its parent and places around it; wedges).
//   Isenburg, Lindstrom, Snoeyink, "Lossless compression of predicted floating-point geometry", 2005 (floats as
//   integers of the same order; the number of bits of a difference is coded, its bits are stored).
//
// The parent is stored as it is. Which part of its fan the new vertex takes is one number below n (n - 1) for a closed
// fan of n faces. A position is predicted by the mean of what the new vertex is joined to, attributes likewise.
#pragma once

#include <cstdint>
#include <vector>

#include "lod/asset/number_streams.h"
#include "lod/asset/split_lookahead.h"
#include "lod/asset/split_mesh.h"
#include "mesh/packed_vertices.h"

namespace lodestone {

// The streams of a block.
namespace split_streams {
enum : size_t {
    fan = 0,                 // of closed fans of 2 .. 15 faces, a stream per number
    other_fan = 16,          // of all others
    wedges,                  // of the new vertex, less 1
    parents,                 // of each wedge, among those of the parent vertex
    locals,                  // wedges of corners, less what is expected
    position,                // three streams: sizes of differences
    normal = position + 3,   // two; of tangents, too
    uv = normal + 2,         // two
    second_uv = uv + 2,      // two
    colour = second_uv + 2,  // four
    material = colour + 4,   // difference to the parent's; and what tangents are there, likewise
    base = material + 1,     // faces of the base
    walk = base + 1,         // face orders (face_walk.h): a stream per context
    count = walk + 12
};
// Bits, numbered by themselves.
enum : size_t { split_bits, vertex_bits, order_bits, bit_count };
}  // namespace split_streams

// A split with what its wedges are.
struct SplitStep {
    SplitMesh::Split split;
    std::vector<uint32_t> parents;     // per wedge of the new vertex: which of the parent's wedges it becomes
    std::vector<uint32_t> arc_locals;  // per face of the arc: the wedge of its corner at the new vertex
    std::array<uint32_t, 3> right_locals{}, left_locals{};  // wedges of the new faces' corners
};

// What wedges look like, in their order.
struct WedgeLooks {
    std::vector<MeshVertex>& vertices;
    std::vector<FurtherAttributes>& further;  // as many where there are some, else none
};

// Codes splits, one after another, into or out of one block; the mesh and its vertices grow.
// Io: NumberWriter or NumberReader. Where it writes, the step is given, and `looks` holds those of all wedges; where it
// reads, the step is filled, and those of new wedges are appended.
template <class Io>
class SplitCoder {
public:
    // grid: positions are multiples of it, a power of two; 0 where they are any numbers.
    SplitCoder(Io& io, SplitMesh& mesh, const WedgeLooks& looks, const PresentAttributes& has, double grid)
        : io_(io),
          mesh_(mesh),
          vertices_(looks.vertices),
          further_(looks.further),
          has_(has),
          grid_(grid),
          per_grid_(grid > 0 ? 1 / grid : 0) {}

    // A vertex of the base, of so many wedges, and a face of it.
    void base_vertex(uint32_t wedges);
    void base_face(std::array<uint32_t, 3>& vertices, std::array<uint16_t, 3>& locals);
    // False where what is read is no split; the mesh is then of no use.
    bool step(SplitStep& step);

private:
    using Corner = SplitMesh::Corner;
    // Sums over the wedges that a prediction is made from.
    struct Around {
        double position[3] = {}, uv[2] = {}, second_uv[2] = {};
        int64_t normal[2] = {}, tangent[2] = {}, count = 0, tangents = 0;
    };
    void add_around(uint32_t wedge);
    bool arc(SplitMesh::Split& split);
    bool small_fan(SplitMesh::Split& split, const SplitMesh::Fan& fan);
    bool large_fan(SplitMesh::Split& split);
    bool no_fan(SplitMesh::Split& split);
    void ends(SplitMesh::Split& split);
    bool local(uint32_t& value, uint32_t expected, uint32_t wedges);
    bool locals(SplitStep& step, uint32_t wedges);
    void vertex(const SplitStep& step);
    void position(uint32_t first_wedge, uint32_t wedges, uint32_t parent);
    void attributes(uint32_t wedge, uint32_t parent);
    void further(FurtherAttributes& made, const FurtherAttributes& before);
    void tangent(uint32_t& made, uint32_t before);
    void floating(size_t stream, float& value, float expected, float reference);
    void on_grid(size_t stream, float& value, float expected, float reference);
    void difference(size_t stream, int32_t& value, uint32_t expected_bits);
    void below(uint32_t& value, uint32_t end);
    void number(size_t stream, uint32_t& value);
    void flag(bool& value);

    Io& io_;
    SplitMesh& mesh_;
    std::vector<MeshVertex>& vertices_;
    std::vector<FurtherAttributes>& further_;
    const PresentAttributes has_;
    const double grid_, per_grid_;  // powers of two, so that both are exact
    SplitMesh::Fan fan_;
    Around around_;
    SplitLookahead lookahead_;  // where it reads
};

extern template class SplitCoder<NumberWriter>;
extern template class SplitCoder<NumberReader>;

}  // namespace lodestone
