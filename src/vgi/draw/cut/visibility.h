// Which views may see a page, told from its sphere and its cone of normals.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "shaders/shared/vgi_cut.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/slack.h"

namespace lodestone::vgi {

// Holds the frusta of all views that differ from this one by no more than the margin; planes as frustum_of.
Frustum widened_frustum(const View& view, const CutMargin& margin);
// Of each view. casters_alone: as CutRequest::casters_alone.
std::vector<Frustum> widened_frusta(std::span<const View> views, const CutMargin& margin, bool casters_alone);

// A page as a device looks at it. below: Residency::below.
gpu::VgiCutPage cut_page_of(const PageBounds& bounds, SampleCodes below);

class Visibility {
public:
    // about: its bounds are used; must outlive this.
    Visibility(const CutRequest& request, const Atlas& about);

    // Of a request for a distance there is one, which sees everything.
    uint32_t all() const { return frusta_.empty() ? 1 : (1u << frusta_.size()) - 1; }
    // Of the views in `mask`, those that may see something of the page, numbered over all charts.
    uint32_t seen(uint32_t mask, uint32_t number) const { return seen(mask, about_->bounds[number]); }
    // The same of any sphere and cone.
    uint32_t seen(uint32_t mask, const PageBounds& bounds) const;
    // The same; slack: how long that holds.
    uint32_t seen(uint32_t mask, const PageBounds& bounds, Slack& slack) const;
    uint32_t seen(uint32_t mask, uint32_t number, Slack& slack) const {
        return seen(mask, about_->bounds[number], slack);
    }
    // False of a request for a distance, of which everything is seen.
    bool leaves_out() const { return !frusta_.empty(); }

    // How far things moved since another was made for the same atlas; nothing where more than that has changed.
    std::optional<Motion> since(const Visibility& before) const;

    // For a device to tell the same.
    void describe(gpu::VgiCutInstance& instance) const;

private:
    bool turned_away(const PageBounds& bounds) const;

    const Atlas* about_;
    std::vector<Frustum> frusta_;  // object space
    glm::vec3 eye_{0};
    float scale_ = 1;       // world units to one of the object
    float eye_margin_ = 0;  // object units
    bool cones_ = false;    // views[0] leaves out back faces, and the surface is closed
};

}  // namespace lodestone::vgi
