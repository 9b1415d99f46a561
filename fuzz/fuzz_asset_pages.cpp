// Families of pages below their checksums: whatever the bytes are, they are refused or unpack to pages of the right
// size, parents and children alike. Input: cells, channels, family, mode; then the family's bytes as they are, or what
// pages to encode and where to damage what comes of them: few inputs are streams that zstd takes.
#include <algorithm>
#include <cstdlib>

#include "base/random.h"
#include "fuzz/mutators.h"
#include "fuzz/watch.h"
#include "vgi/asset/codec/page_family.h"

using namespace lodestone;
using namespace lodestone::vgi;

namespace {

// A family's pages and their parent, with values from a few bytes: noise of so many bits over a slope. All others of
// the chart are empty.
std::vector<Page> pages_of(const PageTree& tree, uint32_t family, size_t channels, std::span<const uint8_t> from) {
    Random random(from.size() < 2 ? 0 : from[0] | from[1] << 8);
    const uint32_t bits = from.size() < 3 ? 3 : from[2] % 17;
    const size_t plane = size_t{tree.samples_per_side()} * tree.samples_per_side();
    std::vector<Page> pages(tree.pages());
    const auto fill = [&](Page& page) {
        for (size_t i = 0; i < channels * plane; ++i)
            page.values.push_back(static_cast<uint16_t>(i % plane + random.below(1u << bits)));
    };
    for (uint32_t k = 0; k < PageTree::members(family); ++k) fill(pages[tree.member(family, k)]);
    if (family > 0) fill(pages[tree.parent(tree.member(family, 0))]);
    return pages;
}

size_t bytes_of(std::span<const Page> pages) {
    size_t bytes = 0;
    for (const Page& page : pages) bytes += page.values.size() * sizeof page.values[0];
    return bytes;
}

// Returns the bytes of the pages' values; 0 where the family is refused.
size_t unpack(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
              std::span<const std::byte> bytes) {
    const auto unpacked = PageFamily::unpack(tree, channels, family, bytes);
    if (!unpacked) return 0;
    Page parent;
    const size_t values = channels.size() * tree.samples_per_side() * tree.samples_per_side();
    parent.values.assign(values, 0x1234);
    for (uint32_t k = 0; k < PageTree::members(family); ++k) {
        const uint32_t number = tree.member(family, k);
        const Page page = unpacked->page(number, number == 0 ? nullptr : &parent);
        if (page.values.size() != values) std::abort();
    }
    return PageTree::members(family) * values * sizeof parent.values[0];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 4) return 0;
    const std::span<const uint8_t> rest(data + 4, size - 4);
    const PageTree tree{2u << data[0] % 7};  // 2 .. 128 cells
    const Layer layer = (data[1] & 8) != 0 ? Layer::attributes : Layer::geometry;
    const auto bit = [&](int number) { return (data[1] >> number & 1) != 0; };
    AtlasAttributes attributes{{true, bit(0), bit(1), bit(2)}, bit(4), bit(5)};
    attributes.texture_quality = static_cast<uint8_t>(data[0] / 7 * 100 / 36);  // 0: without loss
    attributes.dense_quality = static_cast<uint8_t>((attributes.texture_quality + 1) / 2);
    const auto channels = channels_of(attributes, layer, bit(6));
    const uint32_t family = data[2] % tree.families();
    std::vector<std::byte> bytes;
    size_t most = size;  // the larger of what is given and what is coded
    const fuzz::Watch watch;
    if (data[3] % 4 == 0) {
        const auto raw = std::as_bytes(rest);
        bytes.assign(raw.begin(), raw.end());
    } else {
        auto pages = pages_of(tree, family, channels.size(), rest);
        most = std::max(most, bytes_of(pages));
        bytes = encode_family(tree, channels, family, pages);
        if (rest.size() > 3) fuzz::damage(bytes, rest.subspan(3));
    }
    most = std::max(most, unpack(tree, channels, family, bytes));
    watch.check(most);
    return 0;
}
