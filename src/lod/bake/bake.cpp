#include "lod/bake/bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include "base/check.h"
#include "base/none.h"
#include "lod/asset/replay.h"
#include "lod/asset/stored_mesh.h"
#include "lod/bake/orders/drawn_faces.h"
#include "lod/bake/orders/face_order.h"

namespace lodestone {

namespace {

// Between collapses work looks whether it should stop, once for so many.
constexpr uint32_t collapses_between_looks = 65536;
bool told_to_stop(size_t collapse, const Progress& progress) {
    return collapse % collapses_between_looks == 0 && progress.stopped();
}

// Asks an orderer for its orders, level after level.
class OrderPlanner {
public:
    OrderPlanner(const MeshPlan& plan, const std::vector<uint32_t>& face_indices, std::span<const uint32_t> death,
                 FaceOrderer& orderer, const Limits& limits)
        : plan_(plan), orderer_(orderer), limits_(limits), replay_(face_indices, plan.wedge_vertex) {
        const auto levels = static_cast<uint32_t>(plan.ecols.size()) + 1;
        const auto wedges = static_cast<uint32_t>(plan.vertices.size());
        gone_at_.assign(wedges, levels);
        parent_.resize(wedges);
        std::iota(parent_.begin(), parent_.end(), 0u);
        uint32_t wedge = wedges;  // removed wedges are the last ones, the first to go the very last
        for (uint32_t i = 0; i < plan.ecols.size(); ++i) {
            for (uint32_t k = 0; k < plan.ecols[i].wedges; ++k) {
                --wedge;
                gone_at_[wedge] = i + 1;
                parent_[wedge] = plan.parents[wedges - 1 - wedge];
            }
        }
        face_at_ = orderer.first_order({face_indices, death, gone_at_, parent_, wedges, levels});
        alive_ = static_cast<uint32_t>(face_at_.size());
        order_.name = orderer.name();
        order_.drops_dead = orderer.drops_dead();
        order_.orders.push_back({0, face_at_});
    }

    Result<PlannedOrder> run(const Progress& progress) {
        if (order_.drops_dead) return std::move(order_);
        std::optional<DrawnFaces> drawn;
        if (orderer_.in_place()) {
            slot_of_.resize(face_at_.size());
            for (uint32_t s = 0; s < face_at_.size(); ++s) slot_of_[face_at_[s]] = s;
            drawn.emplace(face_at_, slot_of_, replay_);
        }
        uint32_t removed = 0, last = 0;
        for (uint32_t i = 0; i < plan_.ecols.size(); ++i) {
            if (i % collapses_between_looks == 0)
                progress.at("order " + order_.name, static_cast<double>(i) / static_cast<double>(plan_.ecols.size()));
            if (told_to_stop(i, progress)) return fail(Fault::interrupted, "interrupted");
            const uint32_t level = i + 1, died = collapse(plan_.ecols[i], removed, drawn.has_value());
            removed += plan_.ecols[i].wedges;
            alive_ -= died;
            if (drawn) {
                drawn->died(died);
                tswap_step(level, *drawn);
                if (order_.cycle_slots.size() > limits_.lod_entries)
                    return fail(Fault::format,
                                "order " + order_.name + " " +
                                    over_limit("slots moved", order_.cycle_slots.size(), limits_.lod_entries));
            } else if (level >= last + 2 && alive_ > 0 && fits_second_half() &&
                       orderer_.wants_order(level, alive_, static_cast<uint32_t>(face_at_.size()))) {
                keyframe(level);
                last = level;
                if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
            }
        }
        // What was told to stop came in any order.
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        return std::move(order_);
    }

private:
    // Whether an order of the faces alive has room behind the indices of full detail.
    bool fits_second_half() const {
        const uint64_t all = plan_.born.size() + uint64_t{3} * alive_;
        return all <= limits_.lod_indices;
    }

    // Returns how many faces die. notes: written_ becomes the slots whose faces are rewritten, rising.
    uint32_t collapse(const Ecol& ecol, uint32_t removed, bool notes) {
        const auto wedges = static_cast<uint32_t>(plan_.vertices.size());
        written_.clear();
        for (uint32_t r = removed; notes && r < removed + ecol.wedges; ++r)
            replay_.for_corners(wedges - 1 - r, [&](uint32_t c) { written_.push_back(slot_of_[c / 3]); });
        std::sort(written_.begin(), written_.end());
        written_.erase(std::unique(written_.begin(), written_.end()), written_.end());
        uint32_t died = 0;
        for (uint32_t r = removed; r < removed + ecol.wedges; ++r)
            replay_.rewrite(wedges - 1 - r, plan_.parents[r], [&](uint32_t) { ++died; });
        return died;
    }

    // The faces alive, in a new order; the others leave the drawn range.
    void keyframe(uint32_t level) {
        std::vector<uint32_t> slots, alive;
        for (uint32_t s = 0; s < face_at_.size(); ++s) {
            if (replay_.alive(face_at_[s])) {
                slots.push_back(s);
                alive.push_back(face_at_[s]);
            } else {
                replay_.leave_range(face_at_[s]);
            }
        }
        face_at_ = std::move(alive);
        orderer_.reorder(level, replay_.indices(), slots, face_at_);
        order_.orders.push_back({level, face_at_});
    }

    // What the orderer permutes in place on arriving at a level, as one step of tswaps.
    void tswap_step(uint32_t level, DrawnFaces& drawn) {
        const uint32_t before = drawn.slots();
        orderer_.permute(level, written_, drawn);
        const TswapStep step{level, before, drawn.slots(), static_cast<uint32_t>(order_.cycle_lengths.size()),
                             static_cast<uint32_t>(order_.cycle_slots.size())};
        drawn.take_cycles([&](const std::vector<uint32_t>& cycle) {
            order_.cycle_lengths.push_back(static_cast<uint32_t>(cycle.size()));
            order_.cycle_slots.insert(order_.cycle_slots.end(), cycle.begin(), cycle.end());
        });
        if (step.slots_after < before || order_.cycle_lengths.size() > step.first_cycle) order_.tswaps.push_back(step);
    }

    const MeshPlan& plan_;
    FaceOrderer& orderer_;
    const Limits& limits_;
    Replay replay_;
    std::vector<uint32_t> gone_at_, parent_;   // per wedge, as OrderInput
    std::vector<uint32_t> face_at_, slot_of_;  // drawn range: face of slot; slot of face, where tswaps are
    std::vector<uint32_t> written_;            // slots, by the last collapse
    uint32_t alive_ = 0;
    PlannedOrder order_;
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

// When each face dies, and how it lies then.
struct Deaths {
    std::vector<uint32_t> level;   // per face; levels if it outlives all
    std::vector<uint8_t> corner;   // per face: that of the vertex removed
    std::vector<uint8_t> is_left;  // per face: whether the vertex kept is not the next one
};

// Ecols and parents go to the plan. A wedge that no face uses any more at its removal becomes the first wedge of the
// kept vertex.
Result<Deaths> replay_collapses(const CollapseList& list, const WedgeOrder& wedges, Replay replay, MeshPlan& plan,
                                const Progress& progress) {
    const size_t faces_in_all = replay.indices().size() / 3;
    Deaths deaths{std::vector<uint32_t>(faces_in_all, static_cast<uint32_t>(list.collapses.size()) + 1),
                  std::vector<uint8_t>(faces_in_all, 0), std::vector<uint8_t>(faces_in_all, 0)};
    std::vector<uint32_t> parent_of(plan.wedge_vertex.size(), none);
    for (uint32_t i = 0; i < list.collapses.size(); ++i) {
        if (told_to_stop(i, progress)) return fail(Fault::interrupted, "interrupted");
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
            plan.parents.push_back(parent);
            replay.rewrite(wedge, parent, [&](uint32_t face) {
                const auto corners = replay.indices().subspan(size_t{face} * 3, 3);
                const auto at = static_cast<uint8_t>(std::ranges::find(corners, wedge) - corners.begin());
                deaths.level[face] = i + 1;
                deaths.corner[face] = at;
                deaths.is_left[face] = plan.wedge_vertex[corners[(at + 1u) % 3]] != plan.wedge_vertex[parent];
                replay.leave_range(face);
                ++faces;
            });
        }
        LODE_CHECK(faces <= std::numeric_limits<uint16_t>::max(), faces);
        plan.ecols.push_back({static_cast<uint16_t>(count), static_cast<uint16_t>(faces)});
    }
    // Those that outlive all begin with their smallest wedge.
    for (size_t face = 0; face < faces_in_all; ++face) {
        const auto corners = replay.indices().subspan(face * 3, 3);
        if (replay.alive(static_cast<uint32_t>(face)))
            deaths.corner[face] = static_cast<uint8_t>(std::ranges::min_element(corners) - corners.begin());
    }
    return deaths;
}

// Faces in the order and with the corners first in which they are stored: by falling death, those of one collapse as
// SplitMesh has them. Returns their wedges at full detail, and sorts the deaths likewise.
std::vector<uint32_t> as_stored(const std::vector<uint32_t>& face_indices, Deaths& deaths) {
    std::vector<uint32_t> faces(deaths.level.size());
    std::iota(faces.begin(), faces.end(), 0u);
    std::ranges::stable_sort(faces, [&](uint32_t a, uint32_t b) {
        return std::pair(deaths.level[b], deaths.is_left[a]) < std::pair(deaths.level[a], deaths.is_left[b]);
    });
    std::vector<uint32_t> indices, level;
    indices.reserve(face_indices.size());
    level.reserve(faces.size());
    for (const uint32_t f : faces) {
        for (uint32_t k = 0; k < 3; ++k) indices.push_back(face_indices[size_t{f} * 3 + (deaths.corner[f] + k) % 3]);
        level.push_back(deaths.level[f]);
    }
    deaths.level = std::move(level);
    return indices;
}

// What every split needs: the faces as they are born, and the corners that the new vertex takes.
Result<void> note_splits(const std::vector<uint32_t>& indices, MeshPlan& plan, const Progress& progress) {
    Replay replay(indices, plan.wedge_vertex);
    const auto wedges = static_cast<uint32_t>(plan.vertices.size());
    plan.born.resize(indices.size());
    plan.first_corner.push_back(0);
    auto faces = static_cast<uint32_t>(indices.size() / 3);
    uint32_t r = 0;
    for (const Ecol& ecol : plan.ecols) {
        if (told_to_stop(plan.first_corner.size() - 1, progress)) return fail(Fault::interrupted, "interrupted");
        faces -= ecol.faces;
        const uint32_t end = r + ecol.wedges;
        for (uint32_t removed = r; removed < end; ++removed) {
            const uint32_t wedge = wedges - 1 - removed;
            replay.for_corners(wedge, [&](uint32_t c) {
                if (c / 3 < faces) {
                    plan.corners.push_back({c, wedge});
                } else {
                    std::copy_n(&replay.indices()[size_t{c / 3} * 3], 3, &plan.born[size_t{c / 3} * 3]);
                }
            });
        }
        for (; r < end; ++r)
            replay.rewrite(wedges - 1 - r, plan.parents[r], [&](uint32_t face) { replay.leave_range(face); });
        plan.first_corner.push_back(plan.corners.size());
    }
    std::copy_n(replay.indices().begin(), size_t{faces} * 3, plan.born.begin());
    return {};
}

// Whether what was packed is what was planned; where it is not, a collapse was none that can be stored.
bool same(const ProgressiveMesh& pm, const MeshPlan& plan, const std::vector<uint32_t>& indices) {
    if (!std::ranges::equal(pm.vertices, plan.vertices) || !std::ranges::equal(pm.further, plan.further) ||
        !std::ranges::equal(pm.wedge_vertex, plan.wedge_vertex) || !std::ranges::equal(pm.ecols, plan.ecols) ||
        !std::ranges::equal(pm.parents, plan.parents))
        return false;
    for (size_t o = 0; o < plan.orders.size(); ++o) {
        const auto& faces = plan.orders[o].orders[0].faces;
        for (size_t s = 0; s < faces.size(); ++s) {
            if (!std::ranges::equal(pm.orders[o].indices.subspan(s * 3, 3),
                                    std::span(indices).subspan(faces[s] * size_t{3}, 3)))
                return false;
        }
    }
    return true;
}

// Everything but the orders, and the faces' wedges at full detail with the levels at which they die.
Result<std::pair<std::vector<uint32_t>, Deaths>> plan_mesh(const TriMesh& mesh, const CollapseList& list,
                                                           MeshPlan& plan, const Progress& progress) {
    WedgeOrder wedges(mesh, list);
    plan.wedge_vertex = wedges.take_new_vertices();
    const std::vector<MeshVertex> packed = pack_vertices(mesh);
    plan.vertices.resize(packed.size());
    for (uint32_t w = 0; w < packed.size(); ++w) plan.vertices[wedges.new_wedge(w)] = packed[w];
    const std::vector<FurtherAttributes> further = pack_further(mesh);
    plan.further.resize(further.size());
    for (uint32_t w = 0; w < further.size(); ++w) plan.further[wedges.new_wedge(w)] = further[w];
    plan.attributes = attributes_of(mesh);
    std::vector<uint32_t> face_indices;
    face_indices.reserve(mesh.triangle_count() * 3);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) face_indices.push_back(wedges.new_wedge(w));
    }
    auto deaths = replay_collapses(list, wedges, Replay(face_indices, plan.wedge_vertex), plan, progress);
    if (!deaths) return tl::unexpected(deaths.error());
    std::vector<uint32_t> indices = as_stored(face_indices, *deaths);
    if (auto done = note_splits(indices, plan, progress); !done) return tl::unexpected(done.error());
    return std::pair(std::move(indices), std::move(*deaths));
}

}  // namespace

Result<ProgressiveMesh> bake_progressive_mesh(const TriMesh& mesh, const CollapseList& list,
                                              const std::vector<std::string>& orders, const OrderOptions& order_options,
                                              const Progress& progress, const Limits& limits) {
    LODE_CHECK(!orders.empty());
    if (mesh.triangle_count() > limits.triangles)
        return fail(Fault::format, "the mesh " + over_limit("triangles", mesh.triangle_count(), limits.triangles));
    MeshPlan plan;
    auto planned = plan_mesh(mesh, list, plan, progress);
    if (!planned) return tl::unexpected(planned.error());
    const auto& [indices, deaths] = *planned;
    std::vector<bool> searched_less;
    OrderOptions stoppable = order_options;
    if (stoppable.stop == nullptr) stoppable.stop = progress.stop;
    for (const std::string& name : orders) {
        auto orderer = face_orderer_named(name, stoppable);
        if (!orderer) return tl::unexpected(orderer.error());
        auto order = OrderPlanner(plan, indices, deaths.level, **orderer, limits).run(progress);
        if (!order) return tl::unexpected(order.error());
        searched_less.push_back((*orderer)->searched_less());
        plan.orders.push_back(std::move(*order));
    }
    progress.at("pack", 0);
    auto stored = StoredMesh::pack(plan);
    if (!stored) return tl::unexpected(stored.error());
    auto pm = ProgressiveMesh::unpack(std::make_shared<const StoredMesh>(std::move(*stored)));
    if (!pm) return tl::unexpected(pm.error());
    if (!same(*pm, plan, indices))
        return fail(Fault::invariant, "the progressive mesh is not what it was when it is unpacked");
    for (size_t o = 0; o < searched_less.size(); ++o) pm->orders[o].searched_less = searched_less[o];
    pm->material_table = mesh.material_table;
    pm->images = mesh.images;
    return pm;
}

double quantise(TriMesh& mesh, uint32_t bits) {
    LODE_CHECK(bits >= 1 && bits <= 24, bits);
    const auto box = bounding_box(mesh.positions);
    const glm::vec3 sides = box.high - box.low;
    const double longest = std::max({sides.x, sides.y, sides.z});
    if (!(longest > 0)) return 0;
    const double step = std::ldexp(1.0, static_cast<int>(std::ceil(std::log2(longest))) - static_cast<int>(bits));
    for (glm::vec3& p : mesh.positions) {
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = static_cast<float>(std::nearbyint(static_cast<double>(p[axis]) / step) * step) + 0.0f;  // not -0
    }
    return step;
}

}  // namespace lodestone
