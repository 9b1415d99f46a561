#include "lod/asset/progressive_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/check.h"
#include "base/threads.h"
#include "lod/asset/cursor.h"
#include "lod/asset/order_arrays.h"
#include "lod/asset/stored_mesh.h"
#include "mesh/io/material_chunks.h"
#include "mesh/limits.h"

namespace lodestone {

namespace {

tl::unexpected<Error> wrong(const std::string& chunk, const std::string& what) {
    return fail(Fault::format, chunk + ": " + what + "; bake the asset again");
}

// Every keyframe for itself and against the one before, so that what the next checks compute is defined: levels rise by
// at least 2, slots never rise and are as many as faces at least, and a step writes some blocks.
Result<void> check_keyframe_levels(const ProgressiveMesh& pm, const FaceOrder& order, const std::string& place) {
    uint32_t level = 0, slots = order.slots_of(0);
    for (size_t k = 0; k < order.keyframes.size(); ++k) {
        const Keyframe& key = order.keyframes[k];
        const std::string where = "keyframe " + std::to_string(k);
        if (order.drops_dead || key.level < 2 || key.level - 2 < level || key.level >= pm.levels())
            return wrong(place + "/keyframes", where + " is at a wrong level");
        if (key.slots == 0 || key.slots > slots || key.dead != slots - key.slots)
            return wrong(place + "/keyframes", where + " does not fit the drawn range");
        if (key.slots < pm.triangles_at(key.level))
            return wrong(place + "/keyframes", where + " draws fewer faces than there are");
        if (key.blocks_per_step == 0) return wrong(place + "/keyframes", where + " writes no blocks in a step");
        slots = key.slots;
        level = key.level;
    }
    return {};
}

// Blocks of the keyframes of one order: they lie behind one another, each makes sense, and together they tell of every
// face that died.
Result<void> check_keyframe_bytes(const ProgressiveMesh& pm, const FaceOrder& order, const std::string& place) {
    uint32_t slots = order.slots_of(0), block = 0;
    uint64_t begin = 0;
    for (size_t k = 0; k < order.keyframes.size(); ++k) {
        const Keyframe& key = order.keyframes[k];
        const std::string where = "keyframe " + std::to_string(k);
        if (key.first_block != block || key.blocks() > order.block_ends.size() - block)
            return wrong(place + "/keyframes", where + " has the wrong blocks");
        uint64_t dead = 0;
        for (uint32_t b = 0; b < key.blocks(); ++b, ++block) {
            const uint64_t end = order.block_ends[block];
            if (end < begin || end > order.block_bytes.size()) return wrong(place + "/blocks", "a block has no end");
            uint32_t block_dead = 0;
            if (!check_keyframe_block(order.block_bytes.subspan(begin, end - begin),
                                      std::min(keyframe_block_slots, key.slots - b * keyframe_block_slots), slots,
                                      static_cast<uint32_t>(pm.vertices.size()), block_dead)) {
                return wrong(place + "/blocks", "block " + std::to_string(block) + " makes no sense");
            }
            dead += block_dead;
            begin = end;
        }
        if (dead != key.dead) return wrong(place + "/keyframes", where + " loses faces");
        slots = key.slots;
    }
    if (block != order.block_ends.size() || begin != order.block_bytes.size())
        return wrong(place + "/blocks", "some belong to no keyframe");
    return {};
}

// Levels, sizes and blocks of the keyframes of one order.
Result<void> check_keyframes(const ProgressiveMesh& pm, const FaceOrder& order, const std::string& place) {
    if (auto good = check_keyframe_levels(pm, order, place); !good) return good;
    // The half that is not drawn holds one order at a time.
    uint32_t level = 0, reach = 0;
    for (size_t k = 0; k < order.keyframes.size(); ++k) {
        const Keyframe& key = order.keyframes[k];
        const uint32_t room = key.level - level;
        if (key.reach() >= room || reach > room - key.reach())
            return wrong(place + "/keyframes", "keyframe " + std::to_string(k) + " reaches into another one");
        level = key.level;
        reach = key.reach();
    }
    return check_keyframe_bytes(pm, order, place);
}

// Every corner lies in a slot that its half holds at the level where it is rewritten. A cursor may keep no more than
// that (PmCursor's copy for a limited depth).
Result<void> check_corners(const ProgressiveMesh& pm, const FaceOrder& order, const std::string& place) {
    if (order.first_corner.size() != pm.parents.size() + 1 || order.first_corner.front() != 0 ||
        order.first_corner.back() != order.corners.size() ||
        !std::is_sorted(order.first_corner.begin(), order.first_corner.end())) {
        return wrong(place + "/first_corner", "does not divide the corners among the removed wedges");
    }
    uint32_t keyframe = 0;  // drawn at the level
    size_t tswap = 0;
    for (uint32_t level = 0, r = 0; level < pm.ecols.size(); ++level) {
        while (keyframe < order.keyframes.size() && order.keyframes[keyframe].level <= level) ++keyframe;
        while (tswap < order.tswaps.size() && order.tswaps[tswap].level <= level) ++tswap;
        std::array<uint64_t, 2> slots{};  // by half
        slots[keyframe & 1] = order.drops_dead ? pm.triangles_at(level)
                              : tswap > 0      ? order.tswaps[tswap - 1].slots_after
                                               : order.slots_of(keyframe);
        if (keyframe > 0 && level - order.keyframes[keyframe - 1].level < order.keyframes[keyframe - 1].reach()) {
            slots[1 - (keyframe & 1)] = order.slots_of(keyframe - 1);
        } else if (keyframe < order.keyframes.size()) {
            slots[1 - (keyframe & 1)] = order.slots_of(keyframe + 1);
        }
        const uint64_t first = order.first_corner[r];
        r += pm.ecols[level].wedges;
        for (const uint32_t corner : order.corners.subspan(first, order.first_corner[r] - first)) {
            if (order.position_of(corner) >= slots[order.half_of(corner)] * 3)
                return wrong(place + "/corners", "a position is out of range");
        }
    }
    return {};
}

Result<void> check_tswaps(const ProgressiveMesh& pm, const FaceOrder& order, const std::string& place) {
    uint32_t slots = order.slots_of(0), level = 0;
    size_t cycle = 0, slot = 0;
    for (size_t k = 0; k < order.tswaps.size(); ++k) {
        const TswapStep& key = order.tswaps[k];
        const std::string where = "step " + std::to_string(k);
        if (key.level <= level || key.level >= pm.levels())
            return wrong(place + "/tswaps", where + " is at a wrong level");
        if (key.slots_before != slots || key.slots_after > slots || order.drops_dead || !order.keyframes.empty()) {
            return wrong(place + "/tswaps", where + " does not fit the drawn range");
        }
        if (key.slots_after < pm.triangles_at(key.level))
            return wrong(place + "/tswaps", where + " draws fewer faces than there are");
        if (key.first_cycle != cycle || key.first_slot != slot)
            return wrong(place + "/tswaps", where + " skips cycles");
        const size_t end = k + 1 < order.tswaps.size() ? order.tswaps[k + 1].first_cycle : order.cycle_lengths.size();
        if (end < cycle || end > order.cycle_lengths.size()) return wrong(place + "/tswaps", where + " has no end");
        for (; cycle < end; ++cycle) {
            const uint32_t length = order.cycle_lengths[cycle];
            if (length < 2 || length > order.cycle_slots.size() - slot)
                return wrong(place + "/cycles", "a cycle is too long or too short");
            for (const size_t stop = slot + length; slot < stop; ++slot) {
                if (order.cycle_slots[slot] >= key.slots_before)
                    return wrong(place + "/cycles", "a slot is out of range");
            }
        }
        slots = key.slots_after;
        level = key.level;
    }
    if (cycle != order.cycle_lengths.size() || slot != order.cycle_slots.size())
        return wrong(place + "/cycles", "some belong to no step");
    return {};
}

// Ranges and sizes of one order, so that a cursor stays inside its buffers.
Result<void> check_ranges(const ProgressiveMesh& pm, const FaceOrder& order) {
    const std::string place = "lod/" + order.name;
    if (order.indices.size() != size_t{pm.triangles_at(0)} * 3)
        return wrong(place + "/indices", "wrong number of faces");
    for (const uint32_t wedge : order.indices) {
        if (wedge >= pm.vertices.size()) return wrong(place + "/indices", "a wedge is out of range");
    }
    Result<void> good = check_tswaps(pm, order, place);
    if (good) good = check_keyframes(pm, order, place);
    if (good) good = check_corners(pm, order, place);
    return good;
}

// What positions and materials a vertex may have.
Result<void> check_vertices(std::span<const MeshVertex> vertices, size_t materials) {
    for (const MeshVertex& v : vertices) {
        if (v.material >= materials) return wrong("lod/vertices", "a material is out of range");
        if (!std::isfinite(v.position[0]) || !std::isfinite(v.position[1]) || !std::isfinite(v.position[2]))
            return wrong("lod/vertices", "a position is no number");
    }
    return {};
}

}  // namespace

const FaceOrder* ProgressiveMesh::order_named(std::string_view name) const {
    const auto found = std::find_if(orders.begin(), orders.end(), [&](const FaceOrder& o) { return o.name == name; });
    return found == orders.end() ? nullptr : &*found;
}

uint32_t ProgressiveMesh::level_for_error(double error) const {
    const auto past = std::upper_bound(errors.begin(), errors.end(), error, [](double e, float level_error) {
        return e < static_cast<double>(level_error);
    });
    return past == errors.begin() ? 0 : static_cast<uint32_t>(past - errors.begin()) - 1;
}

uint32_t ProgressiveMesh::level_for_wedges(uint64_t wedges) const {
    const auto found =
        std::partition_point(wedges_at_.begin(), wedges_at_.end(), [&](uint32_t w) { return w > wedges; });
    return std::min(static_cast<uint32_t>(found - wedges_at_.begin()), levels() - 1);
}

uint32_t ProgressiveMesh::level_for_triangles(uint64_t triangles) const {
    const auto found =
        std::partition_point(triangles_at_.begin(), triangles_at_.end(), [&](uint32_t t) { return t > triangles; });
    return std::min(static_cast<uint32_t>(found - triangles_at_.begin()), levels() - 1);
}

uint32_t FaceOrder::keyframe_at(uint32_t level) const {
    const auto next = std::upper_bound(keyframes.begin(), keyframes.end(), level,
                                       [](uint32_t l, const Keyframe& key) { return l < key.level; });
    return static_cast<uint32_t>(next - keyframes.begin());
}

uint32_t FaceOrder::slots_at(uint32_t level, uint32_t alive) const {
    if (drops_dead) return alive;
    if (tswaps.empty()) return slots_of(keyframe_at(level));
    const auto next = std::upper_bound(tswaps.begin(), tswaps.end(), level,
                                       [](uint32_t l, const TswapStep& step) { return l < step.level; });
    return next == tswaps.begin() ? slots_of(0) : (next - 1)->slots_after;
}

double FaceOrder::moved_per_ecol(size_t collapses) const {
    size_t moved = cycle_slots.size();
    for (const Keyframe& key : keyframes) moved += key.slots;
    return collapses ? static_cast<double>(moved) / static_cast<double>(collapses) : 0;
}

void ProgressiveMesh::set_errors(std::vector<float> level_errors) {
    LODE_CHECK(level_errors.size() == levels() && (level_errors[0] == 0 || levels_missing > 0), level_errors.size());
    LODE_CHECK(std::is_sorted(level_errors.begin(), level_errors.end()));
    struct Owners {
        std::shared_ptr<const void> before;
        std::vector<float> errors;
    };
    const auto owners = std::make_shared<Owners>(Owners{owner, std::move(level_errors)});
    errors = owners->errors;
    owner = owners;
}

Result<void> ProgressiveMesh::check_errors(std::span<const float> e) const {
    if (e.size() != levels()) return wrong("lod/errors", "not one per level");
    const auto falls = [&](size_t i) { return !(e[i] >= e[i - 1]); };  // or is no number
    bool rise = (levels_missing > 0 ? e[0] >= 0 : e[0] == 0) && std::isfinite(e.back());
    for (size_t i = 1; i < e.size() && rise; ++i) rise = !falls(i);
    if (!rise) return wrong("lod/errors", "errors fall or do not begin at 0");
    return {};
}

Result<void> ProgressiveMesh::count_shared() {
    if (orders.empty()) return wrong("lod/mesh", "no face order");
    const Limits limits;
    if (orders.size() > limits.lod_orders)
        return wrong("lod/mesh", over_limit("face orders", orders.size(), limits.lod_orders));
    if (vertices.size() > limits.vertices)
        return wrong("lod/vertices", over_limit("vertices", vertices.size(), limits.vertices));
    if (orders[0].indices.size() / 3 > limits.triangles)
        return wrong("lod/" + orders[0].name, over_limit("triangles", orders[0].indices.size() / 3, limits.triangles));
    wedges_at_.assign(1, static_cast<uint32_t>(vertices.size()));
    triangles_at_.assign(1, static_cast<uint32_t>(orders[0].indices.size() / 3));
    for (const Ecol& step : ecols) {
        if (step.wedges == 0 || step.wedges > wedges_at_.back())
            return wrong("lod/ecols", "more wedges go than there are");
        if (step.faces > triangles_at_.back()) return wrong("lod/ecols", "more faces die than there are");
        wedges_at_.push_back(wedges_at_.back() - step.wedges);
        triangles_at_.push_back(triangles_at_.back() - step.faces);
    }
    if (wedge_vertex.size() != vertices.size()) return wrong("lod/wedge_vertex", "not one per wedge");
    if (further.size() != (attributes.further() ? vertices.size() : 0))
        return wrong("lod/vertices", "further attributes are not as many as wedges");
    for (const uint32_t v : wedge_vertex) {
        if (v >= vertices.size()) return wrong("lod/wedge_vertex", "a vertex is out of range");
    }
    if (parents.size() != vertices.size() - wedges_at_.back()) return wrong("lod/parents", "not one per removed wedge");
    uint32_t r = 0;
    for (size_t i = 0; i < ecols.size(); ++i) {
        for (uint32_t k = 0; k < ecols[i].wedges; ++k, ++r) {
            if (parents[r] >= wedges_at_[i + 1]) return wrong("lod/parents", "a parent is removed before its child");
        }
    }
    if (auto done = check_errors(errors); !done) return done;
    return {};
}

Result<void> ProgressiveMesh::count_levels() {
    if (auto done = count_shared(); !done) return done;
    for (const FaceOrder& order : orders) {
        if (auto done = check_ranges(*this, order); !done) return done;
    }
    return {};
}

Result<void> ProgressiveMesh::validate() const {
    const auto broken = [](const std::string& what) { return fail(Fault::invariant, "progressive mesh: " + what); };
    if (triangles_at_.size() != levels()) return broken("levels are not counted");
    for (uint32_t o = 0; o < orders.size(); ++o) {
        const FaceOrder& order = orders[o];
        PmCursor cursor(*this, o);
        uint64_t writes = 0;
        const auto at_level = [&](uint32_t level) {
            return "order " + order.name + ", level " + std::to_string(level) + ": ";
        };
        for (uint32_t i = 0; i < ecols.size(); ++i) {
            // Every corner an ecol rewrites must hold the wedge that goes, and no other corner may hold it.
            for (uint32_t r = wedges_at_[0] - wedges_at_[i]; r < wedges_at_[0] - wedges_at_[i + 1]; ++r) {
                const uint32_t wedge = wedges_at_[0] - 1 - r;
                for (uint64_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c) {
                    if (cursor.at(order.corners[c]) != wedge) {
                        return broken(at_level(i) + "ecol rewrites a corner that does not hold wedge " +
                                      std::to_string(wedge));
                    }
                    ++writes;
                }
            }
            cursor.ecol();
            // A full look at 64 levels and at the base; what an ecol touches is looked at at every level above.
            if (i % (ecols.size() / 64 + 1) == 0 || i + 1 == ecols.size()) {
                if (auto done = cursor.validate(); !done) return done;
            }
        }
        if (writes != order.corners.size())
            return broken("order " + order.name + " has corners that belong to no ecol");
        cursor.goto_level(0);
        if (!std::ranges::equal(cursor.drawn_indices(), order.indices)) {
            return broken(at_level(0) + "the index buffer after going to the base and back differs from before");
        }
        if (auto done = cursor.validate(); !done) return done;
    }
    return {};
}

namespace {

// What the spans of an opened mesh refer to.
struct Opened {
    StoredMesh::Unpacked mesh;
    std::vector<OrderArrays> orders;
    std::vector<float> errors;
};

}  // namespace

Result<ProgressiveMesh> ProgressiveMesh::unpack(std::shared_ptr<const StoredMesh> stored) {
    auto unpacked = stored->unpack();
    if (!unpacked) return tl::unexpected(unpacked.error());
    const auto opened = std::make_shared<Opened>();
    opened->mesh = std::move(*unpacked);
    const StoredMesh::Unpacked& mesh = opened->mesh;
    ProgressiveMesh pm;
    PlayedMesh played{mesh.ecols,   mesh.parents,   mesh.wedge_vertex, static_cast<uint32_t>(mesh.vertices.size()),
                      mesh.indices, mesh.witnesses, mesh.arcs,         mesh.arc_ends};
    // Side by side: what they play is theirs alone.
    std::vector<Result<OrderArrays>> unfolded(mesh.orders.size());
    parallel_for(unfolded.size(), 1, [&](size_t begin, size_t end) {
        for (size_t o = begin; o < end; ++o) unfolded[o] = arrays_of(played, mesh.orders[o]);
    });
    for (auto& arrays : unfolded) {
        if (!arrays) return tl::unexpected(arrays.error());
        opened->orders.push_back(std::move(*arrays));
    }
    for (size_t o = 0; o < mesh.orders.size(); ++o)
        pm.orders.push_back(opened->orders[o].order(mesh.orders[o].name, mesh.orders[o].drops_dead));
    // What they were made of is not needed any more.
    for (auto* made_of : {&opened->mesh.indices, &opened->mesh.witnesses, &opened->mesh.arcs}) *made_of = {};
    opened->mesh.arc_ends = {};
    opened->mesh.orders = {};
    opened->errors.assign(mesh.ecols.size() + 1, 0.0f);
    pm.vertices = mesh.vertices;
    pm.further = mesh.further;
    pm.wedge_vertex = mesh.wedge_vertex;
    pm.ecols = mesh.ecols;
    pm.parents = mesh.parents;
    pm.errors = opened->errors;
    pm.attributes = stored->attributes();
    pm.levels_missing = mesh.levels_missing;
    pm.parts = mesh.parts;
    pm.owner = opened;
    pm.stored = std::move(stored);
    if (auto counted = pm.count_shared(); !counted) return tl::unexpected(counted.error());
    // What was made of keyframes is right as it is made; tswaps are played as they are stored.
    for (const FaceOrder& order : pm.orders) {
        if (order.tswaps.empty()) continue;
        if (auto good = check_ranges(pm, order); !good) return tl::unexpected(good.error());
    }
    return pm;
}

Result<void> ProgressiveMesh::write_chunks(ChunkWriter& writer) const {
    LODE_CHECK(stored != nullptr);
    Result<void> done = write_materials(writer, material_table, images);
    return done ? stored->write(writer, errors) : done;
}

Result<ProgressiveMesh> ProgressiveMesh::open(const ChunkFile& file) {
    const std::string path = file.path().string();
    const auto named = [&](const Error& e) { return fail_at(path, e); };
    auto stored = StoredMesh::read(file);
    if (!stored) return tl::unexpected(stored.error());
    auto errors = stored->unpack_errors();
    if (!errors) return named(errors.error());
    auto materials = read_materials(file);
    if (!materials) return tl::unexpected(materials.error());
    auto pm = unpack(std::make_shared<const StoredMesh>(std::move(*stored)));
    if (!pm) return named(pm.error());
    pm->material_table = std::move(materials->table);
    pm->images = std::move(materials->images);
    if (pm->vertices.empty() || pm->full_triangles() == 0)
        return named({Fault::format, "lod/blocks: there is nothing to draw; bake the asset again"});
    if (auto good = check_vertices(pm->vertices, std::max<size_t>(1, pm->material_table.size())); !good)
        return named(good.error());
    if (auto good = pm->check_errors(*errors); !good) return named(good.error());
    pm->set_errors(std::move(*errors));
    pm->parts.errors = pm->stored->stored_bytes() - pm->parts.all();
    return pm;
}

}  // namespace lodestone
