#include "vgi/pages.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <string>

#include "base/check.h"
#include "vgi/bintree.h"

namespace lodestone::vgi {

namespace {

// Residuals repeat little but for runs of zeros: what counts is how they are divided into blocks and their code
// lengths, not searching for matches. Level 12 as it comes takes 1.7 times as long for half a percent more bytes.
constexpr std::array<std::pair<ZSTD_cParameter, int>, 5> compression{{{ZSTD_c_compressionLevel, 12},
                                                                      {ZSTD_c_strategy, ZSTD_btultra},
                                                                      {ZSTD_c_minMatch, 7},
                                                                      {ZSTD_c_searchLog, 1},
                                                                      {ZSTD_c_contentSizeFlag, 0}}};
// What every zstd frame begins with (RFC 8878, 3.1.1); pages leave it out, streams being small.
constexpr std::array<std::byte, 4> magic{std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};

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

// One channel of a page while it is coded: samples are known one after the other, in the order of `for_order`.
struct Plane {
    const uint16_t* page;  // its first channel; those before this one are known
    uint32_t number;       // of the channel
    int32_t n;             // cells
    Channel channel;

    size_t size() const { return static_cast<size_t>(n + 1) * static_cast<size_t>(n + 1); }
    size_t index(int32_t x, int32_t y) const { return number * size() + static_cast<size_t>(y * (n + 1) + x); }

    int32_t at(int32_t x, int32_t y) const {
        const uint16_t v = page[index(x, y)];
        return channel.is_signed ? static_cast<int16_t>(v) : v;
    }
    static int32_t rounded(int32_t sum, int32_t count) {
        return sum >= 0 ? (sum + count / 2) / count : -((-sum + count / 2) / count);
    }
    // Halfway between b and c on a line of evenly spaced samples a, b, c, d, by the cubic through all four.
    static int32_t cubic(int32_t a, int32_t b, int32_t c, int32_t d) { return rounded(9 * (b + c) - a - d, 16); }
    uint16_t predict_base(int32_t x, int32_t y) const {
        if (x == 0 && y == 0) return 0;
        if (channel.kind == Channel::Kind::name || x == 0 || y == 0)
            return static_cast<uint16_t>(x > 0 ? at(x - 1, y) : at(x, y - 1));
        return static_cast<uint16_t>(at(x - 1, y) + at(x, y - 1) - at(x - 1, y - 1));
    }
    uint16_t predict(int32_t x, int32_t y) const {
        if (channel.kind == Channel::Kind::name) return static_cast<uint16_t>(at(x & ~1, y & ~1));
        if (channel.kind == Channel::Kind::bound) {
            int32_t least = 255;
            Bintree{n}.for_parents({x, y}, [&](GridPoint p) { least = std::min(least, at(p.x, p.y)); });
            return static_cast<uint16_t>(least);
        }
        if (channel.kind == Channel::Kind::radius) return radius_around({x, y});
        if ((y & 1) == 0) {
            if (x < 3 || x + 3 > n) return static_cast<uint16_t>(rounded(at(x - 1, y) + at(x + 1, y), 2));
            return static_cast<uint16_t>(cubic(at(x - 3, y), at(x - 1, y), at(x + 1, y), at(x + 3, y)));
        }
        if ((x & 1) == 0) {
            if (y < 3 || y + 3 > n) return static_cast<uint16_t>(rounded(at(x, y - 1) + at(x, y + 1), 2));
            return static_cast<uint16_t>(cubic(at(x, y - 3), at(x, y - 1), at(x, y + 1), at(x, y + 3)));
        }
        const int32_t edges = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
        if (channel.kind != Channel::Kind::smooth) return static_cast<uint16_t>(rounded(edges, 4));
        const int32_t corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
        return static_cast<uint16_t>(rounded(3 * edges - corners, 8));
    }
    // Code of the distance to the farthest corner of the triangles that p splits, as ErrorCodes::of_radius has it, in
    // integers: half octaves of a length are octaves of its square, and code 255 is that of 3 * 2^40 lattice steps,
    // squared.
    uint16_t radius_around(GridPoint p) const {
        const size_t here = static_cast<size_t>(p.y * (n + 1) + p.x);
        if (page[3 * size() + here] == 0) return 0;  // an error of 0 is never wanted
        uint64_t largest = 1;
        const auto reach = [&](GridPoint q) {
            uint64_t squared = 0;
            for (size_t k = 0; k < 3; ++k) {
                const int64_t off =
                    int64_t{page[k * size() + static_cast<size_t>(q.y * (n + 1) + q.x)]} - page[k * size() + here];
                squared += static_cast<uint64_t>(off * off);
            }
            largest = std::max(largest, squared);
        };
        const Bintree tree{n};
        for (const GridPoint end : tree.hypotenuse(p)) reach(end);
        tree.for_parents(p, reach);
        const auto octave = static_cast<uint32_t>(std::bit_width(largest)) - 1;
        return static_cast<uint16_t>(214 + octave + (2 * largest > uint64_t{3} << octave ? 1 : 0));
    }
    // Samples that are coded: all of a base page; otherwise middles of edges and centres, whichever tell more of the
    // others first.
    template <class Visit>
    void for_order(bool base, Visit&& visit) const {
        if (base) {
            for (int32_t y = 0; y <= n; ++y) {
                for (int32_t x = 0; x <= n; ++x) visit(x, y, predict_base(x, y));
            }
            return;
        }
        const auto centres = [&] {
            for (int32_t y = 1; y <= n; y += 2) {
                for (int32_t x = 1; x <= n; x += 2) visit(x, y, predict(x, y));
            }
        };
        if (channel.kind == Channel::Kind::bound) centres();
        for (int32_t y = 0; y <= n; y += 2) {
            for (int32_t x = 1; x <= n; x += 2) visit(x, y, predict(x, y));
        }
        for (int32_t y = 1; y <= n; y += 2) {
            for (int32_t x = 0; x <= n; x += 2) visit(x, y, predict(x, y));
        }
        if (channel.kind != Channel::Kind::bound) centres();
    }
};

size_t coded_samples(const PageTree& tree, bool base) {
    const size_t n = tree.samples_per_side(), kept = tree.cells_per_page() / 2 + 1;
    return base ? n * n : n * n - kept * kept;
}

// Low bytes, then high bytes, of the channels of a group, are one stream.
struct Stream {
    uint8_t group;
    bool high;
    size_t channels;
};
std::vector<Stream> streams_of(std::span<const Channel> channels) {
    std::vector<Stream> streams;
    for (size_t c = 0; c < channels.size();) {
        size_t end = c;
        while (end < channels.size() && channels[end].group == channels[c].group) ++end;
        streams.push_back({channels[c].group, false, end - c});
        if (channels[c].wide) streams.push_back({channels[c].group, true, end - c});
        c = end;
    }
    return streams;
}

// Differences fold to small positive numbers; of 8-bit channels they wrap around within 8 bits.
uint16_t fold(uint16_t off, bool wide) {
    if (wide) return static_cast<uint16_t>((off << 1) ^ (0u - (off >> 15)));
    const auto byte = static_cast<uint8_t>(off);
    return static_cast<uint8_t>((byte << 1) ^ (0u - (byte >> 7)));
}
uint16_t unfold(uint16_t folded) { return static_cast<uint16_t>((folded >> 1) ^ (0u - (folded & 1u))); }
uint16_t wrapped(uint32_t value, const Channel& channel) {
    if (channel.wide) return static_cast<uint16_t>(value);
    const auto byte = static_cast<uint8_t>(value);
    return channel.is_signed ? static_cast<uint16_t>(static_cast<int8_t>(byte)) : byte;
}

struct FreeContext {
    void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
    void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); }
};

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

std::vector<Channel> channels_of(const PresentAttributes& attributes, Layer layer) {
    using Kind = Channel::Kind;
    constexpr Channel lattice{0, true, false, Kind::smooth}, error{1, false, false, Kind::bound},
        radius{2, false, false, Kind::radius}, normal{0, false, true, Kind::smooth}, uv{1, true, false},
        colour{2, false, false}, material{3, true, false, Kind::name};
    if (layer == Layer::geometry) return {lattice, lattice, lattice, error, radius};
    std::vector<Channel> channels{normal, normal};
    if (attributes.uvs) channels.insert(channels.end(), 2, uv);
    if (attributes.colours) channels.insert(channels.end(), 4, colour);
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
            result.values[channel * samples + i] = static_cast<uint16_t>(at(texel));  // sign kept
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

std::vector<std::byte> encode_family(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                     std::span<const Page> pages) {
    LODE_CHECK(pages.size() == tree.pages(), pages.size());
    const auto n = static_cast<int32_t>(tree.cells_per_page());
    const size_t coded = coded_samples(tree, family == 0), members = PageTree::members(family);
    std::vector<std::byte> packed;
    static thread_local std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
    // How much there is is known to whoever unpacks: no size is stored.
    for (const auto& [parameter, value] : compression) ZSTD_CCtx_setParameter(context.get(), parameter, value);
    size_t first = 0;
    std::vector<uint8_t> plain;
    std::vector<std::byte> frame;
    for (const Stream& stream : streams_of(channels)) {
        while (channels[first].group != stream.group) ++first;
        plain.clear();
        bool zero = true;
        for (size_t c = first; c < first + stream.channels; ++c) {
            for (uint32_t k = 0; k < members; ++k) {
                const uint16_t* values = pages[tree.member(family, k)].values.data();
                const Plane plane{values, static_cast<uint32_t>(c), n, channels[c]};
                plane.for_order(family == 0, [&](int32_t x, int32_t y, uint16_t expected) {
                    const uint16_t folded =
                        fold(static_cast<uint16_t>(values[plane.index(x, y)] - expected), channels[c].wide);
                    plain.push_back(static_cast<uint8_t>(stream.high ? folded >> 8 : folded));
                    zero = zero && plain.back() == 0;
                });
            }
        }
        LODE_CHECK(plain.size() == coded * members * stream.channels, plain.size());
        // Two bytes of size, 0 for nothing but zeros.
        size_t size = 0;
        if (!zero) {
            frame.resize(ZSTD_compressBound(plain.size()));
            size = ZSTD_compress2(context.get(), frame.data(), frame.size(), plain.data(), plain.size());
            LODE_CHECK(!ZSTD_isError(size) && size < 65536 && size > magic.size() &&
                           std::equal(magic.begin(), magic.end(), frame.begin()),
                       family);
            size -= magic.size();
        }
        packed.push_back(static_cast<std::byte>(size));
        packed.push_back(static_cast<std::byte>(size >> 8));
        if (size > 0)
            packed.insert(packed.end(), frame.begin() + magic.size(),
                          frame.begin() + static_cast<ptrdiff_t>(magic.size() + size));
    }
    return packed;
}

Result<PageFamily> PageFamily::unpack(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                      std::span<const std::byte> bytes) {
    const auto broken = [&]() {
        return fail(Fault::format,
                    "family " + std::to_string(family) + " of pages cannot be unpacked; bake the asset again");
    };
    const size_t coded = coded_samples(tree, family == 0) * PageTree::members(family);
    static thread_local std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
    PageFamily unpacked(tree, channels, family);
    unpacked.folded_.assign(channels.size() * coded, 0);
    std::vector<uint8_t> plain;
    std::vector<std::byte> frame;
    size_t first = 0, at = 0;
    for (const Stream& stream : streams_of(channels)) {
        while (channels[first].group != stream.group) ++first;
        if (at + 2 > bytes.size()) return broken();
        const size_t size = std::to_integer<size_t>(bytes[at]) | std::to_integer<size_t>(bytes[at + 1]) << 8;
        at += 2;
        if (at + size > bytes.size()) return broken();
        if (size == 0) continue;
        plain.resize(coded * stream.channels);
        frame.assign(magic.begin(), magic.end());
        frame.insert(frame.end(), bytes.begin() + static_cast<ptrdiff_t>(at),
                     bytes.begin() + static_cast<ptrdiff_t>(at + size));
        const size_t got = ZSTD_decompressDCtx(context.get(), plain.data(), plain.size(), frame.data(), frame.size());
        if (ZSTD_isError(got) || got != plain.size()) return broken();
        at += size;
        for (size_t i = 0; i < plain.size(); ++i)
            unpacked.folded_[first * coded + i] |= static_cast<uint16_t>(plain[i] << (stream.high ? 8 : 0));
    }
    if (at != bytes.size()) return broken();
    return unpacked;
}

Page PageFamily::page(uint32_t number, const Page* parent) const {
    LODE_CHECK(tree_.family(number) == family_ && (number == 0) == (parent == nullptr), number);
    const auto n = static_cast<int32_t>(tree_.cells_per_page());
    const size_t plane_size = size_t{tree_.samples_per_side()} * tree_.samples_per_side(),
                 coded = coded_samples(tree_, family_ == 0), members = PageTree::members(family_);
    size_t k = 0;
    while (tree_.member(family_, static_cast<uint32_t>(k)) != number) ++k;
    Page samples;
    samples.values.resize(channels_.size() * plane_size);
    if (parent != nullptr) copy_from_parent(tree_, number, channels_.size(), *parent, samples);
    for (size_t c = 0; c < channels_.size(); ++c) {
        const Plane plane{samples.values.data(), static_cast<uint32_t>(c), n, channels_[c]};
        const uint16_t* next = folded_.data() + (c * members + k) * coded;
        plane.for_order(number == 0, [&](int32_t x, int32_t y, uint16_t expected) {
            samples.values[plane.index(x, y)] = wrapped(uint32_t{expected} + unfold(*next++), channels_[c]);
        });
    }
    return samples;
}

}  // namespace lodestone::vgi
