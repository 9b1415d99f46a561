// Decodes pages beside the frames. The pages of a family are stored as one (pages.h), but are wanted at different
// times: families that were unpacked lately are kept, so that most are unpacked once.
#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "base/result.h"
#include "frame/plan.h"
#include "vgi/asset/codec/page_family.h"
#include "vgi/draw/open_atlas.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/draw/worker.h"

namespace lodestone::vgi {

// A page of positions or attributes, or a leaf's part.
struct PageId {
    Layer layer;
    uint32_t atlas, number;  // number: of the atlas
    auto operator<=>(const PageId&) const = default;
};

struct DecodedPage {
    PageId id{};
    std::shared_ptr<const GeometryPage> geometry;
    std::shared_ptr<const AttributePage> attributes;
    std::shared_ptr<const AttributeBlocks> blocks;  // the same, where the pool has blocks
    std::shared_ptr<const DrawnLeafPart> leaf;      // all null: it could not be decoded
    std::string fault;                              // and why
    Fault whose = Fault::format;                    // of the file, or of what it lies on
    uint64_t bytes() const;                         // that are uploaded of it; 0 where it could not be decoded
};

// What decoding a page takes, none of which changes meanwhile.
struct DecodeTask {
    PageId id;
    AtlasFile::PageName name;  // the same; of a leaf's part, the page in whose square it is
    const OpenAtlas* atlas;
    Blob blob;  // of its family; of the part
    std::shared_ptr<const GeometryPage> parent_geometry;
    std::shared_ptr<const AttributePage> parent_attributes;  // both null: a coarsest page
};

class PageDecoder {
public:
    explicit PageDecoder(PoolWords words) : words_(words) {}

    // At once.
    DecodedPage decode(const DecodeTask& task) const;

    // Beside what follows, on all processors. What was started before must have been taken.
    void start(std::vector<DecodeTask> tasks);
    // Waits for what was started, in the order of its tasks. Nothing where nothing was.
    std::vector<DecodedPage> take();

private:
    using FamilyId = std::tuple<Layer, uint32_t, uint32_t, uint32_t>;  // layer, atlas, chart, number
    struct Kept {
        std::shared_ptr<const PageFamily> family;
        uint64_t used = 0;  // by which start()
    };
    // Tasks by number whose pages are of one family; of leaves, one at a time.
    struct Siblings {
        FamilyId id{};
        std::shared_ptr<const PageFamily> family;  // null until it is unpacked; where none of them has its bytes
        std::vector<size_t> tasks;
    };
    std::vector<Siblings> grouped(const std::vector<DecodeTask>& tasks) const;
    void decode(Siblings& siblings, const std::vector<DecodeTask>& tasks, std::vector<DecodedPage>& decoded) const;
    std::vector<DecodedPage> run(const std::vector<DecodeTask>& tasks);
    void forget_oldest();
    DecodedPage decode(const DecodeTask& task, const PageFamily& family) const;
    DecodedPage decode_leaf(const DecodeTask& task) const;

    PoolWords words_;
    std::map<FamilyId, Kept> families_;  // the worker's own while it decodes
    uint64_t started_ = 0;
    std::future<std::vector<DecodedPage>> decoding_;
    Worker worker_;  // last: its thread ends before what it works for
};

}  // namespace lodestone::vgi
