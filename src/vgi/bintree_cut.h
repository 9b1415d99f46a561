// A cut through an atlas for one instance: the triangles of the bintree that the pixel error asks for, from what pages
// are there. Whether a sample is in it is a pure function of numbers that all triangles around it share, so the
// triangles fit together, across pages, charts and what is missing, with no look at neighbours.
// The papers are named in sample_errors.h.
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <span>
#include <utility>
#include <vector>

#include "frame/view.h"
#include "vgi/residency.h"

namespace lodestone::vgi {

// By how much eyes and frusta may be elsewhere than where the views of a request have them.
struct CutMargin {
    float distance = 0;  // world units, of eyes and planes
    float widening = 0;  // of the tangents of a camera's half angles, as a share
    bool operator==(const CutMargin&) const = default;
};

// What a frame wants of an instance.
struct CutRequest {
    glm::mat4 object_to_world{1};
    std::span<const View> views;
    const View* level_view = nullptr;  // sets the levels; views[0] where there is none
    double pixel_error = 1;            // pixels, > 0
    int64_t forced_level = -1;         // >= 0: this level everywhere
    bool cull_back_faces = true;       // views[0] may leave out what shows it none but back faces
    CutMargin margin;
    const View& sets_levels() const { return level_view != nullptr ? *level_view : views[0]; }
};

// How long a distance of an error is in a view: a sample of error E and radius r is wanted from within
// scale * (E * magnification + r), world units. Smaller than wanted errors are taken where the atlas asks for it.
double magnification_of(const View& view, double pixel_error);

struct Cut {
    // Triangles by the set of views they are for (bit v: views[v]), each an index list: slot of the sample's page times
    // LODE_VGI_PAGE_TEXELS, plus its place in the page. Counter-clockwise seen from outside.
    std::vector<std::pair<uint32_t, std::vector<uint32_t>>> parts;
    uint64_t triangles = 0;  // of all parts that views[0] has
};

// What a cut found of pages; accumulates over instances. Sized as the residency's pages.
struct PageDemand {
    std::vector<uint8_t> touched;  // 1: a sample of the page is in the cut
    // Of a missing page: how many times the pixel error leaving it out may cost, less where no camera sees it; 0: not
    // wanted.
    std::vector<float> wanted;
    explicit PageDemand(uint32_t pages = 0) : touched(pages, 0), wanted(pages, 0.0f) {}
};

Cut cut_bintree(const Residency& residency, const CutRequest& request, PageDemand& demand);

// Pages that views[0] of the request, an eye further along the camera's way, would want and `wanted` does not ask for.
// Both are sized as the residency's pages; what is foreseen counts less than what is wanted now.
void foresee(const Residency& residency, const CutRequest& request, std::span<const float> wanted,
             std::vector<float>& foreseen);

}  // namespace lodestone::vgi
