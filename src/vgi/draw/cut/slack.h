// How long decisions of a cut hold while eye and instance move.
#pragma once

#include <algorithm>
#include <limits>

namespace lodestone::vgi {

// How far points moved, seen from the eye: one that was `lever` away by at most distance + angle * lever.
struct Motion {
    float distance = 0;  // world units
    float angle = 0;     // radians
    float of(float lever) const { return distance + angle * lever; }
};

inline Motion larger(const Motion& a, const Motion& b) {
    return {std::max(a.distance, b.distance), std::max(a.angle, b.angle)};
}

// How much nearer or farther than before anything in some place counts to be, at most; less than 0 where all of it
// counts to be farther, or nearer. World units.
struct Change {
    float nearer = 0, farther = 0;
};

// What decisions outlast, world units: that what they are about counts to be nearer or farther by less than this, and,
// of those that rest on something else, any motion of less than their slack.
struct Steadiness {
    float nearer = std::numeric_limits<float>::infinity(), farther = std::numeric_limits<float>::infinity();
    float slack = std::numeric_limits<float>::infinity(), lever = 0;

    // Of a decision of the second kind.
    void add(float own_slack, float own_lever) {
        slack = std::min(slack, own_slack);
        lever = std::max(lever, own_lever);
    }
    void add(const Steadiness& other) {
        nearer = std::min(nearer, other.nearer);
        farther = std::min(farther, other.farther);
        add(other.slack, other.lever);
    }
    void add_unsteady() { slack = -1; }
    bool outlasts(const Motion& motion, const Change& change) const {
        return slack > motion.of(lever) && nearer > change.nearer && farther > change.farther;
    }
    // Thereafter.
    Steadiness after(const Motion& motion, const Change& change) const {
        return {nearer - change.nearer, farther - change.farther, slack - motion.of(lever), lever + motion.distance};
    }
};

}  // namespace lodestone::vgi
