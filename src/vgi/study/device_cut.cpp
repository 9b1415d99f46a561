#include "vgi/study/device_cut.h"

#include <algorithm>
#include <array>
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

static_assert(LODE_CUT_ABSENT == ~0u && LODE_CUT_MOST_GROUPS == most_groups && most_node_shift == 3);

constexpr uint32_t findings_tag = 1;
enum Passes : uint32_t { clear = first_pass, roots, look, close, divide, count, sum, emit };  // pipelines
constexpr std::array<const char*, 8> pass_names{"clear", "roots", "look", "close", "divide", "count", "sum", "emit"};

uint32_t halvings_of(const Atlas& about) { return about.levels() - 1; }
uint32_t top_of(const Atlas& about) {
    return halvings_of(about) > most_node_shift ? halvings_of(about) - most_node_shift : 0;
}
uint32_t nodes_of(const Atlas& about) {
    return halvings_of(about) - top_of(about) + ((1u << (2 * top_of(about) + 2)) - 1) / 3;
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

// The instances of a frame as its passes read them, each with room of its own in the tables.
class CutInstances {
public:
    explicit CutInstances(const DeviceCutSizes& one) : one_(one) {}
    std::vector<gpu::VgiCutInstance> records;
    std::vector<DeviceCut::DrawRange> places;
    std::vector<uint64_t> nodes;  // of all of them, by depth
    uint32_t most_charts = 0;

    void add(uint32_t asset, const OpenAtlas& atlas, const CutRequest& request, int64_t forced_level) {
        const Atlas& about = atlas.file->about();
        const DeviceCutSizes before = one_.times(records.size());
        gpu::VgiCutInstance& r = records.emplace_back();
        RefinementTest(request, about).describe(r);
        Visibility(request, about).describe(r);
        r.asset = asset;
        r.first_page = atlas.first[index_of(Layer::geometry)];
        r.pages = atlas.trees[index_of(Layer::geometry)].pages();
        r.first_chart = atlas.first_chart;
        r.charts = about.charts();
        r.first_state = static_cast<uint32_t>(before.states);
        r.first_leaf = static_cast<uint32_t>(before.leaves);
        r.first_patch = static_cast<uint32_t>(before.patches * LODE_VGI_PATCH_WORDS);
        r.first_id = static_cast<uint32_t>(places.size());
        r.forced_level = static_cast<int32_t>(std::clamp<int64_t>(forced_level, -1, halvings_of(about)));
        places.push_back({r.first_patch, before.records * LODE_CUT_RECORD_WORDS * sizeof(uint32_t),
                          static_cast<uint32_t>(DeviceCutSizes::of(about).records)});
        most_charts = std::max(most_charts, about.charts());
        add_nodes(about);
    }

private:
    void add_nodes(const Atlas& about) {
        const uint32_t levels = halvings_of(about), top = top_of(about);
        if (nodes.size() <= levels) nodes.resize(levels + 1, 0);
        for (uint32_t depth = 0; depth <= levels; ++depth) {
            const uint32_t shift = depth > levels - top ? depth - (levels - top) : 0;
            nodes[depth] += uint64_t{about.charts()} << (2 * shift);
        }
    }

    DeviceCutSizes one_;
};

// Empty lists, one after the other in the room for their entries.
Blob empty_lists(std::span<const uint64_t> nodes) {
    std::array<gpu::VgiCutList, LODE_CUT_LIST_COUNT> lists{};
    LODE_CHECK(nodes.size() <= LODE_CUT_DEPTHS, nodes.size());
    uint64_t first = 0;
    for (uint32_t l = 0; l < lists.size(); ++l) {
        lists[l] = {0, 1, 1, 0, static_cast<uint32_t>(first)};
        if (l < nodes.size()) first += nodes[l];
    }
    return Blob::copy_of(lists.data(), lists.size());
}

void dispatch_directly(Passes pass, const std::array<uint64_t, 2>& groups, const Words& words, Plan& plan) {
    Dispatch d;
    d.pipeline = pass;
    for (size_t k = 0; k < groups.size(); ++k)
        d.groups[k] = static_cast<uint32_t>(std::clamp<uint64_t>(groups[k], 1, most_groups));
    d.words = words;
    plan.commands.push_back({Stage::update, d});
}
// As many groups as the list's entries take.
void dispatch_over(uint32_t list, Passes pass, Plan& plan) {
    Dispatch d;
    d.pipeline = pass;
    d.arguments = cut_lists;
    d.offset = list * sizeof(gpu::VgiCutList);
    d.words[LODE_CUT_WORD_LIST] = list;
    plan.commands.push_back({Stage::update, d});
}

constexpr uint64_t groups_of(uint64_t threads) { return (threads + LODE_CUT_GROUP - 1) / LODE_CUT_GROUP; }

void dispatch_passes(const CutInstances& instances, uint64_t finding_words, Plan& plan) {
    Words words{};
    words[LODE_CUT_WORD_INSTANCES] = static_cast<uint32_t>(instances.records.size());
    words[LODE_CUT_WORD_FINDINGS] = static_cast<uint32_t>(finding_words);
    constexpr uint64_t words_at_once = 64;  // that a thread zeroes, more or less
    dispatch_directly(roots,
                      {std::max(groups_of(instances.most_charts), groups_of(finding_words / words_at_once)),
                       instances.records.size()},
                      words, plan);
    const auto depths = static_cast<uint32_t>(instances.nodes.size());
    for (uint32_t depth = 0; depth + 1 < depths; ++depth) dispatch_over(depth, look, plan);
    for (uint32_t depth = depths; depth-- > 2;) dispatch_over(depth - 1, close, plan);
    for (uint32_t depth = 0; depth < depths; ++depth) dispatch_over(depth, divide, plan);
    dispatch_over(LODE_CUT_DRAWN, count, plan);
    dispatch_directly(sum, {instances.records.size(), 1}, words, plan);
    dispatch_over(LODE_CUT_DRAWN, emit, plan);
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
DeviceCutSizes DeviceCutSizes::largest_of(std::span<const OpenAtlas> atlases) {
    DeviceCutSizes largest;
    for (const OpenAtlas& atlas : atlases) {
        const DeviceCutSizes sizes = of(atlas.file->about());
        largest.states = std::max(largest.states, sizes.states);
        largest.leaves = std::max(largest.leaves, sizes.leaves);
        largest.patches = std::max(largest.patches, sizes.patches);
        largest.records = std::max(largest.records, sizes.records);
    }
    return largest;
}
DeviceCutSizes DeviceCutSizes::times(uint64_t instances) const {
    return {states * instances, leaves * instances, patches * instances, records * instances};
}
uint64_t DeviceCutSizes::list_bytes() const { return patches * LODE_VGI_PATCH_WORDS * sizeof(uint32_t); }
uint64_t DeviceCutSizes::table_bytes() const {
    const uint64_t entries = states + patches;
    return (states + entries + leaves + records * LODE_CUT_RECORD_WORDS) * sizeof(uint32_t);
}

uint64_t DeviceCut::finding_words() const {
    uint64_t words = LODE_CUT_FIRST_FINDING;
    for (const OpenAtlas& atlas : atlases_) words += 2 * atlas.pages(Layer::geometry);
    return words;
}

void DeviceCut::add_to(Recipe& recipe, uint32_t instances) const {
    LODE_CHECK(recipe.buffers.size() == cut_instances && recipe.pipelines.size() == clear);
    const DeviceCutSizes sizes = one_.times(instances);
    uint64_t pages = 0, charts = 0;
    for (const OpenAtlas& atlas : atlases_) {
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
         {"findings about pages", finding_words() * word, use_storage, 4},
         {"lists of nodes", LODE_CUT_LIST_COUNT * sizeof(gpu::VgiCutList), use_storage | use_indirect, 4},
         {"nodes in lists", (sizes.states + sizes.patches) * word, use_storage, 4}});
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
                    {LODE_CUT_RECORDS, cut_records, Access::read_write},
                    {LODE_CUT_FINDINGS, cut_findings, Access::read_write},
                    {LODE_CUT_LISTS, cut_lists, Access::read_write},
                    {LODE_CUT_ENTRIES, cut_entries, Access::read_write},
                    {LODE_VGI_PATCHES, draw_lists, Access::write}};
    pass.constants.resize(2);
    pass.constants[LODE_CUT_SLOT_STATES] = static_cast<uint32_t>(one_.states);
    pass.constants[LODE_CUT_SLOT_RECORDS] = static_cast<uint32_t>(one_.records);
    for (const char* name : pass_names) {
        pass.name = std::string("cut: ") + name;
        pass.compute = std::string("vgi/cut_") + name + ".comp";
        recipe.pipelines.push_back(pass);
    }
}

void DeviceCut::upload_tables(const Recipe& recipe, Plan& plan) const {
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
    add_upload(plan, cut_lists, 0, empty_lists({}));
    const auto words_of = [&](uint32_t buffer) {
        return static_cast<uint32_t>(recipe.buffers[buffer].bytes / sizeof(uint32_t));
    };
    Words words{};
    words[LODE_CUT_WORD_STATES] = words_of(cut_states);
    words[LODE_CUT_WORD_RECORDS] = words_of(cut_records);
    dispatch_directly(clear, {groups_of(words_of(cut_states)), 1}, words, plan);
}

std::vector<DeviceCut::DrawRange> DeviceCut::cut(const FrameInput& input, std::span<const InstanceTree::Seen> seen,
                                                 double pixel_error, Plan& plan) const {
    CutInstances instances(one_);
    for (const InstanceTree::Seen& s : seen) {
        const Instance& instance = input.instances[s.instance];
        instances.add(instance.asset, atlases_[instance.asset], request_of(input, instance, pixel_error),
                      // There are no leaves: level 0 is as 1, the finest samples.
                      input.budget.forced_level - (input.budget.forced_level > 0 ? 1 : 0));
        instances.records.back().views = s.views;
    }
    dispatch_over(LODE_CUT_ALL, clear, plan);
    add_upload(plan, cut_lists, 0, empty_lists(instances.nodes));
    if (!seen.empty())
        add_upload(plan, cut_instances, 0, Blob::copy_of(instances.records.data(), instances.records.size()));
    dispatch_passes(instances, finding_words(), plan);
    plan.commands.push_back(
        {Stage::update, Readback{cut_findings, 0, finding_words() * sizeof(uint32_t), findings_tag}});
    return std::move(instances.places);
}

std::optional<DeviceCut::Findings> DeviceCut::findings(std::span<const ReadbackResult> readbacks) const {
    const ReadbackResult* last = nullptr;
    for (const ReadbackResult& r : readbacks) {
        if (r.tag == findings_tag && (last == nullptr || r.frame > last->frame)) last = &r;
    }
    // What is not as long as it should be tells nothing.
    if (last == nullptr || last->blob.size() != finding_words() * sizeof(uint32_t)) return {};
    std::vector<uint32_t> words(last->blob.size() / sizeof(uint32_t));
    std::memcpy(words.data(), last->blob.data(), words.size() * sizeof(uint32_t));
    Findings found;
    found.frame = last->frame;
    found.triangles = words[0];
    found.nodes = words[1];
    for (auto a = static_cast<uint32_t>(atlases_.size()); a-- > 0;) {
        const OpenAtlas& atlas = atlases_[a];
        const uint32_t first = atlas.first[index_of(Layer::geometry)];
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
