#include "vgi/asset/codec/page_family.h"

#include <string>

#include "base/check.h"
#include "base/files/entropy_coder.h"
#include "vgi/asset/codec/page_plane.h"
#include "vgi/asset/codec/unsampled_pages.h"

namespace lodestone::vgi {

namespace {

size_t coded_samples(const PageTree& tree, const Channel& channel, bool base) {
    const size_t n = tree.samples_per_side(), known = tree.cells_per_page() / 2 + 1;
    return base || channel.averaged ? n * n : n * n - known * known;
}

// Low bytes, then high bytes, of the channels of a group without loss, are one stream; those of samples of which the
// parents have means one by itself.
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
        if (channels[c].step > 0) {
            c = end;
            continue;
        }
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

// folded: per channel, member after member.
std::vector<std::byte> packed_streams(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                      const std::vector<std::vector<uint16_t>>& folded) {
    const uint32_t members = PageTree::members(family);
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

}  // namespace

std::vector<std::byte> encode_family(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                     std::span<Page> pages) {
    LODE_CHECK(pages.size() == tree.pages(), pages.size());
    if (!tree.has_samples(family)) return {};
    if (const uint32_t stride = tree.base_stride(); family == 0 && stride > 1) {
        Page part = sampled_part(tree, channels, pages[0], stride);
        auto packed = encode_family(tree.sampled_base(), channels, 0, std::span(&part, 1));
        pages[0] = spread_samples(tree, channels, part, stride);
        return packed;
    }
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
            if (channels[c].step > 0) continue;
            const Plane plane{known.values.data(), static_cast<uint32_t>(c), n, level, channels[c]};
            const uint32_t shift = family == 0 ? 0 : plane.shift();
            plane.for_order(family == 0, [&](int32_t x, int32_t y, uint16_t expected) {
                const auto off = static_cast<uint16_t>(values[plane.index(x, y)] - expected);
                folded[c].push_back(fold(off, channels[c].wide, shift));
            });
        }
    }
    std::vector<std::byte> packed = packed_streams(tree, channels, family, folded);
    LossyFamily lossy(tree, channels, family);
    if (lossy.empty()) return packed;
    const Page* parent = family == 0 ? nullptr : &pages[family - 1];
    lossy.take(pages, parent);
    lossy.encode(packed);
    for (uint32_t k = 0; k < members; ++k) lossy.put(k, parent, pages[tree.member(family, k)]);
    return packed;
}

Result<PageFamily> PageFamily::unpack(const PageTree& tree, std::span<const Channel> channels, uint32_t family,
                                      std::span<const std::byte> bytes) {
    const auto broken = [&]() {
        return fail(Fault::format,
                    "family " + std::to_string(family) + " of pages cannot be unpacked; bake the asset again");
    };
    if (!tree.has_samples(family)) {
        if (!bytes.empty()) return broken();
        return PageFamily(tree, channels, family);
    }
    if (family == 0 && tree.base_stride() > 1) {
        auto base = unpack(tree.sampled_base(), channels, 0, bytes);
        if (!base) return broken();
        base->whole_ = tree;
        return base;
    }
    const size_t members = PageTree::members(family);
    PageFamily unpacked(tree, channels, family);
    for (const Channel& channel : channels) {
        const size_t coded = channel.step > 0 ? 0 : coded_samples(tree, channel, family == 0);
        unpacked.folded_.emplace_back(members * coded, uint16_t{0});
    }
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
    if (unpacked.lossy_.empty() ? !bytes.empty() : !unpacked.lossy_.decode(bytes)) return broken();
    return unpacked;
}

Page PageFamily::page(uint32_t number, const Page* parent) const {
    LODE_CHECK(tree_.family(number) == family_ && (number == 0) == (parent == nullptr), number);
    if (!tree_.has_samples(family_)) {
        Page between;
        between.values.resize(channels_.size() * tree_.samples_per_side() * tree_.samples_per_side());
        copy_from_parent(tree_, number, channels_.size(), *parent, between);
        fill_unsampled(tree_, channels_, 2, between);
        return between;
    }
    if (whole_) return spread_samples(*whole_, channels_, sampled_page(number, parent), whole_->base_stride());
    return sampled_page(number, parent);
}

Page PageFamily::sampled_page(uint32_t number, const Page* parent) const {
    const auto n = static_cast<int32_t>(tree_.cells_per_page());
    const size_t plane_size = size_t{tree_.samples_per_side()} * tree_.samples_per_side();
    size_t k = 0;
    while (tree_.member(family_, static_cast<uint32_t>(k)) != number) ++k;
    Page samples;
    samples.values.resize(channels_.size() * plane_size);
    if (parent != nullptr) copy_from_parent(tree_, number, channels_.size(), *parent, samples);
    if (!lossy_.empty()) lossy_.put(static_cast<uint32_t>(k), parent, samples);
    for (size_t c = 0; c < channels_.size(); ++c) {
        if (channels_[c].step > 0) continue;
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
