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
// of those that rest on something else, any motion of less than their allowed_motion.
struct Slack {
    float nearer = std::numeric_limits<float>::infinity(), farther = std::numeric_limits<float>::infinity();
    float allowed_motion = std::numeric_limits<float>::infinity(), lever = 0;

    // Of a decision of the second kind.
    void add(float own_motion, float own_lever) {
        allowed_motion = std::min(allowed_motion, own_motion);
        lever = std::max(lever, own_lever);
    }
    void add(const Slack& other) {
        nearer = std::min(nearer, other.nearer);
        farther = std::min(farther, other.farther);
        add(other.allowed_motion, other.lever);
    }
    void add_none() { allowed_motion = -1; }
    bool holds_after(const Motion& motion, const Change& change) const {
        return allowed_motion > motion.of(lever) && nearer > change.nearer && farther > change.farther;
    }
    // Thereafter.
    Slack after(const Motion& motion, const Change& change) const {
        return {nearer - change.nearer, farther - change.farther, allowed_motion - motion.of(lever),
                lever + motion.distance};
    }
};

}  // namespace lodestone::vgi
