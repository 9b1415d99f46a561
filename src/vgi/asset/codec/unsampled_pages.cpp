#include "vgi/asset/codec/unsampled_pages.h"

#include <bit>
#include <glm/geometric.hpp>

#include "vgi/asset/bintree.h"
#include "vgi/asset/error_codes.h"

namespace lodestone::vgi {

namespace {

// Copies every stride-th sample of a page of `row` samples a side, or puts them there.
template <class Copy>
void for_sampled(uint32_t row, size_t channels, uint32_t stride, const Copy& copy) {
    size_t i = 0;
    for (size_t c = 0; c < channels; ++c) {
        for (size_t y = 0; y < row; y += stride) {
            for (size_t x = 0; x < row; x += stride) copy(i++, (c * row + y) * row + x);
        }
    }
}

// What lies between two numbers of one of the channels; the next one's too, of directions.
void put_between(Channel::Kind kind, uint16_t* at, size_t p, size_t a, size_t b, size_t plane) {
    switch (kind) {
        case Channel::Kind::name:
            at[p] = at[a];
            return;
        case Channel::Kind::error:
            at[p] = 0;
            return;
        case Channel::Kind::radius:
            at[p] = ErrorCodes::absent;
            return;
        case Channel::Kind::direction: {
            const auto direction = [&](size_t i) {
                return unpack_octahedral({static_cast<int8_t>(at[i]), static_cast<int8_t>(at[i + plane])});
            };
            const glm::vec3 sum = direction(a) + direction(b);
            const float length = glm::length(sum);
            const auto packed = pack_octahedral(length > 1e-3f ? sum / length : direction(a));
            // The sign is kept. NOLINTNEXTLINE(bugprone-signed-char-misuse)
            for (size_t k = 0; k < 2; ++k) at[p + k * plane] = static_cast<uint16_t>(packed[k]);
            return;
        }
        default:
            at[p] = static_cast<uint16_t>((uint32_t{at[a]} + at[b] + 1) / 2);
    }
}

}  // namespace

Page sampled_part(const PageTree& tree, std::span<const Channel> channels, const Page& page, uint32_t stride) {
    const size_t side = tree.cells_per_page() / stride + 1;
    Page part;
    part.values.resize(channels.size() * side * side);
    for_sampled(tree.samples_per_side(), channels.size(), stride,
                [&](size_t mine, size_t its) { part.values[mine] = page.values[its]; });
    return part;
}

Page spread_samples(const PageTree& tree, std::span<const Channel> channels, const Page& sampled, uint32_t stride) {
    Page page;
    page.values.resize(channels.size() * tree.samples_per_side() * tree.samples_per_side());
    for_sampled(tree.samples_per_side(), channels.size(), stride,
                [&](size_t its, size_t mine) { page.values[mine] = sampled.values[its]; });
    fill_unsampled(tree, channels, stride, page);
    return page;
}

void fill_unsampled(const PageTree& tree, std::span<const Channel> channels, uint32_t stride, Page& page) {
    const Bintree of_page{static_cast<int32_t>(tree.cells_per_page())};
    const size_t row = tree.samples_per_side(), plane = row * row;
    const auto number = [&](GridPoint p) { return static_cast<size_t>(p.y) * row + static_cast<size_t>(p.x); };
    for (auto depth = 2 * static_cast<uint32_t>(std::countr_zero(stride)); depth-- > 0;) {
        of_page.for_depth(depth, [&](GridPoint p) {
            const auto ends = of_page.hypotenuse(p);
            for (size_t c = 0; c < channels.size(); ++c) {
                put_between(channels[c].kind, page.values.data() + c * plane, number(p), number(ends[0]),
                            number(ends[1]), plane);
                if (channels[c].kind == Channel::Kind::direction) ++c;
            }
        });
    }
}

}  // namespace lodestone::vgi
