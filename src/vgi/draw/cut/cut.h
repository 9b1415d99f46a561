// What cuts through an atlas for one instance have in common, however they are made of triangles: what is asked for
// and what comes of it. Two ways: bintree_cut.h and grid_cut.h.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "frame/view.h"
#include "vgi/draw/cut/page_demand.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

// By how much eyes and frusta may be elsewhere than where the views of a request have them.
struct CutMargin {
    float distance = 0;  // world units, of eyes and planes
    float turn = 0;      // radians, of the direction that a camera looks in
    float widening = 0;  // of the tangents of a camera's half angles, as a share
    bool operator==(const CutMargin&) const = default;
};
inline constexpr float most_turn = 0.1f;  // of a margin: it takes finer samples aside

// What a frame wants of an instance.
struct CutRequest {
    glm::mat4 object_to_world{1};
    std::span<const View> views;
    const View* level_view = nullptr;  // sets the levels; views[0] where there is none
    double pixel_error = 1;            // pixels, > 0
    int64_t forced_level = -1;         // >= 0: this level of samples everywhere
    bool forced_leaves = false;        // with a forced level: leaves wherever they are
    bool cull_back_faces = true;       // views[0] may leave out what shows it none but back faces
    bool casters_alone = true;         // View::shades_first_view_alone is heeded
    CutMargin margin;
    // Where it is given, all of the atlas counts to be so far away, object units, and is seen from all around: a cut
    // for whatever instance is no nearer. Of the views only the one that sets the levels counts then, for its
    // magnification.
    std::optional<float> distance;
    const View& sets_levels() const { return level_view != nullptr ? *level_view : views[0]; }
};

struct Cut {
    // Triangles by the set of views they are for (bit v: views[v]), in ascending order, each an index list: slot of the
    // sample's page times LODE_VGI_PAGE_TEXELS, plus its place in the page; counter-clockwise seen from outside. Or, of
    // patches that a device tessellates, their records (shaders/shared/vgi_texels.h). Or corners of charts that are
    // drawn where another is (LODE_VGI_CORNER there).
    std::vector<std::pair<uint32_t, std::vector<uint32_t>>> parts;
    uint64_t triangles = 0;  // of all parts that views[0] has, without flat ones
};

// What a missing page counts, for the views in `mask`: less where views[0] does not see it.
inline float wish_for(float excess, uint32_t mask) {
    return std::max(excess, 1e-6f) * ((mask & 1) != 0 ? 1.0f : 0.25f);
}

// The parts of a cut while it is made.
class CutParts {
public:
    std::vector<uint32_t>& list(uint32_t mask) {
        if (parts_.empty() || mask != parts_[last_].first) {
            last_ = 0;
            while (last_ < parts_.size() && parts_[last_].first != mask) ++last_;
            if (last_ == parts_.size()) parts_.emplace_back(mask, std::vector<uint32_t>{});
        }
        return parts_[last_].second;
    }
    // None where there are none of these views.
    const std::vector<uint32_t>* find(uint32_t mask) const {
        const auto at = std::ranges::find(parts_, mask, &std::pair<uint32_t, std::vector<uint32_t>>::first);
        return at == parts_.end() ? nullptr : &at->second;
    }
    // Empties all lists and keeps their room.
    void clear() {
        for (auto& part : parts_) part.second.clear();
    }
    // Appends those of others, in their order.
    void add(std::span<const CutParts* const> others);
    // In order of their masks.
    std::vector<std::pair<uint32_t, std::vector<uint32_t>>> take();

private:
    std::vector<std::pair<uint32_t, std::vector<uint32_t>>> parts_;
    size_t last_ = 0;
};

struct IncrementalCut;

// A technique that makes one instance into triangles.
class Cutter {
public:
    virtual ~Cutter() = default;
    // Whether charts whose corners are not all wanted are drawn without their samples (corner_front.h).
    virtual bool moves_corners() const { return false; }
    // Whether cuts are lists of triangles; if not, of patches.
    virtual bool makes_triangles() const { return true; }
    // charts: those that some view sees, rising. demand: takes the pages that are used and missed. kept: what the cut
    // before left for this one, and this one leaves for the next; a technique that needs nothing of it leaves it alone.
    virtual Cut cut(const Residency& residency, const CutRequest& request, std::span<const uint32_t> charts,
                    PageDemand& demand, IncrementalCut& kept) const = 0;
};

}  // namespace lodestone::vgi
