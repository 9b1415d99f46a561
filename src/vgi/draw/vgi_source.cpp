#include "vgi/draw/vgi_source.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>

#include "base/check.h"
#include "frame/screen_error.h"
#include "shaders/shared/vgi_cut.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/attributes/mip_tail.h"
#include "vgi/draw/buffer_sizes.h"
#include "vgi/draw/corners/chart_boxes.h"
#include "vgi/draw/cut/bintree_cut.h"
#include "vgi/draw/cut/frame_cuts.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/vertex_kinds.h"
#include "vgi/draw/memory_shares.h"
#include "vgi/draw/pages/page_cache.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/study/device_cut.h"
#include "vgi/study/grid_cut.h"

namespace lodestone::vgi {

namespace {

// Vertices of leaves and what is seen at a pixel have so many bits for a chart, and corners of charts more.
static_assert(Limits{}.charts <= LODE_VGI_CHART_MASK && 4 * (Limits{}.charts + 1) <= LODE_VGI_CORNER_STEP);
// Words of a cut that is made ahead: so many times those that are drawn, or so many in any case.
constexpr uint64_t most_growth = 4, always_worth = uint64_t{4} << 20;
// To a draw: lavapipe takes time by their square (800 at once: 2.5 times as long as 100 at a time).
constexpr uint32_t most_patches = LODE_CUT_RECORD_PATCHES;

// The one place that knows all techniques.
std::shared_ptr<const Cutter> cutter_of(Raster raster) {
    switch (raster) {
        case Raster::bintree:
            return std::make_shared<const BintreeCutter>();
        case Raster::grid:
            return std::make_shared<const GridCutter>(GridOutput::indices, GridRule::by_error);
        case Raster::grid_area:
            return std::make_shared<const GridCutter>(GridOutput::indices, GridRule::by_area);
        case Raster::tess:
            return std::make_shared<const GridCutter>(GridOutput::patches, GridRule::by_error);
        case Raster::device:
            break;
    }
    return nullptr;
}

class VgiSource final : public FrameSource {
public:
    // list_budget: bytes, of the lists; pool_budget: of all other buffers.
    VgiSource(std::vector<OpenAtlas> atlases, Recipe recipe, Raster raster, std::array<PageCache::PoolSpec, 3> pools,
              PoolWords words, uint64_t list_budget, uint64_t pool_budget)
        : atlases_(std::move(atlases)),
          recipe_(std::move(recipe)),
          raster_(raster),
          cutter_(cutter_of(raster)),
          words_(words),
          list_sizes_(recipe_, {draw_lists}, list_budget),
          pool_sizes_(recipe_, all_but_lists(recipe_), pool_budget),
          pages_(atlases_, pools, words, pool_sizes_),
          instances_(atlases_, [](const OpenAtlas& atlas) { return atlas.charts.sphere(); }) {
        if (raster == Raster::device) device_.emplace(atlases_);
    }
    ~VgiSource() override {
        if (next_.valid()) next_.wait();
    }

    Result<void> load_base_pages() { return pages_.load_base_pages(); }

    const Recipe& recipe() const override { return recipe_; }

    Plan plan(const FrameInput& input) override {
        LODE_CHECK(!input.views.empty());
        Plan plan;
        plan.generation = recipe_.generation;
        const std::optional<FrameInput> last = std::exchange(last_, input);
        foresight_.see(input.views[0]);
        last_->arrivals.clear();
        last_->readbacks.clear();
        take_next_cuts(input);
        instances_.update(input.instances);
        pages_.begin_frame(input.frame, input.completed_frame);
        for (BufferSizes* sizes : {&list_sizes_, &pool_sizes_}) sizes->begin_frame(input.frame, input.completed_frame);
        if (!last) {
            upload_tables(plan);
            pages_.place(input, ~uint64_t{0}, plan);
        }
        const bool missed = !cuts_ || (!device_ && !cuts_->region.covers(input));
        if (missed) {
            const CutInput now = cut_input(CutRegion::of(input), pages_.snapshot(), instances_, nullptr);
            take_cuts(make_cuts(cutter_.get(), now, limits(input), memory_));
        }
        if (device_) take_findings(input);
        pages_.touch(cuts_->touched);
        if (last) {
            const uint64_t lists = uploaded_ || device_ ? 0 : cuts_->word_count * sizeof(uint32_t);
            pages_.place(input, input.budget.upload_bytes - std::min(input.budget.upload_bytes, lists), plan);
        }
        device_ ? draw_device_cuts(input, plan) : draw_cuts(input, plan);
        light(input, plan);
        const PageCache::Missing missing = pages_.request(cuts_->wishes, input, plan);
        begin_next_cuts(last, input);

        plan.stats.resident_bytes = list_sizes_.held() + pool_sizes_.held();
        plan.stats.index_bytes = recipe_.buffers[draw_lists].bytes;
        plan.stats.triangles = device_ ? found_.triangles : cuts_->triangles;
        plan.stats.more = {{"pages_resident", pages_.resident()},
                           {"attribute_bytes_resident", static_cast<double>(pages_.attribute_bytes_resident())},
                           {"pages_missing", missing.pages},
                           {"leaf_parts_resident", pages_.leaf_parts_resident()},
                           {"leaf_parts_missing", missing.leaf_parts},
                           {"pages_uploaded", pages_.uploaded()},
                           {"pages_evicted", pages_.evicted()},
                           {"pages_failed", pages_.failed()},
                           {"requests_waiting", pages_.waiting()},
                           {"raised_error", device_ ? raised_ : cuts_->raised},
                           {"cut_in_frame", missed ? 1 : 0},
                           {"cuts_given_up", given_up_}};
        return plan;
    }

    Result<void> validate() const override {
        for (const OpenAtlas& atlas : atlases_) {
            if (auto good = atlas.charts.validate(atlas.file->about()); !good) return good;
        }
        if (auto good = instances_.validate(); !good) return good;
        return pages_.validate();
    }

private:
    static std::vector<uint32_t> all_but_lists(const Recipe& recipe) {
        std::vector<uint32_t> buffers;
        for (uint32_t b = 0; b < recipe.buffers.size(); ++b) {
            if (b != draw_lists) buffers.push_back(b);
        }
        return buffers;
    }

    // Of lists, that fit their buffer and half of what a frame may upload; the other half is for pages.
    uint64_t most_words(uint64_t upload_bytes) const {
        return std::min(recipe_.buffers[draw_lists].most_bytes, upload_bytes / 2) / sizeof(uint32_t);
    }

    CutLimits limits(const FrameInput& input) const {
        if (!cuts_) return {most_words(~uint64_t{0})};
        return {most_words(input.budget.upload_bytes), cuts_->raised, cuts_->triangles, cuts_->word_count};
    }

    void take_cuts(FrameCuts cuts) {
        cuts_ = std::move(cuts);
        uploaded_ = false;
    }

    // The cuts made beside the last frame; those that are drawn may be good for longer than what was thought to come.
    void take_next_cuts(const FrameInput& input) {
        if (!next_.valid()) return;
        NextCuts next = next_.get();
        memory_ = std::move(next.memory);
        given_up_ += next.cuts.given_up;
        if (!next.cuts.given_up && next.cuts.region.covers(input)) {
            take_cuts(std::move(next.cuts));
        } else {
            behind_ = true;
        }
    }

    // Beside what follows of this frame: cuts for the next, unless those there are will be as good as new. What the
    // task reads does not change before it is done, which take_next_cuts waits for; what it writes is its own.
    void begin_next_cuts(const std::optional<FrameInput>& last, const FrameInput& now) {
        std::optional<CutRegion> region = last ? CutRegion::after(*last, now, foresight_.share()) : CutRegion::of(now);
        if (!region) return;  // every frame cuts for itself
        const bool changed = pages_.take_changed() || std::exchange(behind_, false);
        if (!changed && *region == cuts_->region) return;
        auto ahead = std::make_shared<CutRegion>(std::move(*region));
        auto memory = std::make_shared<CutMemory>(std::move(memory_));
        CutLimits to = limits(now);
        to.worth = std::max(most_growth * cuts_->word_count, always_worth);
        next_ = beside_.start<NextCuts>([this, ahead = std::move(ahead), pages = pages_.snapshot(),
                                         last_view = now.views[0], memory = std::move(memory), to] {
            const CutInput input = cut_input(std::move(*ahead), pages, instances_, &last_view);
            FrameCuts cuts = make_cuts(cutter_.get(), input, to, *memory);
            return NextCuts{std::move(cuts), std::move(*memory)};
        });
    }

    void upload_tables(Plan& plan) const {
        std::vector<gpu::VgiAsset> records;
        uint32_t all_positions = 0;
        for (const OpenAtlas& atlas : atlases_) all_positions += atlas.pages(Layer::geometry);
        std::vector<float> codes, spacing;
        std::vector<CornerRecord> corners;
        for (const OpenAtlas& atlas : atlases_) {
            const Atlas& about = atlas.file->about();
            gpu::VgiAsset r{};
            r.origin_x = static_cast<float>(about.origin.x);
            r.origin_y = static_cast<float>(about.origin.y);
            r.origin_z = static_cast<float>(about.origin.z);
            r.step = static_cast<float>(about.step);
            r.uv_low_x = about.uv_low.x;
            r.uv_low_y = about.uv_low.y;
            r.uv_step_x = about.uv_step.x;
            r.uv_step_y = about.uv_step.y;
            r.cells = about.cells;
            r.header_shift = atlas.header_shift;
            r.page_cells = atlas.trees[0].cells_per_page();
            r.first_chart = atlas.first_chart;
            r.first_page = atlas.first[0];
            r.first_attribute_page = all_positions + atlas.first[1];
            r.pages = atlas.trees[0].pages();
            r.first_mip_tail = static_cast<uint32_t>(atlas.first_mip_tail);
            r.attribute_page_words = words_.of_page(atlas.trees[1].cells_per_page());
            r.attribute_pages = atlas.trees[1].pages();
            r.attribute_cells = static_cast<uint32_t>(std::countr_zero(about.attribute_cells));
            r.has = attributes_of_samples(about.attributes);
            r.leaf_step = static_cast<float>(about.step / (1u << about.leaf_shift));
            add_corners(atlas, r, corners);
            for (const ChartSpacing& of : atlas.spacing) spacing.push_back(of.mean);
            records.push_back(r);
            const ErrorCodes decoded(about.extent());
            for (int code = 0; code < 256; ++code) codes.push_back(decoded.error(static_cast<uint8_t>(code)));
            for (int code = 0; code < 256; ++code) codes.push_back(decoded.radius(static_cast<uint8_t>(code)));
        }
        for (const OpenAtlas& atlas : atlases_) {
            const auto bytes = std::as_bytes(std::span(*atlas.mip_tail));
            add_upload(plan, attribute_pool, atlas.first_mip_tail * words_.of_sample * sizeof(uint32_t),
                       Blob(atlas.mip_tail, bytes.data(), bytes.size()));
        }
        add_upload(plan, asset_table, 0, Blob::copy_of(records.data(), records.size()));
        if (!corners.empty()) add_upload(plan, corners_of_charts, 0, Blob::copy_of(corners.data(), corners.size()));
        add_upload(plan, code_table, 0, Blob::copy_of(codes.data(), codes.size()));
        add_upload(plan, chart_table, 0, Blob::copy_of(spacing.data(), spacing.size()));
        if (device_) device_->upload_tables(recipe_, plan);
    }

    // Only the bintree knows of corners that are drawn elsewhere.
    void add_corners(const OpenAtlas& atlas, gpu::VgiAsset& record, std::vector<CornerRecord>& all) const {
        record.first_corners_of_charts = LODE_VGI_NO_CORNERS;
        if (raster_ != Raster::bintree || atlas.topology->corners().empty()) return;
        const Atlas& about = atlas.file->about();
        record.first_corner = static_cast<uint32_t>(all.size());
        record.first_corners_of_charts = static_cast<uint32_t>(all.size() + about.corners.size());
        const auto table = corner_table(about, coarsest_corners(*atlas.mip_tail, about.charts(),
                                                                atlas.trees[1].cells_per_page(), words_.of_sample));
        all.insert(all.end(), table.begin(), table.end());
        record.first_box = static_cast<uint32_t>(all.size());
        const auto boxes = chart_boxes(about);
        all.insert(all.end(), boxes.begin(), boxes.end());
    }

    // What the device found out in a frame before is what this one goes on from: pages that are used and missed.
    void take_findings(const FrameInput& input) {
        if (auto found = device_->findings(input.readbacks)) {
            found_ = std::move(*found);
            if (found_.frame >= raised_in_) adapt_error(input);
        }
        pages_.touch_positions(found_.touched);
        auto& wishes = cuts_->wishes;
        std::erase_if(wishes, [](const FrameCuts::Wish& w) { return w.layer == Layer::geometry && !w.prefetched; });
        for (const auto& w : found_.wishes) wishes.push_back({w.wanted, Layer::geometry, false, w.atlas, w.number});
        sort_wishes(wishes);
    }

    // What was found in frames before the error last changed says nothing of how it is now.
    void adapt_error(const FrameInput& input) {
        const double before = raised_;
        if (found_.triangles > input.budget.max_triangles) {
            raised_ *= error_scale_step;
        } else if (may_lower(found_.triangles, input.budget.max_triangles)) {
            raised_ = std::max(1.0, raised_ / error_scale_step);
        }
        if (raised_ != before) raised_in_ = input.frame;
    }

    void draw_device_cuts(const FrameInput& input, Plan& plan) {
        const double pixel_error = input.budget.pixel_error * raised_;
        const auto seen = instances_.seen(frusta_of(input.views));
        const auto places = device_->cut(input, seen, pixel_error, plan);
        const double magnification =
            input.budget.forced_level >= 0 || input.level_view ? 0 : magnification_of(input.views[0], pixel_error);
        for (size_t i = 0; i < seen.size(); ++i) {
            DrawIndirect draw;
            Draw whole = draw_of(input.instances[seen[i].instance].asset, magnification);
            whole.first_id = static_cast<uint32_t>(plan.instance_ids.size());
            plan.instance_ids.push_back(seen[i].instance);
            draw.arguments = cut_records;
            draw.offset = places[i].record_offset;
            draw.draws = places[i].records;
            draw.stride = LODE_CUT_RECORD_WORDS * sizeof(uint32_t);
            for (uint32_t v = 0; v < input.views.size(); ++v) {
                if ((seen[i].views >> v & 1) == 0) continue;
                draw.draw = whole;
                draw.draw.view = v;
                draw.draw.words[LODE_VGI_WORD_PATCH] = static_cast<uint32_t>(places[i].first_word);
                add_draw(draw, input.views[v].kind, plan);
            }
            plan.stats.instances_drawn += seen[i].views & 1;
        }
        plan.stats.instances_culled = static_cast<uint32_t>(input.instances.size()) - plan.stats.instances_drawn;
    }

    // Those that are drawn, from the first byte of the lists on: uploads wait for the frames that read them anyway.
    void upload_lists(Plan& plan) {
        if (uploaded_) return;
        uploaded_ = true;
        const auto bytes = std::as_bytes(std::span(cuts_->words.get(), cuts_->word_count));
        if (bytes.empty()) return;
        if (bytes.size() > list_sizes_.bytes(draw_lists)) grow_lists(bytes.size(), plan);
        add_upload(plan, draw_lists, 0, Blob(cuts_->words, bytes.data(), bytes.size()));
    }
    // By half at least, and to all they may have from a quarter of that on. So sizes that they had are 3/4 of the most
    // together, and there is always room.
    void grow_lists(uint64_t needed, Plan& plan) {
        const uint64_t most = recipe_.buffers[draw_lists].most_bytes;
        uint64_t bytes = std::max(needed, list_sizes_.bytes(draw_lists) * 3 / 2);
        bytes = bytes > most / 4 ? most : (bytes + list_step - 1) / list_step * list_step;
        list_sizes_.resize(draw_lists, bytes, 0, plan);
    }

    void draw_cuts(const FrameInput& input, Plan& plan) {
        upload_lists(plan);
        // Cuts may be made with a smaller error than is asked for, never with a larger. By area there are samples that
        // no error asks for, and nowhere for them to come from.
        const double magnification =
            cuts_->level >= 0 || input.level_view || raster_ == Raster::grid_area
                ? 0
                : magnification_of(input.views[0], std::max(input.budget.pixel_error, cuts_->pixel_error));
        // Then what had arrived by the cuts' error may be on its way.
        const bool as_cut = magnification == 0 || input.budget.pixel_error <= cuts_->pixel_error;
        const auto first_id = static_cast<uint32_t>(plan.instance_ids.size());
        plan.instance_ids.insert(plan.instance_ids.end(), cuts_->instances.begin(), cuts_->instances.end());
        // What is drawn alike follows each other, whatever instances it is of.
        std::vector<std::pair<uint32_t, const FrameCuts::Part*>> by_pipeline;
        for (const FrameCuts::Part& part : cuts_->parts)
            by_pipeline.emplace_back(pipeline_of(part.kinds, as_cut), &part);
        std::ranges::stable_sort(by_pipeline, {}, &std::pair<uint32_t, const FrameCuts::Part*>::first);
        for (uint32_t v = 0; v < input.views.size(); ++v) {
            for (const auto& [pipeline, part] : by_pipeline) {
                if ((part->views >> v & 1) == 0) continue;
                Draw draw = draw_of(input.instances[cuts_->instances[part->first_instance]].asset, magnification);
                draw.pipeline = pipeline;
                draw.view = v;
                draw.first_id = first_id + part->first_instance;
                draw.instances = part->instances;
                draw_list(draw, input.views[v].kind, *part, plan);
            }
        }
        plan.stats.instances_drawn = cuts_->instances_drawn;
        plan.stats.instances_culled = static_cast<uint32_t>(input.instances.size()) - plan.stats.instances_drawn;
    }

    // as_cut: leaves that had arrived by the cut have.
    static uint32_t pipeline_of(uint32_t kinds, bool as_cut) {
        if (kinds == LODE_VGI_KIND_SAMPLES) return samples_pipeline;
        if (kinds == kinds_of_samples) return any_samples_pipeline;
        if (kinds == LODE_VGI_KIND_CORNERS) return corners_pipeline;
        if (kinds == LODE_VGI_KIND_LEAVES && as_cut) return leaves_pipeline;
        return (kinds & ~kinds_of_leaves) == 0 ? moving_leaves_pipeline : visibility_pipeline;
    }
    // The triangles or patches of a part.
    void draw_list(Draw draw, View::Kind kind, const FrameCuts::Part& part, Plan& plan) const {
        if (raster_ != Raster::tess) {
            draw.index_buffer = draw_lists;
            draw.index_offset = uint64_t{part.first_word} * sizeof(uint32_t);
            draw.count = part.words;
            return add_draw(draw, kind, plan);
        }
        draw.words[LODE_VGI_WORD_PATCH] = part.first_word;
        const uint32_t patches = part.words / LODE_VGI_PATCH_WORDS;
        for (draw.first_vertex = 0; draw.first_vertex < patches; draw.first_vertex += most_patches) {
            draw.count = std::min(most_patches, patches - draw.first_vertex);
            add_draw(draw, kind, plan);
        }
    }
    template <class AnyDraw>
    static void add_draw(const AnyDraw& draw, View::Kind kind, Plan& plan) {
        plan.commands.push_back({kind == View::Kind::shadow ? Stage::shadow : Stage::depth, draw});
    }
    // What the camera sees, by what it is. Where nothing is drawn, there is nothing to light, and no instance to name.
    void light(const FrameInput& input, Plan& plan) const {
        if (plan.instance_ids.empty()) return;
        std::set<std::pair<uint32_t, uint32_t>> drawn;  // stencils, in views
        for (const Command& command : plan.commands) {
            const Draw* draw = drawn_by(command);
            if (command.stage == Stage::depth && draw != nullptr)
                drawn.emplace(draw->view, recipe_.pipelines[draw->pipeline].stencil);
        }
        for (uint32_t v = 0; v < input.views.size(); ++v) {
            for (uint32_t p = 0; p < recipe_.pipelines.size(); ++p) {
                const PipelineSpec& spec = recipe_.pipelines[p];
                if (!spec.whole_view || !drawn.contains({v, spec.stencil})) continue;
                Draw draw;
                draw.pipeline = p;
                draw.view = v;
                draw.count = 3;
                plan.commands.push_back({Stage::colour, draw});
            }
        }
    }

    // What all draws of instances of an asset have in common.
    static Draw draw_of(uint32_t asset, double magnification) {
        Draw draw;
        draw.pipeline = visibility_pipeline;
        draw.words[LODE_VGI_WORD_ASSET] = asset;
        draw.words[LODE_VGI_WORD_MAGNIFICATION] = std::bit_cast<uint32_t>(static_cast<float>(magnification));
        return draw;
    }

    std::vector<OpenAtlas> atlases_;
    Recipe recipe_;
    Raster raster_;
    std::shared_ptr<const Cutter> cutter_;  // null where the device cuts
    PoolWords words_;
    BufferSizes list_sizes_, pool_sizes_;
    PageCache pages_;
    std::optional<FrameCuts> cuts_;  // that are drawn
    CutMemory memory_;               // of the cuts made last; while next_ is made, the task has it
    InstanceTree instances_;
    std::optional<DeviceCut> device_;
    DeviceCut::Findings found_;  // of the last frame that is known of
    uint64_t given_up_ = 0;      // cuts made ahead that came to too much
    double raised_ = 1;          // times the pixel error, to save triangles where the device cuts
    uint64_t raised_in_ = 0;     // the frame that first had it
    std::optional<FrameInput> last_;
    Foresight foresight_;
    bool uploaded_ = false;  // cuts_, to the lists
    bool behind_ = false;    // pages have changed since cuts_ were made
    struct NextCuts {
        FrameCuts cuts;
        CutMemory memory;
    };
    std::future<NextCuts> next_;
    Worker beside_;  // last: its thread ends before what it works for
};

// What shaders/shared/vgi_surface.glsl is told of attributes.
struct AttributeConstants {
    uint32_t own_uvs;
    PoolWords words;
    std::vector<uint32_t> constants(uint32_t kinds) const { return {kinds, own_uvs, words.ever, words.of_sample}; }
    // Leaves of which nothing is looked up in samples are lit by themselves, for far less. To tell them apart costs a
    // look at every pixel.
    bool lights_leaves() const { return (words.ever & LODE_VGI_MORE_THAN_NORMALS) == 0; }
    uint32_t stencil(uint32_t kinds) const { return (kinds & ~kinds_of_leaves) == 0 && lights_leaves() ? 1 : 0; }
};

// kinds: LODE_VGI_KIND_..., of vertices of triangles.
PipelineSpec drawing_pipeline(bool tess, uint32_t kinds, const AttributeConstants& attributes) {
    PipelineSpec pipeline;
    pipeline.name = tess                                   ? "patches"
                    : kinds == LODE_VGI_KIND_LEAVES        ? "leaves"
                    : kinds == LODE_VGI_KIND_MOVING_LEAVES ? "moving leaves"
                    : kinds == LODE_VGI_KIND_SAMPLES       ? "samples"
                    : kinds == kinds_of_samples            ? "any samples"
                    : kinds == LODE_VGI_KIND_CORNERS       ? "corners"
                                                           : "samples and corners";
    pipeline.vertex = tess ? "vgi/patch.vert" : "vgi/sample.vert";
    if (tess) {
        pipeline.tessellation_control = "vgi/patch.tesc";
        pipeline.tessellation_evaluation = "vgi/patch.tese";
        pipeline.patch_vertices = 1;
    }
    pipeline.visibility = attributes.own_uvs != 0 ? "vgi/visible_uvs.frag" : "vgi/visible.frag";
    pipeline.visibility_targets = attributes.own_uvs != 0 ? 2 : 1;
    pipeline.cutout = "vgi/cutout.frag";
    pipeline.blended = "vgi/blended.frag";
    pipeline.storage = {StorageBinding::pool(LODE_VGI_GEOMETRY, geometry_pool, LODE_VGI_GEOMETRY_WORDS),
                        StorageBinding::texels(LODE_VGI_SLOTS, slot_table, 2),
                        StorageBinding::texels(LODE_VGI_ASSETS, asset_table, 4),
                        StorageBinding::texels(LODE_VGI_CODES, code_table, 1),
                        StorageBinding::texels(LODE_VGI_CHARTS, chart_table, 1),
                        StorageBinding::texels(LODE_VGI_CORNERS, corners_of_charts, 4),
                        StorageBinding::pool(LODE_VGI_LEAVES, leaf_pool, 4)};
    pipeline.storage.insert(pipeline.storage.end(), {StorageBinding::texels(LODE_VGI_TABLE, page_table, 1),
                                                     StorageBinding::pool(LODE_VGI_ATTRIBUTES, attribute_pool, 1)});
    pipeline.constants = attributes.constants(kinds);
    pipeline.stencil = attributes.stencil(kinds);
    if (tess) pipeline.storage.push_back({LODE_VGI_PATCHES, draw_lists, Access::read});
    return pipeline;
}

// kinds: of what it lights.
PipelineSpec lighting_pipeline_of(uint32_t kinds, const AttributeConstants& attributes) {
    PipelineSpec lighting;
    lighting.name = "lighting";
    lighting.stencil = attributes.stencil(kinds);
    lighting.vertex = "frame/whole_view.vert";
    lighting.fragment = "vgi/atlas.frag";
    lighting.whole_view = true;
    lighting.constants = attributes.constants(kinds);
    lighting.storage = {StorageBinding::pool(LODE_VGI_GEOMETRY, geometry_pool, LODE_VGI_GEOMETRY_WORDS),
                        StorageBinding::texels(LODE_VGI_TABLE, page_table, 1),
                        StorageBinding::pool(LODE_VGI_ATTRIBUTES, attribute_pool, 1),
                        StorageBinding::texels(LODE_VGI_ASSETS, asset_table, 4),
                        StorageBinding::texels(LODE_VGI_CHARTS, chart_table, 1),
                        StorageBinding::texels(LODE_VGI_CORNERS, corners_of_charts, 4)};
    return lighting;
}

DeviceNeeds device_needs(const Totals& totals, std::span<const OpenAtlas> atlases, const VgiOptions& options) {
    if (options.raster != Raster::device) return {};
    const DeviceCutSizes sizes = DeviceCutSizes::largest_of(atlases).times(std::max(1u, options.instances));
    return {sizes.table_bytes() + options.instances * sizeof(gpu::VgiCutInstance) +
                totals.rows[0] * (sizeof(gpu::VgiCutPage) + 2 * sizeof(uint32_t)) +
                totals.charts * 4 * sizeof(uint32_t) + LODE_CUT_LIST_COUNT * sizeof(gpu::VgiCutList),
            sizes.list_bytes()};
}

}  // namespace

Result<std::unique_ptr<FrameSource>> open_vgi(const std::vector<std::shared_ptr<const AtlasFile>>& files,
                                              const VgiOptions& options) {
    LODE_CHECK(!files.empty());
    Totals totals;
    std::vector<OpenAtlas> atlases = open_atlases(files, options, totals);
    const auto shares = share_budget(totals, atlases.size(), options, device_needs(totals, atlases, options));
    if (!shares) return tl::unexpected(shares.error());
    Recipe recipe;
    recipe.buffers = buffers_of(totals, *shares, atlases.size());
    const uint32_t kinds = shares->pools[2].most_slots > 0 ? every_kind : every_kind & ~kinds_of_leaves;
    const uint32_t own_uvs = (kinds & kinds_of_leaves) != 0 && totals.words.leaf_uvs ? 1 : 0;
    const AttributeConstants attributes{own_uvs, totals.words};
    recipe.pipelines = {drawing_pipeline(shares->tess, shares->tess ? kinds_of_samples : kinds, attributes),
                        lighting_pipeline_of(every_kind, attributes)};
    if (!shares->tess) {
        for (const uint32_t alone : {LODE_VGI_KIND_SAMPLES, kinds_of_samples, LODE_VGI_KIND_CORNERS})
            recipe.pipelines.push_back(drawing_pipeline(false, alone, attributes));
        if ((kinds & kinds_of_leaves) != 0) {
            for (const uint32_t alone : {LODE_VGI_KIND_LEAVES, LODE_VGI_KIND_MOVING_LEAVES})
                recipe.pipelines.push_back(drawing_pipeline(false, alone, attributes));
            if (attributes.lights_leaves())
                recipe.pipelines.push_back(lighting_pipeline_of(kinds_of_leaves, attributes));
        }
    }
    if (options.raster == Raster::device) DeviceCut(atlases).add_to(recipe, std::max(1u, options.instances));
    auto source =
        std::make_unique<VgiSource>(std::move(atlases), std::move(recipe), options.raster, shares->pools, totals.words,
                                    shares->list_budget, options.resident_bytes - shares->list_budget);
    if (auto done = source->load_base_pages(); !done) return tl::unexpected(done.error());
    return source;
}

}  // namespace lodestone::vgi
