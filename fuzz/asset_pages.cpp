// Families of pages below their checksums: whatever the bytes are, they are refused or unpack to pages of the right
// size, parents and children alike.
#include <cstdlib>

#include "vgi/asset/pages.h"

using namespace lodestone;
using namespace lodestone::vgi;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 2) return 0;
    const PageTree tree{2u << data[0] % 8};  // 2 .. 256 cells
    const bool bit[] = {(data[1] & 1) != 0, (data[1] & 2) != 0, (data[1] & 4) != 0};
    const Layer layer = (data[1] & 8) != 0 ? Layer::attributes : Layer::geometry;
    const auto channels = channels_of({true, bit[0], bit[1], bit[2]}, layer);
    const uint32_t families = tree.families(), family = (data[1] >> 4) % families;
    const auto unpacked = PageFamily::unpack(tree, channels, family, std::as_bytes(std::span(data, size)).subspan(2));
    if (!unpacked) return 0;
    Page parent;
    const size_t values = channels.size() * tree.samples_per_side() * tree.samples_per_side();
    parent.values.assign(values, 0x1234);
    for (uint32_t k = 0; k < PageTree::members(family); ++k) {
        const uint32_t number = tree.member(family, k);
        const Page page = unpacked->page(number, number == 0 ? nullptr : &parent);
        if (page.values.size() != values) std::abort();
    }
    return 0;
}
