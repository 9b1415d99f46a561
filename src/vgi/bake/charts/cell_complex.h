// A surface divided into cells that are merged, two at a time, into larger ones: the macro complex of which clusters
// are made. Every cell is a disk with at least three sides, and any two touch in nothing, in a point, or along one arc.
//
// Kept as a half-edge structure in which the twin of half-edge h is h ^ 1: at first an edge per mesh edge, and fewer as
// edges inside a merged cell go and arcs with the same cell on either side become one.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/bake/charts/features.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// Sums over the triangles of a cell: enough to fit a plane to it in constant time.
struct CellMoments {
    double area = 0;                        // object units squared
    double weighted = 0;                    // integral of the density wanted
    glm::dvec3 normal{0};                   // vector area
    glm::dvec3 first{0};                    // integral of the position
    double second[6] = {0, 0, 0, 0, 0, 0};  // integrals of xx, yy, zz, xy, xz, yz

    void add(const CellMoments& other);  // moments of both cells together
    // Mean squared distance to the plane that fits best; object units squared.
    double flatness() const;
};

// What merging has left of one part of a surface: cells, and the edges between them. Vertices have the numbers of the
// whole surface; half-edges 2 e and 2 e + 1 are the sides of edge e.
struct CellPart {
    // A cell that is left.
    struct Cell {
        CellMoments moments;            // of its triangles
        double perimeter = 0;           // object units
        uint32_t first = 0, sides = 0;  // first: some half-edge of it
    };
    // An edge between two cells that are left, or at the end of the part.
    struct Edge {
        std::array<uint32_t, 2> origin, next, cell;  // of either side; cell: none where the part ends
        double length = 0, feature = 0;              // of the edge, and of it on features; object units
        uint32_t source = none;                      // where the part ends: triangle of the source mesh on this side
    };
    std::vector<Cell> cells;  // by number
    std::vector<Edge> edges;  // by number
};

// The complex, from triangles to clusters.
class CellComplex {
public:
    // One cell per triangle, and a cell that is never merged per boundary loop. The surface must be valid and have no
    // inner edge between boundary vertices (surface_of sees to it).
    // density: per triangle, > 0, for CellMoments::weighted; empty for 1 everywhere. middle: positions in moments are
    // relative to it; where moments are to be added it must be the same.
    explicit CellComplex(const Surface& surface, std::span<const float> density = {}, const FeatureLines& features = {},
                         const glm::dvec3& middle = glm::dvec3(0));
    // Of the parts of a surface of so many vertices, joined where they have edges in common. The cells of the first
    // part come first.
    CellComplex(std::span<const CellPart> parts, size_t vertices, const FeatureLines& features);

    // Edges are numbered below this; some are gone.
    uint32_t edge_slots() const { return static_cast<uint32_t>(length_.size()); }
    bool edge_alive(uint32_t edge) const { return length_[edge] >= 0; }       // whether it is not gone
    double edge_length(uint32_t edge) const { return length_[edge]; }         // object units; below 0 where it is gone
    double feature_length(uint32_t edge) const { return feature_[edge]; }     // of it, on features
    uint32_t cell_of(uint32_t half_edge) const { return cell_[half_edge]; }   // the cell on its side
    uint32_t next(uint32_t half_edge) const { return next_[half_edge]; }      // counter-clockwise around its cell
    uint32_t origin(uint32_t half_edge) const { return origin_[half_edge]; }  // the vertex it begins at
    // Some half-edge of the cell; none where it was merged.
    uint32_t first_half_edge(uint32_t cell) const { return first_[cell]; }
    uint32_t sides(uint32_t cell) const { return sides_[cell]; }                // how many arcs it has
    double perimeter(uint32_t cell) const { return perimeter_[cell]; }          // object units
    const CellMoments& moments(uint32_t cell) const { return moments_[cell]; }  // of its triangles
    // Cells below are triangles, or of parts (or what was merged into them); from here on they stand for boundary
    // loops.
    uint32_t triangle_cells() const { return triangle_cells_; }
    bool alive(uint32_t cell) const { return first_[cell] != none; }  // whether it was not merged into another

    // Whether the cells either side of an edge may become one: the invariant holds afterwards.
    bool may_merge(uint32_t edge);
    // Merges them; may_merge must hold. Returns the cell they become.
    uint32_t merge(uint32_t edge);

    // Per cell that there was at first (a triangle, or one of a part): its cell.
    std::vector<uint32_t> labels() const;
    // The cells that are left of a surface as a part, with their edges to boundary loops ending in none; there every
    // cell must still be one triangle. vertices: number of each on the whole surface. cell_of: per triangle, its cell's
    // number in the part.
    CellPart part(const Surface& surface, std::span<const uint32_t> vertices, std::vector<uint32_t>& cell_of) const;

    // Every link, and the invariant by looking at all pairs of cells that touch.
    Result<void> validate() const;

private:
    template <class Visit>
    void around(uint32_t vertex, Visit&& visit) const;  // visit(half-edge out of it), in turn
    void dissolve(uint32_t vertex);
    void close_boundary();
    uint32_t degree(uint32_t vertex) const;
    std::vector<std::vector<uint32_t>> join_edges(std::span<const CellPart> parts, const FeatureLines& features);
    bool ends_allow_merge(uint32_t edge);
    bool touch_nowhere_else(uint32_t edge);

    uint32_t triangle_cells_ = 0;
    std::vector<uint32_t> next_, prev_, origin_, cell_;  // per half-edge
    std::vector<double> length_;                         // per edge, < 0: gone
    std::vector<double> feature_;                        // per edge: length on features
    std::vector<uint32_t> first_, sides_;                // per cell
    std::vector<double> perimeter_;
    std::vector<CellMoments> moments_;
    std::vector<uint32_t> out_;  // per vertex: some half-edge out of it, none where no corner is left
    // Of may_merge(): per cell, the last query in which it was found at the edge's ends, and touching the first cell.
    std::vector<uint32_t> at_ends_, touching_;
    uint32_t query_ = 0;
    mutable std::vector<uint32_t> parent_;  // per triangle cell: the one it was merged into
};

}  // namespace lodestone::vgi
