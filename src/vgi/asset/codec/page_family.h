// How pages (pages.h) are compressed, family by family: without loss as differences from what neighbours let expect
// (page_plane.h), or, channels that may lose something, by lossy_family.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/asset/codec/lossy_family.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Compresses the pages of a family. pages: all of the chart, by number; those of the family become what is decoded, and
// those of the family of their parent are. Deterministic.
std::vector<std::byte> encode_family(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                     std::span<Page> pages);

// A family as it was stored, its pages still differences from their parent.
class PageFamily {
public:
    // Fault::format where the bytes are not those of such a family. channels: must outlive this.
    static Result<PageFamily> unpack(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                     std::span<const std::byte> bytes);
    // The samples of a page.
    // number: of a page of this family. parent: of every page but 0.
    Page page(uint32_t number, const Page* parent) const;

private:
    PageFamily(const PageTree& tree, std::span<const Channel> channels, uint32_t family)
        : tree_(tree), channels_(channels), family_(family), lossy_(tree, channels, family) {}
    // Of what is coded.
    Page sampled_page(uint32_t number, const Page* parent) const;

    PageTree tree_;
    std::optional<PageTree> whole_;  // where this is of a coarsest page's own samples
    std::span<const Channel> channels_;
    uint32_t family_;
    std::vector<std::vector<uint16_t>> folded_;  // per channel, member after member; empty where it is lossy
    LossyFamily lossy_;
};

}  // namespace lodestone::vgi
