#include "lod/bake/orders/fan_order.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/none.h"

namespace lodestone {

namespace {

constexpr uint32_t large_fan = 8;  // caches

class FanOrder {
public:
    FanOrder(const Fans& fans, uint32_t cache, const FanWeights& weights)
        : fans_(fans),
          indices_(fans.indices),
          cache_(cache),
          weights_(weights),
          spokes_(fans.spokes),
          vertices_(fans.vertices),
          ring_(cache, none),
          aging_(cache),
          needed_(cache + 1),
          ages_(fans.most_spokes + 1),
          emitted_(indices_.size() / 3, 0) {
        for (uint32_t v = 0; v < fans.vertices; ++v)
            vertices_[v] = {static_cast<uint32_t>(-1'000'000'000), fans.first[v + 1] - fans.first[v]};
        for (uint32_t age = 0; age < cache; ++age) aging_[age] = -weights_.age * age / cache_;
        order_.reserve(emitted_.size());
    }

    std::vector<uint32_t> run(const Rollouts& rollouts, uint32_t lead) {
        for (uint32_t face = 0; face < lead; ++face) emit(face);
        while (order_.size() < emitted_.size()) {
            rank_cached(std::max(rollouts.candidates, 1u));
            if (rollouts.candidates > 1 && ranked_.size() > 1) {
                try_all(rollouts.faces);
            } else {
                path_.assign(1, ranked_.empty() ? off_cache() : ranked_[0].second);
            }
            const uint32_t fans = rollouts.candidates > 1 ? std::max(rollouts.fans, 1u) : 1;
            for (uint32_t done = 0; done < fans && order_.size() < emitted_.size(); ++done) {
                if (done == path_.size()) path_.push_back(next_fan());
                emit_fan(path_[done]);
            }
            path_.erase(path_.begin(), path_.begin() + std::min<ptrdiff_t>(fans, std::ssize(path_)));
        }
        order_.erase(order_.begin(), order_.begin() + lead);
        return std::move(order_);
    }

private:
    struct Vertex {
        uint32_t stamp;  // when it last came into the cache
        uint32_t left;   // corners not emitted yet
    };
    bool cached(const Vertex& v) const { return now_ - v.stamp <= cache_; }
    bool cached(uint32_t v) const { return cached(vertices_[v]); }
    uint32_t held() const { return std::min(now_, cache_); }

    // Where in ring_ the vertex is that came `age` arrivals before the last one; age: below cache_.
    uint32_t place_of(uint32_t age) const { return head_ > age ? head_ - 1 - age : head_ + cache_ - 1 - age; }

    // The cheapest `count` cached vertices that have faces left, cheapest first, into ranked_.
    void rank_cached(uint32_t count) {
        ranked_.clear();
        count_needed();
        for (uint32_t age = 0; age < held(); ++age) {
            const uint32_t v = ring_[place_of(age)];
            if (vertices_[v].left == 0) continue;
            const double cost = cost_of_fan(v, age);
            if (ranked_.size() == count && cost >= ranked_.back().first) continue;
            if (ranked_.size() == count) ranked_.pop_back();
            const auto place = std::upper_bound(ranked_.begin(), ranked_.end(), cost,
                                                [](double c, const auto& r) { return c < r.first; });
            ranked_.insert(place, {cost, v});
        }
    }

    // Into needed_: how many cached vertices of each age or above have faces left.
    void count_needed() {
        const uint32_t end = held();
        needed_[end] = 0;
        for (uint32_t age = end; age-- > 0;)
            needed_[age] = needed_[age + 1] + (vertices_[ring_[place_of(age)]].left > 0 ? 1 : 0);
    }

    // A vertex to go on with where no cached one has faces left: the one that left the cache last, or any.
    uint32_t off_cache() {
        for (size_t i = recent_.size(); i-- > 0;) {
            const uint32_t v = recent_[i];
            if (vertices_[v].left > 0) return v;
            if (!journalled_) recent_.pop_back();
        }
        while (emitted_[next_face_]) ++next_face_;
        return indices_[size_t{next_face_} * 3];
    }

    // The hub to go on with where nothing is tried out.
    uint32_t next_fan() {
        rank_cached(1);
        return ranked_.empty() ? off_cache() : ranked_[0].second;
    }

    // Puts into path_ the best of the ranked fans and those that came after it as it was tried out. What path_ holds
    // before goes on from where the last choice left off, so it need not be searched again.
    void try_all(uint32_t faces) {
        const std::vector<std::pair<double, uint32_t>> tried = ranked_;
        if (path_.empty() || path_[0] != tried[0].second) path_.assign(1, tried[0].second);
        double least = try_out(path_, faces);
        for (size_t c = 1; c < tried.size(); ++c) {
            trial_.assign(1, tried[c].second);
            const double rate = try_out(trial_, faces);
            if (rate >= least) continue;
            least = rate;
            path_.swap(trial_);
        }
    }

    // Vertices brought in per face over the next `faces` faces, if the fans of the path came first. Appends to it those
    // that come then; leaves everything else as it was.
    double try_out(std::vector<uint32_t>& path, uint32_t faces) {
        journalled_ = true;
        const uint32_t now = now_;
        const size_t emitted = order_.size(), recent = recent_.size();
        const uint32_t next_face = next_face_, last[3] = {last_[0], last_[1], last_[2]};
        const auto left = [&] { return emitted + std::max<size_t>(faces, 1) - order_.size(); };
        emit_fan(path[0], left());
        for (size_t done = 1; order_.size() < emitted + faces && order_.size() < emitted_.size(); ++done) {
            if (done == path.size()) path.push_back(next_fan());
            emit_fan(path[done], left());
        }
        const double rate = static_cast<double>(now_ - now) / static_cast<double>(order_.size() - emitted);
        for (size_t i = journal_.size(); i-- > 0;) {
            --now_;
            head_ = head_ == 0 ? cache_ - 1 : head_ - 1;
            ring_[head_] = journal_[i].pushed_out;
            vertices_[journal_[i].vertex].stamp = journal_[i].stamp;
        }
        for (; order_.size() > emitted; order_.pop_back()) {
            const uint32_t face = order_.back();
            emitted_[face] = 0;
            for (const uint32_t end : fans_.ends[face]) ++spokes_[end].faces;
            for (uint32_t k = 0; k < 3; ++k) ++vertices_[indices_[size_t{face} * 3 + k]].left;
        }
        journal_.clear();
        recent_.resize(recent);
        next_face_ = next_face;
        std::copy(last, last + 3, last_);
        journalled_ = false;
        return rate;
    }

    double cost_of_fan(uint32_t v, uint32_t age) {
        const uint32_t left = vertices_[v].left;
        // A fan that no cache holds comes last; its faces are not gone through each time it is looked at.
        if (is_large(v)) return weights_.miss * left;
        // Of the vertices it finishes, the ages of those that are cached.
        uint32_t brought = 0, finished = 1, ages = 0;
        for (uint32_t i = fans_.first_spoke[v]; i < fans_.first_spoke[v + 1]; ++i) {
            const Fans::Spoke spoke = spokes_[i];
            const Vertex w = vertices_[spoke.vertex];
            const uint32_t in_fan = spoke.faces > 0 ? 1 : 0, in_cache = cached(w) ? 1 : 0;
            const uint32_t last = w.left == spoke.faces ? in_fan : 0;
            brought += in_fan & ~in_cache;
            finished += last;
            ages_[ages] = now_ - 1 - w.stamp;
            ages += last & in_cache;
        }
        // What it pushes out is what has aged enough, but for itself and what it finishes.
        const uint32_t oldest = cache_ - std::min(brought, cache_);
        uint32_t evicted = 0;
        if (oldest < held()) {
            evicted = needed_[oldest] - (age >= oldest ? 1 : 0);
            for (uint32_t i = 0; i < ages; ++i) evicted -= ages_[i] >= oldest ? 1 : 0;
        }
        const double outlives = age + brought < cache_ ? aging_[age] : 1;
        return weights_.miss * brought - weights_.face * left - weights_.finished * finished +
               weights_.evicted * evicted + outlives;
    }

    // The faces of v that are left, each next to the last where it can be; of a fan that no cache holds `most` at most.
    void emit_fan(uint32_t v, size_t most = ~size_t{0}) {
        if (is_large(v)) {
            emit_large_fan(v, most);
            return;
        }
        while (vertices_[v].left > 0) {
            uint32_t best = none, fewest = 4;
            bool best_touches = false;
            for (uint32_t i = fans_.first[v]; i < fans_.first[v + 1]; ++i) {
                const uint32_t face = fans_.faces_of[i];
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
        uint32_t next = fans_.first[hub];  // all before it are emitted
        for (size_t done = 0; vertices_[hub].left > 0 && done < most; ++done) {
            uint32_t face = beside_last(hub);
            if (face == none) {
                while (emitted_[fans_.faces_of[next]]) ++next;
                face = fans_.faces_of[next];
            }
            emit(face);
        }
    }

    // A face of the hub that is not emitted and shares another vertex with the last face; none if there is none.
    uint32_t beside_last(uint32_t hub) const {
        for (const uint32_t w : last_) {
            if (w == none || w == hub || is_large(w)) continue;
            for (uint32_t i = fans_.first[w]; i < fans_.first[w + 1]; ++i) {
                const uint32_t face = fans_.faces_of[i];
                const uint32_t* corners = &indices_[size_t{face} * 3];
                if (!emitted_[face] && (corners[0] == hub || corners[1] == hub || corners[2] == hub)) return face;
            }
        }
        return none;
    }

    // Of more faces than a cache holds vertices, many times.
    bool is_large(uint32_t v) const { return vertices_[v].left > large_fan * cache_; }

    void emit(uint32_t face) {
        emitted_[face] = 1;
        order_.push_back(face);
        for (const uint32_t end : fans_.ends[face]) --spokes_[end].faces;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t v = indices_[size_t{face} * 3 + k];
            Vertex& vertex = vertices_[v];
            last_[k] = v;
            --vertex.left;
            if (cached(vertex)) continue;
            uint32_t& place = ring_[head_];
            head_ = head_ + 1 == cache_ ? 0 : head_ + 1;
            if (journalled_) journal_.push_back({v, place, vertex.stamp});
            place = v;
            vertex.stamp = now_++;
            recent_.push_back(v);
        }
    }

    const Fans& fans_;
    const std::span<const uint32_t> indices_;
    const uint32_t cache_;
    const FanWeights weights_;
    std::vector<Fans::Spoke> spokes_;  // with the faces that are left
    std::vector<Vertex> vertices_;
    std::vector<uint32_t> ring_;  // the cache, by time of arrival
    uint32_t head_ = 0;           // where the next vertex comes in ring_: now_ modulo cache_
    std::vector<uint32_t> recent_, order_;
    std::vector<double> aging_;                        // per age in the cache: what it costs
    std::vector<uint32_t> needed_;                     // see count_needed
    std::vector<uint32_t> ages_;                       // of cost_of_fan
    std::vector<uint8_t> emitted_;                     // per face: 0 or 1
    std::vector<std::pair<double, uint32_t>> ranked_;  // cost and vertex
    uint32_t last_[3] = {none, none, none};            // vertices of the last face
    uint32_t next_face_ = 0;                           // all before it are emitted
    uint32_t now_ = 0;                                 // vertices brought in so far, 3 * Limits::faces at most
    struct Arrival {
        uint32_t vertex, pushed_out, stamp;
    };
    std::vector<Arrival> journal_;  // of a try-out, to take it back
    bool journalled_ = false;
    std::vector<uint32_t> path_, trial_;  // hubs of the fans to come: chosen; tried
};

}  // namespace

Fans::Fans(std::span<const uint32_t> corners, uint32_t count)
    : indices(corners),
      vertices(count),
      first(size_t{count} + 1, 0),
      faces_of(corners.size()),
      ends(corners.size() / 3) {
    for (const uint32_t v : indices) ++first[v + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> fill(first.begin(), first.end() - 1);
    for (uint32_t c = 0; c < indices.size(); ++c) faces_of[fill[indices[c]]++] = c / 3;
    first_spoke.reserve(first.size());
    first_spoke.push_back(0);
    spokes.reserve(indices.size() + 1);
    std::vector<uint32_t> place(vertices, none);  // of the spoke from the present hub
    // Corners i of a face, and the two others: 2 i and 2 i + 1 in ends.
    for (uint32_t hub = 0; hub < vertices; ++hub) {
        for (uint32_t i = first[hub]; i < first[hub + 1]; ++i) {
            const uint32_t* corner = &indices[size_t{faces_of[i]} * 3];
            if (i > first[hub] && faces_of[i] == faces_of[i - 1]) continue;
            for (uint32_t side = 0; side < 6; ++side) {
                const uint32_t from = corner[side / 2], to = corner[(side / 2 + 1 + side % 2) % 3];
                if (from != hub || to == hub) continue;
                if (place[to] == none || place[to] < first_spoke[hub]) {
                    place[to] = static_cast<uint32_t>(spokes.size());
                    spokes.push_back({to, 0});
                }
                ++spokes[place[to]].faces;
                ends[faces_of[i]][side] = place[to];
            }
        }
        first_spoke.push_back(static_cast<uint32_t>(spokes.size()));
        most_spokes = std::max(most_spokes, first_spoke[hub + 1] - first_spoke[hub]);
    }
    for (size_t f = 0; f < ends.size(); ++f) {
        for (uint32_t side = 0; side < 6; ++side) {
            const uint32_t from = indices[f * 3 + side / 2], to = indices[f * 3 + (side / 2 + 1 + side % 2) % 3];
            if (from == to) ends[f][side] = static_cast<uint32_t>(spokes.size());
        }
    }
    spokes.push_back({0, 0});
}

std::vector<uint32_t> fan_order(const Fans& fans, uint32_t cache, const FanWeights& weights, const Rollouts& rollouts,
                                uint32_t lead) {
    LODE_CHECK(cache >= 3 && cache <= 1024, cache);
    return FanOrder(fans, cache, weights).run(rollouts, lead);
}

}  // namespace lodestone
