// Pages on their way: asked for, decoded beside the frames, given a slot of a pool, uploaded, and evicted when others
// need the room.
#pragma once

#include <future>
#include <span>
#include <vector>

#include "frame/frame_source.h"
#include "shaders/shared/vgi_texels.h"

#include "vgi/draw/cut/frame_cuts.h"
#include "vgi/draw/open_atlas.h"
#include "vgi/draw/page_pool.h"
#include "vgi/draw/worker.h"

namespace lodestone::vgi {

// Buffers and pipelines of the recipe.
enum Pipelines : uint32_t { visibility_pipeline, lighting_pipeline, first_pass };  // first_pass: of DeviceCut
enum Buffers : uint32_t {
    geometry_pool,
    slot_table,
    page_table,
    attribute_pool,
    asset_table,
    code_table,
    chart_table,
    draw_lists,
    // Where the device cuts (device_cut.h).
    cut_instances,
    cut_bounds,
    cut_sides,
    cut_states,
    cut_leaves,
    cut_records,
    cut_findings
};
inline constexpr uint64_t geometry_slot_bytes = uint64_t{LODE_VGI_PAGE_TEXELS} * sizeof(GeometryTexel);

class PageStream {
public:
    // atlases: must outlive this. slots: of the pools, by layer. texel_words: of every sample of attributes.
    PageStream(std::span<OpenAtlas> atlases, std::array<uint32_t, 2> slots, uint32_t texel_words);

    // The coarsest page of every chart; they are placed by the first frame. Fault::format for a damaged one.
    Result<void> load_base_pages();

    // Once a frame, in this order: the frame begins; pages that cuts use are touched; what was decoded is placed, as
    // many bytes as may be uploaded, and what has arrived goes to be decoded; pages are asked for.
    void begin_frame(uint64_t frame, uint64_t completed);
    void touch(const std::array<std::vector<uint32_t>, 2>& pages);
    void touch_positions(std::span<const uint32_t> pages);  // those of them that are still there
    // all: with no regard to Budget::upload_bytes.
    void place(const FrameInput& input, bool all, Plan& plan);
    // Returns how many of the pages wanted now are not there.
    uint32_t request(std::span<const FrameCuts::Wish> wishes, uint64_t frame, Plan& plan);

    // Pages came or went since this was last asked.
    bool take_changed() { return std::exchange(changed_, false); }
    uint32_t resident() const { return pools_[0].resident() + pools_[1].resident(); }
    uint32_t uploaded() const { return uploaded_; }  // by this frame
    uint32_t evicted() const { return evicted_; }
    uint32_t failed() const { return failed_; }  // ever
    uint32_t waiting() const { return waiting_; }

    // Pools, atlases and what is known of each page agree.
    Result<void> validate() const;

private:
    enum class State : uint8_t { absent, waiting, failed };  // of pages that are not there
    struct Decoded {
        Layer layer;
        uint32_t atlas, number;
        std::shared_ptr<const GeometryPage> geometry;
        std::shared_ptr<const AttributePage> attributes;  // both null: it could not be decoded
    };
    static Decoded decode(Decoded decoded, const PageTree& tree, std::span<const Channel> channels, uint32_t page,
                          std::span<const std::byte> bytes, const Page* parent, const PresentAttributes& attributes,
                          uint32_t texel_words);
    PagePool& pool(Layer layer) { return pools_[index_of(layer)]; }
    State& state(Layer layer, uint32_t atlas, uint32_t number) {
        return states_[index_of(layer)][atlases_[atlas].first[index_of(layer)] + number];
    }
    void take_decoded();
    void start_decoding(const FrameInput& input);
    void forget(Layer layer, uint32_t atlas, uint32_t number);
    void fail_page(Layer layer, uint32_t atlas, uint32_t number, uint64_t frame);
    void evict(Layer layer, uint32_t key);
    void upload_page(const Decoded& page, uint32_t slot, Plan& plan);
    void upload_page_tables(Plan& plan);

    std::span<OpenAtlas> atlases_;
    uint32_t texel_words_;
    std::vector<PagePool> pools_;                 // by layer
    std::array<std::vector<State>, 2> states_;    // by layer, over all atlases
    std::array<std::vector<uint64_t>, 2> retry_;  // frame from which a failed page may be asked for again
    std::vector<Decoded> ready_;                  // decoded, without a slot yet
    std::vector<std::future<Decoded>> decoding_;
    uint32_t waiting_ = 0, uploaded_ = 0, evicted_ = 0, failed_ = 0;
    bool changed_ = true;
    Worker decoder_;  // last: its thread ends before what it works for
};

// Adds an upload to the plan's update stage.
void add_upload(Plan& plan, uint32_t buffer, uint64_t offset, Blob blob);

}  // namespace lodestone::vgi
