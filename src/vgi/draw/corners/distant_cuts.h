// Cuts of corners alone. Where an instance is so far away that no chart of it may have all of its corners, its cut is
// nothing but triangles of corners (corner_front.h), and which of them are wanted is told from how far away it is:
// instances that are about as far share a list (cut/shared_cuts.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <limits>
#include <map>
#include <vector>

#include "frame/instance_set.h"
#include "frame/screen_error.h"
#include "vgi/asset/error_codes.h"
#include "vgi/draw/corners/corner_tree.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/refinement_test.h"

namespace lodestone::vgi {

// How far away instances count to be for views that differ from one by no more than a margin.
class InstanceDistance {
public:
    InstanceDistance(const View& view, const CutMargin& margin);

    // What no point of the sphere is nearer than, object units; may be below 0. around: object space.
    double nearest(const glm::mat4& object_to_world, const Sphere& around) const;

private:
    CountedDistance away_;
    glm::dmat3 to_view_;
    glm::dvec3 eye_;
    double margin_;  // world units
};

// Those of one atlas.
class DistantCuts {
public:
    // tree, about: must outlive this.
    DistantCuts(const CornerTree& tree, const Atlas& about);

    // For which errors: magnification_of. What was made for others is forgotten.
    void begin(double magnification);
    // Nearer than that some chart may have all of its corners; object units; infinite where some chart
    // always has.
    double least() const { return least_; }
    // Triangles that instances in a step are drawn with, an index list as Cut::parts has it. Good until begin().
    const std::vector<uint32_t>& triangles(int32_t step);

    // Distances in steps: the one that `nearest` > 0 is in, and where a step begins. Object units.
    static int32_t step_within(double nearest) {
        return static_cast<int32_t>(std::floor(steps_per_octave * std::log2(nearest)));
    }
    static double reach_of(int32_t step) { return std::exp2(step / steps_per_octave); }
    // The first step that begins no nearer than `least` >= 0.
    static int32_t step_from(double least) {
        if (!std::isfinite(least)) return std::numeric_limits<int32_t>::max();
        int32_t step = step_within(std::max(least, 1e-30));
        while (reach_of(step) < least) ++step;
        return step;
    }
    static constexpr double rounded = 1e-5;  // of distances, what float arithmetic may lose on the way, as a share

private:
    static constexpr double steps_per_octave = 8;
    // From within which distance it is wanted, object units.
    double reach_of(SampleCodes codes) const;

    const CornerTree* tree_;
    const Atlas* about_;
    ErrorCodes codes_;
    double magnification_ = 0;
    double least_;
    std::map<int32_t, std::vector<uint32_t>> made_;
};

}  // namespace lodestone::vgi
