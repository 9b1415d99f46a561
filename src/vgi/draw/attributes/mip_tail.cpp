#include "vgi/draw/attributes/mip_tail.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/looks/srgb.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

namespace {

constexpr size_t charts_of_task = 64;

// A sum of directions, of colours and of what else is bytes, and of their weights.
struct Sum {
    glm::vec3 normal{0};
    std::array<glm::vec4, 3> bytes{};  // of words that are four bytes each
    float weight = 0;
    void add(const Sum& other, float by) {
        normal += by * other.normal;
        for (size_t w = 0; w < bytes.size(); ++w) bytes[w] += by * other.bytes[w];
        weight += by * other.weight;
    }
    Sum mean() const {
        Sum sum;
        sum.add(*this, 1 / weight);
        return sum;
    }
};

class SmallLevels {
public:
    SmallLevels(const Atlas& about, std::span<const std::shared_ptr<const AttributePage>> coarsest,
                uint32_t texel_words)
        : about_(about),
          coarsest_(coarsest),
          words_(texel_words),
          n_(tree_of(about, Layer::attributes).cells_per_page()),
          first_bytes_(1 + (about.attributes.uvs ? 1u : 0u)),
          byte_words_(attribute_words(about.attributes) - first_bytes_),
          samples_(mip_tail_samples(n_)),
          corners_(size_t{4} * about.charts()) {
        for (uint32_t chart = 0; chart < about_.charts(); ++chart) {
            for (uint32_t side = 0; side < 4; ++side) glue_corners(chart, side);
        }
    }

    AttributePage run() {
        const size_t charts = about_.charts();
        result_.resize(charts * samples_ * words_);
        std::vector<std::vector<Sum>> finer(charts), coarser(charts);
        for_charts([&](uint32_t chart) {
            for (uint32_t i = 0; i < (n_ + 1) * (n_ + 1); ++i) finer[chart].push_back(unpacked(chart, i));
        });
        for (uint32_t level = 1; n_ >> level > 0; ++level) {
            for_charts([&](uint32_t chart) { coarser[chart] = own_sums(finer[chart], n_ >> level); });
            share(coarser, level);
            for_charts([&](uint32_t chart) {
                for (Sum& s : coarser[chart]) s = s.mean();
                pack(chart, level, coarser[chart]);
            });
            finer.swap(coarser);
        }
        return std::move(result_);
    }

private:
    template <class Do>
    void for_charts(Do&& what) const {
        parallel_for(about_.charts(), charts_of_task, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c) what(static_cast<uint32_t>(c));
        });
    }
    const uint32_t* texel(uint32_t chart, uint32_t i) const { return coarsest_[chart]->data() + size_t{i} * words_; }
    // Of a sample that level `level` has at step `step` of a side.
    const uint32_t* texel(uint32_t chart, uint32_t side, uint32_t step, uint32_t level) const {
        const auto [x, y] = on_side(side, step << level, n_);
        return texel(chart, y * (n_ + 1) + x);
    }
    // What is glued is one surface; whether it is smooth there, its normals tell.
    static bool smooth(const uint32_t* a, const uint32_t* b) { return ((*a ^ *b) & 0xffff) == 0; }

    void glue_corners(uint32_t chart, uint32_t side) {
        const GluedSide& glued = about_.sides[4 * chart + side];
        if (glued.chart == ~0u) return;
        const auto corner = [](uint32_t c, uint32_t s, uint32_t end) { return 4 * c + (s + end) % 4; };
        for (const uint32_t end : {0u, 1u}) {
            if (smooth(texel(chart, side, end * n_, 0), texel(glued.chart, glued.side, (1 - end) * n_, 0)))
                corners_.join(corner(chart, side, end), corner(glued.chart, glued.side, 1 - end));
        }
    }

    // Of a number of the words of bytes: whether it stands for light. Of colours alpha does not.
    bool is_srgb(uint32_t word, int number) const {
        if (word == 0 && about_.attributes.colours) return number < 3;
        return about_.attributes.emissions && word + 1 == byte_words_;
    }
    Sum unpacked(uint32_t chart, uint32_t i) const {
        const uint32_t* const words = texel(chart, i);
        Sum sum;
        sum.normal = unpack_octahedral({static_cast<int8_t>(*words & 255), static_cast<int8_t>(*words >> 8 & 255)});
        for (uint32_t w = 0; w < byte_words_; ++w) {
            for (int k = 0; k < 4; ++k) {
                const uint32_t byte = words[first_bytes_ + w] >> (8 * k) & 255;
                sum.bytes[w][k] = is_srgb(w, k) ? linear_of_byte(static_cast<int32_t>(byte)) : static_cast<float>(byte);
            }
        }
        sum.weight = 1;
        return sum;
    }

    // By weights 1 2 1 across and down; of samples on a border the half that the chart has, so that both halves make a
    // whole, and in corners the quarter.
    static std::vector<Sum> own_sums(const std::vector<Sum>& finer, uint32_t cells) {
        std::vector<Sum> sums;
        sums.reserve(size_t{cells + 1} * (cells + 1));
        const uint32_t finest = 2 * cells, row = finest + 1;
        for (uint32_t y = 0; y <= finest; y += 2) {
            for (uint32_t x = 0; x <= finest; x += 2) {
                Sum& sum = sums.emplace_back();
                for (uint32_t v = y - (y > 0); v <= std::min(y + 1, finest); ++v) {
                    const float down = v == y && y > 0 && y < finest ? 2 : 1;
                    for (uint32_t u = x - (x > 0); u <= std::min(x + 1, finest); ++u)
                        sum.add(finer[v * row + u], down * (u == x && x > 0 && x < finest ? 2 : 1));
                }
            }
        }
        return sums;
    }

    // Samples that are glued get the sums of all of them.
    void share(std::vector<std::vector<Sum>>& sums, uint32_t level) {
        const uint32_t cells = n_ >> level;
        const auto at = [&](uint32_t chart, uint32_t side, uint32_t step) -> Sum& {
            const auto [x, y] = on_side(side, step, cells);
            return sums[chart][y * (cells + 1) + x];
        };
        for (uint32_t chart = 0; chart < about_.charts(); ++chart) {
            for (uint32_t side = 0; side < 4; ++side) {
                const GluedSide& glued = about_.sides[4 * chart + side];
                if (glued.chart == ~0u || 4 * glued.chart + glued.side <= 4 * chart + side) continue;
                for (uint32_t step = 1; step < cells; ++step) {
                    if (!smooth(texel(chart, side, step, level), texel(glued.chart, glued.side, cells - step, level)))
                        continue;
                    Sum &a = at(chart, side, step), &b = at(glued.chart, glued.side, cells - step);
                    a.add(b, 1);
                    b = a;
                }
            }
        }
        std::vector<Sum> of_corners(4 * about_.charts());
        for (uint32_t corner = 0; corner < of_corners.size(); ++corner)
            of_corners[corners_.find(corner)].add(at(corner / 4, corner % 4, 0), 1);
        for (uint32_t corner = 0; corner < of_corners.size(); ++corner)
            at(corner / 4, corner % 4, 0) = of_corners[corners_.find(corner)];
    }

    // Texture coordinates and materials are those of the sample.
    void pack(uint32_t chart, uint32_t level, const std::vector<Sum>& means) {
        const uint32_t cells = n_ >> level;
        uint32_t* to = result_.data() + (size_t{chart} * samples_ + LODE_VGI_SMALL_FIRST(n_, level)) * words_;
        for (uint32_t i = 0; i < means.size(); ++i, to += words_) {
            const uint32_t x = i % (cells + 1), y = i / (cells + 1);
            const uint32_t* const sample = texel(chart, ((y << level) * (n_ + 1)) + (x << level));
            std::copy_n(sample, words_, to);
            const float length = glm::length(means[i].normal);
            if (length > 1e-3f) {
                const auto [u, v] = pack_octahedral(means[i].normal / length);
                *to = (*to & 0xffff0000u) | static_cast<uint8_t>(u) | uint32_t{static_cast<uint8_t>(v)} << 8;
            }
            for (uint32_t w = 0; w < byte_words_; ++w) {
                uint32_t word = 0;
                for (int k = 0; k < 4; ++k) {
                    const float mean = means[i].bytes[w][k];
                    word |= (is_srgb(w, k) ? srgb_byte_of(mean) : static_cast<uint32_t>(mean + 0.5f)) << (8 * k);
                }
                to[first_bytes_ + w] = word;
            }
        }
    }

    const Atlas& about_;
    const std::span<const std::shared_ptr<const AttributePage>> coarsest_;
    const uint32_t words_, n_;
    const uint32_t first_bytes_, byte_words_;  // of a sample: words of four bytes each
    const uint32_t samples_;
    DisjointSets corners_;  // of charts that are one: 4 * chart + the side that begins there
    AttributePage result_;
};

}  // namespace

uint32_t mip_tail_samples(uint32_t cells) {
    LODE_CHECK(std::has_single_bit(cells), cells);
    return LODE_VGI_SMALL_FIRST(cells, static_cast<uint32_t>(std::bit_width(cells)));
}

AttributePage mip_tail(const Atlas& about, std::span<const std::shared_ptr<const AttributePage>> coarsest,
                       uint32_t texel_words) {
    LODE_CHECK(coarsest.size() == about.charts(), coarsest.size(), about.charts());
    return SmallLevels(about, coarsest, texel_words).run();
}

std::vector<std::array<uint32_t, 4>> coarsest_corners(const AttributePage& tail, uint32_t charts, uint32_t cells,
                                                      uint32_t texel_words) {
    const uint32_t samples = mip_tail_samples(cells);
    std::vector<std::array<uint32_t, 4>> corners(charts);
    for (uint32_t c = 0; c < charts; ++c) {
        const size_t first = size_t{c} * samples + samples - 4;  // the last level is of two by two
        for (const auto& [k, place] : {std::pair(0u, 0u), {1u, 1u}, {2u, 3u}, {3u, 2u}})
            corners[c][k] = tail[(first + place) * texel_words];
    }
    return corners;
}

}  // namespace lodestone::vgi
