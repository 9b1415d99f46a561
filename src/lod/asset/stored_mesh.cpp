#include "lod/asset/stored_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string_view>

#include "base/check.h"
#include "base/json.h"
#include "base/none.h"
#include "lod/asset/face_walk.h"
#include "lod/asset/split_coder.h"
#include "mesh/limits.h"

namespace lodestone {

namespace {

// Splits of a block: at most; at least; and the share of the vertices that are a block, so that a prefix may end nearly
// anywhere. A block also ends where a keyframe of the first order is, if it has half as many.
constexpr uint32_t most_splits = 16384, few_splits = 768, vertices_per_split = 14;

// Streams of tswaps, behind those of splits in the last block.
namespace swap_streams {
enum : size_t { levels, after, cycles, lengths, slots, count };
}
constexpr size_t streams = size_t{split_streams::count} + swap_streams::count;
constexpr size_t first_swaps = size_t{split_streams::count};  // the first of them

tl::unexpected<Error> broken(const std::string& what) {
    return fail(Fault::format, "lod/blocks: " + what + "; bake the asset again");
}

uint32_t zigzag(uint32_t difference) {
    return (difference << 1) ^ static_cast<uint32_t>(static_cast<int32_t>(difference) >> 31);
}
uint32_t unzigzag(uint32_t coded) { return (coded >> 1) ^ (0u - (coded & 1)); }

// Those of an order that are alive at a level with `alive` faces.
std::vector<uint32_t> alive_ones(const std::vector<uint32_t>& order, uint32_t alive) {
    std::vector<uint32_t> kept;
    std::ranges::copy_if(order, std::back_inserter(kept), [&](uint32_t face) { return face < alive; });
    return kept;
}

// Exponents of the grid: its multiples below 2^31 are floats, and not too large.
constexpr int least_exponent = -149, largest_exponent = 90;

// The largest power of two that all coordinates are multiples of, where they are multiples that fit 30 bits.
std::optional<int> grid_of(std::span<const MeshVertex> vertices) {
    int lowest = largest_exponent, highest = least_exponent;
    for (const MeshVertex& v : vertices) {
        for (const float x : v.position) {
            if (x == 0 && std::signbit(x)) return std::nullopt;
            if (x == 0) continue;
            int exponent = 0;
            const auto digits = static_cast<uint32_t>(std::ldexp(std::abs(std::frexp(x, &exponent)), 24));
            lowest = std::min(lowest, exponent - 24 + std::countr_zero(digits));
            highest = std::max(highest, exponent);
        }
    }
    if (lowest < least_exponent || highest - lowest > 30) return std::nullopt;
    return lowest;
}

// Errors from coarse to fine: floats above 0 as integers, by how much their steps change.
class ErrorCoder {
public:
    void write(NumberWriter& to, float error) {
        const auto now = std::bit_cast<uint32_t>(error);
        const uint32_t step = last_ - now;
        to.number(0, zigzag(step - step_));
        step_ = step;
        last_ = now;
    }
    float read(NumberReader& from) {
        step_ += unzigzag(from.number(0));
        last_ -= step_;
        return std::bit_cast<float>(last_);
    }

private:
    uint32_t last_ = 0, step_ = 0;
};

}  // namespace

// -------------------------------------------------------------------------------------------------------- packing

class StoredMesh::Packer {
public:
    Packer(const MeshPlan& plan, StoredMesh& stored)
        : plan_(plan),
          stored_(stored),
          vertices_(plan.vertices),
          further_(plan.further),
          marks_(plan.born.size() / 3, none) {}

    Result<void> run() {
        const auto levels = static_cast<uint32_t>(plan_.ecols.size()) + 1;
        stored_.levels_ = levels;
        stored_.attributes_ = plan_.attributes;
        stored_.grid_exponent_ = grid_of(plan_.vertices);
        for (const PlannedOrder& order : plan_.orders) stored_.orders_.push_back(described(order));
        add_base();
        if (!mesh_.join_base()) return fail(Fault::invariant, "the base of the progressive mesh is no manifold");
        add_orders(levels - 1);
        for (uint32_t level = levels - 1; level-- > 0;) {
            if (!add_split(level))
                return fail(Fault::invariant, "collapse " + std::to_string(level) +
                                                  " of the progressive mesh leaves no manifold, and cannot be stored");
            add_orders(level);
            ++splits_;
            const bool keyframe = std::ranges::binary_search(stored_.orders_.front().keyframes, level);
            const uint32_t enough = std::clamp(mesh_.vertices() / vertices_per_split, few_splits, most_splits);
            if (splits_ >= (keyframe ? enough / 2 : enough)) end_block(level);
        }
        if (splits_ > 0 || stored_.blocks_.empty()) end_block(0);
        return {};
    }

private:
    Order described(const PlannedOrder& order) const {
        Order told{order.name, order.drops_dead, order.orders.size() > 1, !order.tswaps.empty(), {}};
        for (size_t k = 1; k < order.orders.size(); ++k) {
            const auto& faces = order.orders[k].faces;
            told.keyframes.push_back(order.orders[k].level);
            told.keeps &= faces == alive_ones(order.orders[k - 1].faces, static_cast<uint32_t>(faces.size()));
        }
        return told;
    }

    void add_base() {
        Coder coder(io_, mesh_, {vertices_, further_}, plan_.attributes, stored_.grid());
        const uint32_t removed = static_cast<uint32_t>(plan_.parents.size());
        const auto wedges = static_cast<uint32_t>(plan_.wedge_vertex.size()) - removed;
        for (uint32_t w = 0, end = 0; w < wedges; w = end) {
            while (end < wedges && plan_.wedge_vertex[end] == plan_.wedge_vertex[w]) ++end;
            coder.base_vertex(end - w);
        }
        uint32_t faces = static_cast<uint32_t>(marks_.size());
        for (const Ecol& ecol : plan_.ecols) faces -= ecol.faces;
        for (uint32_t f = 0; f < faces; ++f) {
            std::array<uint32_t, 3> corners{};
            std::array<uint16_t, 3> locals{};
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t wedge = plan_.born[size_t{f} * 3 + k];
                corners[k] = plan_.wedge_vertex[wedge];
                locals[k] = static_cast<uint16_t>(wedge - mesh_.first_wedge(corners[k]));
            }
            coder.base_face(corners, locals);
        }
        stored_.base_vertices_ = mesh_.vertices();
        stored_.base_faces_ = faces;
    }

    // The split that undoes the ecol of this number.
    bool add_split(uint32_t ecol) {
        const auto wedges = static_cast<uint32_t>(plan_.wedge_vertex.size());
        const uint32_t first = mesh_.wedge_count(), count = plan_.ecols[ecol].wedges;
        const auto parent = [&](uint32_t w) { return plan_.parents[wedges - 1 - w]; };
        SplitMesh::Split& split = step_.split;
        split = {plan_.wedge_vertex[parent(first)], {}, {}, {}, false, false, none};
        step_.parents.clear();
        for (uint32_t w = first; w < first + count; ++w) {
            if (plan_.wedge_vertex[parent(w)] != split.parent) return false;
            step_.parents.push_back(parent(w) - mesh_.first_wedge(split.parent));
        }
        return find_arc(ecol, first) && find_births(ecol, first) &&
               Coder(io_, mesh_, {vertices_, further_}, plan_.attributes, stored_.grid()).step(step_);
    }

    // The faces that take the new vertex, in their order around the parent.
    bool find_arc(uint32_t ecol, uint32_t first_wedge) {
        SplitMesh::Split& split = step_.split;
        const auto corners =
            std::span(plan_.corners)
                .subspan(plan_.first_corner[ecol], plan_.first_corner[ecol + 1] - plan_.first_corner[ecol]);
        step_.arc_locals.clear();
        if (corners.empty()) return true;
        for (uint32_t i = 0; i < corners.size(); ++i) {
            const uint32_t face = corners[i].corner / 3;
            if (mesh_.vertex({face, corners[i].corner % 3}) != split.parent) return false;
            marks_[face] = i;
        }
        const auto marked = [&](uint32_t face) { return face != none && marks_[face] != none; };
        bool good = true;
        for (const auto& c : corners) {
            const SplitMesh::Corner at{c.corner / 3, c.corner % 3};
            split.before = mesh_.clockwise(at);
            if (marked(split.before.face)) continue;
            SplitMesh::Corner on = at;
            for (; marked(on.face); on = mesh_.counter_clockwise(on)) {
                split.arc.push_back(on);
                step_.arc_locals.push_back(corners[marks_[on.face]].wedge - first_wedge);
            }
            split.after = on;
            break;
        }
        good = split.arc.size() == corners.size();
        for (const auto& c : corners) marks_[c.corner / 3] = none;
        return good;
    }

    // The faces that are born, and where without an arc.
    bool find_births(uint32_t ecol, uint32_t first_wedge) {
        SplitMesh::Split& split = step_.split;
        const uint32_t u = split.parent, v = mesh_.vertices();
        const uint32_t begin = mesh_.face_count();
        for (uint32_t f = begin; f < begin + plan_.ecols[ecol].faces; ++f) {
            std::array<uint32_t, 3> vertices{}, locals{};
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t wedge = plan_.born[size_t{f} * 3 + k];
                vertices[k] = plan_.wedge_vertex[wedge];
                if (vertices[k] > v) return false;
                locals[k] = wedge - (vertices[k] == v ? first_wedge : mesh_.first_wedge(vertices[k]));
            }
            const bool right = vertices[1] == u;
            if (vertices[0] != v || (!right && vertices[2] != u) || (right ? split.right || split.left : split.left))
                return false;
            (right ? split.right : split.left) = true;
            (right ? step_.right_locals : step_.left_locals) = locals;
            if (split.arc.empty()) find_place(right, vertices[right ? 2 : 1]);
        }
        const bool closes = (split.before.face == none || split.right) && (split.after.face == none || split.left);
        return closes && (!split.arc.empty() || split.before.face != none || split.after.face != none ||
                          mesh_.home(u).face == none);
    }

    // Where there is no arc: the face that the new one is joined to, found around its third vertex.
    void find_place(bool right, uint32_t opposite) {
        SplitMesh::Split& split = step_.split;
        split.opposite = opposite;
        const SplitMesh::Corner first = mesh_.home(opposite);
        const auto look = [&](SplitMesh::Corner c) {
            const SplitMesh::Corner ahead{c.face, SplitMesh::next(c.k)}, behind{c.face, SplitMesh::previous(c.k)};
            if (right && mesh_.vertex(ahead) == split.parent) split.before = ahead;
            if (!right && mesh_.vertex(behind) == split.parent) split.after = behind;
        };
        SplitMesh::Corner c = first;
        while (c.face != none) {
            look(c);
            c = mesh_.counter_clockwise(c);
            if (c == first) break;
        }
        if (c.face == none && first.face != none) {
            for (c = mesh_.clockwise(first); c.face != none; c = mesh_.clockwise(c)) look(c);
        }
        if ((right ? split.before : split.after).face != none) split.opposite = none;
    }

    // The orders that are stored at a level, which the mesh is at.
    void add_orders(uint32_t level) {
        for (size_t o = 0; o < plan_.orders.size(); ++o) {
            const PlannedOrder& order = plan_.orders[o];
            if (!stored_.orders_[o].stored_at(level)) continue;
            const auto at = std::ranges::find(order.orders, level, &PlannedKeyframe::level);
            auto faces = at->faces;
            LODE_CHECK(code_walk(io_, mesh_, faces), order.name, level);
            if (level == 0 && stored_.orders_[o].swaps) add_swaps(order);
        }
    }

    void add_swaps(const PlannedOrder& order) {
        io_.number(first_swaps + swap_streams::levels, static_cast<uint32_t>(order.tswaps.size()));
        uint32_t level = 0, last_slot = 0;
        size_t slot = 0;
        for (size_t s = 0; s < order.tswaps.size(); ++s) {
            const TswapStep& step = order.tswaps[s];
            const size_t end =
                s + 1 < order.tswaps.size() ? order.tswaps[s + 1].first_cycle : order.cycle_lengths.size();
            io_.number(first_swaps + swap_streams::levels, step.level - level);
            io_.number(first_swaps + swap_streams::after, step.slots_before - step.slots_after);
            io_.number(first_swaps + swap_streams::cycles, static_cast<uint32_t>(end - step.first_cycle));
            level = step.level;
            for (size_t c = step.first_cycle; c < end; ++c) {
                io_.number(first_swaps + swap_streams::lengths, order.cycle_lengths[c] - 2);
                for (uint32_t i = 0; i < order.cycle_lengths[c]; ++i, ++slot) {
                    io_.number(first_swaps + swap_streams::slots, zigzag(order.cycle_slots[slot] - last_slot));
                    last_slot = order.cycle_slots[slot];
                }
            }
        }
    }

    void end_block(uint32_t level) {
        StoredMesh::Block block;
        block.content = io_.packed();
        block.entry = {level, mesh_.wedge_count(), mesh_.face_count(), static_cast<uint32_t>(block.content.size()), 0,
                       0};
        stored_.blocks_.push_back(std::move(block));
        io_ = NumberWriter(streams, split_streams::bit_count);
        splits_ = 0;
    }

    using Coder = SplitCoder<NumberWriter>;
    const MeshPlan& plan_;
    StoredMesh& stored_;
    SplitMesh mesh_;
    std::vector<MeshVertex> vertices_;
    std::vector<FurtherAttributes> further_;
    std::vector<uint32_t> marks_;  // per face: its place in the arc that is looked for
    SplitStep step_;
    NumberWriter io_{streams, split_streams::bit_count};
    uint32_t splits_ = 0;  // of the block
};

Result<StoredMesh> StoredMesh::pack(const MeshPlan& plan) {
    LODE_CHECK(!plan.orders.empty() && plan.first_corner.size() == plan.ecols.size() + 1);
    StoredMesh stored;
    if (auto done = Packer(plan, stored).run(); !done) return tl::unexpected(done.error());
    return stored;
}

// ------------------------------------------------------------------------------------------------------ unpacking

class StoredMesh::Unpacker {
public:
    explicit Unpacker(const StoredMesh& stored) : stored_(stored), grid_(stored.grid()), level_(stored.levels_ - 1) {
        for (const Order& order : stored.orders_) {
            PlannedOrder planned;
            planned.name = order.name;
            planned.drops_dead = order.drops_dead;
            made_.orders.push_back(std::move(planned));
        }
    }

    Result<Unpacked> run() {
        make_room();
        for (size_t b = 0; b < stored_.blocks_.size(); ++b) {
            if (auto done = read_block(b); !done) return tl::unexpected(done.error());
        }
        made_.levels_missing = level_;
        made_.indices = mesh_.wedge_indices();
        made_.witnesses = mesh_.take_witnesses();
        made_.wedge_vertex.reserve(mesh_.wedge_count());
        for (uint32_t v = 0; v < mesh_.vertices(); ++v)
            made_.wedge_vertex.insert(made_.wedge_vertex.end(), mesh_.wedges_of(v), v);
        std::ranges::reverse(made_.ecols);
        std::ranges::reverse(made_.parents);
        for (size_t o = 0; o < made_.orders.size(); ++o) complete(stored_.orders_[o], made_.orders[o]);
        return std::move(made_);
    }

private:
    using Coder = SplitCoder<NumberReader>;

    // As much as the table says, if so much can be in so many bytes.
    void make_room() {
        if (stored_.blocks_.empty()) return;
        const uint64_t most = stored_.stored_bytes();
        const StoredBlock& last = stored_.blocks_.back().entry;
        const auto wedges = static_cast<size_t>(std::min<uint64_t>(last.wedges, most));
        const auto faces = static_cast<size_t>(std::min<uint64_t>(last.faces, most));
        const auto splits = static_cast<size_t>(std::min<uint64_t>(stored_.levels_ - 1 - last.level, most));
        mesh_.reserve(wedges, faces);
        made_.vertices.reserve(wedges);
        if (stored_.attributes_.further()) made_.further.reserve(wedges);
        made_.ecols.reserve(splits);
        made_.parents.reserve(wedges);
        made_.arc_ends.reserve(splits);
        made_.arcs.reserve(faces * 2);
    }

    Result<void> read_block(size_t b) {
        const Block& block = stored_.blocks_[b];
        const std::string place = "block " + std::to_string(b);
        const uint32_t splits = level_ - block.entry.level, before = b == 0 ? stored_.base_faces_ : mesh_.face_count();
        if (block.entry.faces > uint64_t{before} + 2 * uint64_t{splits}) return broken(place + " has too many faces");
        // In a block of so many bytes there are so many at most: every corner of a face takes a bit.
        if (b == 0 && (stored_.base_vertices_ < 3 || stored_.base_faces_ > block.content.size() * 8 / 3 + 1 ||
                       stored_.base_vertices_ > block.content.size() * 64))
            return broken("the base is none");
        // What a stream can have: some numbers a split, one a face and order, and what a base or seams take.
        const uint64_t most = 1000 + uint64_t{splits} * 64 +
                              uint64_t{block.entry.faces} * (stored_.orders_.size() + 3) +
                              uint64_t{stored_.base_vertices_} * 8 + (block.entry.level == 0 ? swaps_most() : 0);
        auto io = NumberReader::unpack(block.content, streams, split_streams::bit_count, most, std::move(room_));
        if (!io) return broken(place + " cannot be unpacked");
        Coder coder(*io, mesh_, {made_.vertices, made_.further}, stored_.attributes_, grid_);
        if (b == 0) {
            if (!read_base(*io, coder)) return broken("the base is none");
            if (!read_orders(*io)) return broken("an order of the base is none");
        }
        while (level_ > block.entry.level) {
            if (!read_split(*io, coder)) return broken("the split to level " + std::to_string(level_ - 1) + " is none");
            --level_;
            if (!read_orders(*io)) return broken("an order of level " + std::to_string(level_) + " is none");
        }
        if (!io->finished()) return broken(place + " holds something else");
        if (mesh_.wedge_count() != block.entry.wedges || mesh_.face_count() != block.entry.faces)
            return broken(place + " does not lead where it should");
        count_parts(*io);
        room_ = io->take_room();
        return {};
    }

    // Cycles have as many slots as they like, but hardly any takes less than half a bit.
    uint64_t swaps_most() const {
        return std::ranges::any_of(stored_.orders_, &Order::swaps) ? 16 * stored_.blocks_.back().content.size() : 0;
    }

    bool read_base(NumberReader& io, Coder& coder) {
        for (uint32_t v = 0; v < stored_.base_vertices_ && !io.broken(); ++v) coder.base_vertex(1);
        for (uint32_t f = 0; f < stored_.base_faces_ && !io.broken(); ++f) {
            std::array<uint32_t, 3> corners{};
            std::array<uint16_t, 3> locals{};
            coder.base_face(corners, locals);
            for (size_t k = 0; k < 3; ++k) {
                if (locals[k] >= mesh_.wedges_of(corners[k])) return false;
            }
        }
        return !io.broken() && mesh_.join_base();
    }

    bool read_split(NumberReader& io, Coder& coder) {
        const uint32_t faces = mesh_.face_count(), wedges = mesh_.wedge_count();
        if (!coder.step(step_) || io.broken()) return false;
        made_.ecols.push_back(
            {static_cast<uint16_t>(mesh_.wedge_count() - wedges), static_cast<uint16_t>(mesh_.face_count() - faces)});
        for (const uint32_t parent : step_.parents)
            made_.parents.push_back(mesh_.first_wedge(step_.split.parent) + parent);
        for (const SplitMesh::Corner corner : step_.split.arc) made_.arcs.push_back(corner.code());
        made_.arc_ends.push_back(made_.arcs.size());
        return mesh_.wedge_count() <= Limits{}.vertices && mesh_.face_count() <= Limits{}.triangles;
    }

    bool read_orders(NumberReader& io) {
        if (level_ > next_order_) return true;
        next_order_ = next_order_below(level_);
        for (size_t o = 0; o < made_.orders.size(); ++o) {
            const Order& told = stored_.orders_[o];
            if (!told.stored_at(level_)) continue;
            made_.orders[o].orders.push_back({level_, {}});
            if (!code_walk(io, mesh_, made_.orders[o].orders.back().faces) || io.broken()) return false;
            if (level_ == 0 && told.swaps && !read_swaps(io, made_.orders[o])) return false;
        }
        return true;
    }

    // The level below a level where the next order is stored.
    uint32_t next_order_below(uint32_t level) const {
        uint32_t next = 0;
        for (const Order& order : stored_.orders_) {
            if (order.keeps || order.drops_dead) continue;
            const auto behind = std::ranges::lower_bound(order.keyframes, level);
            if (behind != order.keyframes.begin()) next = std::max(next, *(behind - 1));
        }
        return next;
    }

    bool read_swaps(NumberReader& io, PlannedOrder& order) const {
        uint32_t level = 0, slots = mesh_.face_count(), last_slot = 0;
        for (uint32_t left = io.number(first_swaps + swap_streams::levels); left > 0 && !io.broken(); --left) {
            TswapStep step;
            step.level = level += io.number(first_swaps + swap_streams::levels);
            step.slots_before = slots;
            step.slots_after = slots -= std::min(slots, io.number(first_swaps + swap_streams::after));
            step.first_cycle = static_cast<uint32_t>(order.cycle_lengths.size());
            step.first_slot = static_cast<uint32_t>(order.cycle_slots.size());
            order.tswaps.push_back(step);
            for (uint32_t cycles = io.number(first_swaps + swap_streams::cycles); cycles > 0 && !io.broken();
                 --cycles) {
                const uint32_t more = io.number(first_swaps + swap_streams::lengths);
                order.cycle_lengths.push_back(more + 2);
                for (uint64_t i = 0; i < uint64_t{more} + 2 && !io.broken(); ++i)
                    order.cycle_slots.push_back(last_slot += unzigzag(io.number(first_swaps + swap_streams::slots)));
            }
        }
        return !io.broken();
    }

    // Levels from the finest that is there on; and the orders that are not stored because they follow from others, or
    // because the end is missing.
    void complete(const Order& told, PlannedOrder& order) const {
        std::ranges::reverse(order.orders);
        for (PlannedKeyframe& keyframe : order.orders) keyframe.level -= level_;
        const uint32_t faces = mesh_.face_count();
        if (order.orders.empty() || order.orders.front().level != 0) {
            // By the next coarser order, and what is not in it by number.
            PlannedKeyframe finest;
            if (!order.orders.empty()) {
                finest.faces = order.orders.front().faces;
                if (order.orders.front().level < 2) order.orders.erase(order.orders.begin());
            }
            for (auto f = static_cast<uint32_t>(finest.faces.size()); f < faces; ++f) finest.faces.push_back(f);
            order.orders.insert(order.orders.begin(), std::move(finest));
        }
        // Where nothing is drawn any more there is no keyframe.
        std::erase_if(order.orders, [](const PlannedKeyframe& k) { return k.level > 0 && k.faces.empty(); });
        if (!told.keeps) return;
        uint32_t level = 0, alive = faces;
        for (const uint32_t keyframe : told.keyframes) {
            if (keyframe < level_ + 2) continue;
            for (; level < keyframe - level_; ++level) alive -= made_.ecols[level].faces;
            if (alive > 0) order.orders.push_back({level, alive_ones(order.orders.back().faces, alive)});
        }
    }

    void count_parts(const NumberReader& io) {
        using namespace split_streams;
        const auto sum = [&](size_t begin, size_t end) {
            uint64_t all = 0;
            for (size_t s = begin; s < end; ++s) all += io.packed_bytes(s);
            return all;
        };
        made_.parts.connectivity += sum(fan, position) + sum(base, walk) + io.packed_bytes(streams + split_bits);
        made_.parts.vertices += sum(position, base) + io.packed_bytes(streams + vertex_bits);
        made_.parts.orders += sum(walk, streams) + io.packed_bytes(streams + order_bits);
    }

    const StoredMesh& stored_;
    const double grid_;
    uint32_t level_;              // that the mesh is at
    uint32_t next_order_ = none;  // the next level where an order is stored; not above level_ once one was read
    SplitMesh mesh_;
    SplitStep step_;
    std::vector<uint8_t> room_;  // for numbers of blocks
    Unpacked made_;
};

Result<StoredMesh::Unpacked> StoredMesh::unpack() const { return Unpacker(*this).run(); }

Result<std::vector<float>> StoredMesh::unpack_errors() const {
    std::vector<float> errors;
    ErrorCoder coder;
    for (size_t b = 0; b < blocks_.size(); ++b) {
        const uint32_t before = b == 0 ? levels_ : blocks_[b - 1].entry.level, count = before - blocks_[b].entry.level;
        auto io = NumberReader::unpack(blocks_[b].errors, 1, 0, uint64_t{count} * 5);
        if (!io) return broken("the errors of block " + std::to_string(b) + " cannot be unpacked");
        for (uint32_t i = 0; i < count && !io->broken(); ++i) errors.push_back(coder.read(*io));
        if (!io->finished()) return broken("the errors of block " + std::to_string(b) + " are not one per level");
    }
    std::ranges::reverse(errors);
    return errors;
}

// --------------------------------------------------------------------------------------------------- in the file

bool StoredMesh::Order::stored_at(uint32_t level) const {
    return !drops_dead && (level == 0 || (!keeps && std::ranges::binary_search(keyframes, level)));
}

double StoredMesh::grid() const { return grid_exponent_ ? std::ldexp(1.0, *grid_exponent_) : 0; }

std::string StoredMesh::describe() const {
    Json json;
    if (grid_exponent_) json["grid_exponent"] = *grid_exponent_;
    json["version"] = progressive_mesh_version;
    json["attributes"] = {{"normals", attributes_.normals},       {"uvs", attributes_.uvs},
                          {"second_uvs", attributes_.second_uvs}, {"tangents", attributes_.tangents},
                          {"colours", attributes_.colours},       {"materials", attributes_.materials}};
    json["levels"] = levels_;
    json["base"] = {{"vertices", base_vertices_}, {"triangles", base_faces_}};
    for (const Order& o : orders_) {
        json["orders"].push_back({{"name", o.name},
                                  {"drops_dead", o.drops_dead},
                                  {"keeps", o.keeps},
                                  {"swaps", o.swaps},
                                  {"keyframes", o.keyframes}});
    }
    return json.dump();
}

Result<void> StoredMesh::read_description(std::string_view text) {
    const auto wrong = [](const std::string& what) {
        return fail(Fault::format, "lod/mesh: " + what + "; bake the asset again");
    };
    try {
        const Json json = Json::parse(text);
        if (const int version = json.value("version", 1); version != progressive_mesh_version) {
            return wrong("version " + std::to_string(version) +
                         " of progressive meshes, and this program reads version " +
                         std::to_string(progressive_mesh_version));
        }
        const Json& has = json.at("attributes");
        const auto there = [&](const char* attribute) { return has.at(attribute).get<bool>(); };
        attributes_ = {there("normals"),   there("uvs"),        there("colours"),
                       there("materials"), there("second_uvs"), there("tangents")};
        levels_ = json.at("levels").get<uint32_t>();
        if (json.contains("grid_exponent")) grid_exponent_ = json.at("grid_exponent").get<int>();
        base_vertices_ = json.at("base").at("vertices").get<uint32_t>();
        base_faces_ = json.at("base").at("triangles").get<uint32_t>();
        for (const Json& o : json.at("orders")) {
            orders_.push_back({o.at("name").get<std::string>(), o.at("drops_dead").get<bool>(),
                               o.at("keeps").get<bool>(), o.at("swaps").get<bool>(),
                               o.at("keyframes").get<std::vector<uint32_t>>()});
        }
    } catch (const Json::exception& e) { return wrong(e.what()); }
    if (attributes_.second_uvs && !attributes_.uvs)
        return wrong("there are second texture coordinates without first ones");
    if (attributes_.tangents && !attributes_.normals) return wrong("there are tangents without normals");
    const Limits limits;
    if (levels_ == 0 || levels_ > limits.vertices) return wrong("there are no levels, or too many");
    if (grid_exponent_ && (*grid_exponent_ < least_exponent || *grid_exponent_ > largest_exponent))
        return wrong("there is no such grid");
    if (orders_.empty()) return wrong("no face order");
    if (orders_.size() > limits.lod_orders) return wrong(over_limit("face orders", orders_.size(), limits.lod_orders));
    for (const Order& order : orders_) {
        uint32_t level = 0;
        for (const uint32_t keyframe : order.keyframes) {
            if (keyframe < 2 || keyframe - 2 < level || keyframe >= levels_ || order.drops_dead || order.swaps)
                return wrong("a keyframe of order " + order.name + " is at a wrong level");
            level = keyframe;
        }
    }
    return {};
}

Result<void> StoredMesh::write(ChunkWriter& writer, std::span<const float> errors) const {
    LODE_CHECK(levels_missing() == 0 && errors.size() == levels_, levels_missing(), errors.size());
    std::vector<StoredBlock> table;
    std::vector<std::byte> all;
    ErrorCoder coder;
    uint32_t level = levels_;
    for (const Block& block : blocks_) {
        NumberWriter io(1, 0);
        while (level > block.entry.level) coder.write(io, errors[--level]);
        const std::vector<std::byte> packed = io.packed();
        const size_t begin = all.size();
        all.insert(all.end(), block.content.begin(), block.content.end());
        all.insert(all.end(), packed.begin(), packed.end());
        table.push_back(block.entry);
        table.back().error_bytes = static_cast<uint32_t>(packed.size());
        table.back().sum = checksum(std::span(all).subspan(begin));
    }
    auto done = writer.add_text("lod/mesh", describe());
    if (done) done = writer.add_array("lod/table", std::span<const StoredBlock>(table));
    if (done) done = writer.add("lod/blocks", all);
    return done;
}

Result<StoredMesh> StoredMesh::read(const ChunkFile& file) {
    StoredMesh stored;
    auto text = file.text("lod/mesh");
    if (!text) return tl::unexpected(text.error());
    const auto named = [&](const Error& e) { return fail_at(file.path().string(), e); };
    if (auto read = stored.read_description(*text); !read) return named(read.error());
    auto table = file.array<StoredBlock>("lod/table");
    if (!table) return tl::unexpected(table.error());
    const uint64_t there = file.bytes_there("lod/blocks");
    uint64_t begin = 0;
    uint32_t level = stored.levels_;
    for (const StoredBlock& entry : *table) {
        if (entry.level >= level || level - entry.level > most_splits + 1)
            return named(
                broken("block " + std::to_string(stored.blocks_.size()) + " has too many levels, or none").value());
        level = entry.level;
        const uint64_t size = uint64_t{entry.bytes} + entry.error_bytes;
        if (file.is_prefix() && size > there - begin) break;
        if (size > there - begin) return named(broken("they are cut short").value());
        std::vector<std::byte> content(size);
        if (auto read = file.read_part("lod/blocks", begin, content); !read) return tl::unexpected(read.error());
        if (checksum(content) != entry.sum)
            return named(broken("block " + std::to_string(stored.blocks_.size()) + " is damaged").value());
        Block block;
        block.entry = entry;
        block.errors.assign(content.begin() + entry.bytes, content.end());
        content.resize(entry.bytes);
        block.content = std::move(content);
        stored.blocks_.push_back(std::move(block));
        begin += size;
    }
    if (stored.blocks_.empty()) return named(broken("nothing of them is there").value());
    if (!file.is_prefix() && (begin != there || stored.levels_missing() != 0))
        return named(broken("there are more, or less, than the table says").value());
    return stored;
}

uint64_t StoredMesh::stored_bytes() const {
    uint64_t all = 0;
    for (const Block& block : blocks_) all += block.content.size() + block.errors.size();
    return all;
}

}  // namespace lodestone
