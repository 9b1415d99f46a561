#include "lod/bake/orders/cluster_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/check.h"
#include "base/none.h"
#include "base/random.h"
#include "base/threads.h"
#include "lod/bake/orders/draw_clusters.h"
#include "lod/bake/orders/faces_around.h"
#include "lod/bake/orders/label_counts.h"

namespace lodestone {

namespace {

constexpr double hot = 0.8, cold = 0.15;    // temperature, in vertices, from the first sweep to the last
constexpr double loose = 0.2, tight = 0.5;  // penalty per square of faces too many or too few, likewise
constexpr double crowding_penalty = 3;      // per vertex over batch_vertices - 1 at the first level
constexpr uint32_t regions = 4;             // annealed side by side, whatever the number of threads ...
constexpr uint32_t least_to_cut = 128;      // ... from so many clusters on
constexpr uint32_t sweeps_per_round = 12;   // between two cuts into regions
constexpr size_t darings = 1024;

class Clusters {
public:
    Clusters(std::span<const std::vector<uint32_t>> at, std::span<const double> weights, uint32_t vertices,
             const ClusterOrderOptions& options)
        : weights_(weights),
          options_(options),
          faces_(static_cast<uint32_t>(at[0].size() / 3)),
          count_((faces_ + options.batch_faces - 1) / options.batch_faces),
          label_(faces_, none),
          later_weight_(std::accumulate(weights.begin() + 1, weights.end(), 0.0)) {
        // Numbers by first use, so that what lies together on the surface lies together in memory.
        std::vector<uint32_t> number(vertices, none);
        uint32_t used = 0;
        at_.resize(at.size());
        for (size_t s = 0; s < at.size(); ++s) {
            at_[s].reserve(at[s].size());
            for (const uint32_t v : at[s]) {
                if (number[v] == none) number[v] = used++;
                at_[s].push_back(number[v]);
            }
        }
        vertices_ = used;
        for (size_t i = 0; i < darings; ++i) daring_[i] = -std::log((static_cast<double>(i) + 0.5) / darings);
        for (const auto& indices : at_) around_.emplace_back(indices, used);
    }

    std::vector<uint32_t> run(std::span<const uint32_t> slots) {
        if (slots.empty() || !shrink(slots)) grow();
        for (const FacesAround& around : around_) counts_.emplace_back(around, label_);
        count_crowds();
        anneal(options_.sweeps, false);
        make_exact();
        anneal(options_.sweeps / 4, true);
        std::vector<bool> late(count_);
        for (uint32_t c = 0; c < count_; ++c)
            late[c] = size_[c] != options_.batch_faces || crowd_[c] > options_.batch_vertices;
        return draw_clusters(at_[0], around_[0], label_, late, options_.cache, options_.careful);
    }

private:
    template <class Visit>
    void for_neighbours(uint32_t face, Visit&& visit) const {
        FacesAround::visit(&at_[0][size_t{face} * 3], [&](uint32_t v) {
            for (const uint32_t g : around_[0].of(v)) {
                if (g != face) visit(g);
            }
        });
    }

    // Greedily, one cluster after another: the face that brings in the fewest vertices, and among those the one with
    // the fewest free faces around it, so that no islands stay behind.
    void grow() {
        Growth growth{std::vector<uint32_t>(vertices_, 0), std::vector<uint32_t>(vertices_, none), {}, 0};
        for (uint32_t v = 0; v < vertices_; ++v) growth.free_around[v] = static_cast<uint32_t>(around_[0].of(v).size());
        size_.assign(count_, 0);
        for (uint32_t c = 0; c < count_; ++c) {
            growth.rim.assign(1, seed(growth));
            while (size_[c] < options_.batch_faces) {
                uint32_t face = cheapest_of_rim(growth, c);
                if (face == none) {
                    first_free_face(growth);
                    if (growth.next_face == faces_) break;
                    face = growth.next_face;
                }
                take(growth, face, c);
            }
        }
    }
    struct Growth {
        std::vector<uint32_t> free_around;  // per vertex: faces in no cluster yet
        std::vector<uint32_t> touched;      // per vertex: the last cluster that has it
        std::vector<uint32_t> rim;          // faces around the cluster; some may be taken
        uint32_t next_face;                 // all before are taken
    };
    void first_free_face(Growth& growth) const {
        while (growth.next_face < faces_ && label_[growth.next_face] != none) ++growth.next_face;
    }
    // Where the last cluster left off: the face of its rim with the fewest free neighbours.
    uint32_t seed(Growth& growth) const {
        uint32_t best = none, fewest = ~0u;
        for (const uint32_t f : growth.rim) {
            if (label_[f] != none) continue;
            const uint32_t free = free_of(f, growth.free_around);
            if (free < fewest) {
                fewest = free;
                best = f;
            }
        }
        if (best != none) return best;
        first_free_face(growth);
        return growth.next_face;
    }
    // None where all of the rim is taken.
    uint32_t cheapest_of_rim(Growth& growth, uint32_t c) const {
        uint32_t best = none;
        std::pair<uint32_t, uint32_t> least{~0u, ~0u};
        size_t kept = 0;
        for (const uint32_t f : growth.rim) {
            if (label_[f] != none) continue;
            growth.rim[kept++] = f;
            uint32_t fresh = 0;
            FacesAround::visit(&at_[0][size_t{f} * 3], [&](uint32_t v) { fresh += growth.touched[v] != c; });
            const std::pair<uint32_t, uint32_t> cost{fresh, free_of(f, growth.free_around)};
            if (cost < least) {
                least = cost;
                best = f;
            }
        }
        growth.rim.resize(kept);
        return best;
    }
    void take(Growth& growth, uint32_t face, uint32_t c) {
        label_[face] = c;
        ++size_[c];
        FacesAround::visit(&at_[0][size_t{face} * 3], [&](uint32_t v) {
            --growth.free_around[v];
            if (growth.touched[v] == c) return;
            growth.touched[v] = c;
            for (const uint32_t g : around_[0].of(v)) {
                if (label_[g] == none) growth.rim.push_back(g);
            }
        });
    }
    uint32_t free_of(uint32_t f, const std::vector<uint32_t>& free_around) const {
        return free_around[at_[0][size_t{f} * 3]] + free_around[at_[0][size_t{f} * 3 + 1]] +
               free_around[at_[0][size_t{f} * 3 + 2]];
    }

    // From the clusters of an order before, given by the slots the faces have in it: the smallest are dissolved until
    // as many are left as are needed, and their faces go to those around. False where there are too few.
    bool shrink(std::span<const uint32_t> slots) {
        const uint32_t before = *std::ranges::max_element(slots) / options_.batch_faces + 1;
        std::vector<uint32_t> faces(before, 0), number(before, none);
        for (const uint32_t s : slots) ++faces[s / options_.batch_faces];
        if (!number_kept(faces, number)) return false;
        std::vector<uint32_t> free;
        for (uint32_t f = 0; f < faces_; ++f) {
            label_[f] = number[slots[f] / options_.batch_faces];
            if (label_[f] == none) free.push_back(f);
        }
        give_to_neighbours(free);
        return true;
    }
    // Numbers the clusters that stay: along the order, and so over the surface, as many at any place as its faces fill.
    // faces: of each old cluster. number: takes those of the clusters that stay.
    bool number_kept(std::vector<uint32_t>& faces, std::vector<uint32_t>& number) {
        std::vector<uint32_t> old;
        for (uint32_t c = 0; c < faces.size(); ++c) {
            if (faces[c] > 0) old.push_back(c);
        }
        if (old.size() < count_) return false;
        uint64_t so_far = 0;
        size_.clear();
        std::vector<uint32_t> group;
        for (size_t i = 0; i < old.size(); ++i) {
            so_far += faces[old[i]];
            group.push_back(old[i]);
            const auto due = static_cast<uint32_t>(
                i + 1 == old.size() ? count_ : (so_far + options_.batch_faces / 2) / options_.batch_faces);
            const size_t kept = size_.size() + group.size();
            if ((kept > due && group.size() >= 3) || i + 1 == old.size() || group.size() >= 64) {
                // The smallest of the group goes.
                std::vector<uint32_t> by_size = group;
                std::ranges::stable_sort(by_size, {}, [&](uint32_t c) { return faces[c]; });
                for (size_t k = kept > due ? kept - due : 0; k-- > 0;) faces[by_size[k]] = 0;
                for (const uint32_t c : group) {
                    if (faces[c] == 0) continue;
                    number[c] = static_cast<uint32_t>(size_.size());
                    size_.push_back(faces[c]);
                }
                group.clear();
            }
        }
        return size_.size() == count_;
    }
    // Every free face to the smallest cluster that touches it, those first that touch one.
    void give_to_neighbours(std::vector<uint32_t>& free) {
        std::vector<uint32_t> still_free;
        while (!free.empty()) {
            still_free.clear();
            for (const uint32_t f : free) {
                uint32_t best = none;
                for_neighbours(f, [&](uint32_t g) {
                    if (label_[g] != none && (best == none || size_[label_[g]] < size_[best])) best = label_[g];
                });
                if (best == none) {
                    still_free.push_back(f);
                    continue;
                }
                label_[f] = best;
                ++size_[best];
            }
            if (still_free.size() == free.size()) {  // a component of its own
                label_[free.back()] = static_cast<uint32_t>(std::ranges::min_element(size_) - size_.begin());
                ++size_[label_[free.back()]];
                still_free.pop_back();
            }
            free.swap(still_free);
        }
    }

    void count_crowds() {
        crowd_.assign(count_, 0);
        for (uint32_t v = 0; v < vertices_; ++v) {
            for (const LabelCounts::Entry& e : counts_[0].of(v)) ++crowd_[e.label];
        }
    }

    struct Change {
        double energy = 0;         // weighted vertices; penalties apart
        int left = 0, joined = 0;  // vertices that cluster a loses and b gains at the first level
    };
    // If the face went from cluster a to b.
    Change change(uint32_t face, uint32_t a, uint32_t b) const {
        Change result;
        for (size_t s = 0; s < at_.size(); ++s) add_level(s, face, a, b, nothing_moved, result);
        return result;
    }
    // If it did after `before` went from cluster b to a.
    Change change_after(uint32_t before, uint32_t face, uint32_t a, uint32_t b) const {
        Change result;
        for (size_t s = 0; s < at_.size(); ++s) {
            const uint32_t* moved = &at_[s][size_t{before} * 3];
            const auto is_moved = [&](uint32_t v) { return moved[0] == v || moved[1] == v || moved[2] == v; };
            add_level(s, face, a, b, is_moved, result);
        }
        return result;
    }
    static constexpr auto nothing_moved = [](uint32_t) { return false; };
    // What the move changes at level s. is_moved(v): whether one face around v more than counted is in a, and one less
    // in b.
    template <class IsMoved>
    void add_level(size_t s, uint32_t face, uint32_t a, uint32_t b, IsMoved&& is_moved, Change& result) const {
        int lost = 0, gained = 0;
        FacesAround::visit(&at_[s][size_t{face} * 3], [&](uint32_t v) {
            const auto [in_a, in_b] = counts_[s].of(v, a, b);
            const uint32_t moved = is_moved(v) ? 1 : 0;
            lost += in_a + moved == 1;
            gained += in_b == moved;
        });
        result.energy += weights_[s] * (gained - lost);
        if (s > 0) return;
        result.left = lost;
        result.joined = gained;
    }
    double crowding(int vertices) const {
        return crowding_penalty * std::max(0, vertices - static_cast<int>(options_.batch_vertices) + 1);
    }
    double penalty_change(uint32_t a, uint32_t b, const Change& c, double size_weight) const {
        const auto uneven = [&](int faces) {
            const double off = faces - static_cast<int>(options_.batch_faces);
            return size_weight * off * off;
        };
        const int size_a = static_cast<int>(size_[a]), size_b = static_cast<int>(size_[b]);
        const int crowd_a = static_cast<int>(crowd_[a]), crowd_b = static_cast<int>(crowd_[b]);
        return uneven(size_a - 1) - uneven(size_a) + uneven(size_b + 1) - uneven(size_b) + crowding(crowd_a - c.left) -
               crowding(crowd_a) + crowding(crowd_b + c.joined) - crowding(crowd_b);
    }
    void move(uint32_t face, uint32_t a, uint32_t b, const Change& c) {
        label_[face] = b;
        for (size_t s = 0; s < at_.size(); ++s)
            FacesAround::visit(&at_[s][size_t{face} * 3], [&](uint32_t v) { counts_[s].move(v, a, b); });
        --size_[a];
        ++size_[b];
        crowd_[a] -= static_cast<uint32_t>(c.left);
        crowd_[b] += static_cast<uint32_t>(c.joined);
    }

    // Rounds of sweeps. In each the surface is cut into regions of clusters, the faces near another region keep still,
    // and the regions are annealed side by side; the cuts lie elsewhere in the next round. swaps: two faces change
    // places at a time, so that sizes stay.
    void anneal(uint32_t sweeps, bool swaps) {
        const uint32_t rounds = (sweeps + sweeps_per_round - 1) / sweeps_per_round;
        for (uint32_t round = 0; round < rounds; ++round) {
            const std::vector<std::vector<uint32_t>> members = faces_inside(cut(round));
            parallel_for(members.size(), 1, [&](size_t begin, size_t end) {
                for (size_t r = begin; r < end; ++r) {
                    if (members[r].empty()) continue;
                    Random random(mix64(round * 1000003ull + r * 2 + swaps));
                    for (uint32_t sweep = 0; sweep < sweeps_per_round; ++sweep) {
                        if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed)) return;
                        const double t = (round * sweeps_per_round + sweep + 0.5) / (rounds * sweeps_per_round);
                        if (swaps) {
                            swap_sweep(members[r], cold * (1 - t), random);
                        } else {
                            move_sweep(members[r], hot * std::pow(cold / hot, t), loose * std::pow(tight / loose, t),
                                       random);
                        }
                    }
                }
            });
        }
    }

    // Per region, its faces that no face of another one is around at any level; notes them in inside_.
    std::vector<std::vector<uint32_t>> faces_inside(const std::vector<uint32_t>& region) {
        std::vector<std::vector<uint32_t>> members(regions);
        inside_.assign(faces_, 1);
        std::vector<uint32_t> region_around(vertices_);  // none: several
        for (size_t s = 0; s < at_.size(); ++s) {
            for (uint32_t v = 0; v < vertices_; ++v) {
                const auto labels = counts_[s].of(v);
                region_around[v] = labels.empty() ? none : region[labels[0].label];
                for (const LabelCounts::Entry& e : labels) {
                    if (region[e.label] != region_around[v]) region_around[v] = none;
                }
            }
            for (uint32_t f = 0; f < faces_; ++f) {
                const uint32_t own = region[label_[f]], *corner = &at_[s][size_t{f} * 3];
                inside_[f] &= region_around[corner[0]] == own && region_around[corner[1]] == own &&
                              region_around[corner[2]] == own;
            }
        }
        for (uint32_t f = 0; f < faces_; ++f) {
            if (inside_[f]) members[region[label_[f]]].push_back(f);
        }
        return members;
    }

    // Per cluster, the sorted clusters that touch it: sides[first[c] .. first[c + 1]).
    void find_sides(std::vector<uint32_t>& first, std::vector<uint32_t>& sides) const {
        first.assign(count_ + 1, 0);
        const auto visit = [&](auto&& side) {
            for (uint32_t f = 0; f < faces_; ++f) {
                for (const LabelCounts::Entry& e : counts_[0].of(at_[0][size_t{f} * 3])) {
                    if (e.label != label_[f]) side(label_[f], e.label);
                }
            }
        };
        visit([&](uint32_t c, uint32_t) { ++first[c + 1]; });
        std::partial_sum(first.begin(), first.end(), first.begin());
        sides.resize(first.back());
        std::vector<uint32_t> fill(first.begin(), first.end() - 1);
        visit([&](uint32_t c, uint32_t d) { sides[fill[c]++] = d; });
        uint32_t kept = 0;
        for (uint32_t c = 0; c < count_; ++c) {
            const auto begin = sides.begin() + first[c], end = sides.begin() + fill[c];
            std::sort(begin, end);
            first[c] = kept;
            for (auto at = begin; at != end; ++at) {
                if (at == begin || *at != *(at - 1)) sides[kept++] = *at;
            }
        }
        first[count_] = kept;
    }

    // A region per cluster: those nearest to seeds that differ from round to round, in steps from cluster to cluster.
    std::vector<uint32_t> cut(uint32_t round) const {
        std::vector<uint32_t> region(count_, none);
        if (count_ < least_to_cut) {
            region.assign(count_, 0);
            return region;
        }
        std::vector<uint32_t> first, sides, queue;
        find_sides(first, sides);
        Random random(mix64(round + 77));
        for (uint32_t r = 0; r < regions; ++r) {
            const uint32_t seed = random.below(count_);
            if (region[seed] != none) continue;
            region[seed] = r;
            queue.push_back(seed);
        }
        uint32_t next = 0;
        for (size_t q = 0; queue.size() < count_ || q < queue.size(); ++q) {
            if (q == queue.size()) {  // another component
                while (region[next] != none) ++next;
                region[next] = next % regions;
                queue.push_back(next);
            }
            const uint32_t c = queue[q];
            for (uint32_t i = first[c]; i < first[c + 1]; ++i) {
                const uint32_t d = sides[i];
                if (region[d] != none) continue;
                region[d] = region[c];
                queue.push_back(d);
            }
        }
        return region;
    }

    void move_sweep(const std::vector<uint32_t>& members, double temperature, double size_weight, Random& random) {
        for (const uint32_t f : members) {
            const Pick pick = pick_of(f, random);
            const uint32_t a = label_[f], b = pick.label;
            if (a == b) continue;
            Change c;
            add_level(0, f, a, b, nothing_moved, c);
            const double most = temperature * pick.daring - penalty_change(a, b, c, size_weight);
            // At later levels a loses three vertices at most.
            if (c.energy - 3 * later_weight_ > most) continue;
            for (size_t s = 1; s < at_.size(); ++s) add_level(s, f, a, b, nothing_moved, c);
            if (c.energy <= most) move(f, a, b, c);
        }
    }
    void swap_sweep(const std::vector<uint32_t>& members, double temperature, Random& random) {
        for (const uint32_t f : members) {
            const Pick pick = pick_of(f, random);
            const uint32_t a = label_[f], b = pick.label;
            if (a == b) continue;
            // A face of b beside a, some steps along their border.
            uint32_t g = none;
            for (const uint32_t h : around_[0].of(pick.vertex)) {
                if (label_[h] == b) g = h;
            }
            for (int step = 0; step < 4; ++step) {
                const uint32_t h = neighbour(g, random);
                if (label_[h] == b) g = h;
            }
            if (!inside_[g]) continue;
            const Change there = change(f, a, b), back = change_after(f, g, b, a);
            const int crowd_a = static_cast<int>(crowd_[a]), crowd_b = static_cast<int>(crowd_[b]);
            const double rise = there.energy + back.energy + crowding(crowd_a - there.left + back.joined) +
                                crowding(crowd_b + there.joined - back.left) - (crowding(crowd_a) + crowding(crowd_b));
            if (rise > temperature * pick.daring) continue;
            move(f, a, b, there);
            move(g, b, a, back);
        }
    }
    // A vertex of a face, and the cluster of a face around it: perhaps its own.
    struct Pick {
        uint32_t vertex, label;
        double daring;  // temperatures that a rise may be: distributed exponentially, as Metropolis has it
    };
    Pick pick_of(uint32_t face, Random& random) const {
        const uint64_t bits = random.next(), spread = (bits >> 32) * 3;
        const uint32_t v = at_[0][size_t{face} * 3 + (spread >> 32)];
        const auto labels = counts_[0].of(v);
        Pick pick{v, labels[0].label, daring_[bits % darings]};
        if (labels.size() == 1) return pick;
        auto left = static_cast<uint32_t>(((spread & 0xffffffff) * around_[0].of(v).size()) >> 32);
        for (const LabelCounts::Entry& e : labels) {
            pick.label = e.label;
            if (left < e.faces) break;
            left -= e.faces;
        }
        return pick;
    }
    uint32_t neighbour(uint32_t face, Random& random) const {
        const auto around = around_[0].of(at_[0][size_t{face} * 3 + random.below(3)]);
        return around[random.below(static_cast<uint32_t>(around.size()))];
    }

    // Faces go from clusters that have too many to those that have too few, one across each border on the shortest
    // way. The last cluster that is reached may stay smaller.
    void make_exact() {
        std::vector<std::vector<uint32_t>> members(count_);
        for (uint32_t f = 0; f < faces_; ++f) members[label_[f]].push_back(f);
        Search search{std::vector<uint32_t>(count_, none), std::vector<uint32_t>(count_), {}};
        for (uint32_t start = 0; start < count_; ++start) {
            while (size_[start] > options_.batch_faces) {
                const uint32_t goal = nearest_with_room(start, members, search);
                for (uint32_t to = goal; to != start; to = search.from[to]) hand_over(search.from[to], to, members);
            }
        }
        fill_all_but_one(members);
    }
    // Breadth first over clusters that touch.
    struct Search {
        std::vector<uint32_t> seen;   // per cluster: the last search that met it
        std::vector<uint32_t> from;   // per cluster met: the one before
        std::vector<uint32_t> queue;  // clusters
        uint32_t searches = 0;        // so far
    };
    uint32_t nearest_with_room(uint32_t start, const std::vector<std::vector<uint32_t>>& members,
                               Search& search) const {
        const uint32_t batch = options_.batch_faces, mark = search.searches++;
        search.queue.assign(1, start);
        search.seen[start] = mark;
        uint32_t goal = none;
        for (size_t q = 0; q < search.queue.size() && goal == none; ++q) {
            const uint32_t c = search.queue[q];
            for (const uint32_t f : members[c]) {
                for_neighbours(f, [&](uint32_t g) {
                    const uint32_t d = label_[g];
                    if (search.seen[d] == mark) return;
                    search.seen[d] = mark;
                    search.from[d] = c;
                    search.queue.push_back(d);
                    if (size_[d] < batch && goal == none) goal = d;
                });
            }
        }
        if (goal == none) {  // none on this component: any with room
            goal = static_cast<uint32_t>(std::ranges::find_if(size_, [&](uint32_t n) { return n < batch; }) -
                                         size_.begin());
            LODE_CHECK(goal < count_);
            search.from[goal] = start;
        }
        return goal;
    }
    // At most one cluster may be smaller: the others are filled from it.
    void fill_all_but_one(std::vector<std::vector<uint32_t>>& members) {
        const uint32_t batch = options_.batch_faces;
        uint32_t spare = none;
        for (uint32_t c = 0; c < count_; ++c) {
            if (size_[c] < batch && (spare == none || size_[c] < size_[spare])) spare = c;
        }
        for (uint32_t c = 0; c < count_; ++c) {
            while (c != spare && size_[c] < batch) {
                if (size_[spare] == 0) {
                    spare = none;
                    for (uint32_t d = 0; d < count_; ++d) {
                        if (d != c && size_[d] > 0 && size_[d] < batch && (spare == none || size_[d] < size_[spare]))
                            spare = d;
                    }
                    if (spare == none) return;
                }
                hand_over(spare, c, members);
            }
        }
    }
    // The face that costs least.
    void hand_over(uint32_t a, uint32_t b, std::vector<std::vector<uint32_t>>& members) {
        size_t best = 0;
        double least = 1e30;
        Change chosen;
        for (size_t i = 0; i < members[a].size(); ++i) {
            const Change c = change(members[a][i], a, b);
            const double cost = c.energy + crowding(static_cast<int>(crowd_[b]) + c.joined);
            if (cost < least) {
                least = cost;
                best = i;
                chosen = c;
            }
        }
        const uint32_t face = members[a][best];
        move(face, a, b, chosen);
        members[a].erase(members[a].begin() + static_cast<ptrdiff_t>(best));
        members[b].push_back(face);
    }

    std::vector<std::vector<uint32_t>> at_;
    const std::span<const double> weights_;
    const ClusterOrderOptions options_;
    const uint32_t faces_, count_;
    uint32_t vertices_ = 0;
    std::vector<FacesAround> around_;     // per level
    std::array<double, darings> daring_;  // at equal shares
    std::vector<LabelCounts> counts_;     // per level: clusters around vertices
    std::vector<uint32_t> label_;         // cluster of face
    const double later_weight_;           // of the levels but the first
    std::vector<uint8_t> inside_;         // per face: whether it may move in this round
    std::vector<uint32_t> size_, crowd_;  // per cluster: faces; distinct vertices at the first level
};

}  // namespace

std::vector<uint32_t> cluster_order(std::span<const std::vector<uint32_t>> at, std::span<const double> weights,
                                    uint32_t vertices, const ClusterOrderOptions& options,
                                    std::span<const uint32_t> slots) {
    LODE_CHECK(!at.empty() && at.size() == weights.size(), at.size(), weights.size());
    if (at[0].empty()) return {};
    return Clusters(at, weights, vertices, options).run(slots);
}

}  // namespace lodestone
