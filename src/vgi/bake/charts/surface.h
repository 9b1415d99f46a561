// The surface that becomes an atlas: an oriented manifold of triangles that may be cut finer, each part knowing where
// on the source mesh it lies, so that attributes are looked up there and never interpolated across a seam.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/none.h"
#include "base/result.h"
#include "mesh/topology.h"
#include "mesh/tri_mesh.h"

namespace lodestone::vgi {

// A triangle, and where it comes from.
struct SurfaceTriangle {
    std::array<uint32_t, 3> vertices;  // counter-clockwise seen from outside
    uint32_t source;                   // triangle of the source mesh it is part of
    uint32_t places = none;            // entry of CutPlaces; none: it is all of that triangle
};

// Where on their source triangles those lie that are only parts of them.
class CutPlaces {
public:
    // Per corner: weights of the source triangle's corners 1 and 2; that of corner 0 is what is left to 1.
    using Corners = std::array<glm::vec2, 3>;
    CutPlaces() = default;
    // Of entries made before.
    explicit CutPlaces(std::vector<Corners> entries) : entries_(std::move(entries)) {}
    const std::vector<Corners>& entries() const { return entries_; }  // by SurfaceTriangle::places
    // The place of a triangle.
    const Corners& of(const SurfaceTriangle& t) const { return t.places == none ? whole : entries_[t.places]; }
    // Takes the triangle's own entry, or makes one.
    void set(SurfaceTriangle& t, const Corners& corners) {
        if (t.places == none) {
            t.places = static_cast<uint32_t>(entries_.size());
            entries_.push_back(corners);
        } else {
            entries_[t.places] = corners;
        }
    }
    // The triangle with an entry of its own here, if it needs one.
    SurfaceTriangle adopt(SurfaceTriangle t, const CutPlaces& from) {
        if (t.places == none) return t;
        const Corners corners = from.of(t);
        t.places = none;
        set(t, corners);
        return t;
    }

private:
    static constexpr Corners whole{glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, 1)};
    std::vector<Corners> entries_;
};

// As half_edge_twins of mesh/topology.h.
std::vector<uint32_t> twins_of(std::span<const SurfaceTriangle> triangles, size_t vertices, bool* manifold = nullptr);

// A surface that is divided into charts.
struct Surface {
    std::vector<glm::dvec3> positions;       // per vertex, object units
    std::vector<SurfaceTriangle> triangles;  // with vertices of the surface
    CutPlaces places;                        // of its triangles
    uint32_t uncut = none;                   // vertices from this one on are there because charts were cut out

    // 3 t + k: the half-edge across the edge of triangle t from corner k to corner k + 1; none on the boundary.
    std::vector<uint32_t> twins() const { return twins_of(triangles, positions.size()); }
    // Of half-edge 3 t + k, object units.
    double length(uint32_t half_edge) const;
    double area(size_t triangle) const;  // object units squared
    double area() const;                 // of all triangles
    // Oriented manifold without bow-ties, indices in range, places within their source triangles.
    Result<void> validate() const;
};

// What surface_of changed so that clusters can be cut out of any mesh.
struct SurfaceChanges {
    uint32_t lone_triangles = 0;   // triangles without neighbours, made into four
    uint32_t boundary_chords = 0;  // inner edges with both ends on the boundary, split: no cluster may touch it twice
    uint32_t long_edges = 0;       // edges split because they were longer than wanted
};

// A mesh that repair() has made an oriented manifold. longest: edges above are halved, the longest first, so that what
// is cut out can have the size wanted (object units; 0 for none); of a mesh of needles only the longest are, so that
// the surface stays within a few times the triangles given.
Surface surface_of(const TriMesh& mesh, double longest = 0, SurfaceChanges* changes = nullptr);

// Twice the vector area of a triangle: normal times twice its area.
glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

}  // namespace lodestone::vgi
