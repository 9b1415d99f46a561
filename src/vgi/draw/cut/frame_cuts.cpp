#include "vgi/draw/cut/frame_cuts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>

#include "base/check.h"
#include "vgi/bake/images/sample_errors.h"
#include "vgi/draw/cut/bintree_cut.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"
#include "vgi/study/grid_cut.h"

namespace lodestone::vgi {

namespace {

constexpr float frames_ahead = 12;  // that the camera's way is prefetched
constexpr float most_wasted = 2;    // times smaller than wanted, that an error may be

// How the camera moved from one view to the next.
struct Step {
    glm::vec3 eye;
    glm::mat3 turn;  // of view space
    float angle;     // radians, of the turn
};
Step step_between(const View& from, const View& to) {
    const glm::mat3 a(from.world_to_view), b(to.world_to_view);
    const glm::mat3 turn = b * glm::transpose(a);
    const float cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2;
    return {to.eye - from.eye, turn, std::acos(std::clamp(cosine, -1.0f, 1.0f))};
}
float angle_between(const glm::vec3& a, const glm::vec3& b) {
    return 2 * std::asin(std::min(1.0f, glm::distance(a, b) / 2));  // of unit vectors; exact where they are equal
}
CutMargin margin_for(const Step& step, const View& view) {
    const float half = static_cast<float>(view.height) / 2 / view.focal_px;  // tangent
    return {0.5f * glm::length(step.eye), std::min(0.75f * step.angle, most_turn), 0.02f + 0.75f * step.angle / half};
}
CutMargin sum(const CutMargin& a, const CutMargin& b) {
    return {a.distance + b.distance, std::min(a.turn + b.turn, most_turn), a.widening + b.widening};
}

// What carries an instance from one place to another, where it keeps its size and shape.
std::optional<glm::dmat4> rigid_motion(const Instance& from, const Instance& to) {
    const glm::dmat4 motion = glm::dmat4(to.object_to_world) * glm::inverse(glm::dmat4(from.object_to_world));
    const glm::dmat3 turn(motion), off = glm::transpose(turn) * turn - glm::dmat3(1);
    double most = 0;
    for (int k = 0; k < 3; ++k) most = std::max({most, std::abs(off[k][0]), std::abs(off[k][1]), std::abs(off[k][2])});
    if (!(most < 1e-5)) return std::nullopt;
    return motion;
}
View carried(const View& view, const glm::dmat4& motion) {
    View along = view;
    along.eye = glm::vec3(motion * glm::dvec4(view.eye, 1));
    along.world_to_view = glm::mat4(glm::dmat4(view.world_to_view) * glm::inverse(motion));
    return along;
}
View moved(const View& view, const glm::vec3& by, const glm::mat3& turn) {
    View next = view;
    next.eye += by;
    const glm::mat3 rotation = turn * glm::mat3(view.world_to_view);
    next.world_to_view = glm::mat4(rotation);
    next.world_to_view[3] = glm::vec4(-rotation * next.eye, 1);
    return next;
}

bool inside(const View& view, const Frustum& frustum) {
    const glm::dmat4 to_world = glm::inverse(glm::dmat4(view.view_to_clip) * glm::dmat4(view.world_to_view));
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 p = to_world * glm::dvec4(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : 0, 1);
        const glm::dvec3 at = glm::dvec3(p) / p.w;
        for (const glm::vec4& plane : frustum.planes) {
            const double distance = glm::dot(glm::dvec3(plane), at) + static_cast<double>(plane.w);
            if (distance < -1e-5 * glm::length(at)) return false;
        }
    }
    return true;
}

CutRequest request_for(Raster raster, const CutRegion& region, size_t instance, double raised, int64_t level) {
    CutRequest request;
    request.object_to_world = region.instances[instance].object_to_world;
    request.views = region.views;
    request.level_view = region.level_view ? &*region.level_view : nullptr;
    request.pixel_error = region.budget.pixel_error * raised;
    request.forced_level = level;
    request.by_area = raster == Raster::grid_area;
    request.cull_back_faces = region.views[0].culls_back_faces;
    request.margin = region.margins[instance];
    return request;
}

Cut cut_atlas(Raster raster, const Residency& residency, const CutRequest& request, PageDemand& demand,
              IncrementalCut& kept) {
    if (raster == Raster::bintree) return cut_bintree(residency, request, demand, kept);
    return cut_grid(residency, request, demand, raster == Raster::tess ? GridOutput::patches : GridOutput::indices);
}

// What was found of one atlas' pages.
struct Found {
    PageDemand demand;
    std::vector<float> prefetched, attribute_demand;
    std::vector<uint8_t> attribute_touched;
};

}  // namespace

CutRegion CutRegion::of(const FrameInput& input) {
    return {input.views, input.level_view, input.instances, std::vector<CutMargin>(input.instances.size()),
            input.budget};
}

std::optional<CutRegion> CutRegion::after(const FrameInput& last, const FrameInput& now) {
    if (last.instances.size() != now.instances.size()) return std::nullopt;
    CutRegion region = of(now);
    const Step step = step_between(last.views[0], now.views[0]);
    if (last.views.size() != now.views.size() || last.views[0].eye != now.views[0].eye ||
        last.views[0].world_to_view != now.views[0].world_to_view) {
        region.views[0] = moved(now.views[0], step.eye, step.turn);
        region.margins.assign(region.margins.size(), margin_for(step, now.views[0]));
    }
    for (size_t i = 0; i < now.instances.size(); ++i) {
        if (last.instances[i] == now.instances[i]) continue;
        const auto motion = rigid_motion(last.instances[i], now.instances[i]);
        if (!motion || last.instances[i].asset != now.instances[i].asset) return std::nullopt;
        region.instances[i].object_to_world = glm::mat4(*motion * glm::dmat4(now.instances[i].object_to_world));
        // As far as the camera would have had to go to be seen so by the instance.
        const Step as_seen = step_between(carried(now.views[0], *motion), now.views[0]);
        region.margins[i] = sum(region.margins[i], margin_for(as_seen, now.views[0]));
    }
    // Errors are thought to go on as they did, too; a smaller one does no harm.
    const double ratio = now.budget.pixel_error / last.budget.pixel_error;
    if (ratio != 1) region.budget.pixel_error *= std::clamp(std::min(ratio, 1.0), 0.7, 1.0) * 0.97;
    return region;
}

bool CutRegion::covers(const FrameInput& input) const {
    const double error = input.budget.pixel_error;
    if (input.views.size() != views.size() || input.level_view != level_view ||
        input.instances.size() != instances.size() || input.budget.forced_level != budget.forced_level ||
        input.budget.max_triangles != budget.max_triangles || budget.pixel_error > error ||
        budget.pixel_error * most_wasted < error)
        return false;
    if (std::abs(input.views[0].focal_px / views[0].focal_px - 1) > 1e-5f) return false;
    for (size_t v = 0; v < views.size(); ++v) {
        if (input.views[v].kind != views[v].kind || input.views[v].culls_back_faces != views[v].culls_back_faces)
            return false;
    }
    // Views as an instance sees them that stands where it is thought to be.
    const auto within = [&](std::span<const View> seen, const CutMargin& margin) {
        if (glm::distance(seen[0].eye, views[0].eye) > margin.distance) return false;
        if (angle_between(seen[0].forward(), views[0].forward()) > margin.turn) return false;
        for (size_t v = 0; v < views.size(); ++v) {
            if (seen[v] != views[v] && !inside(seen[v], widened_frustum(views[v], margin))) return false;
        }
        return true;
    };
    std::optional<CutMargin> enough;  // for those that stand there
    for (size_t i = 0; i < instances.size(); ++i) {
        if (input.instances[i] == instances[i]) {
            if (input.views == views || enough == margins[i]) continue;
            if (!within(input.views, margins[i])) return false;
            enough = margins[i];
            continue;
        }
        if (level_view || input.instances[i].asset != instances[i].asset) return false;
        const auto motion = rigid_motion(input.instances[i], instances[i]);
        if (!motion) return false;
        std::vector<View> seen;
        for (const View& view : input.views) seen.push_back(carried(view, *motion));
        if (!within(seen, margins[i])) return false;
    }
    return true;
}

FrameCuts make_cuts(std::span<OpenAtlas> atlases, Raster raster, CutRegion wanted, const FrameInput* last,
                    const CutLimits& limits, std::vector<IncrementalCut>& kept) {
    FrameCuts result;
    result.region = std::move(wanted);
    const CutRegion& region = result.region;
    const Budget& budget = region.budget;
    for (OpenAtlas& atlas : atlases) atlas.residency->update();
    uint32_t levels = 1;
    for (const OpenAtlas& atlas : atlases) levels = std::max(levels, atlas.file->about().levels());

    kept.resize(region.instances.size());
    // From what the last cuts needed: views change little.
    result.raised = limits.raised;
    if (may_lower(limits.triangles, budget.max_triangles) && may_lower(limits.words, limits.most_words))
        result.raised = std::max(1.0, result.raised / error_scale_step);
    result.level = budget.forced_level;
    const View& sets_levels = region.level_view ? *region.level_view : region.views[0];
    std::vector<Found> found(atlases.size());
    std::vector<Cut> cuts;
    for (;;) {
        cuts.clear();
        for (size_t a = 0; a < atlases.size(); ++a) found[a].demand = PageDemand(atlases[a].residency->pages());
        result.triangles = 0;
        uint64_t words = 0;
        for (size_t i = 0; i < region.instances.size(); ++i) {
            const uint32_t asset = region.instances[i].asset;
            LODE_CHECK(asset < atlases.size(), asset, atlases.size());
            if (raster == Raster::device) continue;
            cuts.push_back(cut_atlas(raster, *atlases[asset].residency,
                                     request_for(raster, region, i, result.raised, result.level), found[asset].demand,
                                     kept[i]));
            result.triangles += cuts.back().triangles;
            for (const auto& part : cuts.back().parts) words += part.second.size();
        }
        // Too many: all errors rise alike, and where they may not rise further one level is drawn everywhere.
        if (result.triangles <= budget.max_triangles && words <= limits.most_words) break;
        if (result.level >= 0) {
            if (result.level >= levels - 1) break;
            ++result.level;
        } else if (magnification_of(sets_levels, budget.pixel_error * result.raised) <= least_magnification) {
            result.level = 0;
        } else {
            result.raised *= error_scale_step;
        }
    }
    result.pixel_error = budget.pixel_error * result.raised;
    auto lists = std::make_shared<std::vector<uint32_t>>();
    size_t total = 0;
    for (const Cut& cut : cuts) {
        for (const auto& part : cut.parts) total += part.second.size();
    }
    lists->reserve(total);
    for (uint32_t i = 0; i < cuts.size(); ++i) {
        for (const auto& [mask, words] : cuts[i].parts) {
            result.parts.push_back({i, mask, static_cast<uint32_t>(words.size())});
            lists->insert(lists->end(), words.begin(), words.end());
        }
    }
    result.words = std::move(lists);

    // Attributes, and what will be wanted further along the way.
    for (size_t a = 0; a < atlases.size(); ++a) {
        found[a].attribute_demand.assign(atlases[a].attributes->pages(), 0.0f);
        found[a].attribute_touched.assign(atlases[a].attributes->pages(), 0);
        found[a].prefetched.assign(atlases[a].residency->pages(), 0.0f);
    }
    const bool moves =
        last != nullptr && result.level < 0 && !region.level_view && last->views[0].eye != region.views[0].eye;
    std::vector<View> ahead;
    if (moves) {
        const glm::vec3 step = region.views[0].eye - last->views[0].eye;
        ahead = {moved(region.views[0], step * frames_ahead, glm::mat3(1))};
    }
    for (size_t i = 0; i < region.instances.size(); ++i) {
        const OpenAtlas& atlas = atlases[region.instances[i].asset];
        Found& f = found[region.instances[i].asset];
        CutRequest request = request_for(raster, region, i, result.raised, result.level);
        atlas.attributes->want(atlas.residency->about(), atlas.spacing, request, f.attribute_demand,
                               f.attribute_touched);
        if (!moves) continue;
        request.views = ahead;
        prefetch(*atlas.residency, request, f.demand.wanted, f.prefetched);
    }

    for (uint32_t a = 0; a < atlases.size(); ++a) {
        const OpenAtlas& atlas = atlases[a];
        const Found& f = found[a];
        for (const Layer layer : both_layers) {
            const bool geometry = layer == Layer::geometry;
            const auto& touched = geometry ? f.demand.touched : f.attribute_touched;
            const auto& wishes = geometry ? f.demand.wanted : f.attribute_demand;
            // Pages have higher numbers than their parents.
            for (uint32_t n = static_cast<uint32_t>(touched.size()); n-- > 0;) {
                if (touched[n]) result.touched[index_of(layer)].push_back(atlas.first[index_of(layer)] + n);
                if (wishes[n] > 0) {
                    result.wishes.push_back({wishes[n], layer, false, a, n});
                } else if (geometry && f.prefetched[n] > 0) {
                    result.wishes.push_back({f.prefetched[n], layer, true, a, n});
                }
            }
        }
    }
    sort_wishes(result.wishes);
    return result;
}

void sort_wishes(std::vector<FrameCuts::Wish>& wishes) {
    std::ranges::sort(wishes, [](const FrameCuts::Wish& x, const FrameCuts::Wish& y) {
        return x.wanted != y.wanted ? x.wanted > y.wanted
                                    : std::tuple(x.layer, x.atlas, x.number) < std::tuple(y.layer, y.atlas, y.number);
    });
}

}  // namespace lodestone::vgi
