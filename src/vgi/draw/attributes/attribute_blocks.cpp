#include "vgi/draw/attributes/attribute_blocks.h"

#include <stb_dxt.h>

#include <algorithm>
#include <array>
#include <functional>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t samples_of_block = 16;
using Bytes16 = std::array<uint8_t, samples_of_block>;

// Words of one kind in a block, or of the samples of a block.
using Samples = std::array<const uint32_t*, samples_of_block>;

// Around which axis normals are octahedral: x, y, z, -x, -y, -z.
constexpr uint32_t axis_z = 2, axes = 6;

// What looks along +z in place of the axis; without mirrors.
glm::vec3 from_axis(uint32_t axis, const glm::vec3& turned) {
    const int k = static_cast<int>(axis % 3);
    glm::vec3 n;
    n[(k + 1) % 3] = turned.x;
    n[(k + 2) % 3] = axis < 3 ? turned.y : -turned.y;
    n[k] = axis < 3 ? turned.z : -turned.z;
    return n;
}
glm::vec3 to_axis(uint32_t axis, const glm::vec3& n) {
    const int k = static_cast<int>(axis % 3);
    const float sign = axis < 3 ? 1.0f : -1.0f;
    return {n[(k + 1) % 3], sign * n[(k + 2) % 3], sign * n[k]};
}

// The two words of a block of single numbers.
struct NumberBlock {
    uint32_t low, high;
    // Rounded down, as stb_dxt expects: what differs by less than eight comes back as it was.
    uint32_t byte(uint32_t number) const {
        const uint64_t both = uint64_t{high} << 32 | low;
        const auto code = static_cast<uint32_t>(both >> (16 + 3 * number) & 7);
        const uint32_t first = low & 255, last = low >> 8 & 255;
        if (code < 2) return code == 0 ? first : last;
        return ((8 - code) * first + (code - 1) * last) / 7;
    }
};

uint32_t word_of(const uint8_t* bytes) {
    return uint32_t{bytes[0]} | uint32_t{bytes[1]} << 8 | uint32_t{bytes[2]} << 16 | uint32_t{bytes[3]} << 24;
}

NumberBlock number_block(const Bytes16& numbers) {
    std::array<uint8_t, 8> block{};
    stb_compress_bc4_block(block.data(), numbers.data());
    return {word_of(block.data()), word_of(&block[4])};
}

std::array<uint32_t, 2> colour_block(const Samples& samples, uint32_t word) {
    std::array<uint8_t, 4 * samples_of_block> rgba{};
    for (uint32_t i = 0; i < samples_of_block; ++i) {
        for (uint32_t k = 0; k < 3; ++k) rgba[4 * i + k] = static_cast<uint8_t>(samples[i][word] >> (8 * k));
        rgba[4 * i + 3] = 255;
    }
    std::array<uint8_t, 8> block{};
    stb_compress_dxt_block(block.data(), rgba.data(), 0, STB_DXT_HIGHQUAL);
    return {word_of(block.data()), word_of(&block[4])};
}

// Red, green and blue, a byte each.
uint32_t colour_of(uint32_t ends, uint32_t codes, uint32_t number) {
    const uint32_t code = codes >> (2 * number) & 3;
    uint32_t colour = 0;
    for (uint32_t k = 0; k < 3; ++k) {
        const auto end = [&](uint32_t packed) {
            if (k == 1) return (packed >> 5 & 63) << 2 | (packed >> 9 & 3);
            const uint32_t five = k == 0 ? packed >> 11 & 31 : packed & 31;
            return five << 3 | five >> 2;
        };
        const uint32_t first = end(ends & 0xffff), last = end(ends >> 16);
        const uint32_t value = code == 0   ? first
                               : code == 1 ? last
                               : code == 2 ? (2 * first + last + 1) / 3
                                           : (first + 2 * last + 1) / 3;
        colour |= value << (8 * k);
    }
    return colour;
}

// The four that most samples have.
std::array<uint32_t, 3> material_block(const Samples& samples) {
    constexpr size_t most = 4;
    std::vector<std::pair<uint32_t, uint32_t>> found;  // how many samples have it; the material
    for (const uint32_t* sample : samples) {
        const auto at = std::ranges::find(found, *sample >> 16, &std::pair<uint32_t, uint32_t>::second);
        if (at == found.end()) {
            found.emplace_back(1, *sample >> 16);
        } else {
            ++at->first;
        }
    }
    std::ranges::stable_sort(found, std::greater(), &std::pair<uint32_t, uint32_t>::first);
    found.resize(std::min(found.size(), most));
    std::array<uint32_t, 3> block{};
    for (size_t k = 0; k < found.size(); ++k) block[k / 2] |= found[k].second << (16 * (k % 2));
    for (uint32_t i = 0; i < samples_of_block; ++i) {
        const auto at = std::ranges::find(found, *samples[i] >> 16, &std::pair<uint32_t, uint32_t>::second);
        if (at != found.end()) block[2] |= static_cast<uint32_t>(at - found.begin()) << (2 * i);
    }
    return block;
}
uint32_t material_of(std::span<const uint32_t> block, uint32_t number) {
    const uint32_t code = block[2] >> (2 * number) & 3;
    return block[code / 2] >> (16 * (code % 2)) & 0xffff;
}

struct NormalBlocks {
    NumberBlock u, v;
    uint32_t axis;
    glm::vec3 normal(uint32_t number) const {
        const auto coordinate = [&](const NumberBlock& of) {
            return static_cast<int8_t>(static_cast<int32_t>(of.byte(number)) - 128);
        };
        return from_axis(axis, unpack_octahedral({coordinate(u), coordinate(v)}));
    }
};

// The one whose worst normal is off least; z where it is off by little more than what numbers are rounded to anyway.
NormalBlocks normal_blocks(const Samples& samples) {
    constexpr float small = 0.9998f;  // cosine of 1.1 degrees
    NormalBlocks best{};
    float best_cosine = -2;
    for (uint32_t step = 0; step < axes && best_cosine < small; ++step) {
        const uint32_t axis = (axis_z + step) % axes;
        Bytes16 u{}, v{};
        for (uint32_t i = 0; i < samples_of_block; ++i) {
            const auto at = axis == axis_z ? std::array{static_cast<int8_t>(*samples[i] & 255),
                                                        static_cast<int8_t>(*samples[i] >> 8 & 255)}
                                           : pack_octahedral(to_axis(axis, packed_normal(*samples[i])));
            u[i] = static_cast<uint8_t>(at[0] + 128);
            v[i] = static_cast<uint8_t>(at[1] + 128);
        }
        const NormalBlocks blocks{number_block(u), number_block(v), axis};
        float cosine = 1;
        for (uint32_t i = 0; i < samples_of_block; ++i)
            cosine = std::min(cosine, glm::dot(blocks.normal(i), packed_normal(*samples[i])));
        if (cosine <= best_cosine) continue;
        best = blocks;
        best_cosine = cosine;
    }
    return best;
}

class Encoder {
public:
    Encoder(const AttributePage& page, const PageTree& tree, const AtlasAttributes& attributes,
            const BlockLayout& layout)
        : page_(page),
          attributes_(attributes),
          layout_(layout),
          cells_(tree.cells_per_page()),
          blocks_(layout.page_words(cells_), 0) {
        LODE_CHECK(!attributes.uvs && page.size() == size_t{cells_ + 1} * (cells_ + 1) * layout.sample_words,
                   page.size());
    }

    AttributeBlocks run() {
        const uint32_t last = cells_, along = LODE_VGI_BLOCKS_ALONG(cells_);
        for (uint32_t y = 0; y <= last; ++y) {
            for (uint32_t x = 0; x <= last; ++x) {
                const PlaceInBlocks place = place_in_blocks(cells_, x, y, layout_);
                if (place.number == PlaceInBlocks::in_plain)
                    std::copy_n(sample(x, y), layout_.sample_words, &blocks_[place.word]);
            }
        }
        for (uint32_t b = 0; b < along * along; ++b) encode(b, 1 + 4 * (b % along), 1 + 4 * (b / along));
        return std::move(blocks_);
    }

private:
    const uint32_t* sample(uint32_t x, uint32_t y) const {
        return &page_[(size_t{y} * (cells_ + 1) + x) * layout_.sample_words];
    }
    // Beyond the side it is what is on it.
    void encode(uint32_t number, uint32_t first_x, uint32_t first_y) {
        Samples samples{};
        for (uint32_t i = 0; i < samples_of_block; ++i)
            samples[i] = sample(std::min(first_x + i % 4, cells_), std::min(first_y + i / 4, cells_));
        uint32_t* const block = &blocks_[layout_.first_block(cells_) + size_t{number} * layout_.block_words()];
        const NormalBlocks normals = normal_blocks(samples);
        put(normals.u, block);
        put(normals.v, block + 2);
        blocks_[layout_.first_axis(cells_) + number / 8] |= normals.axis << (4 * (number % 8));
        if ((layout_.has & LODE_VGI_HAS_MATERIALS) != 0 && attributes_.materials) {
            std::ranges::copy(material_block(samples), block + LODE_VGI_BLOCK_MATERIALS);
        }
        uint32_t word = 1;
        if (attributes_.colours) {
            const uint32_t bytes = (layout_.has & LODE_VGI_ALPHA_IN_BLOCKS) != 0 ? 4 : 3;
            if ((layout_.has & LODE_VGI_HAS_COLOURS) != 0)
                put(samples, word, bytes, block + LODE_VGI_BLOCK_COLOURS(layout_.has));
            ++word;
        }
        if (attributes_.surfaces) {
            if ((layout_.has & LODE_VGI_HAS_SURFACES) != 0)
                put(samples, word, 3, block + LODE_VGI_BLOCK_SURFACES(layout_.has));
            ++word;
        }
        if (attributes_.emissions && (layout_.has & LODE_VGI_HAS_EMISSIONS) != 0)
            std::ranges::copy(colour_block(samples, word), block + LODE_VGI_BLOCK_EMISSIONS(layout_.has));
    }
    // The first bytes of a word of the samples.
    static void put(const Samples& samples, uint32_t word, uint32_t bytes, uint32_t* to) {
        for (uint32_t k = 0; k < bytes; ++k, to += 2) {
            Bytes16 numbers{};
            for (uint32_t i = 0; i < samples_of_block; ++i)
                numbers[i] = static_cast<uint8_t>(samples[i][word] >> (8 * k));
            put(number_block(numbers), to);
        }
    }
    static void put(const NumberBlock& numbers, uint32_t* to) {
        to[0] = numbers.low;
        to[1] = numbers.high;
    }

    const AttributePage& page_;
    const AtlasAttributes& attributes_;
    const BlockLayout& layout_;
    const uint32_t cells_;
    AttributeBlocks blocks_;
};

}  // namespace

uint32_t BlockLayout::block_words() const { return LODE_VGI_BLOCK_WORDS(has); }
uint32_t BlockLayout::first_axis(uint32_t cells) const { return LODE_VGI_BLOCK_AXES(cells, sample_words); }
uint32_t BlockLayout::first_block(uint32_t cells) const { return LODE_VGI_BLOCKS(cells, sample_words); }
uint32_t BlockLayout::page_words(uint32_t cells) const {
    return first_block(cells) + LODE_VGI_BLOCKS_ALONG(cells) * LODE_VGI_BLOCKS_ALONG(cells) * block_words();
}

AttributeBlocks attribute_blocks(const AttributePage& page, const PageTree& tree, const AtlasAttributes& attributes,
                                 const BlockLayout& layout) {
    return Encoder(page, tree, attributes, layout).run();
}

PlaceInBlocks place_in_blocks(uint32_t cells, uint32_t x, uint32_t y, const BlockLayout& layout) {
    LODE_CHECK(x <= cells && y <= cells, x, y, cells);
    if (x == 0 || y == 0 || x == cells || y == cells) {
        const uint32_t step = y == 0 ? x : x == cells ? cells + y : y == cells ? 3 * cells - x : 4 * cells - y;
        return {step * layout.sample_words};
    }
    const uint32_t block = (y - 1) / 4 * LODE_VGI_BLOCKS_ALONG(cells) + (x - 1) / 4;
    return {layout.first_block(cells) + block * layout.block_words(), block, (y - 1) % 4 * 4 + (x - 1) % 4};
}

BlockSample block_sample(std::span<const uint32_t> block, uint32_t axis, uint32_t number, uint32_t has) {
    const auto numbers = [&](size_t word) { return NumberBlock{block[word], block[word + 1]}; };
    BlockSample sample;
    sample.normal = NormalBlocks{numbers(0), numbers(2), axis}.normal(number);
    if ((has & LODE_VGI_HAS_MATERIALS) != 0)
        sample.material = material_of(block.subspan(LODE_VGI_BLOCK_MATERIALS, 3), number);
    const auto word = [&](uint32_t first, uint32_t bytes) {
        uint32_t packed = 0;
        for (uint32_t k = 0; k < bytes; ++k) packed |= numbers(first + 2 * size_t{k}).byte(number) << (8 * k);
        return packed;
    };
    if ((has & LODE_VGI_HAS_COLOURS) != 0) {
        const bool alpha = (has & LODE_VGI_ALPHA_IN_BLOCKS) != 0;
        sample.colour = word(LODE_VGI_BLOCK_COLOURS(has), alpha ? 4 : 3) | (alpha ? 0 : 0xff000000u);
    }
    if ((has & LODE_VGI_HAS_SURFACES) != 0) sample.surface = word(LODE_VGI_BLOCK_SURFACES(has), 3);
    if ((has & LODE_VGI_HAS_EMISSIONS) != 0) {
        const uint32_t at = LODE_VGI_BLOCK_EMISSIONS(has);
        sample.emission = colour_of(block[at], block[at + 1], number);
    }
    return sample;
}

}  // namespace lodestone::vgi
