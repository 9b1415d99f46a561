#include "lod/bake/orders/fan_order.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/none.h"
#include "base/random.h"

namespace lodestone {

namespace {

constexpr uint32_t large_fan = 8;  // caches
// The stamp of a vertex that was not brought in yet: far behind every other, 3 * Limits::faces at most.
constexpr uint32_t unborn = static_cast<uint32_t>(-1'000'000'000);
// While it is tried out, a path is given up that costs so much more than the best one, from so many faces on.
constexpr uint32_t far_behind = 4;
constexpr size_t first_faces = 15;
// Faces a path is longer than it must be when it is lengthened, so that this is done less often.
constexpr size_t spare_faces = 30;

class FanOrder {
public:
    FanOrder(const Fans& fans, uint32_t cache, const FanWeights& weights, const Rollouts& rollouts)
        : fans_(fans),
          rollouts_(rollouts),
          indices_(fans.indices),
          cache_(cache),
          weights_(weights),
          spokes_(fans.spokes),
          vertices_(fans.vertices),
          ring_(cache, none),
          aging_(cache),
          needed_(cache + 1),
          ages_(fans.most_spokes + 1),
          emitted_(indices_.size() / 3, 0),
          later_stamps_(rollouts.later.empty() ? 0 : fans.vertices, unborn) {
        for (uint32_t v = 0; v < fans.vertices; ++v) vertices_[v] = {unborn, fans.first[v + 1] - fans.first[v]};
        for (uint32_t age = 0; age < cache; ++age) aging_[age] = -weights_.age * age / cache_;
        order_.reserve(emitted_.size());
    }

    std::vector<uint32_t> run(uint32_t lead) {
        for (uint32_t face = 0; face < lead; ++face) emit(face);
        while (order_.size() < emitted_.size()) {
            if (fans_.stop != nullptr && fans_.stop->load(std::memory_order_relaxed)) {
                for (uint32_t face = 0; face < emitted_.size(); ++face) {
                    if (!emitted_[face]) order_.push_back(face);
                }
                break;
            }
            if (rollouts_.candidates > 1) {
                look_ahead();
            } else {
                emit_fan(next_fan());
            }
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

    // Into hubs_: the cached vertices that have faces left, the youngest first. Into needed_: how many of them there
    // are of each age or above.
    void find_hubs() {
        hubs_.clear();
        for (uint32_t age = 0; age < held(); ++age) {
            const uint32_t v = ring_[place_of(age)];
            needed_[age] = static_cast<uint32_t>(hubs_.size());
            if (vertices_[v].left > 0) hubs_.push_back({v, age});
        }
        const auto all = static_cast<uint32_t>(hubs_.size());
        for (uint32_t age = 0; age < held(); ++age) needed_[age] = all - needed_[age];
        needed_[held()] = 0;
    }

    // The cheapest `count` hubs, cheapest first, into ranked_.
    void rank_hubs(uint32_t count) {
        ranked_.clear();
        for (const Hub hub : hubs_) {
            const double cost = cost_of_fan(hub.vertex, hub.age);
            if (ranked_.size() == count && cost >= ranked_.back().first) continue;
            if (ranked_.size() == count) ranked_.pop_back();
            const auto place = std::upper_bound(ranked_.begin(), ranked_.end(), cost,
                                                [](double c, const auto& r) { return c < r.first; });
            ranked_.insert(place, {cost, hub.vertex});
        }
    }

    // The hub that costs least; where there is none, one off the cache.
    uint32_t cheapest_hub() {
        uint32_t cheapest = none;
        double least = 0;
        for (const Hub hub : hubs_) {
            const double cost = cost_of_fan(hub.vertex, hub.age);
            if (cheapest != none && cost >= least) continue;
            least = cost;
            cheapest = hub.vertex;
        }
        return cheapest == none ? off_cache() : cheapest;
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
        find_hubs();
        return cheapest_hub();
    }

    // Emits some fans of the path, after other hubs to begin with were tried out.
    void look_ahead() {
        find_hubs();
        rank_hubs(rollouts_.candidates);
        const std::vector<std::pair<double, uint32_t>> tried = ranked_;
        if (path_.empty()) {
            path_.assign(1, tried.empty() ? off_cache() : tried[0].second);
            marks_.clear();
        }
        const size_t faces = std::max(rollouts_.faces, 1u);
        if (tried.size() > 1) {
            if (marks_.size() < faces) lengthen(faces + spare_faces);
            for (const auto& [cost, hub] : tried) {
                if (hub != path_[0]) try_out(hub, faces);
            }
        }
        const size_t before = order_.size(), fans = std::max(rollouts_.fans, 1u);
        size_t done = 0;
        for (; done < fans && order_.size() < emitted_.size(); ++done) {
            if (done == path_.size()) path_.push_back(next_fan());
            emit_fan(path_[done]);
        }
        path_.erase(path_.begin(), path_.begin() + static_cast<ptrdiff_t>(done));
        const size_t passed = std::min(order_.size() - before, marks_.size());
        marks_.erase(marks_.begin(), marks_.begin() + static_cast<ptrdiff_t>(passed));
    }

    // Goes on with the path until it has `faces` faces, and marks it.
    void lengthen(size_t faces) {
        const Place begin = depart();
        find_hubs();
        for (size_t done = 0; order_.size() < begin.faces + faces && order_.size() < emitted_.size();) {
            if (done == path_.size()) path_.push_back(cheapest_hub());
            emit_fan(path_[done++], begin.faces + faces - order_.size());
            find_hubs();
            tried_marks_.back().state = state();
        }
        marks_.swap(tried_marks_);
        go_back(begin);
    }

    // What would come if the fan of `hub` were next. This is the path from now on if it costs less than the path after
    // `faces` faces, or where it meets it.
    void try_out(uint32_t hub, size_t faces) {
        const Place begin = depart();
        tried_path_.assign(1, hub);
        bool better = false, meets = false;
        for (;;) {
            emit_fan(tried_path_.back(), begin.faces + faces - order_.size());
            find_hubs();
            tried_marks_.back().state = state();
            const size_t done = tried_marks_.size(), last = std::min(done, marks_.size()) - 1;
            const uint32_t cost = tried_marks_[last].cost, least = marks_[last].cost;
            better = cost < least;
            meets = done <= marks_.size() && marks_[last].state == tried_marks_[last].state;
            const bool hopeless = done > first_faces && cost >= least + far_behind;
            if (meets || hopeless || done >= faces || order_.size() == emitted_.size()) break;
            tried_path_.push_back(cheapest_hub());
        }
        go_back(begin);
        if (!better) return;
        if (meets) follow_path();
        path_.swap(tried_path_);
        marks_.swap(tried_marks_);
    }

    // What was tried out goes on as the path does from where they met.
    void follow_path() {
        const size_t met = tried_marks_.size();
        const auto fans = std::count_if(marks_.begin(), marks_.begin() + static_cast<ptrdiff_t>(met),
                                        [](const Mark& m) { return m.state != 0; });
        tried_path_.insert(tried_path_.end(), path_.begin() + fans, path_.end());
        const uint32_t less = marks_[met - 1].cost - tried_marks_[met - 1].cost;
        for (size_t i = met; i < marks_.size(); ++i) tried_marks_.push_back({marks_[i].cost - less, marks_[i].state});
    }

    // A hash of which faces are drawn and of which vertices the cache still holds for others; never 0. Where these are
    // the same, what comes next is hardly different, whatever the order in the cache.
    uint64_t state() const {
        uint64_t sum = drawn_;
        for (const Hub hub : hubs_) sum += mix64(~uint64_t{hub.vertex});
        return sum | 1;
    }

    // Where a try-out begins.
    struct Place {
        size_t faces, recent;
        uint32_t next_face, pending, last[3];
        uint64_t drawn;
    };
    Place depart() {
        journalled_ = true;
        tried_marks_.clear();
        return {order_.size(), recent_.size(), next_face_, pending_, {last_[0], last_[1], last_[2]}, drawn_};
    }
    // Leaves everything as it was there, but for the marks.
    void go_back(const Place& begin) {
        for (; !journal_.empty(); journal_.pop_back()) {
            --now_;
            head_ = head_ == 0 ? cache_ - 1 : head_ - 1;
            ring_[head_] = journal_.back().pushed_out;
            vertices_[journal_.back().vertex].stamp = journal_.back().stamp;
        }
        for (; !later_journal_.empty(); later_journal_.pop_back(), --later_now_)
            later_stamps_[later_journal_.back().first] = later_journal_.back().second;
        for (; order_.size() > begin.faces; order_.pop_back()) {
            const uint32_t face = order_.back();
            emitted_[face] = 0;
            for (const uint32_t end : fans_.ends[face]) ++spokes_[end].faces;
            for (uint32_t k = 0; k < 3; ++k) ++vertices_[indices_[size_t{face} * 3 + k]].left;
        }
        recent_.resize(begin.recent);
        next_face_ = begin.next_face;
        pending_ = begin.pending;
        std::copy(begin.last, begin.last + 3, last_);
        drawn_ = begin.drawn;
        journalled_ = false;
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
        faces_left_.clear();
        for (uint32_t i = fans_.first[v]; i < fans_.first[v + 1]; ++i) {
            const uint32_t face = fans_.faces_of[i];
            if (!emitted_[face] && (faces_left_.empty() || faces_left_.back() != face)) faces_left_.push_back(face);
        }
        while (!faces_left_.empty()) {
            size_t best = 0;
            uint32_t fewest = 4;
            bool best_touches = false;
            for (size_t i = 0; i < faces_left_.size(); ++i) {
                uint32_t misses = 0, shared = 0;
                for (uint32_t k = 0; k < 3; ++k) {
                    const uint32_t w = indices_[size_t{faces_left_[i]} * 3 + k];
                    misses += cached(w) ? 0 : 1;
                    shared += w == last_[0] || w == last_[1] || w == last_[2] ? 1 : 0;
                }
                if (misses < fewest || (misses == fewest && shared >= 2 && !best_touches)) {
                    best = i;
                    fewest = misses;
                    best_touches = shared >= 2;
                }
            }
            emit(faces_left_[best]);
            faces_left_.erase(faces_left_.begin() + static_cast<ptrdiff_t>(best));
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
            if (!cached(vertex)) bring_in(v);
        }
        if (rollouts_.candidates <= 1) return;
        drawn_ += mix64(face);
        if (!rollouts_.later.empty()) emit_later(&rollouts_.later[size_t{face} * 3]);
        if (journalled_) tried_marks_.push_back({now_ + pending_ + later_now_, 0});
    }

    void bring_in(uint32_t v) {
        Vertex& vertex = vertices_[v];
        uint32_t& place = ring_[head_];
        head_ = head_ + 1 == cache_ ? 0 : head_ + 1;
        if (journalled_) journal_.push_back({v, place, vertex.stamp});
        if (place != none && vertices_[place].left > 0) ++pending_;
        if (vertex.stamp != unborn) --pending_;
        place = v;
        vertex.stamp = now_++;
        recent_.push_back(v);
    }

    void emit_later(const uint32_t* corners) {
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t& stamp = later_stamps_[corners[k]];
            if (later_now_ - stamp <= cache_) continue;
            if (journalled_) later_journal_.emplace_back(corners[k], stamp);
            stamp = later_now_++;
        }
    }

    const Fans& fans_;
    const Rollouts rollouts_;
    const std::span<const uint32_t> indices_;
    const uint32_t cache_;
    const FanWeights weights_;
    std::vector<Fans::Spoke> spokes_;  // with the faces that are left
    std::vector<Vertex> vertices_;
    std::vector<uint32_t> ring_;  // the cache, by time of arrival
    uint32_t head_ = 0;           // where the next vertex comes in ring_: now_ modulo cache_
    std::vector<uint32_t> recent_, order_;
    std::vector<double> aging_;  // per age in the cache: what it costs
    struct Hub {
        uint32_t vertex, age;
    };
    std::vector<Hub> hubs_;                            // see find_hubs
    std::vector<uint32_t> needed_;                     // likewise
    std::vector<uint32_t> ages_;                       // of cost_of_fan
    std::vector<uint32_t> faces_left_;                 // of emit_fan
    std::vector<uint8_t> emitted_;                     // per face: 0 or 1
    std::vector<std::pair<double, uint32_t>> ranked_;  // cost and vertex
    uint32_t last_[3] = {none, none, none};            // vertices of the last face
    uint32_t next_face_ = 0;                           // all before it are emitted
    uint32_t now_ = 0;                                 // vertices brought in so far, 3 * Limits::faces at most
    uint32_t pending_ = 0;                             // vertices pushed out that must be brought in again
    uint64_t drawn_ = 0;                               // hash of the faces emitted, in any order
    uint32_t later_now_ = 0;                           // vertices brought in so far at the later level
    std::vector<uint32_t> later_stamps_;               // per vertex, likewise
    struct Arrival {
        uint32_t vertex, pushed_out, stamp;
    };
    std::vector<Arrival> journal_;                              // of a try-out, to take it back
    std::vector<std::pair<uint32_t, uint32_t>> later_journal_;  // vertex and stamp
    bool journalled_ = false;
    struct Mark {
        uint32_t cost;   // vertices brought in and pending, at both levels
        uint64_t state;  // where a fan ends; 0 inside one
    };
    std::vector<uint32_t> path_, tried_path_;  // hubs of the fans to come: chosen; tried
    std::vector<Mark> marks_, tried_marks_;    // per face of them
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
    LODE_CHECK(rollouts.later.empty() || rollouts.later.size() == fans.indices.size(), rollouts.later.size());
    return FanOrder(fans, cache, weights, rollouts).run(lead);
}

}  // namespace lodestone
