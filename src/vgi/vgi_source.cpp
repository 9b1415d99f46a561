#include "vgi/vgi_source.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/threads.h"
#include "frame/screen_error.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/attribute_pages.h"
#include "vgi/bintree_cut.h"
#include "vgi/decoder.h"
#include "vgi/page_pool.h"
#include "vgi/sample_errors.h"

namespace lodestone::vgi {

namespace {

enum Buffers : uint32_t {
    geometry_pool,
    slot_table,
    page_table,
    attribute_pool,
    asset_table,
    code_table,
    chart_table,
    index_lists
};
constexpr uint64_t geometry_slot_bytes = uint64_t{LODE_VGI_PAGE_TEXELS} * sizeof(GeometryTexel);
constexpr uint32_t index_regions = 3;                      // one is written while the last frames' are drawn
constexpr uint32_t most_waiting = 256;                     // requests at once
constexpr uint32_t most_new_requests = 64;                 // per frame
constexpr uint64_t retry_frames = 120;                     // until a page that could not be read is asked for again
constexpr uint64_t most_index_bytes = uint64_t{48} << 20;  // per list
constexpr double raise = 1.189207115;  // of errors, where there are too many triangles: a quarter of an octave
constexpr float frames_ahead = 12;     // that the camera's way is foreseen

constexpr std::array<Layer, 2> both_layers{Layer::geometry, Layer::attributes};
constexpr size_t index_of(Layer layer) { return static_cast<size_t>(layer); }

enum class PageState : uint8_t { absent, waiting, failed };  // of pages that are not there

struct Asset {
    std::shared_ptr<const AtlasFile> file;
    std::unique_ptr<Residency> residency;
    std::unique_ptr<AttributePages> attributes;
    std::array<PageTree, 2> trees;
    std::array<std::vector<Channel>, 2> channels;
    std::array<uint32_t, 2> first{};  // number of its first page among all assets', by layer
    std::vector<float> spacing;       // per chart, of attributes
    uint32_t first_chart = 0;         // among all assets'
    PageDemand demand;
    std::vector<float> foreseen;  // as PageDemand::wanted, of the frames to come
    std::vector<float> attribute_demand;
    std::vector<uint8_t> attribute_touched;
    bool changed = true;  // residency has to be updated
};

struct Decoded {
    Layer layer;
    uint32_t asset, number;
    std::shared_ptr<const GeometryPage> geometry;
    std::shared_ptr<const AttributePage> attributes;  // both null: it could not be decoded
};

class VgiSource final : public FrameSource {
public:
    VgiSource(std::vector<Asset> assets, Recipe recipe, std::array<uint32_t, 2> slots, uint32_t texel_words,
              uint64_t index_capacity)
        : assets_(std::move(assets)),
          recipe_(std::move(recipe)),
          texel_words_(texel_words),
          index_capacity_(index_capacity) {
        for (const Layer layer : both_layers) {
            uint32_t pages = 0;
            for (Asset& asset : assets_) {
                asset.first[index_of(layer)] = pages;
                pages += asset.file->about().charts() * asset.trees[index_of(layer)].pages();
            }
            pools_.emplace_back(pages, slots[index_of(layer)]);
            states_[index_of(layer)].assign(pages, PageState::absent);
            retry_[index_of(layer)].assign(pages, 0);
        }
    }

    // The coarsest page of every chart.
    Result<void> load_base_pages() {
        for (uint32_t a = 0; a < assets_.size(); ++a) {
            const Asset& asset = assets_[a];
            const uint32_t charts = asset.file->about().charts();
            std::vector<Decoded> pages(size_t{charts} * 2);
            parallel_for(charts, 4, [&](size_t begin, size_t end) {
                for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
                    for (const Layer layer : both_layers) {
                        const size_t l = index_of(layer);
                        pages[c * 2 + l] = decode({layer, a, c * asset.trees[l].pages(), nullptr, nullptr},
                                                  asset.trees[l], asset.channels[l], 0, asset.file->bytes(layer, c, 0),
                                                  nullptr, asset.file->about().attributes, texel_words_);
                    }
                }
            });
            for (Decoded& page : pages) {
                if (page.geometry != nullptr)
                    assets_[a].spacing.push_back(spacing_of(asset.file->about(), *page.geometry));
                if (page.geometry == nullptr && page.attributes == nullptr) {
                    return fail(Fault::format, asset.file->file().path().string() + ": a coarsest page of chart " +
                                                   std::to_string(page.number / asset.trees[0].pages()) +
                                                   " cannot be unpacked; bake the asset again");
                }
                ready_.push_back(std::move(page));
            }
        }
        return {};
    }

    const Recipe& recipe() const override { return recipe_; }

    Plan plan(const FrameInput& input) override {
        LODE_CHECK(!input.views.empty());
        Plan plan;
        plan.generation = recipe_.generation;
        for (PagePool& pool : pools_) pool.begin_frame(input.frame, input.completed_frame);
        uploaded_pages_ = evicted_pages_ = 0;
        if (!begun_) upload_tables(plan);
        take_decoded();
        start_decoding(input);
        place_ready(input, plan);
        for (Asset& asset : assets_) {
            if (asset.changed) asset.residency->update();
            cut_is_stale_ = cut_is_stale_ || asset.changed;
            asset.changed = false;
        }
        make_cuts(input);
        draw_cuts(input, plan);
        touch_pages();
        const uint32_t missing = request_pages(input, plan);
        begun_ = true;
        last_ = input;
        last_.arrivals.clear();
        last_.readbacks.clear();

        for (const BufferSpec& buffer : recipe_.buffers) plan.stats.resident_bytes += buffer.bytes;
        plan.stats.index_bytes = recipe_.buffers[index_lists].bytes;
        plan.stats.more = {{"pages_resident", pools_[0].resident() + pools_[1].resident()},
                           {"pages_missing", missing},
                           {"pages_uploaded", uploaded_pages_},
                           {"pages_evicted", evicted_pages_},
                           {"pages_failed", failed_pages_},
                           {"requests_waiting", waiting_},
                           {"raised_error", raised_}};
        return plan;
    }

    Result<void> validate() const override {
        for (const PagePool& pool : pools_) {
            if (auto good = pool.validate(); !good) return good;
        }
        for (const Asset& asset : assets_) {
            if (auto good = asset.residency->validate(); !good) return good;
            for (const Layer layer : both_layers) {
                const PagePool& pool = pools_[index_of(layer)];
                for (uint32_t n = 0; n < asset.file->about().charts() * asset.trees[index_of(layer)].pages(); ++n) {
                    const bool there = layer == Layer::geometry ? asset.residency->entry(n).texels != nullptr
                                                                : asset.attributes->holds(n);
                    if (there != pool.holds(asset.first[index_of(layer)] + n))
                        return fail(Fault::invariant, "vgi: a page and its slot disagree");
                }
            }
        }
        return {};
    }

private:
    PagePool& pool(Layer layer) { return pools_[index_of(layer)]; }
    PageState& state(Layer layer, uint32_t asset, uint32_t number) {
        return states_[index_of(layer)][assets_[asset].first[index_of(layer)] + number];
    }

    // parent: of every page but a coarsest. Without samples where the bytes are not a page's.
    static Decoded decode(Decoded decoded, const PageTree& tree, std::span<const Channel> channels, uint32_t page,
                          std::span<const std::byte> bytes, const Page* parent, const PresentAttributes& attributes,
                          uint32_t texel_words) {
        const auto plain = decode_page(tree, channels, page, bytes, parent);
        if (!plain) return decoded;
        if (decoded.layer == Layer::geometry) {
            decoded.geometry = std::make_shared<const GeometryPage>(packed_geometry(*plain, tree));
        } else {
            decoded.attributes =
                std::make_shared<const AttributePage>(packed_attributes(*plain, tree, attributes, texel_words));
        }
        return decoded;
    }

    static uint64_t id_of(Layer layer, uint32_t asset, uint32_t number) {
        return uint64_t{asset} << 40 | uint64_t{number} << 1 | index_of(layer);
    }

    // What was decoded since the last frame.
    void take_decoded() {
        for (auto& page : decoding_) ready_.push_back(page.get());
        decoding_.clear();
    }

    void start_decoding(const FrameInput& input) {
        for (const Arrival& arrival : input.arrivals) {
            const auto layer = static_cast<Layer>(arrival.request & 1);
            const auto a = static_cast<uint32_t>(arrival.request >> 40);
            const auto number = static_cast<uint32_t>(arrival.request >> 1 & 0xffffffffu);
            if (a >= assets_.size() || number >= states_[index_of(layer)].size() ||
                state(layer, a, number) != PageState::waiting)
                continue;  // nothing that was asked for
            const Asset& asset = assets_[a];
            const PageTree tree = asset.trees[index_of(layer)];
            const uint32_t page = number % tree.pages(), up = number - page + tree.parent(page);
            if (arrival.blob.size() == 0) {
                failed(layer, a, number, input.frame);
                continue;
            }
            if (!pool(layer).holds(asset.first[index_of(layer)] + up)) {
                forget(layer, a, number);
                continue;
            }
            auto parent = std::make_shared<const Page>(layer == Layer::geometry
                                                           ? unpacked_geometry(*asset.residency->entry(up).texels)
                                                           : asset.attributes->unpacked(up));
            decoding_.push_back(decoder_.start<Decoded>(
                [layer, a, number, tree, page, parent, blob = arrival.blob, channels = asset.channels[index_of(layer)],
                 attributes = asset.file->about().attributes, words = texel_words_] {
                    return decode({layer, a, number, nullptr, nullptr}, tree, channels, page,
                                  std::span(blob.data(), blob.size()), parent.get(), attributes, words);
                }));
        }
    }

    void forget(Layer layer, uint32_t asset, uint32_t number) {
        state(layer, asset, number) = PageState::absent;
        --waiting_;
    }
    void failed(Layer layer, uint32_t asset, uint32_t number, uint64_t frame) {
        state(layer, asset, number) = PageState::failed;
        retry_[index_of(layer)][assets_[asset].first[index_of(layer)] + number] = frame + retry_frames;
        --waiting_;
        ++failed_pages_;
    }

    // Gives decoded pages their slots, as many as may be uploaded.
    void place_ready(const FrameInput& input, Plan& plan) {
        uint64_t bytes = 0;
        size_t done = 0;
        for (; done < ready_.size(); ++done) {
            Decoded& page = ready_[done];
            Asset& asset = assets_[page.asset];
            const size_t l = index_of(page.layer);
            const PageTree& tree = asset.trees[l];
            const uint32_t within = page.number % tree.pages(), key = asset.first[l] + page.number;
            const bool base = within == 0;
            const uint64_t size = page.geometry != nullptr     ? page.geometry->size() * sizeof(GeometryTexel)
                                  : page.attributes != nullptr ? page.attributes->size() * sizeof(uint32_t)
                                                               : 0;
            if (begun_ && bytes > 0 && bytes + size > input.budget.upload_bytes) break;
            if (size == 0) {
                failed(page.layer, page.asset, page.number, input.frame);
                continue;
            }
            const uint32_t parent = base ? PagePool::nothing : key - within + tree.parent(within);
            std::optional<PagePool::Placed> placed;
            if (base || pool(page.layer).holds(parent)) placed = pool(page.layer).place(key, parent, base);
            if (!base) forget(page.layer, page.asset, page.number);
            if (!placed) continue;  // no room: if it is still wanted, it is asked for again
            if (placed->evicted != PagePool::nothing) evict(page.layer, placed->evicted);
            bytes += size;
            ++uploaded_pages_;
            upload_page(page, placed->slot, plan);
        }
        ready_.erase(ready_.begin(), ready_.begin() + static_cast<ptrdiff_t>(done));
        for (uint32_t a = 0; a < assets_.size(); ++a) upload_page_table(a, plan);
    }

    void evict(Layer layer, uint32_t key) {
        const size_t l = index_of(layer);
        uint32_t a = 0;
        while (a + 1 < assets_.size() && assets_[a + 1].first[l] <= key) ++a;
        const uint32_t number = key - assets_[a].first[l];
        if (layer == Layer::geometry) {
            assets_[a].residency->drop(number);
            assets_[a].changed = true;
        } else {
            assets_[a].attributes->drop(number);
            attributes_changed_ = true;
        }
        ++evicted_pages_;
    }

    void upload(Plan& plan, uint32_t buffer, uint64_t offset, Blob blob) const {
        plan.stats.uploaded_bytes += blob.size();
        plan.commands.push_back({Stage::update, Upload{buffer, offset, std::move(blob)}});
    }

    void upload_page(const Decoded& page, uint32_t slot, Plan& plan) {
        Asset& asset = assets_[page.asset];
        if (page.layer == Layer::geometry) {
            asset.residency->put(page.number, page.geometry, slot);
            asset.changed = true;
            const auto bytes = std::as_bytes(std::span(*page.geometry));
            upload(plan, geometry_pool, slot * geometry_slot_bytes, Blob(page.geometry, bytes.data(), bytes.size()));
            const PageTree& tree = asset.trees[0];
            uint32_t level = 0, x = 0, y = 0;
            tree.place(page.number % tree.pages(), &level, &x, &y);
            const uint32_t header[2] = {page.number / tree.pages() | level << 28, x | y << 16};
            upload(plan, slot_table, uint64_t{slot} * sizeof header, Blob::copy_of(header, 2));
            return;
        }
        asset.attributes->put(page.number, page.attributes, slot);
        attributes_changed_ = true;
        const auto bytes = std::as_bytes(std::span(*page.attributes));
        upload(plan, attribute_pool, uint64_t{slot} * LODE_VGI_PAGE_TEXELS * texel_words_ * sizeof(uint32_t),
               Blob(page.attributes, bytes.data(), bytes.size()));
    }

    // Rows of the page table whose charts have changed.
    void upload_page_table(uint32_t a, Plan& plan) {
        const Asset& asset = assets_[a];
        const uint32_t per_chart = asset.trees[1].pages();
        asset.attributes->for_changed([&](uint32_t first_chart, std::span<const uint32_t> rows) {
            upload(plan, page_table, (uint64_t{asset.first[1]} + uint64_t{first_chart} * per_chart) * sizeof(uint32_t),
                   Blob::copy_of(rows.data(), rows.size()));
        });
    }

    void upload_tables(Plan& plan) const {
        std::vector<gpu::VgiAsset> records;
        std::vector<float> codes, spacing;
        for (const Asset& asset : assets_) {
            const Atlas& about = asset.file->about();
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
            r.levels = about.levels();
            r.page_cells = asset.trees[0].cells_per_page();
            r.first_chart = asset.first_chart;
            spacing.insert(spacing.end(), asset.spacing.begin(), asset.spacing.end());
            records.push_back(r);
            const ErrorCodes decoded(about.extent());
            for (int code = 0; code < 256; ++code) codes.push_back(decoded.error(static_cast<uint8_t>(code)));
            for (int code = 0; code < 256; ++code) codes.push_back(decoded.radius(static_cast<uint8_t>(code)));
        }
        upload(plan, asset_table, 0, Blob::copy_of(records.data(), records.size()));
        upload(plan, code_table, 0, Blob::copy_of(codes.data(), codes.size()));
        upload(plan, chart_table, 0, Blob::copy_of(spacing.data(), spacing.size()));
    }

    // The cuts of all instances; what they take and want of pages.
    void make_cuts(const FrameInput& input) {
        const bool same = begun_ && input.views == last_.views && input.level_view == last_.level_view &&
                          input.instances == last_.instances && input.budget == last_.budget;
        if (!same || cut_is_stale_) cut(input);
        if (same && !attributes_changed_) return;
        for (Asset& asset : assets_) {
            asset.attribute_demand.assign(asset.attributes->pages(), 0.0f);
            asset.attribute_touched.assign(asset.attributes->pages(), 0);
        }
        for (const Instance& instance : input.instances) {
            Asset& asset = assets_[instance.asset];
            asset.attributes->want(asset.residency->about(), asset.spacing, request_for(input, instance),
                                   asset.attribute_demand, asset.attribute_touched);
        }
        attributes_changed_ = false;
    }

    void cut(const FrameInput& input) {
        // From what the last frame needed, a step back: views change little.
        raised_ = std::max(1.0, raised_ / raise);
        level_ = input.budget.forced_level;
        for (;;) {
            cuts_.clear();
            for (Asset& asset : assets_) asset.demand = PageDemand(asset.residency->pages());
            uint64_t triangles = 0, indices = 0;
            for (const Instance& instance : input.instances) {
                LODE_CHECK(instance.asset < assets_.size(), instance.asset, assets_.size());
                Asset& asset = assets_[instance.asset];
                cuts_.push_back(cut_bintree(*asset.residency, request_for(input, instance), asset.demand));
                triangles += cuts_.back().triangles;
                for (const auto& part : cuts_.back().parts) indices += part.second.size();
            }
            // Too many: all errors rise alike, and where they may not rise further one level is drawn everywhere.
            if (triangles <= input.budget.max_triangles && indices <= index_capacity_) break;
            if (level_ >= 0) {
                if (level_ >= coarsest_level()) break;
                ++level_;
            } else if (magnification_of(input.sets_levels(), input.budget.pixel_error * raised_) <=
                       least_magnification) {
                level_ = 0;
            } else {
                raised_ *= raise;
            }
        }
        cut_is_stale_ = true;  // until its triangles are uploaded
    }
    int64_t coarsest_level() const {
        uint32_t levels = 1;
        for (const Asset& asset : assets_) levels = std::max(levels, asset.file->about().levels());
        return levels - 1;
    }

    CutRequest request_for(const FrameInput& input, const Instance& instance) const {
        CutRequest request;
        request.object_to_world = instance.object_to_world;
        request.views = input.views;
        request.level_view = &input.sets_levels();
        request.pixel_error = input.budget.pixel_error * raised_;
        request.forced_level = level_;
        request.cull_back_faces = input.views[0].culls_back_faces;
        return request;
    }

    void draw_cuts(const FrameInput& input, Plan& plan) {
        if (cut_is_stale_) {
            region_ = (region_ + 1) % index_regions;
            std::vector<uint32_t> lists;
            for (const Cut& cut : cuts_) {
                for (const auto& part : cut.parts) lists.insert(lists.end(), part.second.begin(), part.second.end());
            }
            LODE_CHECK(lists.size() <= index_capacity_, lists.size(), index_capacity_);
            if (!lists.empty())
                upload(plan, index_lists, region_ * index_capacity_ * sizeof(uint32_t),
                       Blob::copy_of(lists.data(), lists.size()));
            cut_is_stale_ = false;
        }
        uint64_t first = region_ * index_capacity_;
        for (uint32_t i = 0; i < cuts_.size(); ++i) {
            const Instance& instance = input.instances[i];
            const auto first_id = static_cast<uint32_t>(plan.instance_ids.size());
            plan.instance_ids.push_back(i);
            Draw draw;
            draw.index_buffer = index_lists;
            draw.first_id = first_id;
            draw.words[LODE_VGI_WORD_ASSET] = instance.asset;
            const double magnification = level_ >= 0 || input.level_view
                                             ? 0
                                             : magnification_of(input.views[0], input.budget.pixel_error * raised_);
            draw.words[LODE_VGI_WORD_MAGNIFICATION] = std::bit_cast<uint32_t>(static_cast<float>(magnification));
            const float scale = largest_scale(instance.object_to_world);
            draw.words[LODE_VGI_WORD_SCALE] = std::bit_cast<uint32_t>(scale);
            draw.words[LODE_VGI_WORD_TEXEL_WORDS] = texel_words_;
            const Asset& asset = assets_[instance.asset];
            const PresentAttributes& has = asset.file->about().attributes;
            draw.words[LODE_VGI_WORD_TABLE] = asset.first[1];
            draw.words[LODE_VGI_WORD_IMAGES] =
                asset.trees[1].pages() |
                static_cast<uint32_t>(std::countr_zero(asset.file->about().attribute_cells)) << 16 |
                ((has.uvs ? LODE_VGI_HAS_UVS : 0u) | (has.colours ? LODE_VGI_HAS_COLOURS : 0u) |
                 (has.materials ? LODE_VGI_HAS_MATERIALS : 0u))
                    << 20;
            bool drawn = false;
            for (const auto& [mask, indices] : cuts_[i].parts) {
                draw.index_offset = first * sizeof(uint32_t);
                draw.count = static_cast<uint32_t>(indices.size());
                first += indices.size();
                for (uint32_t v = 0; v < input.views.size(); ++v) {
                    if ((mask >> v & 1) == 0) continue;
                    draw.view = v;
                    const float focal = input.views[v].focal_px;
                    draw.words[LODE_VGI_WORD_PIXEL] = std::bit_cast<uint32_t>(focal > 0 ? 1 / (focal * scale) : 0.0f);
                    if (input.views[v].kind == View::Kind::shadow) {
                        plan.commands.push_back({Stage::shadow, draw});
                        continue;
                    }
                    plan.commands.push_back({Stage::depth, draw});
                    plan.commands.push_back({Stage::colour, draw});
                    plan.stats.triangles += indices.size() / 3;
                    drawn = drawn || v == 0;
                }
            }
            ++(drawn ? plan.stats.instances_drawn : plan.stats.instances_culled);
        }
    }

    void touch_pages() {
        for (Asset& asset : assets_) {
            // Pages have higher numbers than their parents.
            for (uint32_t n = asset.residency->pages(); n-- > 0;) {
                if (asset.demand.touched[n]) pools_[0].touch(asset.first[0] + n);
            }
            for (uint32_t n = asset.attributes->pages(); n-- > 0;) {
                if (asset.attribute_touched[n]) pools_[1].touch(asset.first[1] + n);
            }
        }
    }

    // Asks for what is missing, the worst first. Returns how many pages this frame had to do without.
    uint32_t request_pages(const FrameInput& input, Plan& plan) {
        uint32_t missing = 0;
        for (const Asset& asset : assets_) {
            missing += static_cast<uint32_t>(std::ranges::count_if(asset.demand.wanted, [](float w) { return w > 0; }));
            missing +=
                static_cast<uint32_t>(std::ranges::count_if(asset.attribute_demand, [](float w) { return w > 0; }));
        }
        foresee_way(input);
        struct Wish {
            float wanted;
            Layer layer;
            uint32_t asset, number;
        };
        std::vector<Wish> wishes;
        for (const Layer layer : both_layers) {
            const size_t l = index_of(layer);
            // No more than there is room for: what is wanted least would only push out what is wanted more.
            uint32_t room = pool(layer).available();
            std::vector<Wish> mine;
            for (uint32_t a = 0; a < assets_.size(); ++a) {
                const Asset& asset = assets_[a];
                const auto& now = layer == Layer::geometry ? asset.demand.wanted : asset.attribute_demand;
                for (uint32_t n = 0; n < now.size(); ++n) {
                    const float wanted = layer == Layer::geometry ? std::max(now[n], asset.foreseen[n]) : now[n];
                    if (!(wanted > 0)) continue;
                    PageState& s = state(layer, a, n);
                    if (s == PageState::failed && retry_[l][asset.first[l] + n] <= input.frame) s = PageState::absent;
                    if (s == PageState::waiting) room -= std::min(room, 1u);
                    if (s == PageState::absent) mine.push_back({wanted, layer, a, n});
                }
            }
            const auto worse = [](const Wish& x, const Wish& y) {
                return x.wanted != y.wanted ? x.wanted > y.wanted
                                            : std::pair(x.asset, x.number) < std::pair(y.asset, y.number);
            };
            const size_t take = std::min<size_t>({mine.size(), room, most_new_requests});
            std::partial_sort(mine.begin(), mine.begin() + static_cast<ptrdiff_t>(take), mine.end(), worse);
            wishes.insert(wishes.end(), mine.begin(), mine.begin() + static_cast<ptrdiff_t>(take));
        }
        std::ranges::stable_sort(wishes, std::greater<>(), [](const Wish& w) { return w.wanted; });
        for (const Wish& w : wishes) {
            if (waiting_ >= most_waiting) break;
            const Asset& asset = assets_[w.asset];
            const uint32_t per_chart = asset.trees[index_of(w.layer)].pages();
            const auto place = asset.file->place(w.layer, w.number / per_chart, w.number % per_chart);
            plan.requests.push_back(
                {id_of(w.layer, w.asset, w.number), w.asset, place.chunk, place.offset, place.bytes, w.wanted});
            state(w.layer, w.asset, w.number) = PageState::waiting;
            ++waiting_;
        }
        return missing;
    }

    // Where the camera will be if it goes on as it did.
    void foresee_way(const FrameInput& input) {
        for (Asset& asset : assets_) asset.foreseen.assign(asset.residency->pages(), 0.0f);
        if (!begun_ || level_ >= 0 || input.level_view) return;
        const glm::vec3 step = input.views[0].eye - last_.views[0].eye;
        if (glm::dot(step, step) == 0) return;
        std::vector<View> views{input.views[0]};
        views[0].eye += step * frames_ahead;
        views[0].world_to_view[3] -= glm::vec4(glm::mat3(views[0].world_to_view) * (step * frames_ahead), 0);
        for (const Instance& instance : input.instances) {
            Asset& asset = assets_[instance.asset];
            CutRequest request = request_for(input, instance);
            request.views = views;
            request.level_view = nullptr;
            foresee(*asset.residency, request, asset.demand.wanted, asset.foreseen);
        }
    }

    std::vector<Asset> assets_;
    Recipe recipe_;
    uint32_t texel_words_;
    uint64_t index_capacity_;                       // indices of one region
    std::vector<PagePool> pools_;                   // by layer
    std::array<std::vector<PageState>, 2> states_;  // by layer, over all assets
    std::array<std::vector<uint64_t>, 2> retry_;    // frame from which a failed page may be asked for again
    std::vector<Decoded> ready_;                    // decoded, without a slot yet
    std::vector<std::future<Decoded>> decoding_;
    std::vector<Cut> cuts_;  // per instance
    FrameInput last_;
    uint32_t waiting_ = 0, uploaded_pages_ = 0, evicted_pages_ = 0, failed_pages_ = 0;
    uint64_t region_ = 0;
    double raised_ = 1;   // times the pixel error asked for
    int64_t level_ = -1;  // drawn everywhere, or -1
    bool begun_ = false, cut_is_stale_ = true, attributes_changed_ = true;
    Decoder decoder_;  // last: its thread ends before what it works for
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_vgi(std::vector<std::shared_ptr<const AtlasFile>> files,
                                              const VgiOptions& options) {
    LODE_CHECK(!files.empty());
    std::vector<Asset> assets;
    uint32_t texel_words = 1;
    for (auto& file : files) texel_words = std::max(texel_words, attribute_words(file->about().attributes));
    std::array<uint64_t, 2> pages{}, base{};
    for (auto& file : files) {
        Asset asset;
        const Atlas& about = file->about();
        asset.file = file;
        asset.first_chart = static_cast<uint32_t>(base[0]);
        asset.residency = std::make_unique<Residency>(about);
        asset.attributes = std::make_unique<AttributePages>(about);
        for (const Layer layer : both_layers) {
            const size_t l = index_of(layer);
            asset.trees[l] = tree_of(about, layer);
            asset.channels[l] = channels_of(about.attributes, layer);
            pages[l] += uint64_t{about.charts()} * asset.trees[l].pages();
            base[l] += about.charts();
        }
        assets.push_back(std::move(asset));
    }
    const std::array<uint64_t, 2> slot_bytes{geometry_slot_bytes + 8,
                                             uint64_t{LODE_VGI_PAGE_TEXELS} * texel_words * sizeof(uint32_t)};
    // A quarter of the budget is for index lists, or what the coarsest level of a few instances takes; the rest for
    // pages, halves for each kind unless one needs less.
    const uint64_t tables = (pages[1] + base[0]) * sizeof(uint32_t) + assets.size() * (sizeof(gpu::VgiAsset) + 2048);
    const uint64_t index_bytes =
        std::clamp(options.resident_bytes / 4 / index_regions / 12 * 12, base[0] * 24 * std::max(1u, options.instances),
                   std::max(most_index_bytes, base[0] * 24 * std::max(1u, options.instances)));
    uint64_t left = options.resident_bytes - std::min(options.resident_bytes, tables + index_bytes * index_regions);
    const uint64_t need = base[0] * slot_bytes[0] + base[1] * slot_bytes[1];
    if (need > left) {
        return fail(Fault::machine, "the coarsest pages need " + std::to_string(need) +
                                        " bytes and the budget leaves " + std::to_string(left) +
                                        " for pages; raise the budget");
    }
    std::array<uint32_t, 2> slots{};
    left -= need;
    const std::array<uint64_t, 2> more{(pages[0] - base[0]) * slot_bytes[0], (pages[1] - base[1]) * slot_bytes[1]};
    const uint64_t first = std::min(more[0], std::max(left / 2, left - std::min(left, more[1])));
    slots[0] = static_cast<uint32_t>(base[0] + first / slot_bytes[0]);
    slots[1] = static_cast<uint32_t>(base[1] + std::min(more[1], left - first) / slot_bytes[1]);

    Recipe recipe;
    recipe.buffers = {
        {"page pool of positions", slots[0] * geometry_slot_bytes, use_storage,
         static_cast<uint32_t>(geometry_slot_bytes)},
        {"slots of the page pool", slots[0] * uint64_t{8}, use_storage, 8},
        {"page table", std::max<uint64_t>(pages[1], 1) * sizeof(uint32_t), use_storage, 4},
        {"page pool of attributes", slots[1] * slot_bytes[1], use_storage, static_cast<uint32_t>(slot_bytes[1])},
        {"assets", assets.size() * sizeof(gpu::VgiAsset), use_storage, sizeof(gpu::VgiAsset)},
        {"errors and radii", assets.size() * 2048, use_storage, 2048},
        {"spacing of samples", base[0] * sizeof(float), use_storage, 4},
        {"index lists", index_bytes * index_regions, use_index, 4}};
    PipelineSpec pipeline;
    pipeline.name = "bintree";
    pipeline.vertex = "vgi/bintree.vert";
    pipeline.fragment = "vgi/atlas.frag";
    uint32_t ever = 0;
    for (const Asset& asset : assets) {
        const Atlas& about = asset.file->about();
        // Texture coordinates are of use where there is a texture.
        if (about.attributes.uvs && !about.images.empty()) ever |= LODE_VGI_HAS_UVS;
        if (about.attributes.colours) ever |= LODE_VGI_HAS_COLOURS;
        if (about.attributes.materials) ever |= LODE_VGI_HAS_MATERIALS;
    }
    pipeline.constants = {ever};
    pipeline.storage = {
        {LODE_VGI_GEOMETRY, geometry_pool, Access::read}, {LODE_VGI_SLOTS, slot_table, Access::read, 1},
        {LODE_VGI_TABLE, page_table, Access::read, 1},    {LODE_VGI_ATTRIBUTES, attribute_pool, Access::read},
        {LODE_VGI_ASSETS, asset_table, Access::read, 1},  {LODE_VGI_CODES, code_table, Access::read, 1},
        {LODE_VGI_CHARTS, chart_table, Access::read, 1}};
    recipe.pipelines = {pipeline};
    auto source = std::make_unique<VgiSource>(std::move(assets), std::move(recipe), slots, texel_words,
                                              index_bytes / sizeof(uint32_t));
    if (auto done = source->load_base_pages(); !done) return tl::unexpected(done.error());
    return source;
}

}  // namespace lodestone::vgi
