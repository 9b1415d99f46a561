#include "lod/bake/orders/window_search.h"

#include <algorithm>
#include <numeric>

#include "base/none.h"
#include "lod/bake/orders/fan_order.h"

namespace lodestone {

namespace {

constexpr uint64_t slot_bytes = 12;  // three indices
// A plan is judged at its level, and at the one where this share of the faces has died besides.
constexpr double later_share = 0.15;

// What is tried: caches a little smaller lose less when gaps open.
struct FanTrial {
    uint32_t cache_less;
    FanWeights weights;
};
constexpr FanTrial fan_trials[] = {{0, small_fans}, {0, large_fans}, {1, small_fans}, {1, large_fans}};
constexpr size_t quick_candidates = 2;

Rollouts rollouts_of(uint32_t look_ahead, std::span<const uint32_t> later) {
    return look_ahead == 0 ? Rollouts{} : Rollouts{6, look_ahead, 3, later};
}

// The first position of an order at which a wedge set is drawn whole.
class Hosts {
public:
    Hosts(std::span<const uint32_t> wedges, std::span<const uint32_t> order) {
        places_.reserve(order.size() * 3);
        for (uint32_t i = 0; i < order.size(); ++i) {
            for (uint32_t k = 0; k < 3; ++k) places_.emplace_back(wedges[size_t{order[i]} * 3 + k], i);
        }
        std::sort(places_.begin(), places_.end());
    }
    // The position of a face with all of the wedges; none where there is none.
    uint32_t of(const uint32_t* wedges) const {
        for (auto p = std::ranges::lower_bound(places_, std::pair(wedges[0], 0u));
             p != places_.end() && p->first == wedges[0]; ++p) {
            if (std::ranges::binary_search(places_, std::pair(wedges[1], p->second)) &&
                std::ranges::binary_search(places_, std::pair(wedges[2], p->second)))
                return p->second;
        }
        return none;
    }

private:
    std::vector<std::pair<uint32_t, uint32_t>> places_;  // wedge and position, sorted
};

}  // namespace

WindowSearch::WindowSearch(const OrderInput& input, uint32_t cache, const GreedyOptions& options)
    : input_(input),
      cache_(cache),
      options_(options),
      number_(input.wedges, none),
      stamp_(input.wedges, -1'000'000'000),
      line_stamp_(input.indices.size() * sizeof(uint32_t) / options.line_bytes + 1, 0) {}

std::vector<uint32_t> WindowSearch::first_order(const std::atomic<bool>* stop) {
    std::vector<uint32_t> best;
    double least = 0;
    Fans fans(input_.indices, input_.wedges);
    fans.stop = stop;
    const uint32_t level = level_after(0, static_cast<uint32_t>(input_.death.size()));
    std::vector<uint32_t> later;
    later.reserve(input_.indices.size());
    for (const uint32_t wedge : input_.indices) later.push_back(input_.ancestor(wedge, level));
    for (const FanTrial& candidate : std::span(fan_trials).first(quick_candidates)) {
        std::vector<uint32_t> order =
            fan_order(fans, cache_, candidate.weights, rollouts_of(options_.look_ahead, later));
        const double cost = transforms({}, input_.indices, order, {}, 0);
        if (best.empty() || cost < least) {
            least = cost;
            best = std::move(order);
        }
    }
    return best;
}

void WindowSearch::look_at(const DrawnFaces& faces, uint32_t level, uint32_t alive) {
    faces_ = &faces;
    level_ = level;
    later_ = level_after(level, alive);
}

uint32_t WindowSearch::level_after(uint32_t level, uint32_t alive) const {
    return std::min(level + static_cast<uint32_t>(later_share * alive / 2), input_.levels - 1);
}

void WindowSearch::line_is_written(uint32_t slot) {
    for (const uint64_t byte : {slot * slot_bytes, slot * slot_bytes + slot_bytes - 1})
        line_stamp_[byte / options_.line_bytes] = group_;
}
void WindowSearch::forget_lines() { ++group_; }

// The living faces before a slot that fill the cache, in drawing order.
std::vector<uint32_t> WindowSearch::slots_before(uint32_t slot) const {
    std::vector<uint32_t> slots;
    while (slot-- > 0 && slots.size() < cache_) {
        if (faces_->alive(slot)) slots.push_back(slot);
    }
    std::ranges::reverse(slots);
    return slots;
}

WindowSearch::Faces WindowSearch::collect(uint32_t first, uint32_t last, uint32_t end) const {
    Faces faces;
    for (uint32_t s = first; s < last; ++s) (faces_->alive(s) ? faces.alive : faces.dead).push_back(faces_->face_at(s));
    faces.own = static_cast<uint32_t>(faces.alive.size());
    for (uint32_t s = end; s < faces_->slots(); ++s) {
        if (faces_->alive(s)) faces.alive.push_back(faces_->face_at(s));
    }
    for (const uint32_t face : faces.alive) {
        const uint32_t* wedges = faces_->wedges(faces_->slot_of(face));
        for (uint32_t k = 0; k < 3; ++k) {
            faces.wedges[0].push_back(wedges[k]);
            faces.wedges[1].push_back(input_.ancestor(wedges[k], later_));
        }
    }
    faces.lead = slots_before(first);
    for (uint32_t s = last; s < end && faces.behind.size() < cache_; ++s) {
        if (faces_->alive(s)) faces.behind.push_back(s);
    }
    faces.tail_lead = slots_before(end);
    return faces;
}

uint32_t WindowSearch::number_wedges(const Faces& faces, std::vector<uint32_t> (&numbered)[2]) {
    std::vector<uint32_t> used;
    const auto number = [&](uint32_t wedge) {
        if (number_[wedge] == none) {
            number_[wedge] = static_cast<uint32_t>(used.size());
            used.push_back(wedge);
        }
        return number_[wedge];
    };
    for (const uint32_t slot : faces.lead) {
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t wedge = faces_->wedges(slot)[k];
            numbered[0].push_back(number(wedge));
            numbered[1].push_back(number(input_.ancestor(wedge, later_)));
        }
    }
    for (size_t i = 0; i < 2; ++i) {
        for (const uint32_t wedge : faces.wedges[i]) numbered[i].push_back(number(wedge));
    }
    for (const uint32_t wedge : used) number_[wedge] = none;
    return static_cast<uint32_t>(used.size());
}

// Of the faces `order` of `wedges` and of those behind, after those of the lead.
double WindowSearch::transforms(std::span<const uint32_t> lead, std::span<const uint32_t> wedges,
                                std::span<const uint32_t> order, std::span<const uint32_t> behind, uint32_t level) {
    now_ += cache_ + 1;
    const auto draw = [&](uint32_t wedge) {
        if (!cached(wedge)) stamp_[wedge] = now_++;
    };
    const auto draw_slots = [&](std::span<const uint32_t> slots) {
        for (const uint32_t slot : slots) {
            for (uint32_t k = 0; k < 3; ++k) draw(input_.ancestor(faces_->wedges(slot)[k], level));
        }
    };
    draw_slots(lead);
    const int64_t before = now_;
    for (const uint32_t f : order) {
        for (uint32_t k = 0; k < 3; ++k) draw(wedges[size_t{f} * 3 + k]);
    }
    draw_slots(behind);
    return static_cast<double>(now_ - before);
}

// As the faces lie; the mean of both levels.
double WindowSearch::transforms_now(const Faces& faces) {
    std::vector<uint32_t> own(faces.alive.size());
    std::iota(own.begin(), own.end(), 0u);
    const auto taken = std::span(own).subspan(faces.own);
    double sum = 0;
    for (size_t i = 0; i < 2; ++i) {
        const uint32_t level = i == 0 ? level_ : later_;
        sum += transforms(faces.lead, faces.wedges[i], std::span(own).first(faces.own), faces.behind, level) / 2;
        if (!taken.empty()) sum += transforms(faces.tail_lead, faces.wedges[i], taken, {}, level) / 2;
    }
    return sum;
}

// The living in their order, and dead ones where they cost no transform, as many as there is room for: a dead face is
// drawn behind a living one that has its wedges. The dead left over go to the slots of the faces taken.
std::vector<uint32_t> WindowSearch::with_dead(const Faces& faces, std::span<const uint32_t> order, size_t slots) const {
    const Hosts hosts(faces.wedges[0], order);
    std::vector<std::pair<uint32_t, uint32_t>> placed;  // position and face
    std::vector<uint32_t> homeless;
    const size_t room = slots - order.size();
    for (const uint32_t face : faces.dead) {
        const uint32_t host = placed.size() < room ? hosts.of(faces_->wedges(faces_->slot_of(face))) : none;
        if (host == none) {
            homeless.push_back(face);
        } else {
            placed.emplace_back(host, face);
        }
    }
    for (size_t i = 0; placed.size() < room && i < homeless.size(); ++i)
        placed.emplace_back(static_cast<uint32_t>(order.size()) - 1, homeless[i]);
    std::ranges::stable_sort(placed, {}, &std::pair<uint32_t, uint32_t>::first);
    std::vector<uint32_t> arranged;
    arranged.reserve(slots);
    size_t next = 0;
    for (uint32_t i = 0; i < order.size(); ++i) {
        arranged.push_back(faces.alive[order[i]]);
        for (; next < placed.size() && placed[next].first == i; ++next) arranged.push_back(placed[next].second);
    }
    return arranged;
}

void WindowSearch::count_writes(WindowPlan& plan, const Faces& faces) {
    plan.writes = static_cast<uint32_t>(faces.alive.size()) - faces.own;
    plan.lines = 0;
    uint64_t last_line = ~uint64_t{0};
    for (uint32_t i = 0; i < plan.faces.size(); ++i) {
        const uint32_t slot = plan.first + i;
        if (faces_->face_at(slot) == plan.faces[i]) continue;
        ++plan.writes;
        const uint64_t line = slot * slot_bytes / options_.line_bytes;
        plan.lines += line != last_line && line_stamp_[line] != group_ ? 1 : 0;
        last_line = line;
    }
}

WindowPlan WindowSearch::plan(uint32_t first, uint32_t last, uint32_t end, bool careful) {
    const Faces faces = collect(first, last, end);
    WindowPlan best;
    best.first = first, best.last = last, best.end = end;
    best.taken = static_cast<uint32_t>(faces.alive.size()) - faces.own;
    if (faces.alive.empty()) return best;
    std::vector<uint32_t> numbered[2];
    const uint32_t vertices = number_wedges(faces, numbered);
    const Fans fans(numbered[0], vertices);
    const auto lead = static_cast<uint32_t>(faces.lead.size());
    const double before = transforms_now(faces);
    const bool whole = first == 0 && last == faces_->slots();  // then no dead slot is needed
    const size_t tried = careful ? std::size(fan_trials) : quick_candidates;
    for (size_t c = 0; c < tried; ++c) {
        const uint32_t cache = std::max(3u, cache_ - std::min(cache_, fan_trials[c].cache_less));
        const Rollouts ahead =
            careful && c < quick_candidates ? rollouts_of(options_.look_ahead, numbered[1]) : Rollouts{};
        std::vector<uint32_t> order = fan_order(fans, cache, fan_trials[c].weights, ahead, lead);
        for (uint32_t& f : order) f -= lead;
        WindowPlan plan;
        plan.first = first, plan.last = last, plan.end = end, plan.taken = best.taken, plan.whole = whole;
        plan.saved = before;
        for (size_t i = 0; i < 2; ++i)
            plan.saved -= transforms(faces.lead, faces.wedges[i], order, faces.behind, i == 0 ? level_ : later_) / 2;
        plan.faces = with_dead(faces, order, whole ? order.size() : last - first);
        count_writes(plan, faces);
        if (c == 0 || worth(plan) > worth(best)) best = std::move(plan);
    }
    return best;
}

}  // namespace lodestone
