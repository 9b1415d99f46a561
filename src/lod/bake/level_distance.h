// How far the levels of a progressive mesh are from its source, followed from collapse to collapse.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "lod/asset/progressive_mesh.h"
#include "lod/asset/replay.h"
#include "mesh/distance/moving_surface.h"

namespace lodestone {

// A collapse changes the faces around one vertex and nothing else, so only what is near them is measured again, both
// ways. Points of the source (every vertex, and samples spread over the area) are kept with the face of the level that
// is closest to each; where that face changes, the faces that changed with it are looked at. A point they are all
// farther from than the largest distance so far is searched for in the whole level. Of each face that changed, a grid
// of points is looked up in the source. Around what comes near the largest distance so far, ever finer steps lead to
// the largest there.
class LevelDistance {
public:
    struct Options {
        uint64_t samples = 100000;  // of the source, spread by area; and of each level, as a measure of grids
        uint64_t seed = 1;
    };
    // pm: must outlive this, with orders; at least one triangle.
    LevelDistance(const ProgressiveMesh& pm, const Options& options);

    // One level coarser; not at the base. The largest distance found at any level so far, object units; 0 where all
    // are nearer than the step between floats at the largest coordinate.
    double ecol();
    // That step, object units.
    double resolution() const { return resolution_; }
    // A point that is as far as that from the other surface.
    struct Witness {
        glm::dvec3 place{0};
        bool of_source = false;  // or of the level at which the largest distance was found
    };
    const Witness& witness() const { return witness_; }

private:
    struct Point {
        glm::vec3 place;
        uint32_t next;  // of the same face
    };
    void collapse_faces();
    void collect_points();
    void place_points();
    bool other_has_edge(uint32_t face, uint32_t corner) const;
    bool near_source(const glm::dvec3& place, double enough) const;
    void look_from(uint32_t corner);
    void look_around(uint32_t point, const ClosestSurface::Hit& hit);
    void note(double distance, const glm::dvec3& place, bool of_source);

    const ProgressiveMesh& pm_;
    std::vector<glm::vec3> positions_;  // by wedge
    Replay replay_;
    ClosestSurface source_;
    MovingSurface level_;
    std::vector<Point> points_;          // samples, then vertices as they go
    std::vector<uint32_t> sampled_;      // by sample: the source triangle it is on
    std::vector<uint32_t> first_point_;  // by face
    std::vector<uint32_t> source_near_;  // by face: a source triangle near it
    std::vector<uint32_t> corners_;      // that the present collapse changed: 3 * face + k
    std::vector<uint32_t> displaced_;    // points whose face changed
    uint32_t ecol_ = 0, wedges_ = 0;
    double largest_ = 0, resolution_ = 0;
    Witness witness_;
    double samples_per_area_ = 0, spacing_ = 0;  // of level grids
};

}  // namespace lodestone
