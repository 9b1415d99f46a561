#include "vgi/draw/cut/cut_region.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "frame/screen_error.h"
#include "vgi/draw/cut/visibility.h"

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
    // What a turn moves the axes by, all together, is the square root of 8 times the sine of half its angle; the
    // angle's cosine would not tell less than 4e-4 radians from nothing.
    const glm::mat3 by = b - a;
    const float moved = std::sqrt(glm::dot(by[0], by[0]) + glm::dot(by[1], by[1]) + glm::dot(by[2], by[2]));
    const float angle = 2 * std::asin(std::min(1.0f, moved / std::sqrt(8.0f)));
    return {to.eye - from.eye, angle > 0 ? b * glm::transpose(a) : glm::mat3(1), angle};
}
float angle_between(const glm::vec3& a, const glm::vec3& b) {
    return 2 * std::asin(std::min(1.0f, glm::distance(a, b) / 2));  // of unit vectors; exact where they are equal
}
constexpr float turn_share = 1.5f;   // of a step's angle, for 1 of its length
constexpr float least_turn = 1e-4f;  // radians: a camera that does not turn is rounded from frame to frame
// share: Foresight::share.
CutMargin margin_for(const Step& step, const View& view, float share) {
    const float half = static_cast<float>(view.height) / 2 / view.focal_px;  // tangent
    const float turn = least_turn + turn_share * share * step.angle;
    return {share * glm::length(step.eye), std::min(turn, most_turn), 0.02f + turn / half};
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
View moved_view(const View& view, const glm::vec3& by, const glm::mat3& turn) {
    View next = view;
    next.eye += by;
    const glm::mat3 rotation = turn * glm::mat3(view.world_to_view);
    next.world_to_view = glm::mat4(rotation);
    next.world_to_view[3] = glm::vec4(-rotation * next.eye, 1);
    return next;
}

// Numbers of instances that are not the same in two sets of one size, rising.
std::vector<uint32_t> differing(const InstanceSet& before, const InstanceSet& now) {
    std::vector<uint32_t> numbers;
    if (const auto changed = now.changed_since(before.generation())) {
        numbers.assign(changed->begin(), changed->end());
        std::ranges::sort(numbers);
        numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    } else {
        for (uint32_t i = 0; i < now.size(); ++i) numbers.push_back(i);
    }
    std::erase_if(numbers, [&](uint32_t i) { return before[i] == now[i]; });
    return numbers;
}

bool inside(const View& view, const Frustum& frustum) {
    const glm::dmat4 to_world = glm::inverse(glm::dmat4(view.view_to_clip) * glm::dmat4(view.world_to_view));
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 p = to_world * glm::dvec4(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : 0, 1);
        const glm::dvec3 at = glm::dvec3(p) / p.w;
        for (const glm::vec4& plane : frustum.planes()) {
            const double distance = glm::dot(glm::dvec3(plane), at) + static_cast<double>(plane.w);
            if (distance < -1e-5 * glm::length(at)) return false;
        }
    }
    return true;
}

}  // namespace

CutRegion CutRegion::of(const FrameInput& input) {
    return {input.views, input.level_view, {}, input.instances, {}, input.budget};
}

const CutRegion::Moved* CutRegion::find_moved(uint32_t instance) const {
    const auto at = std::ranges::lower_bound(moved, instance, {}, &Moved::instance);
    return at != moved.end() && at->instance == instance ? &*at : nullptr;
}

void Foresight::see(const View& now) {
    if (last_ && before_) {
        const Step step = step_between(*before_, *last_);
        const View thought = moved_view(*last_, step.eye, step.turn);
        const Step off = step_between(thought, now);
        // What does not move tells nothing of how it will.
        const float length = glm::length(step.eye), far = glm::length(off.eye), turned = turn_share * step.angle;
        const float turned_off = off.angle - least_turn;
        if (length > 0 || far > 0 || turned > least_turn || turned_off > 0) {
            const auto needed = [](float missed, float gone) {
                if (!(missed > 0)) return 0.0f;
                return missed > most * gone ? most : missed / gone;
            };
            needed_[next_++ % needed_.size()] = std::max(needed(far, length), needed(turned_off, turned));
        }
    }
    before_ = std::exchange(last_, now);
}

float Foresight::share() const {
    if (next_ < needed_.size()) return most;
    return std::clamp(1.5f * std::ranges::max(needed_), least, most);
}

std::optional<CutRegion> CutRegion::after(const FrameInput& last, const FrameInput& now, float share) {
    if (last.instances.size() != now.instances.size()) return std::nullopt;
    CutRegion region = of(now);
    const Step step = step_between(last.views[0], now.views[0]);
    if (last.views.size() != now.views.size() || last.views[0].eye != now.views[0].eye ||
        last.views[0].world_to_view != now.views[0].world_to_view) {
        region.views[0] = moved_view(now.views[0], step.eye, step.turn);
        region.margin = margin_for(step, now.views[0], share);
    }
    for (const uint32_t i : differing(last.instances, now.instances)) {
        const auto motion = rigid_motion(last.instances[i], now.instances[i]);
        if (!motion || last.instances[i].asset != now.instances[i].asset) return std::nullopt;
        region.moved.push_back({i, now.instances[i], region.margin});
        Moved& moved = region.moved.back();
        moved.there.object_to_world = glm::mat4(*motion * glm::dmat4(now.instances[i].object_to_world));
        // As far as the camera would have had to go to be seen so by the instance.
        const Step as_seen = step_between(carried(now.views[0], *motion), now.views[0]);
        moved.margin = sum(moved.margin, margin_for(as_seen, now.views[0], Foresight::most));
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
        // What casts shadows was told by the light's direction.
        if (input.views[v].shades_first_view_alone != views[v].shades_first_view_alone ||
            (views[v].shades_first_view_alone && input.views[v].forward() != views[v].forward()))
            return false;
        if (input.views[v].kind != views[v].kind || input.views[v].culls_back_faces != views[v].culls_back_faces)
            return false;
    }
    // Views as an instance sees them that stands where it is thought to be.
    const auto within = [&](std::span<const View> seen, const CutMargin& allowed) {
        if (glm::distance(seen[0].eye, views[0].eye) > allowed.distance) return false;
        if (angle_between(seen[0].forward(), views[0].forward()) > allowed.turn) return false;
        for (size_t v = 0; v < views.size(); ++v) {
            if (seen[v] != views[v] && !inside(seen[v], widened_frustum(views[v], allowed))) return false;
        }
        return true;
    };
    // Those that stand where they stood.
    if (moved.size() < instances.size() && input.views != views && !within(input.views, margin)) return false;
    // Those that moved, or were thought to.
    std::vector<uint32_t> elsewhere = differing(instances, input.instances);
    for (const Moved& m : moved) elsewhere.push_back(m.instance);
    std::ranges::sort(elsewhere);
    elsewhere.erase(std::unique(elsewhere.begin(), elsewhere.end()), elsewhere.end());
    for (const uint32_t i : elsewhere) {
        const Moved* const thought = find_moved(i);
        const Instance& there = thought != nullptr ? thought->there : instances[i];
        const CutMargin& own = thought != nullptr ? thought->margin : margin;
        if (input.instances[i] == there) {
            if (input.views != views && !within(input.views, own)) return false;
            continue;
        }
        if (level_view || input.instances[i].asset != there.asset) return false;
        const auto motion = rigid_motion(input.instances[i], there);
        if (!motion) return false;
        std::vector<View> seen;
        for (const View& view : input.views) seen.push_back(carried(view, *motion));
        if (!within(seen, own)) return false;
    }
    return true;
}

const Instance& CutRegion::there(const CutInstance& instance) const {
    return instance.moved != nullptr ? instance.moved->there : instances[instance.number];
}

const CutMargin& CutRegion::margin_of(const CutInstance& instance) const {
    return instance.moved != nullptr ? instance.moved->margin : margin;
}

CutInput cut_input(CutRegion region, std::vector<AtlasSnapshot> atlases, const InstanceTree& tree, const View* last) {
    CutInput input;
    input.atlases = std::move(atlases);
    if (last != nullptr && !region.level_view && last->eye != region.views[0].eye) {
        const glm::vec3 step = region.views[0].eye - last->eye;
        input.ahead = moved_view(region.views[0], step * frames_ahead, glm::mat3(1));
    }
    // Both at once: bits of views, and one more for the one ahead.
    const auto frusta_of = [&](const CutMargin& margin, bool casters_alone) {
        std::vector<Frustum> frusta = widened_frusta(region.views, margin, casters_alone);
        if (input.ahead) frusta.push_back(widened_frustum(*input.ahead, margin));
        return frusta;
    };
    const uint32_t further = 1u << region.views.size();
    const auto add = [&](uint32_t number, uint32_t seen_by, const CutRegion::Moved* moved) {
        if ((seen_by & (further - 1)) != 0) input.seen.push_back({number, seen_by & (further - 1), moved});
        if ((seen_by & further) != 0) input.seen_ahead.push_back({number, 1, moved});
    };
    // Those that stand are looked for in the tree, the others one by one.
    for (const InstanceTree::Seen& s : tree.seen(frusta_of(region.margin, true))) {
        if (region.find_moved(s.instance) == nullptr) add(s.instance, s.views, nullptr);
    }
    for (const CutRegion::Moved& m : region.moved) {
        const Sphere sphere = to_world(input.atlases[m.there.asset].atlas->charts.sphere(), m.there.object_to_world);
        const std::vector<Frustum> frusta = frusta_of(m.margin, false);
        uint32_t seen_by = 0;
        for (size_t v = 0; v < frusta.size(); ++v)
            seen_by |= frusta[v].touches(sphere.centre, sphere.radius) ? 1u << v : 0u;
        add(m.instance, seen_by, &m);
    }
    if (!region.moved.empty()) {
        std::ranges::sort(input.seen, {}, &CutInstance::number);
        std::ranges::sort(input.seen_ahead, {}, &CutInstance::number);
    }
    input.region = std::move(region);
    return input;
}

}  // namespace lodestone::vgi
