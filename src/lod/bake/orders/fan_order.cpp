#include "lod/bake/orders/fan_order.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/check.h"

namespace lodestone {

namespace {

constexpr uint32_t none = ~0u;
constexpr uint32_t large_fan = 8;  // caches

class FanOrder {
public:
    FanOrder(std::span<const uint32_t> indices, uint32_t vertices, uint32_t cache, const FanWeights& weights)
        : indices_(indices),
          cache_(cache),
          weights_(weights),
          first_(vertices + 1, 0),
          faces_of_(indices.size()),
          left_(vertices, 0),
          stamp_(vertices, -1'000'000'000),
          ring_(cache, none),
          in_fan_(vertices),
          emitted_(indices.size() / 3, 0) {
        for (const uint32_t v : indices) ++left_[v];
        std::partial_sum(left_.begin(), left_.end(), first_.begin() + 1);
        std::vector<uint32_t> fill(first_.begin(), first_.end() - 1);
        for (uint32_t c = 0; c < indices.size(); ++c) faces_of_[fill[indices[c]]++] = c / 3;
        order_.reserve(emitted_.size());
    }

    std::vector<uint32_t> run(const Rollouts& rollouts, uint32_t lead) {
        for (uint32_t face = 0; face < lead; ++face) emit(face);
        while (order_.size() < emitted_.size()) {
            rank_cached(std::max(rollouts.candidates, 1u));
            size_t best = 0;
            if (rollouts.candidates > 1 && ranked_.size() > 1) {
                const std::vector<std::pair<double, uint32_t>> tried = ranked_;
                double least = 0;
                for (size_t c = 0; c < tried.size(); ++c) {
                    const double rate = try_out(tried[c].second, rollouts.faces);
                    if (c == 0 || rate < least) {
                        least = rate;
                        best = c;
                    }
                }
                ranked_ = tried;
            }
            emit_fan(ranked_.empty() ? off_cache() : ranked_[best].second);
            for (uint32_t more = 1; rollouts.candidates > 1 && more < rollouts.fans && order_.size() < emitted_.size();
                 ++more) {
                rank_cached(1);
                emit_fan(ranked_.empty() ? off_cache() : ranked_[0].second);
            }
        }
        order_.erase(order_.begin(), order_.begin() + lead);
        return std::move(order_);
    }

private:
    bool cached(uint32_t v) const { return now_ - stamp_[v] <= static_cast<int64_t>(cache_); }

    // Where in ring_ the vertex is that came `age` arrivals before the last one; age: below cache_.
    uint32_t place_of(uint32_t age) const { return head_ > age ? head_ - 1 - age : head_ + cache_ - 1 - age; }

    // The cheapest `count` cached vertices that have faces left, cheapest first, into ranked_.
    void rank_cached(uint32_t count) {
        ranked_.clear();
        const auto held = static_cast<uint32_t>(std::min<int64_t>(now_, cache_));
        for (uint32_t age = 0; age < held; ++age) {
            const uint32_t v = ring_[place_of(age)];
            if (left_[v] == 0) continue;
            const double cost = cost_of_fan(v, age);
            if (ranked_.size() == count && cost >= ranked_.back().first) continue;
            if (ranked_.size() == count) ranked_.pop_back();
            const auto place = std::upper_bound(ranked_.begin(), ranked_.end(), cost,
                                                [](double c, const auto& r) { return c < r.first; });
            ranked_.insert(place, {cost, v});
        }
    }

    // A vertex to go on with where no cached one has faces left: the one that left the cache last, or any.
    uint32_t off_cache() {
        for (size_t i = recent_.size(); i-- > 0;) {
            const uint32_t v = recent_[i];
            if (left_[v] > 0) return v;
            if (!journalled_) recent_.pop_back();
        }
        while (emitted_[next_face_]) ++next_face_;
        return indices_[size_t{next_face_} * 3];
    }

    // Vertices brought in per face over the next `faces` faces, if v came first. Leaves everything as it was.
    double try_out(uint32_t v, uint32_t faces) {
        journalled_ = true;
        const int64_t now = now_;
        const size_t emitted = order_.size(), recent = recent_.size();
        const uint32_t next_face = next_face_, last[3] = {last_[0], last_[1], last_[2]};
        const auto left = [&] { return emitted + std::max<size_t>(faces, 1) - order_.size(); };
        emit_fan(v, left());
        while (order_.size() < emitted + faces && order_.size() < emitted_.size()) {
            rank_cached(1);
            emit_fan(ranked_.empty() ? off_cache() : ranked_[0].second, left());
        }
        const double rate = static_cast<double>(now_ - now) / static_cast<double>(order_.size() - emitted);
        for (size_t i = journal_.size(); i-- > 0;) {
            --now_;
            head_ = head_ == 0 ? cache_ - 1 : head_ - 1;
            ring_[head_] = journal_[i].pushed_out;
            stamp_[journal_[i].vertex] = journal_[i].stamp;
        }
        for (; order_.size() > emitted; order_.pop_back()) {
            const uint32_t face = order_.back();
            emitted_[face] = 0;
            for (uint32_t k = 0; k < 3; ++k) ++left_[indices_[size_t{face} * 3 + k]];
        }
        journal_.clear();
        recent_.resize(recent);
        next_face_ = next_face;
        std::copy(last, last + 3, last_);
        journalled_ = false;
        return rate;
    }

    double cost_of_fan(uint32_t v, uint32_t age) {
        // A fan that no cache holds comes last; its faces are not gone through each time it is looked at.
        if (is_large(v)) return weights_.miss * left_[v];
        // Neighbours across the faces left, each with how many of those faces it is in.
        ring_of_fan_.clear();
        ++fan_;
        for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
            const uint32_t face = faces_of_[i];
            if (emitted_[face]) continue;
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t w = indices_[size_t{face} * 3 + k];
                if (w == v) continue;
                if (std::exchange(in_fan_[w].fan, fan_) != fan_) {
                    in_fan_[w].place = static_cast<uint32_t>(ring_of_fan_.size());
                    ring_of_fan_.emplace_back(w, 1u);
                } else {
                    ++ring_of_fan_[in_fan_[w].place].second;
                }
            }
        }
        uint32_t brought = 0, finished = 1;
        for (const auto& [w, count] : ring_of_fan_) {
            brought += cached(w) ? 0 : 1;
            finished += left_[w] == count ? 1 : 0;
        }
        uint32_t evicted = 0;
        const auto held = static_cast<uint32_t>(std::min<int64_t>(now_, cache_));
        for (uint32_t a = cache_ - std::min(brought, cache_); a < held; ++a) {
            const uint32_t w = ring_[place_of(a)];
            if (w == v || left_[w] == 0) continue;
            evicted += in_fan_[w].fan != fan_ || ring_of_fan_[in_fan_[w].place].second < left_[w] ? 1 : 0;
        }
        const double last = age + brought < cache_ ? -weights_.age * age / cache_ : 1;
        return weights_.miss * brought - weights_.face * left_[v] - weights_.finished * finished +
               weights_.evicted * evicted + last;
    }

    // The faces of v that are left, each next to the last where it can be; of a fan that no cache holds `most` at most.
    void emit_fan(uint32_t v, size_t most = ~size_t{0}) {
        if (is_large(v)) {
            emit_large_fan(v, most);
            return;
        }
        while (left_[v] > 0) {
            uint32_t best = none, fewest = 4;
            bool best_touches = false;
            for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
                const uint32_t face = faces_of_[i];
                if (emitted_[face]) continue;
                uint32_t misses = 0, shared = 0;
                for (uint32_t k = 0; k < 3; ++k) {
                    const uint32_t w = indices_[size_t{face} * 3 + k];
                    misses += cached(w) ? 0 : 1;
                    shared += w == last_[0] || w == last_[1] || w == last_[2] ? 1 : 0;
                }
                if (misses < fewest || (misses == fewest && shared >= 2 && !best_touches)) {
                    best = face;
                    fewest = misses;
                    best_touches = shared >= 2;
                }
            }
            emit(best);
        }
    }

    // Round the hub from face to face, in time that grows with the faces and not with their square.
    void emit_large_fan(uint32_t hub, size_t most) {
        uint32_t next = first_[hub];  // all before it are emitted
        for (size_t done = 0; left_[hub] > 0 && done < most; ++done) {
            uint32_t face = beside_last(hub);
            if (face == none) {
                while (emitted_[faces_of_[next]]) ++next;
                face = faces_of_[next];
            }
            emit(face);
        }
    }

    // A face of the hub that is not emitted and shares another vertex with the last face; none if there is none.
    uint32_t beside_last(uint32_t hub) const {
        for (const uint32_t w : last_) {
            if (w == none || w == hub || is_large(w)) continue;
            for (uint32_t i = first_[w]; i < first_[w + 1]; ++i) {
                const uint32_t face = faces_of_[i];
                const uint32_t* corners = &indices_[size_t{face} * 3];
                if (!emitted_[face] && (corners[0] == hub || corners[1] == hub || corners[2] == hub)) return face;
            }
        }
        return none;
    }

    // Of more faces than a cache holds vertices, many times.
    bool is_large(uint32_t v) const { return left_[v] > large_fan * cache_; }

    void emit(uint32_t face) {
        emitted_[face] = 1;
        order_.push_back(face);
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t v = indices_[size_t{face} * 3 + k];
            last_[k] = v;
            --left_[v];
            if (cached(v)) continue;
            uint32_t& place = ring_[head_];
            head_ = head_ + 1 == cache_ ? 0 : head_ + 1;
            if (journalled_) journal_.push_back({v, place, stamp_[v]});
            place = v;
            stamp_[v] = now_++;
            recent_.push_back(v);
        }
    }

    std::span<const uint32_t> indices_;
    const uint32_t cache_;
    const FanWeights weights_;
    std::vector<uint32_t> first_, faces_of_;  // per vertex: its faces
    std::vector<uint32_t> left_;              // per vertex: corners not emitted yet
    std::vector<int64_t> stamp_;              // per vertex: when it last came into the cache
    std::vector<uint32_t> ring_;              // the cache, by time of arrival
    uint32_t head_ = 0;                       // where the next vertex comes in ring_: now_ modulo cache_
    std::vector<uint32_t> recent_, order_;
    std::vector<std::pair<uint32_t, uint32_t>> ring_of_fan_;
    struct InFan {
        uint64_t fan = 0;    // the last whose ring it was in
        uint32_t place = 0;  // in ring_of_fan_
    };
    std::vector<InFan> in_fan_;                        // per vertex
    uint64_t fan_ = 0;                                 // counts fans looked at
    std::vector<uint8_t> emitted_;                     // per face: 0 or 1
    std::vector<std::pair<double, uint32_t>> ranked_;  // cost and vertex
    uint32_t last_[3] = {none, none, none};            // vertices of the last face
    uint32_t next_face_ = 0;                           // all before it are emitted
    int64_t now_ = 0;                                  // vertices brought in so far
    struct Arrival {
        uint32_t vertex, pushed_out;
        int64_t stamp;
    };
    std::vector<Arrival> journal_;  // of a try-out, to take it back
    bool journalled_ = false;
};

}  // namespace

std::vector<uint32_t> fan_order(std::span<const uint32_t> indices, uint32_t vertices, uint32_t cache,
                                const FanWeights& weights, const Rollouts& rollouts, uint32_t lead) {
    LODE_CHECK(cache >= 3 && cache <= 1024, cache);
    return FanOrder(indices, vertices, cache, weights).run(rollouts, lead);
}

}  // namespace lodestone
