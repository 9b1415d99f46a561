#include "lod/bake/orders/draw_clusters.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/none.h"

namespace lodestone {

namespace {

class ClusterDrawing {
public:
    ClusterDrawing(std::span<const uint32_t> indices, const FacesAround& around, std::span<const uint32_t> label,
                   uint32_t clusters, uint32_t cache, bool careful)
        : indices_(indices),
          around_(around),
          label_(label),
          count_(clusters),
          cache_(cache),
          careful_(careful),
          members_(clusters),
          drawn_(clusters, false),
          seen_(around.first.size() - 1, none),
          number_(around.first.size() - 1, none),
          entered_(around.first.size() - 1, -1'000'000) {
        for (uint32_t f = 0; f < label.size(); ++f) members_[label[f]].push_back(f);
    }

    // Cluster after cluster, each beside the one before. Those that would close a batch early, or are not full, come
    // last: they move no other one.
    std::vector<uint32_t> run(const std::vector<bool>& is_late) {
        std::vector<uint32_t> late, sequence;
        for (uint32_t c = 0; c < count_; ++c) {
            if (!is_late[c]) continue;
            drawn_[c] = true;
            late.push_back(c);
        }
        uint32_t next = 0;
        std::vector<uint32_t> trail;  // clusters drawn, to go back to where something was left
        for (;;) {
            uint32_t best = none;
            for (size_t back = trail.size(); best == none && back > 0; --back) {
                best = beside(trail[back - 1]);
                if (best == none) trail.resize(back - 1);
            }
            while (best == none && next < count_) {
                if (!drawn_[next]) best = next;
                ++next;
            }
            if (best == none) break;
            drawn_[best] = true;
            sequence.push_back(best);
            trail.push_back(best);
        }
        // The smaller ones at the very end.
        std::ranges::stable_sort(late, std::greater<>(), [&](uint32_t c) { return members_[c].size(); });
        sequence.insert(sequence.end(), late.begin(), late.end());
        std::vector<uint32_t> order;
        for (size_t i = 0; i < sequence.size(); ++i)
            draw(members_[sequence[i]], i + 1 < sequence.size() ? sequence[i + 1] : none, order);
        LODE_CHECK(order.size() == label_.size(), order.size(), label_.size());
        return order;
    }

private:
    // Of the clusters around one that are still to be drawn, the one that shares the most vertices with it, and rather
    // one that few others are left around.
    uint32_t beside(uint32_t cluster) {
        std::vector<std::pair<uint32_t, uint32_t>> shared;  // cluster, vertices
        const auto count_around = [&](uint32_t c, auto& counts) {
            counts.clear();
            const uint32_t mark = stamp_++;
            for (const uint32_t f : members_[c]) {
                FacesAround::visit(&indices_[size_t{f} * 3], [&](uint32_t v) {
                    if (seen_[v] == mark) return;
                    seen_[v] = mark;
                    std::array<uint32_t, 8> met{};
                    size_t count = 0;
                    for (const uint32_t g : around_.of(v)) {
                        const uint32_t d = label_[g];
                        if (d == c || drawn_[d]) continue;
                        if (std::find(met.begin(), met.begin() + static_cast<ptrdiff_t>(count), d) !=
                            met.begin() + static_cast<ptrdiff_t>(count))
                            continue;
                        if (count < met.size()) met[count++] = d;
                        const auto at = std::ranges::find(counts, d, &std::pair<uint32_t, uint32_t>::first);
                        if (at == counts.end()) {
                            counts.push_back({d, 1});
                        } else {
                            ++at->second;
                        }
                    }
                });
            }
        };
        count_around(cluster, shared);
        uint32_t best = none;
        double most = -1e30;
        std::vector<std::pair<uint32_t, uint32_t>> left;
        for (const auto& [c, vertices] : shared) {
            count_around(c, left);
            double open = 0;
            for (const auto& [d, n] : left) open += n;
            const double score = vertices - 0.25 * open;
            if (score > most) {
                most = score;
                best = c;
            }
        }
        return best;
    }
    bool cached(uint32_t v) const { return now_ - entered_[v] <= static_cast<int64_t>(cache_); }

    // The faces of a cluster by greed, several times with different leanings; kept is the order with the fewest
    // vertices brought in, those that the next cluster will miss included.
    void draw(const std::vector<uint32_t>& faces, uint32_t next, std::vector<uint32_t>& order) {
        wanted_.clear();
        const uint32_t mark = stamp_++;
        if (next != none) {
            for (const uint32_t f : members_[next]) {
                FacesAround::visit(&indices_[size_t{f} * 3], [&](uint32_t v) {
                    if (std::exchange(seen_[v], mark) != mark) wanted_.push_back(v);
                });
            }
        }
        number_corners(faces, mark);
        constexpr Leaning leanings[] = {{0.3, 0.1, 0.05}, {0, 0.1, 0.05},  {0.6, 0.1, 0.05}, {0.3, 0.2, 0.2},
                                        {0.6, 0.2, 0.2},  {1.2, 0.1, 0.1}, {0.3, 0.05, 0.4}, {0.6, 0.05, 0.4}};
        std::vector<uint32_t> best, tried;
        double fewest = 1e30;
        for (const Leaning& leaning : std::span(leanings).first(careful_ ? std::size(leanings) : 1)) {
            tried.clear();
            const double cost = try_to_draw(faces, leaning, tried);
            undo();
            if (cost < fewest) {
                fewest = cost;
                best = tried;
            }
        }
        for (const uint32_t face : best) {
            order.push_back(face);
            enter(face);
        }
        journal_.clear();
    }
    struct Leaning {
        double wanted, left, age;
    };
    // Numbers the vertices of a cluster from 0 on, and notes which of them the next cluster uses: those whose seen_ is
    // the mark.
    void number_corners(const std::vector<uint32_t>& faces, uint32_t mark) {
        own_.clear();
        corners_.clear();
        for (const uint32_t f : faces) {
            Corners corners{0, {}};
            FacesAround::visit(&indices_[size_t{f} * 3], [&](uint32_t v) {
                if (number_[v] >= own_.size() || own_[number_[v]].vertex != v) {
                    number_[v] = static_cast<uint32_t>(own_.size());
                    own_.push_back({v, 0, seen_[v] == mark});
                }
                ++own_[number_[v]].faces;
                corners.at[corners.count++] = number_[v];
            });
            corners_.push_back(corners);
        }
    }
    double try_to_draw(const std::vector<uint32_t>& cluster, const Leaning& leaning, std::vector<uint32_t>& order) {
        std::vector<uint32_t> faces(cluster.size()), left(own_.size());  // both of the faces still to draw
        std::iota(faces.begin(), faces.end(), 0u);
        for (size_t v = 0; v < own_.size(); ++v) left[v] = own_[v].faces;
        struct Terms {
            double age, left, wanted;
        };
        std::vector<Terms> terms(own_.size());
        const int64_t begin = now_;
        while (!faces.empty()) {
            for (size_t v = 0; v < own_.size(); ++v) {
                const int64_t age = now_ - entered_[own_[v].vertex];
                // A vertex that is about to leave is used before one that came just now.
                terms[v] = {age <= static_cast<int64_t>(cache_) ? -leaning.age * static_cast<double>(age) / cache_ : 1,
                            leaning.left * left[v], own_[v].wanted ? leaning.wanted : 0};
            }
            size_t best = 0;
            double least = 1e30;
            for (size_t i = 0; i < faces.size(); ++i) {
                const Corners& corners = corners_[faces[i]];
                double cost = 0;
                for (uint32_t k = 0; k < corners.count; ++k) {
                    const Terms& t = terms[corners.at[k]];
                    cost += t.age;
                    cost += t.left;
                    cost += t.wanted;
                }
                if (cost < least) {
                    least = cost;
                    best = i;
                }
            }
            const Corners& drawn = corners_[faces[best]];
            for (uint32_t k = 0; k < drawn.count; ++k) --left[drawn.at[k]];
            order.push_back(cluster[faces[best]]);
            faces.erase(faces.begin() + static_cast<ptrdiff_t>(best));
            enter(order.back());
        }
        auto cost = static_cast<double>(now_ - begin);
        // What entered last is there when the next cluster begins and likely still when it is needed.
        for (const uint32_t v : wanted_) cost -= cached(v) ? 0.9 : 0;
        return cost;
    }
    void enter(uint32_t face) {
        FacesAround::visit(&indices_[size_t{face} * 3], [&](uint32_t v) {
            if (cached(v)) return;
            journal_.push_back({v, entered_[v]});
            entered_[v] = now_++;
        });
    }
    void undo() {
        for (; !journal_.empty(); journal_.pop_back(), --now_) entered_[journal_.back().first] = journal_.back().second;
    }

    const std::span<const uint32_t> indices_;
    const FacesAround& around_;
    const std::span<const uint32_t> label_;
    const uint32_t count_, cache_;
    const bool careful_;
    std::vector<std::vector<uint32_t>> members_;
    std::vector<bool> drawn_;
    uint32_t stamp_ = 0;
    std::vector<uint32_t> seen_;    // per vertex: stamp
    std::vector<uint32_t> number_;  // per vertex: its place in own_, if it is there
    std::vector<int64_t> entered_;  // per vertex: when it entered the cache
    std::vector<std::pair<uint32_t, int64_t>> journal_;
    std::vector<uint32_t> wanted_;  // vertices of the cluster that is next
    struct Own {
        uint32_t vertex, faces;
        bool wanted;  // by the next cluster
    };
    struct Corners {
        uint32_t count;
        std::array<uint32_t, 3> at;  // in own_
    };
    std::vector<Own> own_;          // vertices of the cluster that is being drawn
    std::vector<Corners> corners_;  // of its faces: their distinct vertices
    int64_t now_ = 0;
};

}  // namespace

std::vector<uint32_t> draw_clusters(std::span<const uint32_t> indices, const FacesAround& around,
                                    std::span<const uint32_t> label, const std::vector<bool>& late, uint32_t cache,
                                    bool careful) {
    return ClusterDrawing(indices, around, label, static_cast<uint32_t>(late.size()), cache, careful).run(late);
}

}  // namespace lodestone
