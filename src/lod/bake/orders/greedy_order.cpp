#include "lod/bake/orders/greedy_order.h"

#include <algorithm>
#include <numeric>

namespace lodestone {

namespace {

constexpr uint32_t none = ~0u;

// A group of collapses ends when this share of the drawn slots is dead; only then faces are permuted.
constexpr double group_share = 0.1;
// Indices to a 64-byte line of the CPU's cache.
constexpr uint32_t line_indices = 16;

// What the next face is worth: a cached vertex, being in place, lying in a line that is written anyway, a vertex that
// is done with it.
struct Weights {
    double cached = 1, in_place = 0.75, touched_line = 0.1, finished = 0.2;
};

class Greedy {
public:
    // slots: of each face, ascending, or none of all of them where there is no order yet. written: lines already
    // written in this group.
    Greedy(std::span<const uint32_t> indices, uint32_t vertices, std::span<const uint32_t> slots, uint32_t cache,
           uint32_t look_ahead)
        : indices_(indices),
          slots_(slots),
          cache_(cache),
          look_ahead_(look_ahead),
          first_(vertices + 1, 0),
          faces_of_(indices.size()),
          left_(vertices, 0),
          stamp_(vertices, -1'000'000'000),
          ring_(cache, none),
          emitted_(indices.size() / 3, false) {
        for (const uint32_t v : indices) ++left_[v];
        std::partial_sum(left_.begin(), left_.end(), first_.begin() + 1);
        std::vector<uint32_t> fill(first_.begin(), first_.end() - 1);
        for (uint32_t c = 0; c < indices.size(); ++c) faces_of_[fill[indices[c]]++] = c / 3;
        if (!slots_.empty()) {
            face_in_.assign(slots_.back() + 1, none);
            for (uint32_t f = 0; f < slots_.size(); ++f) face_in_[slots_[f]] = f;
            touched_.assign(slots_.back() * 3 / line_indices + 2, false);
        }
    }

    std::vector<uint32_t> run() {
        order_.reserve(emitted_.size());
        while (order_.size() < emitted_.size()) {
            rank(look_ahead_ > 0 ? tried : 1);
            uint32_t chosen = ranked_.empty() ? next_unemitted() : ranked_[0].second;
            if (look_ahead_ > 0 && ranked_.size() > 1) chosen = best_ahead();
            mark_written(chosen);
            emit(chosen);
        }
        return std::move(order_);
    }

private:
    static constexpr size_t tried = 3;

    bool cached(uint32_t v) const { return now_ - stamp_[v] <= static_cast<int64_t>(cache_); }
    uint32_t slot_now() const { return static_cast<uint32_t>(order_.size()); }

    double worth(uint32_t face) const {
        double sum = 0;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t v = indices_[size_t{face} * 3 + k];
            if (cached(v)) sum += weights_.cached;
            if (left_[v] == 1) sum += weights_.finished;
        }
        if (slots_.empty()) return sum;
        if (slots_[face] == slot_now()) return sum + weights_.in_place;
        const bool line = touched_[slots_[face] * 3 / line_indices] && touched_[slot_now() * 3 / line_indices];
        return line ? sum + weights_.touched_line : sum;
    }

    // The best `count` faces around cached vertices and the one in place, best first; equal ones by number.
    void rank(size_t count) {
        ranked_.clear();
        const auto consider = [&](uint32_t face) {
            if (emitted_[face]) return;
            const double value = worth(face);
            for (const auto& r : ranked_) {
                if (r.second == face) return;
            }
            const auto place = std::find_if(ranked_.begin(), ranked_.end(), [&](const auto& r) {
                return value > r.first || (value == r.first && face < r.second);
            });
            if (place == ranked_.end() && ranked_.size() == count) return;
            ranked_.insert(place, {value, face});
            if (ranked_.size() > count) ranked_.pop_back();
        };
        if (slot_now() < face_in_.size() && face_in_[slot_now()] != none) consider(face_in_[slot_now()]);
        const auto held = static_cast<uint32_t>(std::min<int64_t>(now_, cache_));
        for (uint32_t age = 0; age < held; ++age) {
            const uint32_t v = ring_[static_cast<size_t>((now_ - 1 - age) % cache_)];
            if (left_[v] == 0) continue;
            for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) consider(faces_of_[i]);
        }
    }

    uint32_t next_unemitted() {
        while (emitted_[next_face_]) ++next_face_;
        return next_face_;
    }

    // Of the ranked faces the one whose own worth and that of the next few is largest.
    uint32_t best_ahead() {
        const auto candidates = ranked_;
        uint32_t best = candidates[0].second;
        double most = -1;
        for (const auto& [value, face] : candidates) {
            const size_t begin = order_.size();
            const int64_t now = now_;
            journal_.clear();
            journalled_ = true;
            double sum = value;
            emit(face);
            for (uint32_t step = 0; step < look_ahead_ && order_.size() < emitted_.size(); ++step) {
                rank(1);
                if (ranked_.empty()) break;
                sum += ranked_[0].first;
                emit(ranked_[0].second);
            }
            journalled_ = false;
            now_ = now + static_cast<int64_t>(journal_.size());
            for (size_t i = journal_.size(); i-- > 0;) {
                ring_[static_cast<size_t>(--now_ % cache_)] = journal_[i].pushed_out;
                stamp_[journal_[i].vertex] = journal_[i].stamp;
            }
            for (; order_.size() > begin; order_.pop_back()) {
                emitted_[order_.back()] = false;
                for (uint32_t k = 0; k < 3; ++k) ++left_[indices_[size_t{order_.back()} * 3 + k]];
            }
            if (sum > most) {
                most = sum;
                best = face;
            }
        }
        return best;
    }

    void mark_written(uint32_t face) {
        if (slots_.empty() || slots_[face] == slot_now()) return;
        touched_[slots_[face] * 3 / line_indices] = true;
        touched_[slot_now() * 3 / line_indices] = true;
    }

    void emit(uint32_t face) {
        emitted_[face] = true;
        order_.push_back(face);
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t v = indices_[size_t{face} * 3 + k];
            --left_[v];
            if (cached(v)) continue;
            uint32_t& place = ring_[static_cast<size_t>(now_ % cache_)];
            if (journalled_) journal_.push_back({v, place, stamp_[v]});
            place = v;
            stamp_[v] = now_++;
        }
    }

    std::span<const uint32_t> indices_, slots_;
    const uint32_t cache_, look_ahead_;
    const Weights weights_;
    std::vector<uint32_t> first_, faces_of_, left_;
    std::vector<int64_t> stamp_;
    std::vector<uint32_t> ring_;
    std::vector<bool> emitted_, touched_;
    std::vector<uint32_t> face_in_;  // per slot
    std::vector<std::pair<double, uint32_t>> ranked_;
    std::vector<uint32_t> order_;
    struct Arrival {
        uint32_t vertex, pushed_out;
        int64_t stamp;
    };
    std::vector<Arrival> journal_;
    bool journalled_ = false;
    uint32_t next_face_ = 0;
    int64_t now_ = 0;
};

class GreedyOrderer final : public FaceOrderer {
public:
    explicit GreedyOrderer(const OrderOptions& options)
        : cache_(options.cache.size), look_ahead_(options.greedy_look_ahead) {}

    std::string name() const override { return "greedy"; }
    bool in_place() const override { return true; }

    std::vector<uint32_t> first_order(const OrderInput& input) override {
        wedges_ = input.wedges;
        return Greedy(input.indices, wedges_, {}, cache_, look_ahead_).run();
    }

    bool wants_order(uint32_t, uint32_t alive, uint32_t slots) override {
        return alive > 0 && alive <= (1 - group_share) * slots;
    }

    void reorder(uint32_t, std::span<const uint32_t> indices, std::span<const uint32_t> slots,
                 std::vector<uint32_t>& alive_faces) override {
        std::vector<uint32_t> drawn;
        drawn.reserve(alive_faces.size() * 3);
        for (const uint32_t f : alive_faces)
            drawn.insert(drawn.end(), {indices[size_t{f} * 3], indices[size_t{f} * 3 + 1], indices[size_t{f} * 3 + 2]});
        std::vector<uint32_t> sorted;
        for (const uint32_t i : Greedy(drawn, wedges_, slots, cache_, look_ahead_).run())
            sorted.push_back(alive_faces[i]);
        alive_faces = std::move(sorted);
    }

private:
    const uint32_t cache_, look_ahead_;
    uint32_t wedges_ = 0;
};

}  // namespace

std::unique_ptr<FaceOrderer> make_greedy_orderer(const OrderOptions& options) {
    return std::make_unique<GreedyOrderer>(options);
}

}  // namespace lodestone
