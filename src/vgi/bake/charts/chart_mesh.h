// A part of a surface taken out to be flattened and cut: vertices and triangles with numbers of their own, neighbours
// kept up to date while edges are split.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// Of two vectors of the plane, the area of the parallelogram that they span: positive where b is to the left of a.
inline double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

// The part that was taken out; most often a disk.
struct ChartMesh {
    std::vector<glm::dvec3> positions;       // per vertex, object units
    std::vector<glm::dvec2> flat;            // where each vertex lies in the plane, once flattened
    std::vector<uint32_t> origin;            // vertex of the surface; none for those that splits made
    std::vector<SurfaceTriangle> triangles;  // with vertices of the patch
    CutPlaces places;                        // of its triangles on the source mesh
    std::vector<uint32_t> twin;              // per half-edge 3 t + k; none on the patch's boundary

    // The vertex that half-edge h begins at.
    uint32_t from(uint32_t h) const { return triangles[h / 3].vertices[h % 3]; }
    uint32_t to(uint32_t h) const { return from(next_corner(h)); }  // where it ends

    // Puts a vertex on the edge of h, the share `at` (0 .. 1) of the way from from(h) to to(h): the triangles either
    // side become two each. flat_at: the same in the plane, where it may differ. Returns the vertex; h then ends in it.
    uint32_t split_edge(uint32_t h, double at, double flat_at);
    // One triangle becomes three around a vertex at its centre, in space and in the plane.
    uint32_t split_triangle(uint32_t t);

    // Boundary vertices in order, counter-clockwise, beginning with the lowest; of a disk.
    std::vector<uint32_t> boundary() const;
    std::vector<bool> on_boundary() const;  // per vertex
    // Vertex of the patch by vertex of the surface; those that splits made are left out.
    std::unordered_map<uint32_t, uint32_t> numbers() const;
    double area(uint32_t t) const;              // object units squared
    double signed_flat_area(uint32_t t) const;  // twice
    uint32_t flipped() const;                   // triangles without positive area in the plane
};

// The triangles listed, in that order; vertices numbered by first use.
ChartMesh take_chart_mesh(const Surface& surface, std::span<const uint32_t> triangles);

// Splits every inner edge whose ends both lie on the boundary, in the middle. A straight side can then be drawn with no
// triangle flattened to a line. Returns how many.
uint32_t split_chords(ChartMesh& patch);

}  // namespace lodestone::vgi
