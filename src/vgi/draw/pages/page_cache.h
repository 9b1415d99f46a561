// The owner of every page of every atlas: whether it is absent, requested, decoding, failed or resident, in which slot,
// and whether cuts may use it. Pages are asked for, decoded beside the frames, given a slot of a pool, uploaded, and
// evicted when others need the room.
//
//   absent ─request()→ requested ─arrival→ decoding ─place()→ resident ─evicted→ absent
//                          └─ empty arrival, or it cannot be decoded ─→ failed ─120 frames→ absent
#pragma once

#include <map>
#include <span>
#include <vector>

#include "base/structures/copy_on_write.h"
#include "frame/frame_source.h"
#include "vgi/draw/buffer_sizes.h"
#include "vgi/draw/cut/frame_cuts.h"
#include "vgi/draw/open_atlas.h"
#include "vgi/draw/pages/page_decoder.h"
#include "vgi/draw/pages/slot_pool.h"
#include "vgi/draw/recipe_layout.h"

namespace lodestone::vgi {

class PageCache {
public:
    // A pool of pages: where it begins, in slots of its buffer, and how many it has at first and at most.
    struct PoolSpec {
        uint32_t buffer, first;
        uint32_t slots, most_slots;
    };
    // atlases, sizes: must outlive this. pools: by layer.
    PageCache(std::span<OpenAtlas> atlases, std::array<PoolSpec, 3> pools, PoolWords words, BufferSizes& sizes);

    // The coarsest page of every chart; they are placed by the first frame. Fault::format for a damaged one: there is
    // nothing coarser to draw in its place.
    Result<void> load_base_pages();

    // Once a frame, in this order: the frame begins; pages that cuts use are touched; what was decoded is placed, as
    // many bytes as may be uploaded, and what has arrived goes to be decoded; pages are asked for.
    void begin_frame(uint64_t frame, uint64_t completed);
    void touch(const std::array<std::vector<uint32_t>, 3>& pages);
    void touch_positions(std::span<const uint32_t> pages);  // those of them that are still there
    // upload_bytes: that are left to this frame; one page is placed all the same. Arrivals may be anything: what was
    // not asked for is passed over, and what is not the page it should be has failed.
    void place(const FrameInput& input, uint64_t upload_bytes, Plan& plan);
    // As many of them as the budget has it. Returns how many of those wanted now are not there.
    struct Missing {
        uint32_t pages = 0, leaf_parts = 0;
    };
    Missing request(std::span<const FrameCuts::Wish> wishes, const FrameInput& input, Plan& plan);

    // What is known of all pages now, by atlas; it stays as it is whatever comes.
    std::vector<AtlasSnapshot> snapshot() const;

    // Pages came or went since this was last asked.
    bool take_changed() { return std::exchange(changed_, false); }
    uint32_t resident() const { return fixed_ + pools_[0].resident() + pools_[1].resident(); }
    // With small levels and fixed pages, which are before those of the pool.
    uint64_t attribute_bytes_resident() const {
        return (uint64_t{spec(Layer::attributes).first} + pool(Layer::attributes).resident()) *
               slot_bytes(Layer::attributes);
    }
    uint32_t leaf_parts_resident() const { return pools_[2].resident(); }
    uint32_t uploaded() const { return uploaded_; }  // by this frame
    uint32_t evicted() const { return evicted_; }
    uint32_t failed() const { return failed_; }    // ever
    uint32_t waiting() const { return waiting_; }  // requested or decoding

    // Which pages are usable is what its definition says, the pools are sound, and each slot has the page that has it.
    Result<void> validate() const;

private:
    SlotPool& pool(Layer layer) { return pools_[index_of(layer)]; }
    const SlotPool& pool(Layer layer) const { return pools_[index_of(layer)]; }
    const PoolSpec& spec(Layer layer) const { return specs_[index_of(layer)]; }
    uint64_t slot_bytes(Layer layer) const;
    // The pool's own number of the slot that a page is in, of an atlas whose pages are not fixed; SlotPool::nothing of
    // one that is not there.
    uint32_t pool_slot(const PageId& id) const {
        const uint32_t slot = pages(id.atlas).slot(id.layer, id.number);
        return slot == SlotPool::nothing ? slot : slot - spec(id.layer).first;
    }
    void touch(const PageId& id);
    const AtlasPages& pages(uint32_t atlas) const { return *pages_[atlas]; }
    uint32_t key_of(const PageId& id) const { return atlases_[id.atlas].first[index_of(id.layer)] + id.number; }
    PageId page_of(Layer layer, uint32_t key) const;
    // Of a page that is not a coarsest one; of a leaf's part, the page in whose square it is.
    PageId parent_of(const PageId& id) const;
    void set_state(const PageId& id, PageState state) {
        pages_[id.atlas].write().set_state(id.layer, id.number, state);
    }

    DecodedPage base_page(Layer layer, uint32_t atlas, uint32_t chart) const;
    void start_decoding(const FrameInput& input);
    void forget(const PageId& id);
    // why: as AtlasFile's errors say it.
    void fail_page(const PageId& id, const std::string& why, uint64_t frame);
    AtlasFile::PageName name_of(const PageId& id) const;
    // Whether it stays, as there is nothing coarser.
    bool is_base(const PageId& id) const {
        return id.layer != Layer::leaves && id.number % atlases_[id.atlas].trees[index_of(id.layer)].pages() == 0;
    }
    // Whether it is made from another, and this is not there.
    bool lacks_parent(const PageId& id) const {
        if (is_base(id)) return false;
        const PageId parent = parent_of(id);
        return !pages(id.atlas).holds(parent.layer, parent.number);
    }
    AtlasFile::ByteRange place_of(const PageId& id) const;
    bool place_one(const DecodedPage& page, Plan& plan);
    void make_room(Layer layer, Plan& plan);
    uint32_t slots_within_reach(Layer layer) const;
    void evict(Layer layer, uint32_t key);
    void upload_page(const DecodedPage& page, uint32_t slot, Plan& plan);
    void upload_page_tables(Plan& plan);
    bool there(const FrameCuts::Wish& wish) const;
    bool may_be_asked_for(const FrameCuts::Wish& wish, uint64_t frame);

    std::span<OpenAtlas> atlases_;
    std::array<PoolSpec, 3> specs_;
    BufferSizes& sizes_;
    PoolWords words_;
    std::vector<CopyOnWrite<AtlasPages>> pages_;  // by atlas
    std::vector<SlotPool> pools_;                 // by layer
    std::map<PageId, uint64_t> retry_;            // of failed pages: the frame from which they may be asked for again
    std::array<std::vector<std::vector<uint32_t>>, 2> changed_charts_;  // by layer and atlas: their page tables changed
    std::vector<bool> told_;                                            // by atlas: that a page has failed
    std::vector<std::string> warnings_;                                 // for the next plan
    std::vector<DecodedPage> ready_;                                    // decoded, without a slot yet
    std::vector<Arrival> empty_;  // asked for, of families with nothing to read (PageTree::has_samples())
    uint32_t waiting_ = 0, uploaded_ = 0, evicted_ = 0, failed_ = 0, fixed_ = 0;  // fixed_: pages placed, ever
    bool changed_ = true;
    PageDecoder decoder_;  // of what the last frame brought; last: it ends before what it works for
};

}  // namespace lodestone::vgi
