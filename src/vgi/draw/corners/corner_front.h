// Which corners of charts a cut wants (vgi/asset/corners.h), and the triangles of charts that have not all of theirs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/draw/corners/corner_tree.h"
#include "vgi/draw/cut/cut.h"

namespace lodestone::vgi {

class RefinementTest;
class Visibility;

class CornerFront {
public:
    // Corners of the atlas; all of them where `all`. tree, about: must outlive this.
    CornerFront(const CornerTree& tree, const Atlas& about, const RefinementTest& wanted, bool all);
    // Those of the first `count` corners that are wanted(texel), and whose parents are.
    template <class Wanted>
    CornerFront(const CornerTree& tree, const Atlas& about, uint32_t count, Wanted&& wanted)
        : tree_(tree), about_(about), all_(false) {
        front_.reserve(count);
        for (uint32_t i = 0; i < count; ++i) {
            const Corner& c = about.corners[i];
            const bool is_root = c.parent == i;
            const GeometryTexel texel{c.position[0], c.position[1], c.position[2], c.error, c.radius};
            if (is_root || (front_[c.parent].steps == 0 && wanted(texel))) {
                front_.push_back({i, 0});
            } else {
                front_.push_back({front_[c.parent].corner, front_[c.parent].steps + 1});
            }
        }
    }

    // Of these charts, rising, those whose four corners are all wanted.
    std::vector<uint32_t> whole_of(std::span<const uint32_t> charts) const;
    // The triangles of all other charts that have an area, for the views that may see them. wanted: by which the
    // corners were found.
    void add_triangles(const Visibility& visibility, const RefinementTest& wanted, CutParts& parts) const;
    // All of them, as Cut::parts has them. Where charts have nothing but normals, corners have an index each, whatever
    // their charts, and triangles the order that vertex caches like: who takes vertices from the CPU
    // (pulled_attributes) has the corner's own normal, and what else there is from the chart.
    std::vector<uint32_t> triangles() const;

private:
    // Calls add(the three corners that are drawn, the indices that draw them) for each.
    template <class Add>
    void for_triangles(Add&& add) const;
    bool is_whole(uint32_t chart) const;
    // A corner's nearest wanted ancestor, and how many parents up that is.
    struct Drawn {
        uint32_t corner, steps;
    };
    Drawn drawn(uint32_t corner) const;
    PageBounds around(const std::array<uint32_t, 3>& corners, const RefinementTest& wanted) const;

    const CornerTree& tree_;
    const Atlas& about_;
    bool all_;
    std::vector<Drawn> front_;  // of the first corners, all those that may be wanted
};

}  // namespace lodestone::vgi
