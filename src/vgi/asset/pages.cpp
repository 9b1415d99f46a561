#include "vgi/asset/pages.h"

#include <algorithm>
#include <bit>
#include <string>

#include "base/check.h"
#include "base/files/entropy_coder.h"
#include "vgi/asset/page_means.h"
#include "vgi/asset/page_plane.h"

namespace lodestone::vgi {

namespace {

// Calls visit(channel, get, set) for the numbers of a texel in the order of channels_of; get and set take the texel.
template <class Images, class Visit>
void for_channels(Images& a, Layer layer, Visit&& visit) {
    size_t channel = 0;
    // Of arrays of numbers, and of plain numbers.
    const auto each = [&](auto& image, int count) {
        for (int k = 0; k < count; ++k)
            visit(
                channel++, [&image, k ](size_t texel) -> auto& { return image[texel][static_cast<size_t>(k)]; });
    };
    const auto one = [&](auto& image) {
        visit(
            channel++, [&image](size_t texel) -> auto& { return image[texel]; });
    };
    const auto each_colour = [&](auto& image) {
        for (int k = 0; k < 4; ++k)
            visit(
                channel++, [&image, k ](size_t texel) -> auto& { return image[texel][k]; });
    };
    if (layer == Layer::geometry) {
        each(a.positions, 3);
        one(a.sample_errors);
        one(a.sample_radii);
        return;
    }
    each(a.normals, 2);
    if (a.attributes.uvs) each(a.uvs, 2);
    if (a.attributes.colours) each_colour(a.colours);
    if (a.attributes.surfaces) each(a.surfaces, 3);
    if (a.attributes.emissions) each(a.emissions, 3);
    if (a.attributes.materials) one(a.materials);
}

// Calls visit(local index, texel) for every sample of a page.
template <class Visit>
void for_samples(const Atlas& atlas, Layer layer, uint32_t chart, uint32_t page, Visit&& visit) {
    const PageTree tree = tree_of(atlas, layer, chart);
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const uint32_t n = tree.cells_per_page();
    size_t i = 0;
    for (uint32_t y = py * n; y <= py * n + n; ++y) {
        for (uint32_t x = px * n; x <= px * n + n; ++x, ++i) {
            visit(i, layer == Layer::geometry ? atlas.texel(chart, x << level, y << level)
                                              : atlas.attribute_texel(chart, x << level, y << level));
        }
    }
}

size_t coded_samples(const PageTree& tree, const Channel& channel, bool base) {
    const size_t n = tree.samples_per_side(), known = tree.cells_per_page() / 2 + 1;
    return base || channel.averaged ? n * n : n * n - known * known;
}

// Low bytes, then high bytes, of the channels of a group, are one stream; those of samples of which the parents have
// means one by itself.
struct Stream {
    size_t first, channels;
    size_t begin, end;  // of each page's coded samples
    bool high;
};
std::vector<Stream> streams_of(const PageTree& tree, std::span<const Channel> channels, bool base) {
    std::vector<Stream> streams;
    for (size_t c = 0; c < channels.size();) {
        size_t end = c;
        while (end < channels.size() && channels[end].group == channels[c].group) ++end;
        const size_t coded = coded_samples(tree, channels[c], base),
                     fresh = base ? coded : coded_samples(tree, {}, false);  // of which nothing is known
        const size_t centres = size_t{tree.cells_per_page()} * tree.cells_per_page() / 4;
        const bool centres_first = !base && channels[c].kind == Channel::Kind::error;
        if (centres_first) streams.push_back({c, end - c, 0, centres, false});
        streams.push_back({c, end - c, centres_first ? centres : 0, fresh, false});
        if (channels[c].wide) streams.push_back({c, end - c, 0, fresh, true});
        if (coded > fresh) streams.push_back({c, end - c, fresh, coded, false});
        c = end;
    }
    return streams;
}

// Differences fold to small positive numbers; of 8-bit channels they wrap around within 8 bits, of which the lowest
// `shift` become the highest.
uint16_t fold(uint16_t off, bool wide, uint32_t shift) {
    if (wide) return static_cast<uint16_t>((off << 1) ^ (0u - (off >> 15)));
    const auto byte = static_cast<int8_t>(off);
    const auto high = static_cast<uint8_t>(byte >> shift);
    const uint32_t folded = (high << 1) ^ (0u - (high >> 7));
    return static_cast<uint8_t>((folded & 0xffu >> shift) | static_cast<uint32_t>(off) << (8 - shift));
}
uint16_t unfold(uint16_t folded, uint32_t shift) {
    const uint32_t high = shift == 0 ? folded : folded & 0xffu >> shift, low = shift == 0 ? 0 : folded >> (8 - shift);
    return static_cast<uint16_t>(((high >> 1) ^ (0u - (high & 1u))) << shift | low);
}
uint16_t wrapped(uint32_t value, const Channel& channel) {
    if (channel.wide) return static_cast<uint16_t>(value);
    const auto byte = static_cast<uint8_t>(value);
    return channel.is_signed ? static_cast<uint16_t>(static_cast<int8_t>(byte)) : byte;
}

// The parent's samples are every second one of the page.
void copy_from_parent(const PageTree& tree, uint32_t page, size_t channels, const Page& parent, Page& samples) {
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const size_t n = tree.cells_per_page(), row = n + 1, left = (px % 2) * n / 2, top = (py % 2) * n / 2;
    for (size_t c = 0; c < channels; ++c) {
        for (size_t y = 0; y <= n; y += 2) {
            for (size_t x = 0; x <= n; x += 2)
                samples.values[(c * row + y) * row + x] = parent.values[(c * row + top + y / 2) * row + left + x / 2];
        }
    }
}

}  // namespace

uint32_t PageTree::base_level() const {
    return static_cast<uint32_t>(std::bit_width(cells) - std::bit_width(cells_per_page()));
}
uint32_t PageTree::pages() const {
    uint32_t count = 0;
    for (uint32_t level = 0; level <= base_level(); ++level) count += pages_per_side(level) * pages_per_side(level);
    return count;
}
void PageTree::place(uint32_t page, uint32_t* level, uint32_t* x, uint32_t* y) const {
    *level = base_level();
    for (;; --*level) {
        const uint32_t side = pages_per_side(*level);
        if (page < side * side) {
            *x = page % side;
            *y = page / side;
            return;
        }
        page -= side * side;
    }
}
uint32_t PageTree::level(uint32_t page) const {
    uint32_t level = 0, x = 0, y = 0;
    place(page, &level, &x, &y);
    return level;
}
uint32_t PageTree::parent(uint32_t number) const {
    uint32_t level = 0, x = 0, y = 0;
    place(number, &level, &x, &y);
    return page(level + 1, x / 2, y / 2);
}

uint32_t PageTree::member(uint32_t family, uint32_t k) const {
    if (family == 0) return 0;
    uint32_t level = 0, x = 0, y = 0;
    place(family - 1, &level, &x, &y);
    return page(level - 1, 2 * x + k % 2, 2 * y + k / 2);
}

PageTree tree_of(const Atlas& atlas, Layer layer) {
    return {layer == Layer::geometry ? atlas.cells : atlas.attribute_cells};
}
PageTree tree_of(const Atlas& atlas, Layer layer, uint32_t chart) {
    return {layer == Layer::geometry ? atlas.cells_of(chart) : atlas.attribute_cells_of(chart)};
}

std::vector<Channel> channels_of(const AtlasAttributes& attributes, Layer layer) {
    using Kind = Channel::Kind;
    constexpr Channel lattice{0, true, false, Kind::smooth}, error{1, false, false, Kind::error},
        radius{2, false, false, Kind::radius}, normal{0, false, true, Kind::direction, true}, uv{1, true, false},
        colour{2, false, false, Kind::amount, true, true}, alpha{2, false, false, Kind::amount, true},
        surface{4, false, false, Kind::amount, true}, emission{5, false, false, Kind::amount, true, true},
        material{3, true, false, Kind::name};
    if (layer == Layer::geometry) return {lattice, lattice, lattice, error, radius};
    std::vector<Channel> channels{normal, normal};
    if (attributes.uvs) channels.insert(channels.end(), 2, uv);
    if (attributes.colours) channels.insert(channels.end(), {colour, colour, colour, alpha});
    if (attributes.surfaces) channels.insert(channels.end(), 3, surface);
    if (attributes.emissions) channels.insert(channels.end(), 3, emission);
    if (attributes.materials) channels.push_back(material);
    return channels;
}

Page read_page(const Atlas& atlas, Layer layer, uint32_t chart, uint32_t page) {
    const PageTree tree = tree_of(atlas, layer);
    const size_t samples = size_t{tree.samples_per_side()} * tree.samples_per_side();
    Page result;
    result.values.resize(samples * channels_of(atlas.attributes, layer).size());
    for_channels(atlas, layer, [&](size_t channel, const auto& at) {
        for_samples(atlas, layer, chart, page, [&](size_t i, size_t texel) {
            // The sign is kept. NOLINTNEXTLINE(bugprone-signed-char-misuse)
            result.values[channel * samples + i] = static_cast<uint16_t>(at(texel));
        });
    });
    return result;
}

void write_page(Atlas& atlas, Layer layer, uint32_t chart, uint32_t page, const Page& samples) {
    const PageTree tree = tree_of(atlas, layer);
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side();
    for_channels(atlas, layer, [&](size_t channel, const auto& at) {
        for_samples(atlas, layer, chart, page, [&](size_t i, size_t texel) {
            auto& value = at(texel);
            value = static_cast<std::remove_reference_t<decltype(value)>>(samples.values[channel * count + i]);
        });
    });
}

std::vector<Page> read_pages(const Atlas& atlas, Layer layer, uint32_t chart) {
    const PageTree tree = tree_of(atlas, layer, chart);
    std::vector<Page> pages(tree.pages());
    for (uint32_t p = tree.page(0, 0, 0); p < tree.pages(); ++p) pages[p] = read_page(atlas, layer, chart, p);
    make_parents(tree, channels_of(atlas.attributes, layer), pages);
    return pages;
}

std::vector<std::byte> encode_family(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                     std::span<const Page> pages) {
    LODE_CHECK(pages.size() == tree.pages(), pages.size());
    const auto n = static_cast<int32_t>(tree.cells_per_page());
    const uint32_t members = PageTree::members(family), level = tree.level(tree.member(family, 0));
    // Channel after channel, member after member.
    std::vector<std::vector<uint16_t>> folded(channels.size());
    for (uint32_t k = 0; k < members; ++k) {
        const uint32_t number = tree.member(family, k);
        const std::vector<uint16_t>& values = pages[number].values;
        Page known = pages[number];
        if (family > 0) copy_from_parent(tree, number, channels.size(), pages[tree.parent(number)], known);
        for (size_t c = 0; c < channels.size(); ++c) {
            const Plane plane{known.values.data(), static_cast<uint32_t>(c), n, level, channels[c]};
            const uint32_t shift = family == 0 ? 0 : plane.shift();
            plane.for_order(family == 0, [&](int32_t x, int32_t y, uint16_t expected) {
                const auto off = static_cast<uint16_t>(values[plane.index(x, y)] - expected);
                folded[c].push_back(fold(off, channels[c].wide, shift));
            });
        }
    }
    std::vector<std::byte> packed;
    std::vector<uint8_t> numbers;
    for (const Stream& stream : streams_of(tree, channels, family == 0)) {
        numbers.clear();
        for (size_t c = stream.first; c < stream.first + stream.channels; ++c) {
            const size_t coded = coded_samples(tree, channels[c], family == 0);
            LODE_CHECK(folded[c].size() == members * coded, folded[c].size());
            for (size_t k = 0; k < members; ++k) {
                for (size_t i = k * coded + stream.begin; i < k * coded + stream.end; ++i)
                    numbers.push_back(static_cast<uint8_t>(stream.high ? folded[c][i] >> 8 : folded[c][i]));
            }
        }
        encode_numbers(numbers, packed);
    }
    return packed;
}

Result<PageFamily> PageFamily::unpack(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                      std::span<const std::byte> bytes) {
    const auto broken = [&]() {
        return fail(Fault::format,
                    "family " + std::to_string(family) + " of pages cannot be unpacked; bake the asset again");
    };
    const size_t members = PageTree::members(family);
    PageFamily unpacked(tree, channels, family);
    for (const Channel& channel : channels)
        unpacked.folded_.emplace_back(members * coded_samples(tree, channel, family == 0), uint16_t{0});
    std::vector<uint8_t> numbers;
    for (const Stream& stream : streams_of(tree, channels, family == 0)) {
        numbers.resize(stream.channels * members * (stream.end - stream.begin));
        const auto rest = decode_numbers(bytes, numbers);
        if (!rest) return broken();
        bytes = *rest;
        const uint8_t* next = numbers.data();
        for (size_t c = stream.first; c < stream.first + stream.channels; ++c) {
            std::vector<uint16_t>& folded = unpacked.folded_[c];
            const size_t coded = folded.size() / members;
            for (size_t k = 0; k < members; ++k) {
                for (size_t i = k * coded + stream.begin; i < k * coded + stream.end; ++i)
                    folded[i] |= static_cast<uint16_t>(*next++ << (stream.high ? 8 : 0));
            }
        }
    }
    if (!bytes.empty()) return broken();
    return unpacked;
}

Page PageFamily::page(uint32_t number, const Page* parent) const {
    LODE_CHECK(tree_.family(number) == family_ && (number == 0) == (parent == nullptr), number);
    const auto n = static_cast<int32_t>(tree_.cells_per_page());
    const size_t plane_size = size_t{tree_.samples_per_side()} * tree_.samples_per_side();
    size_t k = 0;
    while (tree_.member(family_, static_cast<uint32_t>(k)) != number) ++k;
    Page samples;
    samples.values.resize(channels_.size() * plane_size);
    if (parent != nullptr) copy_from_parent(tree_, number, channels_.size(), *parent, samples);
    for (size_t c = 0; c < channels_.size(); ++c) {
        const Plane plane{samples.values.data(), static_cast<uint32_t>(c), n, tree_.level(number), channels_[c]};
        const uint32_t shift = number == 0 ? 0 : plane.shift();
        const uint16_t* next = folded_[c].data() + k * folded_[c].size() / PageTree::members(family_);
        plane.for_order(number == 0, [&](int32_t x, int32_t y, uint16_t expected) {
            samples.values[plane.index(x, y)] = wrapped(uint32_t{expected} + unfold(*next++, shift), channels_[c]);
        });
    }
    return samples;
}

}  // namespace lodestone::vgi
