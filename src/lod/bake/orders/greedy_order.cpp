#include "lod/bake/orders/greedy_order.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "base/check.h"
#include "lod/bake/orders/drawn_faces.h"
#include "lod/bake/orders/window_search.h"

namespace lodestone {

namespace {

// Slots that wear is counted for together; windows begin at multiples of it.
constexpr uint32_t block = 32;
// Slots of full detail that stay together when its runs are spread over the buffer.
constexpr uint32_t run_slots = 1024;
// A window is this part of the range, but no shorter than `least_window` and no longer than its option.
constexpr uint32_t windows = 8, least_window = 256;
// The whole range is ordered anew where it is at most so many windows long, or would be with this share of it alive;
// and whenever no larger share is.
constexpr double whole_windows = 1.25, whole_alive = 0.7;
// Faces taken from the end of the range at once, and the dead slots a window must have to take any; of a window.
constexpr double taken_share = 0.33, room_share = 0.11;
// Windows tried for each group, and the changed corners a slot must have seen before its window is.
constexpr size_t windows_tried = 3;
constexpr double worn = 0.5;
// A group ends sooner when it has so many collapses for each living face.
constexpr double soonest = 0.04;
// Groups whose moves may be saved up.
constexpr double saved_up = 4;

// The runs of an order by bit reversal of their numbers.
std::vector<uint32_t> spread_runs(const std::vector<uint32_t>& order) {
    const auto slots = static_cast<uint32_t>(order.size());
    const uint32_t runs = (slots + run_slots - 1) / run_slots;
    const int bits = std::bit_width(runs);
    std::vector<std::pair<uint32_t, uint32_t>> by_reversal;
    for (uint32_t run = 0; run < runs; ++run) {
        uint32_t reversed = 0;
        for (int b = 0; b < bits; ++b) reversed |= (run >> b & 1) << (bits - 1 - b);
        by_reversal.emplace_back(reversed, run);
    }
    std::ranges::sort(by_reversal);
    std::vector<uint32_t> spread;
    spread.reserve(slots);
    for (const auto& [reversed, run] : by_reversal) {
        const uint32_t begin = run * run_slots, end = std::min(slots, begin + run_slots);
        spread.insert(spread.end(), order.begin() + begin, order.begin() + end);
    }
    return spread;
}

struct Move {
    uint32_t slot = 0, face = 0;  // the face comes to the slot, and the one that was there to where that face was
};

// The moves that a plan takes, the first one last: along its cycles, so that a step which makes some of them writes
// hardly more slots than that; those that lead out of the window from where they come in. Where the plan is for the
// whole range, slot after slot: while such a plan is half made, half of what is drawn is then in its new order.
std::vector<Move> moves_of(const WindowPlan& plan, const DrawnFaces& faces) {
    const auto slots = static_cast<uint32_t>(plan.faces.size());
    const auto from = [&](uint32_t i) { return faces.slot_of(plan.faces[i]) - plan.first; };  // wraps before the window
    std::vector<bool> leaves(slots, false), done(slots, false);
    for (uint32_t i = 0; i < slots; ++i) {
        if (from(i) < slots) leaves[from(i)] = true;
    }
    std::vector<Move> moves;
    const auto follow = [&](uint32_t start) {
        for (uint32_t i = start; i < slots && !done[i]; i = from(i)) {
            done[i] = true;
            if (from(i) != i) moves.push_back({plan.first + i, plan.faces[i]});
        }
    };
    for (uint32_t i = 0; i < slots && !plan.whole; ++i) {
        if (!leaves[i]) follow(i);
    }
    for (uint32_t i = 0; i < slots && !plan.whole; ++i) follow(i);
    for (uint32_t i = 0; i < slots && plan.whole; ++i) moves.push_back({i, plan.faces[i]});
    std::ranges::reverse(moves);
    return moves;
}

class GreedyOrderer final : public FaceOrderer {
public:
    explicit GreedyOrderer(const OrderOptions& options)
        : cache_(options.cache.size), moves_(options.moves_per_ecol), options_(options.greedy), stop_(options.stop) {}

    std::string name() const override { return "greedy"; }
    bool in_place() const override { return true; }

    std::vector<uint32_t> first_order(const OrderInput& input) override {
        search_.emplace(input, cache_, options_);
        wear_.assign(input.death.size() / block + 1, 0);
        set_window(static_cast<uint32_t>(input.death.size()));
        near_.assign(wear_.size(), 0);
        return spread_runs(search_->first_order(stop_));
    }
    bool wants_order(uint32_t, uint32_t, uint32_t) override { return false; }
    void reorder(uint32_t, std::span<const uint32_t>, std::span<const uint32_t>, std::vector<uint32_t>&) override {}

    void permute(uint32_t level, std::span<const uint32_t> written, DrawnFaces& faces) override {
        for (const uint32_t slot : written) {
            ++wear_[slot / block];
            written_blocks_.push_back(slot / block);
            search_->line_is_written(slot);
        }
        budget_ = std::min(budget_ + moves_, saved_up * std::max<double>(window_, moves_ * options_.group));
        go_on(faces);
        const bool ends = ++collapses_ >= options_.group || collapses_ >= soonest * faces.alive_count();
        if (!ends) return;
        collapses_ = 0;
        set_window(faces.slots());
        if (faces.slots() > 2 && moves_left_.empty()) {
            search_->look_at(faces, level, faces.alive_count());
            if (const auto plan = choose(faces)) {
                budget_ -= plan->writes;
                moves_left_ = moves_of(*plan, faces);
                std::fill(wear_.begin() + plan->first / block, wear_.begin() + (plan->last + block - 1) / block, 0);
            }
        }
        written_blocks_.clear();
        search_->forget_lines();
    }

private:
    // Makes the next moves of the last plan, as many as one step may.
    void go_on(DrawnFaces& faces) {
        while (!moves_left_.empty() && faces.written() + 2 <= options_.step) {
            const Move move = moves_left_.back();
            moves_left_.pop_back();
            const uint32_t from = faces.slot_of(move.face);
            if (from != move.slot) faces.swap(from, move.slot);
        }
        if (!moves_left_.empty()) return;
        while (faces.slots() > 0 && !faces.alive(faces.slots() - 1)) faces.drop_last();
    }

    void set_window(uint32_t slots) {
        const uint32_t wanted = std::max(std::min(least_window, options_.window), slots / windows);
        span_ = std::max(1u, std::min(wanted, options_.window) / block);
        window_ = span_ * block;
    }

    // What this group does, if anything.
    std::optional<WindowPlan> choose(const DrawnFaces& faces) {
        const uint32_t slots = faces.slots(), alive = faces.alive_count();
        if (std::min<double>(slots, alive / whole_alive) <= whole_windows * window_) {
            if (alive > whole_alive * slots || budget_ < alive) return std::nullopt;
            return search_->plan(0, slots, slots, true);
        }
        if (budget_ < window_) return std::nullopt;
        if (slots > options_.waiting * alive) return take_from_end(faces);
        return mend(faces);
    }

    // The last faces of the range, into the window for which that costs least a face.
    std::optional<WindowPlan> take_from_end(const DrawnFaces& faces) {
        const uint32_t slots = faces.slots();
        uint32_t end = slots, taken = 0;
        while (taken < taken_share * window_ && end > window_) taken += faces.alive(--end) ? 1 : 0;
        std::ranges::fill(near_, 0);
        for (uint32_t s = end; s < slots; ++s) {
            for (uint32_t k = 0; k < 3 && faces.alive(s); ++k)
                faces.for_slots(faces.wedges(s)[k],
                                [&](uint32_t other) { near_[other / block] += other < end ? 1 : 0; });
        }
        std::optional<WindowPlan> best;
        for (const Spot& spot : spots_for(faces, end, taken)) {
            uint32_t from = end, count = taken;
            for (; count > spot.room || !faces.alive(from); ++from) count -= faces.alive(from) ? 1 : 0;
            WindowPlan plan = search_->plan(spot.first * block, spot.first * block + window_, from, false);
            if (!best || search_->worth(plan) / plan.taken > search_->worth(*best) / best->taken)
                best = std::move(plan);
        }
        return best ? std::optional(search_->plan(best->first, best->last, best->end, true)) : std::nullopt;
    }

    struct Spot {
        uint32_t first = 0;  // block
        uint32_t room = 0;   // dead slots of the window that begins there
        uint64_t rank = 0;
    };
    // The windows before `end` with most neighbours and room for faces, apart from each other, best first.
    std::vector<Spot> spots_for(const DrawnFaces& faces, uint32_t end, uint32_t taken) const {
        const uint32_t blocks = end / block;
        std::vector<uint32_t> dead(blocks + 1, 0), near(blocks + 1, 0);  // before each block
        for (uint32_t b = 0; b < blocks; ++b) {
            dead[b + 1] = dead[b];
            for (uint32_t s = b * block; s < (b + 1) * block; ++s) dead[b + 1] += faces.alive(s) ? 0 : 1;
            near[b + 1] = near[b] + near_[b];
        }
        std::vector<Spot> all, apart;
        for (uint32_t first = 0; first + span_ <= blocks; ++first) {
            const uint32_t room = std::min(dead[first + span_] - dead[first], taken);
            if (room > 0 && room >= std::min<double>(taken, room_share * window_))
                all.push_back({first, room, (1 + near[first + span_] - near[first]) * uint64_t{room}});
        }
        std::ranges::stable_sort(all, std::greater<>{}, &Spot::rank);
        for (const Spot& spot : all) {
            const bool close = std::ranges::any_of(apart, [&](const Spot& other) {
                return std::max(other.first, spot.first) - std::min(other.first, spot.first) < (span_ + 3) / 4;
            });
            if (!close) apart.push_back(spot);
            if (apart.size() == windows_tried) break;
        }
        return apart;
    }

    // The most worn windows among those the group wrote; the best of them, if it is worth its writes.
    std::optional<WindowPlan> mend(const DrawnFaces& faces) {
        std::vector<Spot> spots;
        const uint32_t blocks = faces.slots() / block;
        std::ranges::sort(written_blocks_);
        written_blocks_.erase(std::unique(written_blocks_.begin(), written_blocks_.end()), written_blocks_.end());
        for (const uint32_t b : written_blocks_) {
            const uint32_t first = std::min(b > span_ / 2 ? b - span_ / 2 : 0, blocks - span_);
            uint64_t wear = 0;
            for (uint32_t i = first; i < first + span_; ++i) wear += wear_[i];
            if (static_cast<double>(wear) >= worn * window_) spots.push_back({first, 0, wear});
        }
        std::ranges::stable_sort(spots, std::greater<>{}, &Spot::rank);
        if (spots.size() > windows_tried) spots.resize(windows_tried);
        std::optional<WindowPlan> best;
        for (const Spot& spot : spots) {
            WindowPlan plan = search_->plan(spot.first * block, spot.first * block + window_, faces.slots(), false);
            for (uint32_t i = spot.first; i < spot.first + span_; ++i) wear_[i] /= 2;
            if (search_->worth(plan) > 0 && (!best || search_->worth(plan) > search_->worth(*best)))
                best = std::move(plan);
        }
        return best ? std::optional(search_->plan(best->first, best->last, best->end, true)) : std::nullopt;
    }

    const uint32_t cache_;
    const double moves_;
    const GreedyOptions options_;
    const std::atomic<bool>* const stop_;
    std::optional<WindowSearch> search_;
    uint32_t span_ = 0, window_ = 0;        // of a window now: in blocks, in slots
    std::vector<Move> moves_left_;          // of the last plan, the next one last
    uint32_t collapses_ = 0;                // of the group so far
    double budget_ = 0;                     // slots that may be written
    std::vector<uint32_t> wear_;            // per block: corners changed since it was ordered
    std::vector<uint32_t> near_;            // per block: corners it shares with the faces to be taken
    std::vector<uint32_t> written_blocks_;  // by the collapses of the group
};

}  // namespace

std::unique_ptr<FaceOrderer> make_greedy_orderer(const OrderOptions& options) {
    return std::make_unique<GreedyOrderer>(options);
}

}  // namespace lodestone
