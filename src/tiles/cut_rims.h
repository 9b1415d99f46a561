// Rims along which a piece was cut from its source (mesh/clip.h): there the tileset of another piece goes on.
//
// The samples of two pieces are not the same along the line between them. But the line itself is: its vertices are
// those of the source, and of where the planes cut its edges. So every tile at the line, leaves too, goes on from the
// finest samples there to that line, by triangles of samples and of vertices of the line. What remains of any cut is
// then the line, whatever the levels, and the tiles of the other piece run through it the other way.
//
// Vertices of the line are rounded to a lattice that follows from the whole source, and the piece's own lattice is one
// whose points all of those are. Steps are powers of two, so both pieces have the same numbers for them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "mesh/clip.h"
#include "vgi/asset/atlas.h"

namespace lodestone::tiles {

struct ChartSquare;

// What a piece was cut from, and how.
struct PieceOfSource {
    TriMesh mesh;                   // what the atlas was baked from: clipped, and repaired
    Box whole;                      // around all vertices of the source, as it was read
    std::vector<ClipPlane> planes;  // as clip() had them
};

class CutRims {
public:
    using Place = std::array<uint16_t, 3>;  // lattice point of the atlas

    CutRims() = default;  // none
    // Brings the atlas, which has no leaves, to a lattice that fits the line. Fault::invariant where the atlas has
    // other rims than the piece.
    static Result<CutRims> fit(vgi::Atlas& atlas, const PieceOfSource& piece);

    // Whether the side of a square runs along the line somewhere.
    bool on(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) const;
    // The vertices of the line that a finest edge of such a side is closed to, in its direction; often one, none where
    // the edge is at another rim. step: where the edge begins, as sample_on_side() counts.
    std::span<const Place> beyond(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side,
                                  uint32_t step) const;
    bool empty() const { return sides_.empty(); }
    // How far apart the points of the lattice were that samples were rounded to first, in steps of the atlas's now; 1
    // at least. What is nearer need not be told apart.
    double coarseness() const { return coarseness_; }

private:
    // Of a side of a chart.
    struct Line {
        std::vector<uint32_t> first;  // per finest edge, and the end
        std::vector<Place> vertices;
    };
    // Null where the side of a square is not on one of its chart that has a line.
    const Line* line_at(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) const;

    std::unordered_map<uint32_t, Line> sides_;  // by 4 chart + side
    double coarseness_ = 1;
};

}  // namespace lodestone::tiles
