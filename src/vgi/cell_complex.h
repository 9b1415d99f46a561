// A surface divided into cells that are merged, two at a time, into larger ones: the macro complex of which clusters
// are made. Every cell is a disk with at least three sides, and any two touch in nothing, in a point, or along one arc.
//
// Kept as a half-edge structure in which the twin of half-edge h is h ^ 1: at first an edge per mesh edge, and fewer as
// edges inside a merged cell go and arcs with the same cell on either side become one.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/features.h"
#include "vgi/surface.h"

namespace lodestone::vgi {

// Sums over the triangles of a cell: enough to fit a plane to it in constant time.
struct CellMoments {
    double area = 0;
    double weighted = 0;                    // integral of the density wanted
    glm::dvec3 normal{0};                   // vector area
    glm::dvec3 first{0};                    // integral of the position
    double second[6] = {0, 0, 0, 0, 0, 0};  // integrals of xx, yy, zz, xy, xz, yz

    void add(const CellMoments& other);
    // Mean squared distance to the plane that fits best.
    double flatness() const;
};

class CellComplex {
public:
    // One cell per triangle, and a cell that is never merged per boundary loop. The surface must be valid and have no
    // inner edge between boundary vertices (surface_of sees to it).
    // density: per triangle, > 0, for CellMoments::weighted; empty for 1 everywhere.
    explicit CellComplex(const Surface& surface, std::span<const float> density = {},
                         const FeatureLines& features = {});

    uint32_t edge_slots() const { return static_cast<uint32_t>(length_.size()); }
    bool edge_alive(uint32_t edge) const { return length_[edge] >= 0; }
    double edge_length(uint32_t edge) const { return length_[edge]; }
    double feature_length(uint32_t edge) const { return feature_[edge]; }  // of it, on features
    uint32_t cell_of(uint32_t half_edge) const { return cell_[half_edge]; }
    uint32_t next(uint32_t half_edge) const { return next_[half_edge]; }
    uint32_t origin(uint32_t half_edge) const { return origin_[half_edge]; }
    uint32_t first_half_edge(uint32_t cell) const { return first_[cell]; }
    uint32_t sides(uint32_t cell) const { return sides_[cell]; }
    double perimeter(uint32_t cell) const { return perimeter_[cell]; }
    const CellMoments& moments(uint32_t cell) const { return moments_[cell]; }
    // Cells below are triangles (or what was merged into them); from here on they stand for boundary loops.
    uint32_t triangle_cells() const { return triangle_cells_; }
    bool alive(uint32_t cell) const { return first_[cell] != none; }

    // Whether the cells either side of an edge may become one: the invariant holds afterwards.
    bool may_merge(uint32_t edge);
    // Merges them; may_merge must hold. Returns the cell they become.
    uint32_t merge(uint32_t edge);

    // Per triangle of the surface: its cell.
    std::vector<uint32_t> labels() const;

    // Every link, and the invariant by looking at all pairs of cells that touch.
    Result<void> validate() const;

private:
    template <class Visit>
    void around(uint32_t vertex, Visit&& visit) const;  // visit(half-edge out of it), in turn
    void dissolve(uint32_t vertex);
    uint32_t degree(uint32_t vertex) const;

    uint32_t triangle_cells_ = 0;
    std::vector<uint32_t> next_, prev_, origin_, cell_;  // per half-edge
    std::vector<double> length_;                         // per edge, < 0: gone
    std::vector<double> feature_;                        // per edge: length on features
    std::vector<uint32_t> first_, sides_;                // per cell
    std::vector<double> perimeter_;
    std::vector<CellMoments> moments_;
    std::vector<uint32_t> out_;             // per vertex: some half-edge out of it, none where no corner is left
    mutable std::vector<uint32_t> parent_;  // per triangle cell: the one it was merged into
};

}  // namespace lodestone::vgi
