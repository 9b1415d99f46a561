#include "vgi/draw/pages/page_cache.h"

#include <algorithm>
#include <numeric>

#include "base/check.h"
#include "base/threads.h"
#include "vgi/draw/attributes/mip_tail.h"
#include "vgi/draw/pages/page_table.h"

namespace lodestone::vgi {

namespace {

constexpr uint64_t most_waiting = 4;    // frames' requests at once
constexpr uint32_t least_growth = 32;   // slots, of a pool that is full
constexpr uint64_t retry_frames = 120;  // until a page that could not be read is asked for again

// Ids of requests: atlas << 40 | number << 2 | layer.
uint64_t request_id(Layer layer, uint32_t atlas, uint32_t number) {
    return uint64_t{atlas} << 40 | uint64_t{number} << 2 | index_of(layer);
}

}  // namespace

PageCache::PageCache(std::span<OpenAtlas> atlases, std::array<PoolSpec, 3> pools, PoolWords words, BufferSizes& sizes)
    : atlases_(atlases), specs_(pools), sizes_(sizes), words_(words), told_(atlases.size(), false), decoder_(words) {
    for (const OpenAtlas& atlas : atlases_)
        pages_.emplace_back(AtlasPages{Residency(atlas.topology), AttributePages(atlas.file->about())});
    for (const Layer layer : all_layers) {
        uint32_t pages = 0;
        for (OpenAtlas& atlas : atlases_) {
            atlas.first[index_of(layer)] = pages;
            pages += atlas.pages(layer);
            if (layer == Layer::leaves) continue;
            std::vector<uint32_t>& all = changed_charts_[index_of(layer)].emplace_back(atlas.file->about().charts());
            std::iota(all.begin(), all.end(), 0u);
        }
        pools_.emplace_back(spec(layer).slots);
    }
}

PageId PageCache::page_of(Layer layer, uint32_t key) const {
    const size_t l = index_of(layer);
    const auto next = std::ranges::upper_bound(atlases_, key, {}, [&](const OpenAtlas& a) { return a.first[l]; });
    const auto atlas = static_cast<uint32_t>(next - atlases_.begin()) - 1;
    return {layer, atlas, key - atlases_[atlas].first[l]};
}

PageId PageCache::parent_of(const PageId& id) const {
    if (id.layer == Layer::leaves) {
        const PageTopology& topology = *atlases_[id.atlas].topology;
        return {Layer::geometry, id.atlas, topology.page_of_leaf(topology.leaf_of_part(id.number))};
    }
    const PageTree& tree = atlases_[id.atlas].trees[index_of(id.layer)];
    const uint32_t page = id.number % tree.pages();
    return {id.layer, id.atlas, id.number - page + tree.parent(page)};
}

AtlasFile::ByteRange PageCache::place_of(const PageId& id) const {
    const AtlasFile& file = *atlases_[id.atlas].file;
    if (id.layer == Layer::leaves) return file.leaf_place(id.number);
    const AtlasFile::PageName name = name_of(id);
    return file.place(name.layer, name.chart, name.page);
}

AtlasFile::PageName PageCache::name_of(const PageId& id) const {
    // Of a leaf's part: where the leaf is.
    if (id.layer == Layer::leaves) {
        const PageTopology& topology = *atlases_[id.atlas].topology;
        const uint32_t page = topology.page_of_leaf(topology.leaf_of_part(id.number)), pages = topology.tree().pages();
        return {id.layer, page / pages, page % pages};
    }
    const uint32_t per_chart = atlases_[id.atlas].trees[index_of(id.layer)].pages();
    return {id.layer, id.number / per_chart, id.number % per_chart};
}

DecodedPage PageCache::base_page(Layer layer, uint32_t atlas, uint32_t chart) const {
    const PageId id{layer, atlas, chart * atlases_[atlas].trees[index_of(layer)].pages()};
    auto bytes = atlases_[atlas].file->read(name_of(id));
    if (!bytes) return {id, nullptr, nullptr, nullptr, nullptr, bytes.error().message, bytes.error().fault};
    return decoder_.decode({id, name_of(id), &atlases_[atlas], Blob(std::move(*bytes)), nullptr, nullptr});
}

Result<void> PageCache::load_base_pages() {
    for (uint32_t a = 0; a < atlases_.size(); ++a) {
        OpenAtlas& atlas = atlases_[a];
        const Atlas& about = atlas.file->about();
        std::vector<DecodedPage> pages(size_t{about.charts()} * 2);
        atlas.spacing.resize(about.charts());
        parallel_for(about.charts(), 4, [&](size_t begin, size_t end) {
            for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
                for (const Layer layer : both_layers) pages[c * 2 + index_of(layer)] = base_page(layer, a, c);
                const DecodedPage& positions = pages[c * 2 + index_of(Layer::geometry)];
                if (positions.geometry != nullptr)
                    atlas.spacing[c] = spacing_of(about, *positions.geometry, coarsest_bounds(about, c).error);
            }
        });
        std::vector<std::shared_ptr<const AttributePage>> coarsest;
        for (DecodedPage& page : pages) {
            if (!page.fault.empty()) return fail_at(atlas.file->file().path().string(), {page.whose, page.fault});
            if (page.attributes != nullptr) coarsest.push_back(page.attributes);
            ready_.push_back(std::move(page));
        }
        atlas.mip_tail = std::make_shared<const AttributePage>(mip_tail(about, coarsest, words_.of_sample));
    }
    return {};
}

void PageCache::begin_frame(uint64_t frame, uint64_t completed) {
    for (SlotPool& pool : pools_) pool.begin_frame(frame, completed);
    uploaded_ = evicted_ = 0;
}

void PageCache::touch(const std::array<std::vector<uint32_t>, 3>& pages) {
    for (const Layer layer : all_layers) {
        for (const uint32_t key : pages[index_of(layer)]) touch(page_of(layer, key));
    }
}

void PageCache::touch(const PageId& id) {
    if (!atlases_[id.atlas].is_fixed(id.layer)) pool(id.layer).touch(pool_slot(id));
}

void PageCache::touch_positions(std::span<const uint32_t> pages) {
    for (const uint32_t key : pages) {
        const PageId id = page_of(Layer::geometry, key);
        if (this->pages(id.atlas).holds(id.layer, id.number)) touch(id);
    }
}

void PageCache::start_decoding(const FrameInput& input) {
    std::vector<DecodeTask> tasks;
    std::vector<Arrival> arrivals = std::exchange(empty_, {});
    arrivals.insert(arrivals.end(), input.arrivals.begin(), input.arrivals.end());
    for (const Arrival& arrival : arrivals) {
        const PageId id{static_cast<Layer>(arrival.request & 3), static_cast<uint32_t>(arrival.request >> 40),
                        static_cast<uint32_t>(arrival.request >> 2 & 0xffffffffu)};
        if (index_of(id.layer) >= all_layers.size() || id.atlas >= atlases_.size() ||
            arrival.request != request_id(id.layer, id.atlas, id.number) ||
            id.number >= atlases_[id.atlas].pages(id.layer) ||
            pages(id.atlas).state(id.layer, id.number) != PageState::requested)
            continue;  // nothing that was asked for
        if (arrival.blob.size() == 0 && place_of(id).bytes > 0) {
            fail_page(id, "a page cannot be read", input.frame);
            continue;
        }
        if (lacks_parent(id)) {
            forget(id);
            continue;
        }
        const AtlasPages& known = pages(id.atlas);
        DecodeTask task{id, name_of(id), &atlases_[id.atlas], arrival.blob, nullptr, nullptr};
        if (id.layer == Layer::attributes) {
            task.parent_attributes = known.attributes.entry(parent_of(id).number).texels;
        } else {
            task.parent_geometry = known.geometry.entry(parent_of(id).number).texels;
        }
        set_state(id, PageState::decoding);
        tasks.push_back(std::move(task));
    }
    if (!tasks.empty()) decoder_.start(std::move(tasks));
}

void PageCache::forget(const PageId& id) {
    set_state(id, PageState::absent);
    --waiting_;
}

void PageCache::fail_page(const PageId& id, const std::string& why, uint64_t frame) {
    if (!told_[id.atlas]) {
        told_[id.atlas] = true;
        warnings_.push_back(atlases_[id.atlas].file->file().path().string() + ": " + why +
                            "; where pages fail, coarser ones are drawn");
    }
    set_state(id, PageState::failed);
    retry_[id] = frame + retry_frames;
    --waiting_;
    ++failed_;
}

void PageCache::place(const FrameInput& input, uint64_t upload_bytes, Plan& plan) {
    for (DecodedPage& page : decoder_.take()) ready_.push_back(std::move(page));
    start_decoding(input);
    uint64_t bytes = 0;
    size_t done = 0;
    for (; done < ready_.size(); ++done) {
        const DecodedPage& page = ready_[done];
        // With the rows of the page table that tell of it and of what it replaces.
        const uint64_t row =
            page.id.layer == Layer::leaves
                ? 0
                : uint64_t{atlases_[page.id.atlas].trees[index_of(page.id.layer)].pages()} * sizeof(uint32_t);
        const uint64_t size = page.bytes() + header_bytes + 2 * row;
        if (bytes > 0 && bytes + size > upload_bytes) break;
        if (page.bytes() == 0) {
            fail_page(page.id, page.fault, input.frame);
        } else if (place_one(page, plan)) {
            bytes += size;
            ++uploaded_;
        }
    }
    ready_.erase(ready_.begin(), ready_.begin() + static_cast<ptrdiff_t>(done));
    for (CopyOnWrite<AtlasPages>& known : pages_) {
        if (known->geometry.owes_update()) known.write().geometry.update();
    }
    upload_page_tables(plan);
    for (std::string& warning : std::exchange(warnings_, {})) plan.warnings.push_back(std::move(warning));
}

uint64_t PageCache::slot_bytes(Layer layer) const {
    if (layer == Layer::leaves) return leaf_slot_bytes(words_.leaf_block());
    return words_.page_bytes(layer, page_cells);
}

// What the pool could grow to now.
uint32_t PageCache::slots_within_reach(Layer layer) const {
    const uint64_t room = sizes_.most(spec(layer).buffer) / slot_bytes(layer) - spec(layer).first;
    return std::max(pool(layer).slots(), static_cast<uint32_t>(std::min<uint64_t>(room, spec(layer).most_slots)));
}

// A pool that is full grows by an eighth, where it may.
void PageCache::make_room(Layer layer, Plan& plan) {
    SlotPool& pool = this->pool(layer);
    if (!pool.full()) return;
    const uint32_t slots = std::min(slots_within_reach(layer), pool.slots() + std::max(pool.slots() / 8, least_growth));
    if (slots == pool.slots()) return;
    const uint32_t buffer = spec(layer).buffer;
    sizes_.resize(buffer, (uint64_t{spec(layer).first} + slots) * slot_bytes(layer), sizes_.bytes(buffer), plan);
    pool.grow(slots);
}

// False where there is no room, or what it is coded against has gone: if it is still wanted, it is asked for again.
bool PageCache::place_one(const DecodedPage& page, Plan& plan) {
    const PageId& id = page.id;
    const OpenAtlas& atlas = atlases_[id.atlas];
    if (atlas.is_fixed(id.layer)) {
        upload_page(page, atlas.first_fixed[index_of(id.layer)] + id.number, plan);
        ++fixed_;
        return true;
    }
    const bool base = is_base(id);
    if (!base) forget(id);
    if (lacks_parent(id)) return false;
    const uint32_t parent = base || id.layer == Layer::leaves ? SlotPool::nothing : pool_slot(parent_of(id));
    make_room(id.layer, plan);
    const auto placed = pool(id.layer).place(key_of(id), parent, base);
    if (!placed) return false;
    if (placed->evicted != SlotPool::nothing) evict(id.layer, placed->evicted);
    upload_page(page, spec(id.layer).first + placed->slot, plan);
    return true;
}

void PageCache::evict(Layer layer, uint32_t key) {
    const PageId id = page_of(layer, key);
    pages_[id.atlas].write().drop(layer, id.number);
    if (layer != Layer::leaves)
        changed_charts_[index_of(layer)][id.atlas].push_back(id.number /
                                                             atlases_[id.atlas].trees[index_of(layer)].pages());
    changed_ = true;
    ++evicted_;
}

void PageCache::upload_page(const DecodedPage& page, uint32_t slot, Plan& plan) {
    const PageId& id = page.id;
    AtlasPages& known = pages_[id.atlas].write();
    changed_ = true;
    if (id.layer == Layer::leaves) {
        known.geometry.put_leaf_part(id.number, page.leaf, slot);
        const auto bytes = std::as_bytes(std::span(page.leaf->words));
        add_upload(plan, leaf_pool, slot * slot_bytes(Layer::leaves), Blob(page.leaf, bytes.data(), bytes.size()));
        return;
    }
    const OpenAtlas& atlas = atlases_[id.atlas];
    const PageTree& tree = atlas.trees[index_of(id.layer)];
    const uint64_t offset = slot * words_.page_bytes(id.layer, tree.cells_per_page());
    changed_charts_[index_of(id.layer)][id.atlas].push_back(id.number / tree.pages());
    if (id.layer == Layer::geometry) {
        known.geometry.put(id.number, page.geometry, slot);
        const auto bytes = std::as_bytes(std::span(*page.geometry));
        add_upload(plan, geometry_pool, offset, Blob(page.geometry, bytes.data(), bytes.size()));
        uint32_t level = 0, x = 0, y = 0;
        tree.place(id.number % tree.pages(), &level, &x, &y);
        const uint32_t header[2] = {id.number / tree.pages() | level << 28, x | y << 16};
        add_upload(plan, slot_table, uint64_t{slot + atlas.header_shift} * sizeof header, Blob::copy_of(header, 2));
        return;
    }
    known.attributes.put(id.number, page.attributes, slot);
    const auto& words = page.blocks != nullptr ? page.blocks : page.attributes;
    const auto bytes = std::as_bytes(std::span(*words));
    add_upload(plan, attribute_pool, offset, Blob(words, bytes.data(), bytes.size()));
}

// Rows of the page table whose charts have changed, those that follow each other at once.
void PageCache::upload_page_tables(Plan& plan) {
    uint64_t first_of_layer = 0;
    for (const Layer layer : both_layers) {
        const size_t l = index_of(layer);
        for (uint32_t a = 0; a < atlases_.size(); ++a) {
            std::vector<uint32_t> changed = std::exchange(changed_charts_[l][a], {});
            std::ranges::sort(changed);
            changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
            const PageTree& tree = atlases_[a].trees[l];
            for (size_t i = 0; i < changed.size();) {
                const uint32_t first = changed[i];
                std::vector<uint32_t> entries;
                for (uint32_t chart = first; i < changed.size() && changed[i] == chart; ++i, ++chart) {
                    append_table_row(
                        tree, [&](uint32_t page) { return pages(a).slot(layer, chart * tree.pages() + page); },
                        entries);
                }
                const uint64_t place = first_of_layer + atlases_[a].first[l] + uint64_t{first} * tree.pages();
                add_upload(plan, page_table, place * sizeof(uint32_t), Blob::copy_of(entries.data(), entries.size()));
            }
        }
        for (const OpenAtlas& atlas : atlases_) first_of_layer += atlas.pages(layer);
    }
}

// What is left out is nowhere, and nothing is missing there.
bool PageCache::there(const FrameCuts::Wish& w) const {
    if (w.layer == Layer::leaves) return pages(w.atlas).holds(w.layer, w.number);
    const OpenAtlas& atlas = atlases_[w.atlas];
    const uint32_t per_chart = atlas.trees[index_of(w.layer)].pages();
    return pages(w.atlas).holds(w.layer, w.number) ||
           !atlas.file->has(w.layer, w.number / per_chart, w.number % per_chart);
}

// Whether it is absent, not left out, and its parent is there, from which it differs. A coarsest page always is.
bool PageCache::may_be_asked_for(const FrameCuts::Wish& w, uint64_t frame) {
    const PageId id{w.layer, w.atlas, w.number};
    if (pages(w.atlas).state(w.layer, w.number) == PageState::failed && retry_.at(id) <= frame) {
        retry_.erase(id);
        set_state(id, PageState::absent);
    }
    if (pages(w.atlas).state(w.layer, w.number) != PageState::absent || there(w)) return false;
    return !is_base(id) && !lacks_parent(id);
}

PageCache::Missing PageCache::request(std::span<const FrameCuts::Wish> wishes, const FrameInput& input, Plan& plan) {
    Missing missing;
    std::array<uint32_t, 3> room{}, asked{};
    // No more than there is room for: what is wanted least would only push out what is wanted more.
    for (const Layer layer : all_layers)
        room[index_of(layer)] = pool(layer).available() + slots_within_reach(layer) - pool(layer).slots();
    for (const FrameCuts::Wish& w : wishes) {
        if (!w.prefetched && !there(w)) ++(w.layer == Layer::leaves ? missing.leaf_parts : missing.pages);
        const PageState state = pages(w.atlas).state(w.layer, w.number);
        uint32_t& left = room[index_of(w.layer)];
        if (state == PageState::requested || state == PageState::decoding) left -= std::min(left, 1u);
    }
    for (const FrameCuts::Wish& w : wishes) {
        const size_t l = index_of(w.layer);
        if (waiting_ >= most_waiting * input.budget.page_requests) break;
        if (room[l] == 0 || asked[l] == input.budget.page_requests || !may_be_asked_for(w, input.frame)) continue;
        const auto range = place_of({w.layer, w.atlas, w.number});
        const uint64_t id = request_id(w.layer, w.atlas, w.number);
        if (range.bytes == 0) {
            empty_.push_back({id, {}});
        } else {
            plan.requests.push_back({id, w.atlas, range.chunk, range.offset, range.bytes, w.wanted});
        }
        set_state({w.layer, w.atlas, w.number}, PageState::requested);
        ++waiting_;
        --room[l];
        ++asked[l];
    }
    return missing;
}

std::vector<AtlasSnapshot> PageCache::snapshot() const {
    std::vector<AtlasSnapshot> all;
    for (size_t a = 0; a < atlases_.size(); ++a) all.push_back({&atlases_[a], pages_[a].snapshot()});
    return all;
}

Result<void> PageCache::validate() const {
    for (const CopyOnWrite<AtlasPages>& known : pages_) {
        if (auto good = known->geometry.validate(); !good) return good;
    }
    for (const Layer layer : all_layers) {
        const SlotPool& pool = pools_[index_of(layer)];
        if (auto good = pool.validate(); !good) return good;
        for (uint32_t slot = 0; slot < pool.slots(); ++slot) {
            if (pool.page_in(slot) == SlotPool::nothing) continue;
            const PageId id = page_of(layer, pool.page_in(slot));
            if (pool_slot(id) != slot)
                return fail(Fault::invariant, "vgi: a slot is given to a page that is elsewhere");
        }
    }
    return {};
}

}  // namespace lodestone::vgi
