#include "vgi/draw/page_stream.h"

#include <algorithm>

#include "base/check.h"
#include "base/threads.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/draw/mip_tail.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t most_waiting = 256;      // requests at once
constexpr uint32_t most_new_requests = 64;  // per frame and layer
constexpr uint64_t retry_frames = 120;      // until a page that could not be read is asked for again

uint64_t id_of(Layer layer, uint32_t atlas, uint32_t number) {
    return uint64_t{atlas} << 40 | uint64_t{number} << 1 | index_of(layer);
}

}  // namespace

void add_upload(Plan& plan, uint32_t buffer, uint64_t offset, Blob blob) {
    plan.stats.uploaded_bytes += blob.size();
    plan.commands.push_back({Stage::update, Upload{buffer, offset, std::move(blob)}});
}

PageStream::PageStream(std::span<OpenAtlas> atlases, std::array<uint32_t, 2> slots, uint32_t texel_words)
    : atlases_(atlases), texel_words_(texel_words) {
    for (const Layer layer : both_layers) {
        uint32_t pages = 0;
        for (OpenAtlas& atlas : atlases_) {
            atlas.first[index_of(layer)] = pages;
            pages += atlas.pages(layer);
        }
        pools_.emplace_back(pages, slots[index_of(layer)]);
        states_[index_of(layer)].assign(pages, State::absent);
        retry_[index_of(layer)].assign(pages, 0);
    }
}

Result<void> PageStream::load_base_pages() {
    for (uint32_t a = 0; a < atlases_.size(); ++a) {
        const OpenAtlas& atlas = atlases_[a];
        const uint32_t charts = atlas.file->about().charts();
        std::vector<Decoded> pages(size_t{charts} * 2);
        parallel_for(charts, 4, [&](size_t begin, size_t end) {
            for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
                for (const Layer layer : both_layers) {
                    const size_t l = index_of(layer);
                    pages[c * 2 + l] =
                        decode({layer, a, c * atlas.trees[l].pages(), nullptr, nullptr},
                               tree_of(atlas.file->about(), layer, c), atlas.channels[l], 0,
                               atlas.file->bytes(layer, c, 0), nullptr, atlas.file->about().attributes, texel_words_);
                }
            }
        });
        std::vector<std::shared_ptr<const AttributePage>> coarsest;
        for (Decoded& page : pages) {
            if (page.geometry != nullptr)
                atlases_[a].spacing.push_back(spacing_of(atlas.file->about(), *page.geometry));
            if (page.geometry == nullptr && page.attributes == nullptr) {
                return fail(Fault::format, atlas.file->file().path().string() + ": a coarsest page of chart " +
                                               std::to_string(page.number / atlas.trees[0].pages()) +
                                               " cannot be unpacked; bake the asset again");
            }
            if (page.attributes != nullptr) coarsest.push_back(page.attributes);
            ready_.push_back(std::move(page));
        }
        atlases_[a].mip_tail =
            std::make_shared<const AttributePage>(mip_tail(atlas.file->about(), coarsest, texel_words_));
    }
    return {};
}

PageStream::Decoded PageStream::decode(Decoded decoded, const PageTree& tree, std::span<const Channel> channels,
                                       uint32_t page, std::span<const std::byte> bytes, const Page* parent,
                                       const PresentAttributes& attributes, uint32_t texel_words) {
    const auto family = PageFamily::unpack(tree, channels, tree.family(page), bytes);
    if (!family) return decoded;
    const Page plain = family->page(page, parent);
    if (decoded.layer == Layer::geometry) {
        decoded.geometry = std::make_shared<const GeometryPage>(packed_geometry(plain, tree));
    } else {
        decoded.attributes =
            std::make_shared<const AttributePage>(packed_attributes(plain, tree, attributes, texel_words));
    }
    return decoded;
}

void PageStream::begin_frame(uint64_t frame, uint64_t completed) {
    for (PagePool& pool : pools_) pool.begin_frame(frame, completed);
    uploaded_ = evicted_ = 0;
}

void PageStream::touch(const std::array<std::vector<uint32_t>, 2>& pages) {
    for (const Layer layer : both_layers) {
        for (const uint32_t page : pages[index_of(layer)]) pool(layer).touch(page);
    }
}

void PageStream::touch_positions(std::span<const uint32_t> pages) {
    for (const uint32_t page : pages) {
        if (pool(Layer::geometry).holds(page)) pool(Layer::geometry).touch(page);
    }
}

// What was decoded since the last frame.
void PageStream::take_decoded() {
    for (auto& page : decoding_) ready_.push_back(page.get());
    decoding_.clear();
}

void PageStream::start_decoding(const FrameInput& input) {
    for (const Arrival& arrival : input.arrivals) {
        const auto layer = static_cast<Layer>(arrival.request & 1);
        const auto a = static_cast<uint32_t>(arrival.request >> 40);
        const auto number = static_cast<uint32_t>(arrival.request >> 1 & 0xffffffffu);
        if (a >= atlases_.size() || number >= states_[index_of(layer)].size() ||
            state(layer, a, number) != State::waiting)
            continue;  // nothing that was asked for
        const OpenAtlas& atlas = atlases_[a];
        const PageTree& tree = atlas.trees[index_of(layer)];
        const uint32_t page = number % tree.pages(), up = number - page + tree.parent(page);
        if (arrival.blob.size() == 0) {
            fail_page(layer, a, number, input.frame);
            continue;
        }
        if (!pool(layer).holds(atlas.first[index_of(layer)] + up)) {
            forget(layer, a, number);
            continue;
        }
        decoding_.push_back(decoder_.start<Decoded>(
            [layer, a, number, page, &atlas, blob = arrival.blob, words = texel_words_,
             parent_geometry = layer == Layer::geometry ? atlas.residency->entry(up).texels : nullptr,
             parent_attributes = layer == Layer::attributes ? atlas.attributes->texels(up) : nullptr] {
                const size_t l = index_of(layer);
                const PresentAttributes& attributes = atlas.file->about().attributes;
                const Page parent = parent_geometry != nullptr
                                        ? unpacked_geometry(*parent_geometry)
                                        : unpacked_attributes(*parent_attributes, atlas.trees[l], attributes);
                const PageTree own = tree_of(atlas.file->about(), layer, number / atlas.trees[l].pages());
                return decode({layer, a, number, nullptr, nullptr}, own, atlas.channels[l], page,
                              std::span(blob.data(), blob.size()), &parent, attributes, words);
            }));
    }
}

void PageStream::forget(Layer layer, uint32_t atlas, uint32_t number) {
    state(layer, atlas, number) = State::absent;
    --waiting_;
}

void PageStream::fail_page(Layer layer, uint32_t atlas, uint32_t number, uint64_t frame) {
    state(layer, atlas, number) = State::failed;
    retry_[index_of(layer)][atlases_[atlas].first[index_of(layer)] + number] = frame + retry_frames;
    --waiting_;
    ++failed_;
}

void PageStream::place(const FrameInput& input, bool all, Plan& plan) {
    take_decoded();
    start_decoding(input);
    uint64_t bytes = 0;
    size_t done = 0;
    for (; done < ready_.size(); ++done) {
        Decoded& page = ready_[done];
        OpenAtlas& atlas = atlases_[page.atlas];
        const size_t l = index_of(page.layer);
        const PageTree& tree = atlas.trees[l];
        const uint32_t within = page.number % tree.pages(), key = atlas.first[l] + page.number;
        const bool base = within == 0;
        const uint64_t size = page.geometry != nullptr     ? page.geometry->size() * sizeof(GeometryTexel)
                              : page.attributes != nullptr ? page.attributes->size() * sizeof(uint32_t)
                                                           : 0;
        if (!all && bytes > 0 && bytes + size > input.budget.upload_bytes) break;
        if (size == 0) {
            fail_page(page.layer, page.atlas, page.number, input.frame);
            continue;
        }
        const uint32_t parent = base ? PagePool::nothing : key - within + tree.parent(within);
        std::optional<PagePool::Placed> placed;
        if (base || pool(page.layer).holds(parent)) placed = pool(page.layer).place(key, parent, base);
        if (!base) forget(page.layer, page.atlas, page.number);
        if (!placed) continue;  // no room: if it is still wanted, it is asked for again
        if (placed->evicted != PagePool::nothing) evict(page.layer, placed->evicted);
        bytes += size;
        ++uploaded_;
        upload_page(page, placed->slot, plan);
    }
    ready_.erase(ready_.begin(), ready_.begin() + static_cast<ptrdiff_t>(done));
    upload_page_tables(plan);
}

void PageStream::evict(Layer layer, uint32_t key) {
    const size_t l = index_of(layer);
    uint32_t a = 0;
    while (a + 1 < atlases_.size() && atlases_[a + 1].first[l] <= key) ++a;
    const uint32_t number = key - atlases_[a].first[l];
    atlases_[a].tables[l].drop(number);
    if (layer == Layer::geometry) {
        atlases_[a].residency->drop(number);
    } else {
        atlases_[a].attributes->drop(number);
    }
    changed_ = true;
    ++evicted_;
}

void PageStream::upload_page(const Decoded& page, uint32_t slot, Plan& plan) {
    OpenAtlas& atlas = atlases_[page.atlas];
    changed_ = true;
    atlas.tables[index_of(page.layer)].put(page.number, slot);
    if (page.layer == Layer::geometry) {
        atlas.residency->put(page.number, page.geometry, slot);
        const auto bytes = std::as_bytes(std::span(*page.geometry));
        add_upload(plan, geometry_pool, slot * geometry_slot_bytes, Blob(page.geometry, bytes.data(), bytes.size()));
        const PageTree& tree = atlas.trees[0];
        uint32_t level = 0, x = 0, y = 0;
        tree.place(page.number % tree.pages(), &level, &x, &y);
        const uint32_t header[2] = {page.number / tree.pages() | level << 28, x | y << 16};
        add_upload(plan, slot_table, uint64_t{slot} * sizeof header, Blob::copy_of(header, 2));
        return;
    }
    atlas.attributes->put(page.number, page.attributes);
    const auto bytes = std::as_bytes(std::span(*page.attributes));
    add_upload(plan, attribute_pool, uint64_t{slot} * LODE_VGI_PAGE_TEXELS * texel_words_ * sizeof(uint32_t),
               Blob(page.attributes, bytes.data(), bytes.size()));
}

// Rows of the page table whose charts have changed.
void PageStream::upload_page_tables(Plan& plan) {
    uint64_t first = 0;  // of the layer
    for (const Layer layer : both_layers) {
        const size_t l = index_of(layer);
        for (OpenAtlas& atlas : atlases_) {
            atlas.tables[l].for_changed([&](uint32_t first_chart, std::span<const uint32_t> entries) {
                const uint64_t place = first + atlas.first[l] + uint64_t{first_chart} * atlas.trees[l].pages();
                add_upload(plan, page_table, place * sizeof(uint32_t), Blob::copy_of(entries.data(), entries.size()));
            });
        }
        first += states_[l].size();
    }
}

uint32_t PageStream::request(std::span<const FrameCuts::Wish> wishes, uint64_t frame, Plan& plan) {
    uint32_t missing = 0;
    std::array<uint32_t, 2> room{}, asked{};
    // No more than there is room for: what is wanted least would only push out what is wanted more.
    for (const Layer layer : both_layers) room[index_of(layer)] = pool(layer).available();
    // What is left out is nowhere, and nothing is missing there.
    const auto there = [&](const FrameCuts::Wish& w) {
        const OpenAtlas& atlas = atlases_[w.atlas];
        const uint32_t per_chart = atlas.trees[index_of(w.layer)].pages();
        return atlas.holds(w.layer, w.number) || !atlas.file->has(w.layer, w.number / per_chart, w.number % per_chart);
    };
    for (const FrameCuts::Wish& w : wishes) {
        missing += !w.prefetched && !there(w);
        uint32_t& left = room[index_of(w.layer)];
        if (state(w.layer, w.atlas, w.number) == State::waiting) left -= std::min(left, 1u);
    }
    for (const FrameCuts::Wish& w : wishes) {
        const size_t l = index_of(w.layer);
        State& s = state(w.layer, w.atlas, w.number);
        const OpenAtlas& atlas = atlases_[w.atlas];
        if (s == State::failed && retry_[l][atlas.first[l] + w.number] <= frame) s = State::absent;
        if (waiting_ >= most_waiting) break;
        if (s != State::absent || room[l] == 0 || asked[l] == most_new_requests || there(w)) continue;
        const uint32_t per_chart = atlas.trees[l].pages(), page = w.number % per_chart;
        // Pages are differences from their parents.
        if (page > 0 && !atlas.holds(w.layer, w.number - page + atlas.trees[l].parent(page))) continue;
        const auto place = atlas.file->place(w.layer, w.number / per_chart, page);
        plan.requests.push_back(
            {id_of(w.layer, w.atlas, w.number), w.atlas, place.chunk, place.offset, place.bytes, w.wanted});
        s = State::waiting;
        ++waiting_;
        --room[l];
        ++asked[l];
    }
    return missing;
}

Result<void> PageStream::validate() const {
    for (const PagePool& pool : pools_) {
        if (auto good = pool.validate(); !good) return good;
    }
    for (const OpenAtlas& atlas : atlases_) {
        for (const Layer layer : both_layers) {
            const PagePool& pool = pools_[index_of(layer)];
            for (uint32_t n = 0; n < atlas.pages(layer); ++n) {
                if (atlas.holds(layer, n) != pool.holds(atlas.first[index_of(layer)] + n))
                    return fail(Fault::invariant, "vgi: a page and its slot disagree");
            }
        }
    }
    return {};
}

}  // namespace lodestone::vgi
