// How far the finest level is from the source, sampled on both. (The errors that cuts go by are bounds, measured place
// by place: sample_errors.h.)
#pragma once

#include <cstdint>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// A point of the source and where it lies in which chart.
struct SourceSample {
    glm::dvec3 position;
    glm::dvec2 place;
    uint32_t chart = 0;
    double area = 0;  // that it stands for, square object units
};
// So many, area-uniform over the chart; and its vertices, standing for no area, where they are no more.
std::vector<SourceSample> sample_source(uint32_t quad, const Chart& chart, uint32_t samples);

// The finest level against the source. To the image by looking around each sample's place, across borders too; back
// from random points of every chart, as many as it has samples, by a search of the whole source.
struct AtlasDistance {
    double rms = 0, max = 0;  // two-sided, object units; rms by area
};
AtlasDistance measure_finest(const Atlas& atlas, const TriMesh& source, const std::vector<SourceSample>& samples);

// The samples' distance to the finest level of their own charts, whose neighbours need not be there yet: mean square.
double mean_squared_distance(const Atlas& atlas, const std::vector<SourceSample>& samples);

// Squared distance of a point to the finest level within `reach` cells of a place of the square, of one chart; `most`
// where that is less.
double squared_distance_near(const Atlas& atlas, uint32_t chart, const glm::dvec2& place, int reach,
                             const glm::dvec3& point, double most = 1e300);

// The image's surface at a place of the square, 0 .. 1 each way, as Atlas::extract triangulates a level.
glm::dvec3 image_point(const Atlas& atlas, uint32_t chart, uint32_t level, const glm::dvec2& place);

}  // namespace lodestone::vgi
