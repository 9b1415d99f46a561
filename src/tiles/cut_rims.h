// Rims along which a piece was cut from its source (mesh/clip.h): there the tileset of another piece goes on.
//
// The samples of two pieces are not the same along the line between them. But the line itself is: its vertices are
// those of the source, and of where the planes cut its edges. So every tile at the line, leaves too, goes on from the
// finest line there (finest.h) to that line, by triangles of vertices of both. What remains of any cut is then the
// line, whatever the levels, and the tiles of the other piece run through it the other way. Where there are leaves the
// two lines are the same but for rounding, and for the corners of leaves, which are no vertices of the source.
//
// Vertices of the line are rounded to a lattice that follows from the whole source, with leaves to that of leaves for
// it, and the piece's own lattice is one whose points all of those are. Steps are powers of two, so both pieces have
// the same numbers for them, if both have leaves or neither has.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "mesh/clip.h"
#include "tiles/finest.h"
#include "vgi/asset/atlas.h"

namespace lodestone::tiles {

// What a piece was cut from, and how.
struct PieceOfSource {
    TriMesh mesh;                   // what the atlas was baked from: clipped, and repaired
    Box whole;                      // around all vertices of the source, as it was read
    std::vector<ClipPlane> planes;  // as clip() had them
};

class CutRims {
public:
    CutRims() = default;  // none
    // Brings the atlas, its leaves included, to a lattice that fits the line. Fault::invariant where it has other rims
    // than the piece.
    static Result<CutRims> fit(vgi::Atlas& atlas, const PieceOfSource& piece);

    // For every edge of the finest line of a square's side (FinestSurface::side) the vertices of the line of the cut
    // that it is closed to, in its direction: often one, none where the edge is at another rim. No edges at all where
    // the side is on no such rim.
    std::vector<std::span<const LatticePoint>> beyond(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side,
                                                      const std::vector<SideVertex>& line) const;
    bool empty() const { return sides_.empty(); }
    // How far apart the points of the lattice were that samples were rounded to first, in steps of the atlas's now; 1
    // at least. What is nearer need not be told apart.
    double coarseness() const { return coarseness_; }

private:
    // Of a side of a chart.
    struct Line {
        std::vector<SideVertex> finest;
        std::vector<uint32_t> first;  // per edge of that, and the end
        std::vector<LatticePoint> vertices;
    };
    // Null where the side of a square is not on one of its chart that has a line.
    const Line* line_at(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) const;

    std::unordered_map<uint32_t, Line> sides_;  // by 4 chart + side
    double coarseness_ = 1;
};

}  // namespace lodestone::tiles
