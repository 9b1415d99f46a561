// Geomorphs: Hoppe, "Progressive Meshes", SIGGRAPH 1996, section 3.1.
#include "lod/draw/lod_source.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "frame/indexed_mesh.h"
#include "lod/asset/cursor.h"
#include "lod/asset/vertex_places.h"
#include "shaders/shared/lod_morph.h"

namespace lodestone {

namespace {

constexpr uint32_t vertex_buffer = 0, index_buffer = 1, parent_buffer = 2;
constexpr uint64_t slot_bytes = 12;
constexpr uint32_t most_cursors = 64;    // per asset, of falling size
constexpr uint64_t reserve = 4;          // times what a level has changed, of what a frame may upload
constexpr uint32_t levels_at_once = 16;  // that a cursor goes, where what it uploads is watched
// What is kept by place of every wedge that may be on its way.
struct Ancestry {
    uint32_t parent = 0, wedge = 0;  // the parent's place; the wedge's own number
};
static_assert(sizeof(Ancestry) == LODE_LOD_PARENT_WORDS * sizeof(uint32_t));

constexpr uint32_t smallest_capacity = 256;  // slots; smaller cursors would not be worth their draw

// The slots of an asset's cursors, largest first, in at most `budget` slots.
std::vector<uint32_t> cursor_capacities(uint32_t full_slots, uint64_t budget, uint32_t instances) {
    if (uint64_t{full_slots} * instances <= budget) return std::vector<uint32_t>(instances, full_slots);
    // As near to each other as lets them reach down to the smallest.
    const double octaves = std::log2(std::max(2.0, static_cast<double>(full_slots) / smallest_capacity));
    for (double steps_per_octave = 16; steps_per_octave >= 0.5; steps_per_octave /= 2) {
        if (steps_per_octave > 1 && octaves * steps_per_octave + 1 > std::min(instances, most_cursors)) continue;
        std::vector<uint32_t> capacities;
        uint64_t sum = 0;
        double capacity = full_slots;
        while (capacities.size() < std::min(instances, most_cursors) &&
               (capacities.empty() || capacity >= smallest_capacity)) {
            capacities.push_back(static_cast<uint32_t>(capacity));
            sum += capacities.back();
            capacity = std::max(capacity / std::exp2(1 / steps_per_octave),
                                capacity > smallest_capacity ? double{smallest_capacity} : 0);
        }
        if (sum <= budget) return capacities;
    }
    return {static_cast<uint32_t>(std::min<uint64_t>(full_slots, budget))};
}

class LodSource final : public FrameSource {
public:
    struct Served {  // a cursor and its part of the index buffer
        PmCursor cursor;
        uint64_t first_byte;
        std::vector<InstanceTree::Seen> instances;  // of this frame
        uint32_t wanted_level = 0;                  // which is morphed to
        uint32_t drawn_level = 0;                   // the same without morphs
        uint64_t level_bytes = 0;                   // of indices, that a level has changed at most
    };
    struct Asset {
        std::shared_ptr<const ProgressiveMesh> pm;
        std::vector<uint32_t> places;  // of its wedges in the vertex buffer
        Sphere sphere;
        uint64_t vertex_offset = 0;
        uint32_t further_word = 0;  // LODE_MESH_WORD_FURTHER
        bool own_cursors = false;   // cursor i belongs to the asset's i-th instance
        std::vector<Served> cursors;
    };

    LodSource(std::vector<Asset> assets, Recipe recipe, const LodOptions& options)
        : assets_(std::move(assets)),
          instances_(assets_, &Asset::sphere),
          recipe_(std::move(recipe)),
          steady_share_(options.steady_share),
          geomorph_(options.geomorph),
          morphing_share_(options.morphing_share) {}

    const Recipe& recipe() const override { return recipe_; }

    Plan plan(const FrameInput& input) override {
        Plan plan;
        plan.generation = recipe_.generation;
        // What the first frame needs is uploaded whatever the budget.
        uint64_t left = vertices_uploaded_ ? input.budget.upload_bytes : ~uint64_t{0};
        if (!vertices_uploaded_) upload_vertices(plan);
        choose_levels(input, plan);
        std::vector<IndexedRange> ranges;
        for (const InUse& used : in_use_) {
            Served& served = served_by(used);
            const auto changed = go_towards(served, left);
            const uint64_t bytes = upload_dirty(served, assets_[used.asset].places, changed, plan);
            left -= std::min(left, bytes);
            ranges.push_back(range_of(assets_[used.asset], served, input));
        }
        draw_ranges(plan, input, ranges);
        for (const BufferSpec& buffer : recipe_.buffers) plan.stats.resident_bytes += buffer.bytes;
        plan.stats.index_bytes = recipe_.buffers[index_buffer].bytes;
        return plan;
    }

    Result<void> validate() const override {
        for (const Asset& asset : assets_) {
            for (const Served& served : asset.cursors) {
                if (auto done = served.cursor.validate(); !done) return done;
            }
        }
        return {};
    }

private:
    // A cursor that some instance of this frame is drawn from.
    struct InUse {
        uint32_t asset, cursor;
        auto operator<=>(const InUse&) const = default;
    };
    Served& served_by(const InUse& used) { return assets_[used.asset].cursors[used.cursor]; }

    IndexedRange range_of(const Asset& asset, const Served& served, const FrameInput& input) const {
        IndexedRange range;
        if (geomorph_) {
            range.vertex_buffer = no_buffer;
            range.words[LODE_LOD_WORD_ARRIVED] = arrived(asset, served);
            range.words[LODE_LOD_WORD_STAYING] =
                asset.pm->wedges_at(input.level_view ? served.drawn_level : served.wanted_level);
            range.words[LODE_LOD_WORD_FIRST] = static_cast<uint32_t>(asset.vertex_offset / sizeof(MeshVertex));
        } else {
            range.vertex_buffer = vertex_buffer;
            range.vertex_offset = asset.vertex_offset;
        }
        range.words[LODE_MESH_WORD_FURTHER] = asset.further_word;
        range.index_buffer = index_buffer;
        range.index_offset = served.first_byte + uint64_t{served.cursor.drawn().first} * 4;
        range.index_count = served.cursor.slot_count() * 3;
        range.triangles = served.cursor.triangle_count();
        range.level = served.cursor.level();
        range.levels = asset.pm->levels();
        if (!asset.pm->errors.empty()) range.error = static_cast<double>(asset.pm->errors[served.wanted_level]);
        range.instances = served.instances;
        return range;
    }

    void upload_vertices(Plan& plan) {
        for (const Asset& asset : assets_) {
            upload_by_place<MeshVertex>(asset, asset.pm->vertices, vertex_buffer, asset.vertex_offset, plan);
            // They lie in the last buffer.
            upload_by_place<FurtherAttributes>(asset, asset.pm->further,
                                               static_cast<uint32_t>(recipe_.buffers.size()) - 1,
                                               FurtherBuffer::offset(asset.further_word), plan);
            if (geomorph_)
                upload_by_place<Ancestry>(asset, ancestry_of(asset), parent_buffer,
                                          asset.vertex_offset / sizeof(MeshVertex) * sizeof(Ancestry), plan);
        }
        vertices_uploaded_ = true;
    }

    // What there is of every wedge, in the order of their places. Nothing where there is nothing.
    template <class T>
    static void upload_by_place(const Asset& asset, std::span<const T> of_wedges, uint32_t buffer, uint64_t offset,
                                Plan& plan) {
        if (of_wedges.empty()) return;
        std::vector<T> of_places(of_wedges.size());
        for (size_t w = 0; w < of_wedges.size(); ++w) of_places[asset.places[w]] = of_wedges[w];
        const Blob blob = Blob::copy_of(of_places.data(), of_places.size());
        plan.commands.push_back({Stage::update, Upload{buffer, offset, blob}});
        plan.stats.uploaded_bytes += blob.size();
    }

    // By wedge. Those of the base have no parent, and are never asked.
    static std::vector<Ancestry> ancestry_of(const Asset& asset) {
        const auto wedges = static_cast<uint32_t>(asset.places.size());
        std::vector<Ancestry> all(wedges);
        for (uint32_t w = 0; w < wedges; ++w) {
            const uint32_t gone = wedges - 1 - w;
            all[w] = {gone < asset.pm->parents.size() ? asset.places[asset.pm->parents[gone]] : 0, w};
        }
        return all;
    }

    // How many instances of its asset come before each.
    void count_instances(const InstanceSet& instances) {
        if (counted_ == instances.generation()) return;
        const auto changed = counted_size_ == instances.size() ? instances.changed_since(counted_) : std::nullopt;
        counted_ = instances.generation();
        counted_size_ = instances.size();
        if (changed && std::ranges::all_of(*changed, [&](uint32_t i) { return asset_of_[i] == instances[i].asset; }))
            return;
        nth_.clear();
        asset_of_.clear();
        std::vector<uint32_t> met(assets_.size(), 0);
        for (const Instance& instance : instances) {
            LODE_CHECK(instance.asset < assets_.size(), instance.asset, assets_.size());
            asset_of_.push_back(instance.asset);
            nth_.push_back(met[instance.asset]++);
        }
        levels_.resize(instances.size(), never);
        levels_before_.resize(instances.size(), never);
    }

    // Gives every instance that is seen a cursor, and every cursor in use the level it goes to.
    void choose_levels(const FrameInput& input, Plan& plan) {
        LODE_CHECK(!input.views.empty());
        instances_.update(input.instances);
        count_instances(input.instances);
        const auto seen = seen_instances(instances_, input.views);
        double pixel_error = input.budget.pixel_error;
        // A triangle budget raises the error for all alike, by steps of an eighth of an octave.
        for (int step = 0; step < 256; ++step) {
            uint64_t triangles = 0;
            bool coarsest = true;
            assign(input, seen, pixel_error, plan);
            for (const InUse& used : in_use_) {
                const Served& served = served_by(used);
                const ProgressiveMesh& pm = *assets_[used.asset].pm;
                const auto in_view = std::ranges::count_if(served.instances, [](const auto& s) { return s.views & 1; });
                triangles += uint64_t{pm.triangles_at(served.drawn_level)} * static_cast<uint64_t>(in_view);
                coarsest = coarsest && served.drawn_level + 1 == pm.levels();
            }
            if (triangles <= input.budget.max_triangles || coarsest || input.budget.forced_level >= 0) break;
            pixel_error *= std::exp2(0.125);
        }
        for (const InstanceTree::Seen& s : seen) levels_before_[s.instance] = levels_[s.instance];
    }

    void assign(const FrameInput& input, std::span<const InstanceTree::Seen> seen, double pixel_error, Plan& plan) {
        uint32_t out_of_reach = 0;
        for (const InUse& used : in_use_) served_by(used).instances.clear();
        in_use_.clear();
        for (const InstanceTree::Seen& s : seen) {
            const uint32_t i = s.instance, a = input.instances[i].asset;
            const Asset& asset = assets_[a];
            const uint32_t wanted = levels_[i] = level_for(asset, input, i, pixel_error);
            const InUse used{a, cursor_for(asset, wanted, nth_[i])};
            Served& served = served_by(used);
            if (served.instances.empty()) {
                in_use_.push_back(used);
                served.wanted_level = asset.pm->levels() - 1;
            }
            const uint32_t level = std::max(wanted, served.cursor.finest_level());
            out_of_reach += level > wanted;
            served.instances.push_back(s);
            served.wanted_level = std::min(served.wanted_level, level);
        }
        std::ranges::sort(in_use_);
        for (const InUse& used : in_use_) {
            Served& served = served_by(used);
            served.drawn_level = drawn_level(assets_[used.asset], served, input);
        }
        plan.stats.more = {{"levels_out_of_reach", out_of_reach}, {"cursors", static_cast<double>(cursor_count())}};
    }

    uint32_t level_for(const Asset& asset, const FrameInput& input, uint32_t i, double pixel_error) const {
        const uint32_t last = asset.pm->levels() - 1;
        if (input.budget.forced_level >= 0)
            return static_cast<uint32_t>(std::min<int64_t>(input.budget.forced_level, last));
        const double error =
            error_under(input.sets_levels(), asset.sphere, input.instances[i].object_to_world, pixel_error);
        const uint32_t coarsest = asset.pm->level_for_error(error);
        if (levels_before_[i] == never) return coarsest;
        return std::clamp(levels_before_[i], asset.pm->level_for_error(steady_share_ * error), coarsest);
    }

    uint32_t drawn_level(const Asset& asset, const Served& served, const FrameInput& input) const {
        if (!geomorph_ || input.budget.forced_level >= 0) return served.wanted_level;
        const uint32_t staying = asset.pm->wedges_at(served.wanted_level);
        return std::max(asset.pm->level_for_wedges(uint64_t{staying} + morphing(staying)),
                        served.cursor.finest_level());
    }

    uint32_t morphing(uint32_t staying) const { return static_cast<uint32_t>(morphing_share_ * staying); }

    // Where no finer level can be drawn, fewer are on their way, none of which is near its parent.
    uint32_t arrived(const Asset& asset, const Served& served) const {
        if (served.drawn_level > served.cursor.finest_level()) return asset.pm->wedges_at(served.drawn_level);
        const uint32_t staying = asset.pm->wedges_at(served.wanted_level);
        return staying + morphing(staying);
    }

    // Which of the asset's cursors serves the level. nth: how many instances of the asset come before.
    static uint32_t cursor_for(const Asset& asset, uint32_t level, uint32_t nth) {
        if (asset.own_cursors && nth < asset.cursors.size()) return nth;
        uint32_t best = 0;
        for (uint32_t c = 1; c < asset.cursors.size() && asset.cursors[c].cursor.finest_level() <= level; ++c) best = c;
        return best;
    }

    // Moves the cursor to its level, or as near as it comes with so many bytes to upload, at least one level. Returns
    // what changed. Where it does not come there, it goes on in the next frame.
    std::vector<IndexRange> go_towards(Served& served, uint64_t most_bytes) const {
        PmCursor& cursor = served.cursor;
        const uint32_t to = served.drawn_level;
        if (cursor.all_indices().size_bytes() <= most_bytes) cursor.goto_level(to);
        std::vector<IndexRange> dirty = cursor.take_dirty();
        uint64_t bytes = bytes_of(dirty);  // at most
        uint64_t& a_level = served.level_bytes;
        while (cursor.level() != to) {
            // Some levels change more than any before them.
            if (bytes > 0 && bytes + reserve * a_level > most_bytes) {
                merge(dirty);
                bytes = bytes_of(dirty);
                if (bytes + reserve * a_level > most_bytes) break;
            }
            const uint32_t from = cursor.level(), distance = from < to ? to - from : from - to;
            const bool far = a_level > 0 && bytes + 2 * levels_at_once * a_level < most_bytes;
            const uint32_t levels = std::min(distance, far ? levels_at_once : 1);
            cursor.goto_level(from < to ? from + levels : from - levels);
            const auto changed = cursor.take_dirty();
            dirty.insert(dirty.end(), changed.begin(), changed.end());
            bytes += bytes_of(changed);
            a_level = std::max(a_level, (bytes_of(changed) + levels - 1) / levels);
        }
        merge(dirty);
        served.drawn_level = cursor.level();
        served.wanted_level = std::max(served.wanted_level, served.drawn_level);
        return dirty;
    }
    static uint64_t bytes_of(std::span<const IndexRange> ranges) {
        uint64_t bytes = 0;
        for (const IndexRange& range : ranges) bytes += uint64_t{range.count} * sizeof(uint32_t);
        return bytes;
    }
    // Sorts them; what overlaps or touches becomes one.
    static void merge(std::vector<IndexRange>& ranges) {
        std::ranges::sort(ranges, {}, &IndexRange::first);
        size_t kept = 0;
        for (const IndexRange& range : ranges) {
            if (kept > 0 && range.first <= ranges[kept - 1].first + ranges[kept - 1].count) {
                IndexRange& before = ranges[kept - 1];
                before.count = std::max(before.count, range.first + range.count - before.first);
            } else {
                ranges[kept++] = range;
            }
        }
        ranges.resize(kept);
    }

    // Returns how many bytes these are.
    static uint64_t upload_dirty(const Served& served, std::span<const uint32_t> places,
                                 std::span<const IndexRange> ranges, Plan& plan) {
        if (ranges.empty()) return 0;
        const auto indices = served.cursor.all_indices();
        const auto uploaded = std::make_shared<std::vector<uint32_t>>();
        uploaded->reserve(bytes_of(ranges) / sizeof(uint32_t));
        for (const IndexRange& range : ranges) {
            for (const uint32_t wedge : indices.subspan(range.first, range.count)) uploaded->push_back(places[wedge]);
        }
        size_t at = 0;
        for (const IndexRange& range : ranges) {
            const auto* data = reinterpret_cast<const std::byte*>(uploaded->data() + at);
            plan.commands.push_back({Stage::update, Upload{index_buffer, served.first_byte + uint64_t{range.first} * 4,
                                                           Blob(uploaded, data, uint64_t{range.count} * 4)}});
            at += range.count;
        }
        plan.stats.uploaded_bytes += bytes_of(ranges);
        return bytes_of(ranges);
    }

    size_t cursor_count() const {
        size_t count = 0;
        for (const Asset& asset : assets_) count += asset.cursors.size();
        return count;
    }

    std::vector<Asset> assets_;
    InstanceTree instances_;
    Recipe recipe_;
    const double steady_share_;
    const bool geomorph_;
    const double morphing_share_;
    bool vertices_uploaded_ = false;
    static constexpr uint32_t never = ~0u;  // not yet seen
    // By instance: the level it asks for in this frame, and when it was last seen before.
    std::vector<uint32_t> levels_, levels_before_;
    std::vector<uint32_t> nth_, asset_of_;  // by instance: how many of its asset come before; its asset
    uint64_t counted_ = 0;                  // generation of the set they are of
    size_t counted_size_ = 0;
    std::vector<InUse> in_use_;  // rising
};

// Cursors for the capacities, found on one walk from full detail downwards.
void make_cursors(LodSource::Asset& asset, uint32_t order, const std::vector<uint32_t>& capacities,
                  uint64_t& index_bytes) {
    const ProgressiveMesh& pm = *asset.pm;
    PmCursor walker(pm, order);
    const auto snapshots = pm.orders[order].keyframes.empty() ? nullptr : std::make_shared<PmSnapshots>(pm, order);
    for (const uint32_t capacity : capacities) {
        while ((walker.slot_count() > capacity || walker.holds_order_before()) && walker.ecol()) {}
        asset.cursors.push_back({PmCursor(walker, walker.level()), index_bytes, {}});
        asset.cursors.back().cursor.use(snapshots);
        index_bytes += asset.cursors.back().cursor.all_indices().size_bytes();
    }
}

// Makes the cursors of all assets, whose budget is shared in proportion to size, and returns the bytes of their
// indices. orders: per asset. slots: of all together.
uint64_t share_slots(std::vector<LodSource::Asset>& assets, std::span<const uint32_t> orders, uint64_t slots,
                     uint32_t instances) {
    uint64_t full_slots = 0, index_bytes = 0;
    for (const LodSource::Asset& asset : assets) full_slots += asset.pm->full_triangles();
    for (size_t a = 0; a < assets.size(); ++a) {
        const FaceOrder& order = assets[a].pm->orders[orders[a]];
        const uint32_t own = assets[a].pm->full_triangles();
        const auto share = static_cast<uint64_t>(static_cast<double>(slots) * own /
                                                 static_cast<double>(std::max<uint64_t>(full_slots, 1)));
        // Where there are keyframes a cursor has a second half for the order that comes next.
        const double halves = order.keyframes.empty() ? 1 : 1 + static_cast<double>(order.keyframes[0].slots) / own;
        const auto capacities =
            cursor_capacities(own, static_cast<uint64_t>(static_cast<double>(share) / halves), instances);
        assets[a].own_cursors = capacities.size() == instances && capacities.back() == own;
        make_cursors(assets[a], orders[a], capacities, index_bytes);
    }
    return index_bytes;
}

Recipe recipe_of(uint64_t vertex_bytes, uint64_t index_bytes, uint64_t parent_bytes, const FurtherBuffer& further,
                 bool geomorph) {
    Recipe recipe;
    recipe.buffers = {{"lod vertices", std::max<uint64_t>(vertex_bytes, 4),
                       static_cast<uint32_t>(geomorph ? use_storage : use_vertex), 4},
                      {"lod indices", std::max<uint64_t>(index_bytes, 4), use_index, 4}};
    if (geomorph) recipe.buffers.push_back({"lod parents", std::max<uint64_t>(parent_bytes, 4), use_storage, 4});
    recipe.pipelines = {indexed_mesh_pipeline(further, static_cast<uint32_t>(recipe.buffers.size()))};
    if (!further.empty()) recipe.buffers.push_back(further.spec());
    if (geomorph) {
        PipelineSpec& morphing = recipe.pipelines[0];
        morphing.name = "morphing mesh";
        morphing.vertex = further.empty() ? "lod/morph.vert" : "lod/morph_further.vert";
        morphing.layout = {};
        morphing.storage.push_back(StorageBinding::pool(LODE_LOD_VERTICES, vertex_buffer, 1));
        morphing.storage.push_back(StorageBinding::pool(LODE_LOD_PARENTS, parent_buffer, 1));
    }
    return recipe;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> open_lod(const std::vector<std::shared_ptr<const ProgressiveMesh>>& pms,
                                              const LodOptions& options) {
    LODE_CHECK(!pms.empty() && options.instances > 0);
    std::vector<LodSource::Asset> assets;
    std::vector<uint32_t> orders;
    uint64_t vertex_bytes = 0, parent_bytes = 0;
    FurtherBuffer further;
    for (const auto& pm : pms) {
        const FaceOrder* order = options.order.empty() ? pm->orders.data() : pm->order_named(options.order);
        if (order == nullptr) {
            return fail(Fault::usage, "order '" + options.order +
                                          "': the asset does not hold it; bake it with --order " + options.order);
        }
        orders.push_back(static_cast<uint32_t>(order - pm->orders.data()));
        LodSource::Asset asset;
        asset.pm = pm;
        asset.places = vertex_places(*pm, orders.back());
        asset.sphere = bounding_sphere(pm->vertices);
        asset.vertex_offset = vertex_bytes;
        vertex_bytes += pm->vertices.size_bytes();
        if (options.geomorph) parent_bytes += pm->vertices.size() * sizeof(Ancestry);
        asset.further_word = further.add(pm->further);
        assets.push_back(std::move(asset));
    }
    const uint64_t all_bytes = vertex_bytes + parent_bytes + further.bytes();
    if (all_bytes >= options.resident_bytes)
        return over_budget("the vertices", all_bytes + slot_bytes, options.resident_bytes);
    const uint64_t slots = (options.resident_bytes - all_bytes) / slot_bytes;
    const uint64_t index_bytes = share_slots(assets, orders, slots, options.instances);
    Recipe recipe = recipe_of(vertex_bytes, index_bytes, parent_bytes, further, options.geomorph);
    return std::make_unique<LodSource>(std::move(assets), std::move(recipe), options);
}

}  // namespace lodestone
