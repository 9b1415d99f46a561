#include "lod/bake/bake.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "base/check.h"
#include "lod/bake/orders/face_order.h"
#include "lod/bake/replay.h"

namespace lodestone {

namespace {

constexpr uint32_t none = ~0u;

// A keyframe reaches over this part of an interval, before it and behind it; at least 2.
constexpr uint32_t reach_share = 8;

// What all orders share; the spans of a ProgressiveMesh refer to it.
struct Store {
    std::vector<MeshVertex> vertices;
    std::vector<uint32_t> wedge_vertex;
    std::vector<Ecol> ecols;
    std::vector<uint32_t> parents;
    std::vector<float> errors;
    struct Order {
        std::vector<uint32_t> indices, first_corner;
        std::vector<IndexSlot> corners;
        std::vector<TswapStep> tswaps;
        std::vector<uint32_t> cycle_lengths, cycle_slots;
        std::vector<Keyframe> keyframes;
        std::vector<uint32_t> block_ends;
        std::vector<uint8_t> block_bytes;
    };
    std::vector<Order> orders;
};

// Slot s receives the face of slot from[s]: as cycles f with f[i] receiving what f[i + 1] held.
void append_cycles(std::span<const uint32_t> from, Store::Order& order) {
    std::vector<bool> seen(from.size(), false);
    for (uint32_t start = 0; start < from.size(); ++start) {
        if (seen[start] || from[start] == start) continue;
        uint32_t length = 0;
        for (uint32_t s = start; !seen[s]; s = from[s]) {
            seen[s] = true;
            order.cycle_slots.push_back(s);
            ++length;
        }
        order.cycle_lengths.push_back(length);
    }
}

class OrderBake {
public:
    OrderBake(const Store& store, const std::vector<uint32_t>& face_indices, std::span<const uint32_t> death,
              FaceOrderer& orderer)
        : store_(store), orderer_(orderer), replay_(face_indices, store.wedge_vertex) {
        const auto levels = static_cast<uint32_t>(store.ecols.size()) + 1;
        const auto wedges = static_cast<uint32_t>(store.vertices.size());
        gone_at_.assign(wedges, levels);
        parent_.resize(wedges);
        std::iota(parent_.begin(), parent_.end(), 0u);
        uint32_t wedge = wedges;  // removed wedges are the last ones, the first to go the very last
        for (uint32_t i = 0; i < store.ecols.size(); ++i) {
            for (uint32_t k = 0; k < store.ecols[i].wedges; ++k) {
                --wedge;
                gone_at_[wedge] = i + 1;
                parent_[wedge] = store.parents[wedges - 1 - wedge];
            }
        }
        face_at_ = orderer.first_order({face_indices, death, gone_at_, parent_, wedges, levels});
        slot_of_.resize(face_at_.size());
        for (uint32_t s = 0; s < face_at_.size(); ++s) slot_of_[face_at_[s]] = s;
        alive_ = static_cast<uint32_t>(face_at_.size());
    }

    Result<Store::Order> run(const Progress& progress) {
        if (auto planned = plan_keyframes(progress); !planned) return tl::unexpected(planned.error());
        for (const uint32_t face : face_at_) {
            for (uint32_t k = 0; k < 3; ++k) order_.indices.push_back(replay_.indices()[face * 3 + k]);
        }
        order_.first_corner.push_back(0);
        uint32_t r = 0;
        for (uint32_t i = 0; i < store_.ecols.size(); ++i) {
            if (auto going = report(i, progress); !going) return tl::unexpected(going.error());
            ecol(i, r);
            r += store_.ecols[i].wedges;
            if (orderer_.in_place()) {
                const auto slots = static_cast<uint32_t>(face_at_.size());
                if (orderer_.wants_order(i + 1, alive_, slots)) tswap_step(i + 1);
            } else {
                enter_level(i + 1);
            }
        }
        return std::move(order_);
    }

private:
    Result<void> report(uint32_t ecol, const Progress& progress) const {
        if (ecol % 65536 != 0) return {};
        progress.at("order " + orderer_.name(), static_cast<double>(ecol) / static_cast<double>(store_.ecols.size()));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        return {};
    }

    // A keyframe as planned: the faces alive at its level in their new order.
    struct Planned {
        uint32_t level;
        std::vector<uint32_t> faces;
    };

    // Plays all collapses once to have every order made before the first corner is noted: a corner is noted in the next
    // order too as soon as that is being made up.
    Result<void> plan_keyframes(const Progress& progress) {
        if (orderer_.drops_dead() || orderer_.in_place()) return {};
        Replay replay = replay_;
        const auto wedges = static_cast<uint32_t>(store_.vertices.size());
        std::vector<uint32_t> faces = face_at_;
        uint32_t alive = alive_, r = 0, last = 0;
        for (uint32_t i = 0; i < store_.ecols.size(); ++i) {
            if (auto going = report(i, progress); !going) return going;
            for (const uint32_t end = r + store_.ecols[i].wedges; r < end; ++r)
                replay.rewrite(wedges - 1 - r, store_.parents[r], [&](uint32_t) { --alive; });
            const uint32_t level = i + 1;
            if (level < last + 2 || !orderer_.wants_order(level, alive, static_cast<uint32_t>(faces.size()))) continue;
            std::vector<uint32_t> slots;
            size_t kept = 0;
            for (uint32_t s = 0; s < faces.size(); ++s) {
                if (replay.alive(faces[s])) {
                    slots.push_back(s);
                    faces[kept++] = faces[s];
                } else {
                    replay.leave_range(faces[s]);
                }
            }
            faces.resize(kept);
            if (faces.empty()) break;
            orderer_.reorder(level, replay.indices(), slots, faces);
            planned_.push_back({level, faces});
            last = level;
        }
        // Reaches: short, for while two orders are held a collapse is noted in both; but so long that a step writes few
        // blocks, and never so long that two meet.
        for (size_t k = 0; k < planned_.size(); ++k) {
            const uint32_t before = planned_[k].level - (k == 0 ? 0 : planned_[k - 1].level);
            const uint32_t after =
                (k + 1 < planned_.size() ? planned_[k + 1].level : static_cast<uint32_t>(store_.ecols.size()) + 2) -
                planned_[k].level;
            const uint32_t reach = std::max(1u, (std::min(before, after) - 1) / reach_share);
            Keyframe key;
            key.level = planned_[k].level;
            key.slots = static_cast<uint32_t>(planned_[k].faces.size());
            key.blocks_per_step = (key.blocks() + reach - 1) / reach;
            order_.keyframes.push_back(key);
        }
        return {};
    }

    // Corners of the removed wedges, in the order that is drawn and in what the other half holds both before and
    // after; then the collapse.
    void ecol(uint32_t i, uint32_t first_removed) {
        const Ecol step = store_.ecols[i];
        const auto wedges = static_cast<uint32_t>(store_.vertices.size());
        const uint32_t held = std::min(blocks_held(i), blocks_held(i + 1));
        dying_.clear();
        corner_lists_.clear();
        for (uint32_t r = first_removed; r < first_removed + step.wedges; ++r) {
            corner_lists_.emplace_back();
            replay_.for_corners(wedges - 1 - r, [&](uint32_t c) { corner_lists_.back().push_back(c); });
        }
        for (uint32_t r = first_removed; r < first_removed + step.wedges; ++r) {
            replay_.rewrite(wedges - 1 - r, store_.parents[r], [&](uint32_t face) { dying_.push_back(face); });
        }
        alive_ -= static_cast<uint32_t>(dying_.size());
        const uint32_t half = drawn_ & 1;
        for (auto& corners : corner_lists_) {
            const size_t begin = order_.corners.size();
            for (const uint32_t c : corners) {
                if (orderer_.drops_dead() && !replay_.alive(c / 3)) continue;
                const uint32_t face = c / 3;
                // A dead face of the order before the one that is drawn is in no slot of the latter.
                if (slot_of_[face] != none) order_.corners.push_back(IndexSlot::of(half, slot_of_[face] * 3 + c % 3));
                if (held > 0 && other_slot_[face] != none && other_block_[face] < held)
                    order_.corners.push_back(IndexSlot::of(1 - half, other_slot_[face] * 3 + c % 3));
            }
            std::sort(order_.corners.begin() + static_cast<ptrdiff_t>(begin), order_.corners.end(),
                      [](IndexSlot a, IndexSlot b) {
                          return std::pair(a.half(), a.position()) < std::pair(b.half(), b.position());
                      });
            order_.first_corner.push_back(static_cast<uint32_t>(order_.corners.size()));
        }
        if (orderer_.drops_dead()) {
            for (const uint32_t face : dying_) replay_.leave_range(face);
        }
    }

    // Blocks the half that is not drawn holds.
    uint32_t blocks_held(uint32_t level) const {
        for (const uint32_t k : {drawn_, drawn_ + 1}) {
            if (k >= 1 && k <= order_.keyframes.size()) {
                if (const uint32_t held = order_.keyframes[k - 1].blocks_held(level); held > 0) return held;
            }
        }
        return 0;
    }

    void enter_level(uint32_t level) {
        if (drawn_ > 0) {
            const Keyframe& key = order_.keyframes[drawn_ - 1];
            if (level == key.level + key.reach()) forget_order_before();
        }
        if (drawn_ == order_.keyframes.size()) return;
        const Keyframe& next = order_.keyframes[drawn_];
        if (level + next.reach() == next.level) {
            other_slot_.resize(slot_of_.size(), none);
            other_block_.resize(slot_of_.size(), none);
            const std::vector<uint32_t>& faces = planned_[drawn_].faces;
            for (uint32_t s = 0; s < faces.size(); ++s) {
                other_slot_[faces[s]] = s;
                other_block_[faces[s]] = s / keyframe_block_slots;
            }
        } else if (level == next.level) {
            change_order();
        }
    }

    void forget_order_before() {
        for (const uint32_t face : face_before_) {
            other_slot_[face] = other_block_[face] = none;
            if (slot_of_[face] == none) replay_.leave_range(face);
        }
        face_before_.clear();
    }

    // The keyframe itself: the next order is drawn, and the one before is what the other half holds.
    void change_order() {
        Keyframe& key = order_.keyframes[drawn_];
        std::vector<std::vector<DeadFace>> dead(key.blocks());
        for (uint32_t slot = 0; slot < face_at_.size(); ++slot) {
            const uint32_t face = face_at_[slot];
            if (other_slot_[face] != none) continue;
            uint32_t neighbour = none;
            const DeadFace noted = note_dead(face, slot, neighbour);
            dead[neighbour / keyframe_block_slots].push_back(noted);
            other_block_[face] = neighbour / keyframe_block_slots;
            ++key.dead;
        }
        std::swap(slot_of_, other_slot_);
        key.first_block = static_cast<uint32_t>(order_.block_ends.size());
        std::vector<uint32_t>& faces = planned_[drawn_].faces;
        std::vector<uint32_t> sources;
        for (uint32_t first = 0; first < faces.size(); first += keyframe_block_slots) {
            sources.clear();
            for (uint32_t s = first; s < std::min<size_t>(faces.size(), first + keyframe_block_slots); ++s)
                sources.push_back(other_slot_[faces[s]]);
            std::ranges::stable_sort(dead[first / keyframe_block_slots], {}, &DeadFace::neighbour);
            write_keyframe_block(sources, dead[first / keyframe_block_slots], order_.block_bytes);
            order_.block_ends.push_back(static_cast<uint32_t>(order_.block_bytes.size()));
        }
        face_before_ = std::move(face_at_);
        face_at_ = std::move(faces);
        ++drawn_;
    }

    // A face that is in the order drawn but not in the next; neighbour: the slot of the next order it is noted with.
    DeadFace note_dead(uint32_t face, uint32_t slot, uint32_t& neighbour) const {
        const auto indices = replay_.indices();
        DeadFace noted;
        noted.slot = slot;
        for (uint32_t k = 0; k < 3; ++k) noted.wedges[k] = indices[face * 3 + k];
        replay_.for_corners(noted.wedges[0], [&](uint32_t c) {
            const uint32_t other = c / 3, at = other_slot_[other];
            if (at == none || neighbour != none) return;
            std::array<uint8_t, 3> corners{};
            for (uint32_t k = 0; k < 3; ++k) {
                uint8_t corner = 0;
                while (corner < 3 && indices[other * 3 + corner] != noted.wedges[k]) ++corner;
                if (corner == 3) return;
                corners[k] = corner;
            }
            neighbour = at;
            noted.corners = corners;
        });
        noted.literal = neighbour == none;
        if (noted.literal) {
            neighbour = 0;
        } else {
            noted.wedges = {};
        }
        noted.neighbour = static_cast<uint8_t>(neighbour % keyframe_block_slots);
        return noted;
    }

    void tswap_step(uint32_t level) {
        std::vector<uint32_t> alive, dead;
        for (const uint32_t face : face_at_) (replay_.alive(face) ? alive : dead).push_back(face);
        std::vector<uint32_t> slots;
        for (const uint32_t face : alive) slots.push_back(slot_of_[face]);
        orderer_.reorder(level, replay_.indices(), slots, alive);
        const auto after = static_cast<uint32_t>(alive.size()), before = static_cast<uint32_t>(face_at_.size());
        order_.tswaps.push_back({level, before, after, static_cast<uint32_t>(order_.cycle_lengths.size()),
                                 static_cast<uint32_t>(order_.cycle_slots.size())});
        // The dead keep their own slots where those lie behind the new range, so that as few as possible are written.
        std::vector<uint32_t> from(before, none);
        for (uint32_t s = 0; s < after; ++s) from[s] = slot_of_[alive[s]];
        std::vector<uint32_t> homeless;
        for (const uint32_t face : dead) {
            if (slot_of_[face] >= after) {
                from[slot_of_[face]] = slot_of_[face];
            } else {
                homeless.push_back(slot_of_[face]);
            }
        }
        size_t next = 0;
        for (uint32_t s = after; s < before; ++s) {
            if (from[s] == none) from[s] = homeless[next++];
        }
        append_cycles(from, order_);
        for (const uint32_t face : dead) replay_.leave_range(face);
        for (uint32_t s = 0; s < after; ++s) slot_of_[alive[s]] = s;
        face_at_ = std::move(alive);
    }

    const Store& store_;
    FaceOrderer& orderer_;
    Replay replay_;
    std::vector<uint32_t> gone_at_, parent_;   // per wedge, as OrderInput
    std::vector<uint32_t> face_at_, slot_of_;  // drawn range: face of slot; slot of face, none where it is in none
    // Where there are keyframes: how many were passed, the orders of all of them, and the other half: slot and block of
    // face, while it is coming or going; the faces of the order before, by slot, until they are forgotten.
    uint32_t drawn_ = 0;
    std::vector<Planned> planned_;
    std::vector<uint32_t> other_slot_, other_block_, face_before_;
    uint32_t alive_ = 0;
    std::vector<uint32_t> dying_;
    std::vector<std::vector<uint32_t>> corner_lists_;
    Store::Order order_;
};

// Wedges of the mesh in their new order: by the removal of their vertices, so that the wedges of every level are a
// prefix.
class WedgeOrder {
public:
    WedgeOrder(const TriMesh& mesh, const CollapseList& list)
        : first_(mesh.vertex_count() + 1, 0), of_(mesh.wedge_count()), new_wedge_(mesh.wedge_count()) {
        for (const uint32_t v : mesh.wedge_vertex) ++first_[v + 1];
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        std::vector<uint32_t> fill(first_.begin(), first_.end() - 1);
        for (uint32_t w = 0; w < mesh.wedge_count(); ++w) of_[fill[mesh.wedge_vertex[w]]++] = w;
        const std::vector<uint32_t> vertices = vertices_by_removal(mesh, list);
        uint32_t next = 0;
        for (uint32_t v = 0; v < vertices.size(); ++v) {
            for (uint32_t k = 0; k < count(vertices[v]); ++k) {
                new_wedge_[of_[first_[vertices[v]] + k]] = next++;
                new_vertex_.push_back(v);
            }
        }
    }

    uint32_t new_wedge(uint32_t wedge) const { return new_wedge_[wedge]; }
    // Wedges of a vertex of the mesh: how many, and the new number of each.
    uint32_t count(uint32_t vertex) const { return first_[vertex + 1] - first_[vertex]; }
    uint32_t wedge_of(uint32_t vertex, uint32_t k) const { return new_wedge_[of_[first_[vertex] + k]]; }
    std::vector<uint32_t> take_new_vertices() { return std::move(new_vertex_); }  // per new wedge

private:
    // Those that stay come first, in source order, then the removed ones, last removed first.
    static std::vector<uint32_t> vertices_by_removal(const TriMesh& mesh, const CollapseList& list) {
        std::vector<uint32_t> order;
        std::vector<bool> removed(mesh.vertex_count(), false);
        for (const Collapse& c : list.collapses) removed[c.removed] = true;
        for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
            if (!removed[v]) order.push_back(v);
        }
        for (size_t i = list.collapses.size(); i-- > 0;) order.push_back(list.collapses[i].removed);
        LODE_CHECK(order.size() == mesh.vertex_count(), order.size(), mesh.vertex_count());
        return order;
    }

    std::vector<uint32_t> first_, of_;  // wedges of vertex v: of_[first_[v]] ...
    std::vector<uint32_t> new_wedge_, new_vertex_;
};

// Ecols and parents go to the store. Returns, per face, the level at which it dies. A wedge that no face uses any more
// at its removal becomes the first wedge of the kept vertex.
Result<std::vector<uint32_t>> replay_collapses(const CollapseList& list, const WedgeOrder& wedges,
                                               const std::vector<uint32_t>& face_indices, Store& store) {
    std::vector<uint32_t> death(face_indices.size() / 3, static_cast<uint32_t>(list.collapses.size()) + 1);
    Replay replay(face_indices, store.wedge_vertex);
    std::vector<uint32_t> parent_of(store.wedge_vertex.size(), none);
    for (uint32_t i = 0; i < list.collapses.size(); ++i) {
        const Collapse& c = list.collapses[i];
        for (uint32_t p = c.first_wedge; p < c.first_wedge + c.wedge_count; ++p) {
            parent_of[wedges.new_wedge(list.wedge_pairs[p].removed)] = wedges.new_wedge(list.wedge_pairs[p].kept);
        }
        const uint32_t count = wedges.count(c.removed);
        if (count > std::numeric_limits<uint16_t>::max()) {
            return fail(Fault::machine, "vertex " + std::to_string(c.removed) + " has more than 65535 wedges");
        }
        uint32_t faces = 0;
        for (uint32_t k = count; k-- > 0;) {
            const uint32_t wedge = wedges.wedge_of(c.removed, k);
            const uint32_t parent = parent_of[wedge] != none ? parent_of[wedge] : wedges.wedge_of(c.kept, 0);
            store.parents.push_back(parent);
            replay.rewrite(wedge, parent, [&](uint32_t face) {
                death[face] = i + 1;
                replay.leave_range(face);
                ++faces;
            });
        }
        LODE_CHECK(faces <= std::numeric_limits<uint16_t>::max(), faces);
        store.ecols.push_back({static_cast<uint16_t>(count), static_cast<uint16_t>(faces)});
    }
    store.errors.assign(store.ecols.size() + 1, 0.0f);
    return death;
}

// What an order stores is numbered by 32 bits.
Result<void> check_entries(const std::string& name, const Store::Order& order, const Limits& limits) {
    for (const auto& [what, number] :
         {std::pair("corners rewritten", order.corners.size()), std::pair("slots moved", order.cycle_slots.size()),
          std::pair("bytes of keyframes", order.block_bytes.size())}) {
        if (number > limits.lod_entries)
            return fail(Fault::format, "order " + name + " " + over_limit(what, number, limits.lod_entries));
    }
    return {};
}

// A progressive mesh without orders, whose spans refer to the store.
ProgressiveMesh mesh_in(const std::shared_ptr<Store>& store, const TriMesh& mesh) {
    ProgressiveMesh pm;
    pm.vertices = store->vertices;
    pm.wedge_vertex = store->wedge_vertex;
    pm.ecols = store->ecols;
    pm.parents = store->parents;
    pm.errors = store->errors;
    pm.attributes = attributes_of(mesh);
    pm.material_table = mesh.material_table;
    pm.images = mesh.images;
    pm.owner = store;
    return pm;
}

}  // namespace

Result<ProgressiveMesh> bake_progressive_mesh(const TriMesh& mesh, const CollapseList& list,
                                              const std::vector<std::string>& orders, const OrderOptions& order_options,
                                              const Progress& progress, const Limits& limits) {
    LODE_CHECK(!orders.empty());
    if (mesh.triangle_count() > limits.lod_triangles)
        return fail(Fault::format, "the mesh " + over_limit("triangles", mesh.triangle_count(), limits.lod_triangles) +
                                       ", or bake it with --backends vgi");
    const auto store = std::make_shared<Store>();
    WedgeOrder wedges(mesh, list);
    store->wedge_vertex = wedges.take_new_vertices();
    const std::vector<MeshVertex> packed = pack_vertices(mesh);
    store->vertices.resize(packed.size());
    for (uint32_t w = 0; w < packed.size(); ++w) store->vertices[wedges.new_wedge(w)] = packed[w];
    std::vector<uint32_t> face_indices;
    face_indices.reserve(mesh.triangle_count() * 3);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) face_indices.push_back(wedges.new_wedge(w));
    }
    const auto death = replay_collapses(list, wedges, face_indices, *store);
    if (!death) return tl::unexpected(death.error());

    ProgressiveMesh pm = mesh_in(store, mesh);
    store->orders.reserve(orders.size());  // spans refer to them
    for (const std::string& name : orders) {
        auto orderer = face_orderer_named(name, order_options);
        if (!orderer) return tl::unexpected(orderer.error());
        auto baked = OrderBake(*store, face_indices, *death, **orderer).run(progress);
        if (!baked) return tl::unexpected(baked.error());
        if (auto done = check_entries(name, *baked, limits); !done) return tl::unexpected(done.error());
        store->orders.push_back(std::move(*baked));
        const Store::Order& o = store->orders.back();
        pm.orders.push_back({name, (*orderer)->searched_less(), (*orderer)->drops_dead(), o.indices, o.first_corner,
                             o.corners, o.tswaps, o.cycle_lengths, o.cycle_slots, o.keyframes, o.block_ends,
                             o.block_bytes});
    }
    if (auto counted = pm.count_levels(); !counted) return tl::unexpected(counted.error());
    return pm;
}

}  // namespace lodestone
