#include "vgi/pages.h"

#include <zstd.h>

#include <array>
#include <bit>
#include <string>

#include "base/check.h"

namespace lodestone::vgi {

namespace {

constexpr int compression = 12;

// All 16-bit or 8-bit numbers of a texel in a row, positions first.
struct Channels {
    explicit Channels(const Atlas& atlas)
        : uvs(!atlas.uvs.empty()), colours(!atlas.colours.empty()), materials(!atlas.materials.empty()) {}
    bool uvs, colours, materials;
    size_t count() const { return 5 + (uvs ? 2 : 0) + (colours ? 4 : 0) + (materials ? 1 : 0); }
    // Materials are names, not amounts: the mean of two is neither.
    bool is_name(size_t channel) const { return materials && channel + 1 == count(); }

    uint16_t get(const Atlas& a, size_t texel, size_t channel) const {
        if (channel < 3) return a.positions[texel][channel];
        if (channel < 5) return static_cast<uint16_t>(a.normals[texel][channel - 3]);  // sign kept
        channel -= 5;
        if (uvs) {
            if (channel < 2) return a.uvs[texel][channel];
            channel -= 2;
        }
        if (colours) {
            if (channel < 4) return a.colours[texel][static_cast<int>(channel)];
            channel -= 4;
        }
        return a.materials[texel];
    }
    void set(Atlas& a, size_t texel, size_t channel, uint16_t value) const {
        if (channel < 3) {
            a.positions[texel][channel] = value;
            return;
        }
        if (channel < 5) {
            a.normals[texel][channel - 3] = static_cast<int8_t>(static_cast<uint8_t>(value));
            return;
        }
        channel -= 5;
        if (uvs) {
            if (channel < 2) {
                a.uvs[texel][channel] = value;
                return;
            }
            channel -= 2;
        }
        if (colours) {
            if (channel < 4) {
                a.colours[texel][static_cast<int>(channel)] = static_cast<uint8_t>(value);
                return;
            }
            channel -= 4;
        }
        a.materials[texel] = value;
    }
};

// Visits the samples of a page that its parent does not have, with the texels that predict each.
template <class Visit>
void for_samples(const Atlas& atlas, uint32_t chart, uint32_t page, Visit&& visit) {
    const PageTree tree{atlas.cells};
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const uint32_t n = tree.cells_per_page(), stride = 1u << level;
    const bool base = level == tree.base_level();
    const uint32_t x0 = px * n, y0 = py * n;
    std::array<size_t, 4> from{};
    const auto at = [&](uint32_t x, uint32_t y) { return atlas.texel(chart, x * stride, y * stride); };
    for (uint32_t y = y0; y <= y0 + n; ++y) {
        for (uint32_t x = x0; x <= x0 + n; ++x) {
            size_t count = 0;
            if (base) {
                if (x > x0) from[count++] = at(x - 1, y);
                if (y > y0) from[count++] = at(x, y - 1);
                if (count == 2) from[count++] = at(x - 1, y - 1);  // left + above - above left
            } else {
                const uint32_t l = x - x % 2, r = x + x % 2, t = y - y % 2, b = y + y % 2;
                if (l == r && t == b) continue;  // the parent has it
                from[count++] = at(l, t);
                if (l != r) from[count++] = at(r, t);
                if (t != b) from[count++] = at(l, b);
                if (l != r && t != b) from[count++] = at(r, b);
            }
            visit(at(x, y), std::span<const size_t>(from.data(), count), base);
        }
    }
}

uint16_t predict(const Atlas& atlas, const Channels& channels, size_t channel, std::span<const size_t> from,
                 bool base) {
    if (from.empty()) return 0;
    if (channels.is_name(channel)) return channels.get(atlas, from[0], channel);
    // Normals are signed.
    const auto value = [&](size_t i) -> int32_t {
        const uint16_t v = channels.get(atlas, from[i], channel);
        return channel == 3 || channel == 4 ? static_cast<int16_t>(v) : v;
    };
    if (base) return static_cast<uint16_t>(from.size() == 3 ? value(0) + value(1) - value(2) : value(0));
    int32_t sum = 0;
    for (size_t i = 0; i < from.size(); ++i) sum += value(i);
    const auto count = static_cast<int32_t>(from.size());
    return static_cast<uint16_t>((sum + (sum >= 0 ? count / 2 : -(count / 2))) / count);
}

uint32_t samples_of(const Atlas& atlas, uint32_t page) {
    const PageTree tree{atlas.cells};
    const uint32_t n = tree.cells_per_page() + 1, kept = tree.cells_per_page() / 2 + 1;
    return page == 0 ? n * n : n * n - kept * kept;
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
uint32_t PageTree::page(uint32_t level, uint32_t x, uint32_t y) const {
    uint32_t first = 0;
    for (uint32_t l = base_level(); l > level; --l) first += pages_per_side(l) * pages_per_side(l);
    return first + y * pages_per_side(level) + x;
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

std::vector<std::byte> encode_page(const Atlas& atlas, uint32_t chart, uint32_t page) {
    const Channels channels(atlas);
    const size_t samples = samples_of(atlas, page), count = channels.count();
    // Low bytes, then high bytes, of one channel after the other.
    std::vector<uint8_t> plain(samples * count * 2);
    size_t i = 0;
    for_samples(atlas, chart, page, [&](size_t texel, std::span<const size_t> from, bool base) {
        for (size_t c = 0; c < count; ++c) {
            const auto off =
                static_cast<uint16_t>(channels.get(atlas, texel, c) - predict(atlas, channels, c, from, base));
            const auto zigzag = static_cast<uint16_t>((off << 1) ^ (0u - (off >> 15)));
            plain[c * 2 * samples + i] = static_cast<uint8_t>(zigzag);
            plain[(c * 2 + 1) * samples + i] = static_cast<uint8_t>(zigzag >> 8);
        }
        ++i;
    });
    LODE_CHECK(i == samples, i, samples);
    std::vector<std::byte> packed(ZSTD_compressBound(plain.size()));
    const size_t size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), compression);
    LODE_CHECK(!ZSTD_isError(size), page);
    packed.resize(size);
    return packed;
}

Result<void> decode_page(Atlas& atlas, uint32_t chart, uint32_t page, std::span<const std::byte> bytes) {
    const Channels channels(atlas);
    const size_t samples = samples_of(atlas, page), count = channels.count();
    std::vector<uint8_t> plain(samples * count * 2);
    const size_t size = ZSTD_decompress(plain.data(), plain.size(), bytes.data(), bytes.size());
    if (ZSTD_isError(size) || size != plain.size()) {
        return fail(Fault::format, "page " + std::to_string(page) + " of chart " + std::to_string(chart) +
                                       " cannot be unpacked; bake the asset again");
    }
    size_t i = 0;
    for_samples(atlas, chart, page, [&](size_t texel, std::span<const size_t> from, bool base) {
        for (size_t c = 0; c < count; ++c) {
            const auto zigzag =
                static_cast<uint16_t>(plain[c * 2 * samples + i] | plain[(c * 2 + 1) * samples + i] << 8);
            const auto off = static_cast<uint16_t>((zigzag >> 1) ^ (0u - (zigzag & 1u)));
            channels.set(atlas, texel, c, static_cast<uint16_t>(predict(atlas, channels, c, from, base) + off));
        }
        ++i;
    });
    return {};
}

}  // namespace lodestone::vgi
