// Distance between surfaces, measured on the surfaces themselves (a bounding-volume hierarchy), not on their vertices.
// Aspert, Santa-Cruz, Ebrahimi, "MESH: measuring errors between surfaces using the Hausdorff distance", 2002.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "mesh/position_index.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Answers closest-point queries on a set of triangles.
class ClosestSurface {
public:
    // Builds the search tree; needs neither array afterwards.
    // indices: three per triangle, into positions. Degenerate triangles count as the segment or point they are.
    ClosestSurface(std::span<const glm::vec3> positions, std::span<const uint32_t> indices);
    ~ClosestSurface();
    ClosestSurface(ClosestSurface&&) noexcept;  // the other may then only be destroyed

    // The closest point found.
    struct Hit {
        double distance = 0;    // object units
        uint32_t triangle = 0;  // index of the closest triangle
        glm::dvec3 point{0};    // closest point on it
    };
    static constexpr uint32_t no_hint = ~0u;  // no triangle is known to be near
    // The point of the surface that is closest to a point.
    // hint: a triangle likely to be near (its distance bounds the search), or no_hint. The mesh must have a triangle.
    // near_enough: object units; the search ends at the first triangle found that is no farther. Below 0: never.
    Hit closest(const glm::dvec3& point, uint32_t hint = no_hint, double near_enough = -1) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

// Distance from one surface to another, one way.
struct SurfaceDistance {
    double rms = 0;  // object units; over area-uniform samples
    double max = 0;  // largest distance found at a sample or a vertex
};
// Distance between two surfaces, both ways.
struct TwoSidedDistance {
    SurfaceDistance a_to_b, b_to_a;  // of the points of one to the other surface
    // The larger of the two sides, the symmetric rms; object units.
    double rms() const { return a_to_b.rms > b_to_a.rms ? a_to_b.rms : b_to_a.rms; }
    // The larger of the two sides, the (sampled) Hausdorff distance; object units.
    double max() const { return a_to_b.max > b_to_a.max ? a_to_b.max : b_to_a.max; }
};

// How closely surfaces are looked at.
struct DistanceOptions {
    size_t samples = 200000;            // area-uniform sample points on each surface
    size_t vertices = size_t{1} << 22;  // vertices looked at besides, for max; evenly chosen where there are more
    uint64_t seed = 1;                  // of the sample points; equal seeds give equal points
};

// A point of a surface and the triangle it is on.
struct SurfacePoint {
    glm::dvec3 place;   // as the mesh's positions
    uint32_t triangle;  // its number in the mesh
};
// Random points, stratified over the area, triangle after triangle; none where there is no area.
std::vector<SurfacePoint> points_by_area(const TriMesh& mesh, size_t count, uint64_t seed);

// The step between floats at the largest coordinate, object units: what is nearer than that counts as touching.
double resolution_of(const TriMesh& mesh);

// What a largest distance found at samples is multiplied with before it is promised as a bound: sampling finds almost
// the largest, never more.
inline constexpr double sampling_margin = 1.1;

// A surface made ready to be measured against others: its samples and its search tree.
class MeasuredSurface {
public:
    MeasuredSurface(const TriMesh& mesh, const DistanceOptions& options = {});  // the mesh must have a triangle
    ~MeasuredSurface();
    MeasuredSurface(MeasuredSurface&&) noexcept;  // the other may then only be destroyed
    // Distances of this surface's points to the other surface. Deterministic for any number of threads.
    SurfaceDistance to(const MeasuredSurface& other) const;
    // The larger of to(other).max and `at_least`, in a fraction of the time: what is nearer than that is not looked at
    // further, and what is nearer than a step between floats at the largest coordinate counts as touching. Object
    // units.
    double farthest_from(const MeasuredSurface& other, double at_least) const;

private:
    std::vector<glm::dvec3> samples_, vertices_;
    std::vector<glm::vec3> positions_;
    PositionIndex places_;  // of positions_
    ClosestSurface surface_;
    double resolution_;  // object units
};

// Both ways between two meshes, each with a triangle. Deterministic for any number of threads.
TwoSidedDistance surface_distance(const TriMesh& a, const TriMesh& b, const DistanceOptions& options = {});

}  // namespace lodestone
