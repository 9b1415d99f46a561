// Refinement: where charts come out too stretched, or not at all, clusters are cut finer and all is made again. Here is
// which clusters, how much finer, and when that ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lodestone::vgi {

// What a round has shown of its clusters.
struct RoundQuality {
    std::vector<bool> bad;        // that a chart of it is stretched too much or could not be made
    std::vector<double> stretch;  // the largest of its bad charts, as far as it counts; 0 where they could not be made
    // How bad a chart of such an area and stretch is, 0 where it is within the bound. Orders of magnitude count, for a
    // round that leaves a millionfold stretch a thousandfold was not in vain.
    static double cost(double area, double stretch, double bound);
};

class Refinement {
public:
    // clusters: wanted. bound: of stretch. triangles: of the source. most_rounds > 0.
    Refinement(uint32_t clusters, double bound, size_t triangles, uint32_t most_rounds);

    // A round with so many clusters begins.
    void begin(uint32_t clusters);
    // Told how many triangles the surface has once it is cut into quads.
    void cut(size_t triangles);
    // Whether it is the last: what is stretched in it is taken as it is.
    bool is_last() const;
    // Beyond which stretch a chart is bad: what was asked for, or, once clusters are as many as there may be, far more.
    double bound() const;
    // Told the cost of all its charts (by that bound): whether another round is worth its time.
    bool improves(double cost, const RoundQuality& quality);
    // Whether next to nothing is stretched too much, and that slightly: of an atlas with leaves, which are exact there,
    // too. cost: the same, over the area of the surface.
    bool leaves_little(double cost, const RoundQuality& quality) const;
    // Per cluster: how many times denser clusters are to be there than they were, 1 or more. Those stretched most come
    // first as long as there may be more clusters; bad ones beyond that are made anew as dense as they were.
    // wanted: per cluster, how many were wanted where it is.
    std::vector<double> times_denser(const RoundQuality& quality, std::span<const double> wanted) const;

private:
    const uint32_t wanted_;
    const double bound_;
    const size_t triangles_;
    const uint32_t most_rounds_;
    uint32_t rounds_ = 0, clusters_ = 0, most_clusters_ = 0, full_ = 0;  // full: rounds with as many as there may be
    double cost_ = std::numeric_limits<double>::infinity();
    size_t in_vain_ = 0, cut_triangles_ = 0;
};

}  // namespace lodestone::vgi
