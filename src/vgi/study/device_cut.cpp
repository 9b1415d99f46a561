#include "vgi/study/device_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "shaders/shared/vgi_cut.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/study/grid_patch.h"

namespace lodestone::vgi {

namespace {

static_assert(LODE_CUT_ABSENT == ~0u && most_node_shift == 3);

constexpr uint32_t findings_tag = 1;
constexpr uint64_t most_groups = 65535;                                         // in a row: what every device takes
enum Passes : uint32_t { look = first_pass, close, divide, count, sum, emit };  // pipelines

uint32_t levels_of(const Atlas& about) { return about.levels() - 1; }
uint32_t top_of(const Atlas& about) {
    return levels_of(about) > most_node_shift ? levels_of(about) - most_node_shift : 0;
}
uint32_t nodes_of(const Atlas& about) {
    return levels_of(about) - top_of(about) + ((1u << (2 * top_of(about) + 2)) - 1) / 3;
}

CutRequest request_of(const FrameInput& input, const Instance& instance, double pixel_error) {
    CutRequest request;
    request.object_to_world = instance.object_to_world;
    request.views = input.views;
    request.level_view = input.level_view ? &*input.level_view : nullptr;
    request.pixel_error = pixel_error;
    request.cull_back_faces = input.views[0].culls_back_faces;
    return request;
}

// The instances of a frame as its passes read them, each with room of its own in the tables, and how many threads the
// passes need for the largest of them.
struct CutInstances {
    std::vector<gpu::VgiCutInstance> records;
    std::vector<DeviceCut::DrawRange> places;
    std::vector<uint64_t> most_nodes;  // by level
    uint32_t most_charts = 0;

    void add(uint32_t asset, const OpenAtlas& atlas, const CutRequest& request, int64_t forced_level) {
        const Atlas& about = atlas.file->about();
        const DeviceCutSizes sizes = DeviceCutSizes::of(about);
        gpu::VgiCutInstance& r = records.emplace_back();
        RefinementTest(request, about).describe(r);
        Visibility(request, about).describe(r);
        r.asset = asset;
        r.first_page = atlas.first[index_of(Layer::geometry)];
        r.pages = atlas.trees[index_of(Layer::geometry)].pages();
        r.first_chart = atlas.first_chart;
        r.charts = about.charts();
        r.first_state = static_cast<uint32_t>(used_.states);
        r.first_leaf = static_cast<uint32_t>(used_.leaves);
        r.first_patch = static_cast<uint32_t>(used_.patches * LODE_VGI_PATCH_WORDS);
        r.first_record = static_cast<uint32_t>(used_.records);
        r.records = static_cast<uint32_t>(sizes.records);
        r.first_id = static_cast<uint32_t>(places.size());
        r.forced_level = static_cast<int32_t>(std::clamp<int64_t>(forced_level, -1, levels_of(about)));
        places.push_back({r.first_patch, used_.records * LODE_CUT_RECORD_WORDS * sizeof(uint32_t), r.records});
        used_ = {used_.states + sizes.states, used_.leaves + sizes.leaves, used_.patches + sizes.patches,
                 used_.records + sizes.records};
        raise_most(about);
    }

private:
    void raise_most(const Atlas& about) {
        if (most_nodes.size() <= levels_of(about)) most_nodes.resize(levels_of(about) + 1, 0);
        for (uint32_t level = 0; level <= levels_of(about); ++level) {
            const uint32_t shift = level < top_of(about) ? top_of(about) - level : 0;
            most_nodes[level] = std::max(most_nodes[level], uint64_t{about.charts()} << (2 * shift));
        }
        most_charts = std::max(most_charts, about.charts());
    }

    DeviceCutSizes used_;
};

void dispatch_passes(const CutInstances& instances, Plan& plan) {
    const auto dispatch = [&](Passes pass, uint32_t level, uint64_t groups) {
        Dispatch d;
        d.pipeline = pass;
        const uint64_t rows = (groups + most_groups - 1) / most_groups;
        d.groups = {static_cast<uint32_t>((groups + rows - 1) / rows), static_cast<uint32_t>(instances.records.size()),
                    static_cast<uint32_t>(rows)};
        d.words[LODE_CUT_WORD_LEVEL] = level;
        plan.commands.push_back({Stage::update, d});
    };
    const auto over_nodes = [&](Passes pass, uint32_t level) {
        dispatch(pass, level, (instances.most_nodes[level] + LODE_CUT_GROUP - 1) / LODE_CUT_GROUP);
    };
    const auto levels = static_cast<uint32_t>(instances.most_nodes.size());
    for (uint32_t level = levels; level-- > 1;) over_nodes(look, level);
    for (uint32_t level = 1; level < levels; ++level) over_nodes(close, level);
    for (uint32_t level = levels; level-- > 0;) over_nodes(divide, level);
    dispatch(count, 0, instances.most_charts);
    dispatch(sum, 0, 1);
    dispatch(emit, 0, instances.most_charts);
}

}  // namespace

DeviceCutSizes DeviceCutSizes::of(const Atlas& about) {
    DeviceCutSizes sizes;
    sizes.leaves = about.charts();
    sizes.states = uint64_t{about.charts()} * nodes_of(about);
    sizes.patches = uint64_t{about.charts()} << (2 * top_of(about));
    sizes.records = (sizes.patches + LODE_CUT_RECORD_PATCHES - 1) / LODE_CUT_RECORD_PATCHES;
    return sizes;
}
void DeviceCutSizes::raise(const DeviceCutSizes& other) {
    states = std::max(states, other.states);
    leaves = std::max(leaves, other.leaves);
    patches = std::max(patches, other.patches);
    records = std::max(records, other.records);
}
DeviceCutSizes DeviceCutSizes::times(uint64_t instances) const {
    return {states * instances, leaves * instances, patches * instances, records * instances};
}
uint64_t DeviceCutSizes::list_bytes() const { return patches * LODE_VGI_PATCH_WORDS * sizeof(uint32_t); }
uint64_t DeviceCutSizes::table_bytes() const {
    return (states + leaves + records * LODE_CUT_RECORD_WORDS) * sizeof(uint32_t);
}

void DeviceCut::add_to(Recipe& recipe, std::span<const OpenAtlas> atlases, const DeviceCutSizes& sizes,
                       uint32_t instances) {
    LODE_CHECK(recipe.buffers.size() == cut_instances && recipe.pipelines.size() == look);
    uint64_t pages = 0, charts = 0;
    for (const OpenAtlas& atlas : atlases) {
        pages += atlas.pages(Layer::geometry);
        charts += atlas.file->about().charts();
    }
    constexpr uint64_t word = sizeof(uint32_t);
    recipe.buffers.insert(
        recipe.buffers.end(),
        {{"instances to cut", instances * sizeof(gpu::VgiCutInstance), use_storage, sizeof(gpu::VgiCutInstance)},
         {"bounds of pages", pages * sizeof(gpu::VgiCutPage), use_storage, sizeof(gpu::VgiCutPage)},
         {"glued sides", charts * 4 * word, use_storage, 4},
         {"states of nodes", sizes.states * word, use_storage, 4},
         {"nodes drawn of charts", sizes.leaves * word, use_storage, 4},
         {"draws of patches", sizes.records * LODE_CUT_RECORD_WORDS * word, use_storage | use_indirect, 4},
         {"findings about pages", (LODE_CUT_FIRST_FINDING + 2 * pages) * word, use_storage, 4}});
    PipelineSpec pass;
    pass.kind = PipelineKind::compute;
    pass.storage = {StorageBinding::pool(LODE_VGI_GEOMETRY, geometry_pool, LODE_VGI_GEOMETRY_WORDS),
                    StorageBinding::texels(LODE_VGI_ASSETS, asset_table, 4),
                    StorageBinding::texels(LODE_VGI_CODES, code_table, 1),
                    {LODE_CUT_INSTANCES, cut_instances, Access::read},
                    {LODE_CUT_BOUNDS, cut_bounds, Access::read},
                    StorageBinding::texels(LODE_VGI_TABLE, page_table, 1),
                    {LODE_CUT_SIDES, cut_sides, Access::read},
                    {LODE_CUT_STATES, cut_states, Access::read_write},
                    {LODE_CUT_LEAVES, cut_leaves, Access::read_write},
                    {LODE_CUT_RECORDS, cut_records, Access::write},
                    {LODE_CUT_FINDINGS, cut_findings, Access::read_write},
                    {LODE_VGI_PATCHES, draw_lists, Access::write}};
    for (const char* name : {"look", "close", "divide", "count", "sum", "emit"}) {
        pass.name = std::string("cut: ") + name;
        pass.compute = std::string("vgi/cut_") + name + ".comp";
        recipe.pipelines.push_back(pass);
    }
}

void DeviceCut::upload_tables(Plan& plan) const {
    std::vector<gpu::VgiCutPage> pages;
    std::vector<uint32_t> sides;
    for (const OpenAtlas& atlas : atlases_) {
        const Atlas& about = atlas.file->about();
        for (uint32_t page = 0; page < atlas.pages(Layer::geometry); ++page)
            pages.push_back(cut_page_of(about.bounds[page], atlas.topology->below(page)));
        for (const GluedSide& side : about.sides)
            sides.push_back(side.chart == ~0u ? LODE_CUT_ABSENT : side.chart | side.side << 30);
    }
    add_upload(plan, cut_bounds, 0, Blob::copy_of(pages.data(), pages.size()));
    add_upload(plan, cut_sides, 0, Blob::copy_of(sides.data(), sides.size()));
    const std::vector<uint32_t> nothing(LODE_CUT_FIRST_FINDING + 2 * pages.size(), 0);
    add_upload(plan, cut_findings, 0, Blob::copy_of(nothing.data(), nothing.size()));
}

std::vector<DeviceCut::DrawRange> DeviceCut::cut(const FrameInput& input, double pixel_error, Plan& plan) const {
    CutInstances instances;
    for (const Instance& instance : input.instances) {
        LODE_CHECK(instance.asset < atlases_.size(), instance.asset, atlases_.size());
        instances.add(instance.asset, atlases_[instance.asset], request_of(input, instance, pixel_error),
                      input.budget.forced_level);
    }
    if (instances.records.empty()) return {};
    add_upload(plan, cut_instances, 0, Blob::copy_of(instances.records.data(), instances.records.size()));
    dispatch_passes(instances, plan);
    Readback back;
    back.buffer = cut_findings;
    for (const OpenAtlas& atlas : atlases_) back.bytes += 2 * sizeof(uint32_t) * atlas.pages(Layer::geometry);
    back.bytes += LODE_CUT_FIRST_FINDING * sizeof(uint32_t);
    back.tag = findings_tag;
    plan.commands.push_back({Stage::update, back});
    return std::move(instances.places);
}

std::optional<DeviceCut::Findings> DeviceCut::findings(std::span<const ReadbackResult> readbacks,
                                                       const InstanceSet& instances) const {
    const ReadbackResult* last = nullptr;
    for (const ReadbackResult& r : readbacks) {
        if (r.tag == findings_tag && (last == nullptr || r.frame > last->frame)) last = &r;
    }
    uint64_t pages = 0;
    for (const OpenAtlas& atlas : atlases_) pages += atlas.pages(Layer::geometry);
    // What is not as long as it should be tells nothing.
    if (last == nullptr || last->blob.size() != (LODE_CUT_FIRST_FINDING + 2 * pages) * sizeof(uint32_t)) return {};
    std::vector<uint32_t> words(last->blob.size() / sizeof(uint32_t));
    std::memcpy(words.data(), last->blob.data(), words.size() * sizeof(uint32_t));
    Findings found;
    found.triangles = words[0];
    found.nodes = words[1];
    for (auto a = static_cast<uint32_t>(atlases_.size()); a-- > 0;) {
        const OpenAtlas& atlas = atlases_[a];
        const uint32_t first = atlas.first[index_of(Layer::geometry)];
        // What is told of others is from frames before.
        if (std::ranges::find(instances, a, &Instance::asset) == instances.end()) continue;
        for (uint32_t page = atlas.pages(Layer::geometry); page-- > 0;) {
            const uint32_t* of_page = words.data() + LODE_CUT_FIRST_FINDING + 2 * (first + page);
            if (of_page[0] != 0) found.touched.push_back(first + page);
            const auto wanted = std::bit_cast<float>(of_page[1]);
            if (of_page[1] != 0 && std::isfinite(wanted)) found.wishes.push_back({a, page, wanted});
        }
    }
    return found;
}

}  // namespace lodestone::vgi
