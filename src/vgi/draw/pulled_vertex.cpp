#include "vgi/draw/pulled_vertex.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/geometric.hpp>
#include <optional>

#include "frame/screen_error.h"
#include "mesh/packed_vertices.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/attributes/attribute_blocks.h"
#include "vgi/draw/corners/corner_tree.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/leaves/leaf_morph.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

namespace {

glm::vec3 lattice(const GeometryTexel& t) { return {t.x, t.y, t.z}; }
// Of the leaves of a scene: LODE_VGI_LEAF_BLOCK.
uint32_t leaf_block_of(const PlanMirror& mirror) {
    return LODE_VGI_LEAF_BLOCK(mirror.recipe().pipelines[lighting_pipeline].constants[LODE_VGI_OWN_UVS_CONSTANT]);
}
uint32_t number_of_leaf(uint32_t index) { return index & ~(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES); }

class Pulling {
public:
    Pulling(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance)
        : mirror_(mirror),
          draw_(draw),
          to_world_(input.instances[instance].object_to_world),
          scale_(largest_scale(to_world_)),
          view_(input.views[0]),
          leaf_block_(leaf_block_of(mirror)),
          number_(draw.words[LODE_VGI_WORD_ASSET]),
          asset_(mirror.stored<gpu::VgiAsset>(draw, LODE_VGI_ASSETS, number_)),
          origin_(asset_.origin_x, asset_.origin_y, asset_.origin_z),
          magnification_(std::bit_cast<float>(draw.words[LODE_VGI_WORD_MAGNIFICATION])) {}

    glm::vec3 vertex(uint32_t index) const {
        if ((index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0) return leaf(number_of_leaf(index));
        return origin_ +
               asset_.step * ((index & LODE_VGI_CORNER) != 0 ? corner(index & ~LODE_VGI_CORNER).point : sample(index));
    }
    // Of LODE_VGI_CORNER.
    glm::vec3 normal(uint32_t index) const {
        const glm::vec3 normal = corner(index & ~LODE_VGI_CORNER).normal;
        const float length = glm::length(normal);
        return length > 1e-3f ? normal / length : glm::vec3(0, 0, 1);
    }

private:
    // How far it has come to its place, 0 .. 1.
    float arrived(const GeometryTexel& texel) const {
        const float error =
            mirror_.stored<float>(draw_, LODE_VGI_CODES, number_ * 512 + texel.error) * magnification_ * scale_;
        const float radius = mirror_.stored<float>(draw_, LODE_VGI_CODES, number_ * 512 + 256 + texel.radius) * scale_;
        const glm::vec3 world(to_world_ * glm::vec4(origin_ + asset_.step * lattice(texel), 1));
        constexpr auto morph_share = static_cast<float>(1 - 1 / error_ratio);
        const float away = distance_metric(view_, world);
        return error == 0 ? 1 : std::clamp((error + radius - away) / (morph_share * error), 0.0f, 1.0f);
    }

    // A corner of charts, on its way from where its parent is.
    struct MovedCorner {
        glm::vec3 point{0}, normal{0};  // lattice units; object space, not of unit length
    };
    MovedCorner moved_corner(uint32_t number) const {
        MovedCorner moved;
        for (float share = 1; share > 0;) {
            const auto record = mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corner + number);
            const auto texel = std::bit_cast<GeometryTexel>(std::array{record[0], record[1]});
            const float t = magnification_ > 0 && record[2] != number ? arrived(texel) : 1;
            moved.point += share * t * lattice(texel);
            moved.normal +=
                share * t *
                unpack_normal({static_cast<int16_t>(record[3] & 0xffff), static_cast<int16_t>(record[3] >> 16)});
            share *= 1 - t;
            number = record[2];
        }
        return moved;
    }
    uint32_t corner_of_chart(uint32_t chart, uint32_t k) const {
        return mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corners_of_charts + chart)[k];
    }
    // Of a leaf's vertex, or four words of its part.
    std::array<uint32_t, 4> leaf_words(uint32_t texel) const {
        return mirror_.stored<std::array<uint32_t, 4>>(draw_, LODE_VGI_LEAVES, texel);
    }
    glm::vec3 leaf(uint32_t number) const {
        const auto v = leaf_words(LODE_VGI_LEAF_TEXEL(number, leaf_block_));
        const glm::vec3 at(v[0] & 0x1fffff, v[0] >> 21 | (v[1] & 0x3ff) << 11, v[1] >> 10);
        const LeafMorph morph = LeafMorph::unpacked(leaf_words(LODE_VGI_LEAF_MORPHS(number, leaf_block_))[number % 4]);
        const auto leaf_of = [&](uint32_t i) {
            const auto words = leaf_words(LODE_VGI_LEAF_HEADER(number, leaf_block_) + i / 2);
            return std::bit_cast<GeometryTexel>(std::array{words[i % 2 * 2], words[i % 2 * 2 + 1]});
        };
        const float before = 1 - std::min(arrived(leaf_of(0)), arrived(leaf_of(morph.border)));
        return origin_ + asset_.leaf_step * (at + before * glm::vec3(morph.start()));
    }
    MovedCorner corner(uint32_t index) const {
        const uint32_t of_chart = index % LODE_VGI_CORNER_STEP;
        uint32_t number = corner_of_chart(of_chart / 4, of_chart % 4);
        for (uint32_t step = index / LODE_VGI_CORNER_STEP; step > 0; --step)
            number = mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corner + number)[2];
        return moved_corner(number);
    }

    // The corner of its chart that a corner of a page is; 4 where it is none.
    uint32_t corner_at(uint32_t slot, GridPoint p, uint32_t* chart) const {
        const auto header = mirror_.stored<std::array<uint32_t, 2>>(draw_, LODE_VGI_SLOTS, slot + asset_.header_shift);
        const uint32_t level = header[0] >> 28;
        *chart = header[0] & 0x0fffffff;
        const uint32_t x = ((header[1] & 0xffff) * asset_.page_cells + static_cast<uint32_t>(p.x)) << level,
                       y = ((header[1] >> 16) * asset_.page_cells + static_cast<uint32_t>(p.y)) << level;
        if (x % asset_.cells != 0 || y % asset_.cells != 0) return 4;
        return y == 0 ? x / asset_.cells : 3 - x / asset_.cells;
    }

    glm::vec3 sample(uint32_t index) const {
        const uint32_t texels = LODE_VGI_PAGE_TEXELS(asset_.page_cells), slot = index / texels, place = index % texels,
                       row = asset_.page_cells + 1;
        const GridPoint p{static_cast<int32_t>(place % row), static_cast<int32_t>(place / row)};
        const auto texel_at = [&](GridPoint q) {
            return mirror_.stored<GeometryTexel>(
                draw_, LODE_VGI_GEOMETRY,
                uint64_t{slot} * texels + static_cast<uint32_t>(q.y) * row + static_cast<uint32_t>(q.x));
        };
        const GeometryTexel texel = texel_at(p);
        const glm::vec3 point = lattice(texel);
        const Bintree tree{static_cast<int32_t>(asset_.page_cells)};
        if (tree.is_corner(p)) {
            uint32_t chart = 0;
            const uint32_t k = asset_.first_corners_of_charts == LODE_VGI_NO_CORNERS ? 4 : corner_at(slot, p, &chart);
            return k < 4 ? moved_corner(corner_of_chart(chart, k)).point : point;
        }
        if (magnification_ <= 0) return point;
        const auto [a, b] = tree.hypotenuse(p);
        const glm::vec3 middle = 0.5f * (lattice(texel_at(a)) + lattice(texel_at(b)));
        return middle + (point - middle) * arrived(texel);
    }

    const PlanMirror& mirror_;
    const Draw& draw_;
    const glm::mat4 to_world_;
    const float scale_;
    const View& view_;
    const uint32_t leaf_block_;
    const uint32_t number_;
    const gpu::VgiAsset asset_;
    const glm::vec3 origin_;
    const float magnification_;
};

// Where a vertex is in its chart, in cells of the finest positions, and the level of its page.
// Of a leaf there is no page: it lies between samples, and the finest attributes are its own.
struct ChartPlace {
    uint32_t chart = 0, x = 0, y = 0, level = 0;
    bool is_leaf = false;
    glm::vec2 of_leaf{0};           // in the chart, 0 .. 1
    glm::vec3 facing{0};            // of a leaf: its normal
    std::optional<glm::vec2> uv{};  // of a leaf: its own, where the pool has them
};

class PullingAttributes {
public:
    PullingAttributes(const PlanMirror& mirror, const Draw& draw)
        : mirror_(mirror),
          draw_(draw),
          asset_(mirror.stored<gpu::VgiAsset>(draw, LODE_VGI_ASSETS, draw.words[LODE_VGI_WORD_ASSET])),
          layout_{mirror.recipe().pipelines[lighting_pipeline].constants[LODE_VGI_EVER_CONSTANT],
                  mirror.recipe().pipelines[lighting_pipeline].constants[LODE_VGI_WORDS_CONSTANT]},
          leaf_block_(leaf_block_of(mirror)) {
        lighting_.pipeline = lighting_pipeline;
    }

    PulledAttributes at(uint32_t index) const {
        if ((index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0) return leaf(number_of_leaf(index));
        if ((index & LODE_VGI_CORNER) == 0) return at(place_of_sample(index));
        return at(place_of_corner(index & ~LODE_VGI_CORNER));
    }

private:
    PulledAttributes leaf(uint32_t number) const {
        const auto v =
            mirror_.stored<std::array<uint32_t, 4>>(draw_, LODE_VGI_LEAVES, LODE_VGI_LEAF_TEXEL(number, leaf_block_));
        ChartPlace place;
        place.chart = v[2] >> 28 | (v[3] >> 16) << 4;
        place.is_leaf = true;
        place.of_leaf = glm::vec2(v[2] & 0x3fff, v[2] >> 14 & 0x3fff) / static_cast<float>(LODE_VGI_LEAF_PLACES);
        place.facing = unpack_octahedral({static_cast<int8_t>(v[3] & 255), static_cast<int8_t>(v[3] >> 8 & 255)});
        if ((asset_.has & LODE_VGI_HAS_UVS) != 0 && leaf_block_ == LODE_VGI_LEAF_BLOCK(1u)) {
            const auto uvs = mirror_.stored<std::array<uint32_t, 4>>(draw_, LODE_VGI_LEAVES,
                                                                     LODE_VGI_LEAF_MORPHS(number, leaf_block_) + 1);
            place.uv = uv_of({uvs[number % 4] & 0xffff, uvs[number % 4] >> 16});
        }
        PulledAttributes pulled = at(place);
        pulled.normal = place.facing;
        return pulled;
    }
    ChartPlace place_of_sample(uint32_t index) const {
        const uint32_t texels = LODE_VGI_PAGE_TEXELS(asset_.page_cells), slot = index / texels, place = index % texels,
                       row = asset_.page_cells + 1;
        const auto header = mirror_.stored<std::array<uint32_t, 2>>(draw_, LODE_VGI_SLOTS, slot + asset_.header_shift);
        const uint32_t level = header[0] >> 28;
        return {header[0] & 0x0fffffff, ((header[1] & 0xffff) * asset_.page_cells + place % row) << level,
                ((header[1] >> 16) * asset_.page_cells + place / row) << level, level};
    }
    ChartPlace place_of_corner(uint32_t index) const {
        const uint32_t of_chart = index % LODE_VGI_CORNER_STEP, k = of_chart % 4;
        return {of_chart / 4, k == 1 || k == 2 ? asset_.cells : 0, k >= 2 ? asset_.cells : 0, LODE_VGI_CORNER_LEVEL};
    }
    // Four samples around a place, and how much each counts. Texture coordinates are in the word after the first.
    struct Around {
        std::array<BlockSample, 4> sample{};
        std::array<uint64_t, 4> word{};
        std::array<float, 4> weight{};
        size_t nearest = 0;
    };
    Around around(const ChartPlace& place) const {
        const uint32_t cells = std::min(1u << asset_.attribute_cells, LODE_VGI_PAGE_CELLS),
                       shift = static_cast<uint32_t>(std::bit_width(cells)) - 1, base = asset_.attribute_cells - shift,
                       finer = asset_.attribute_cells + 1 - static_cast<uint32_t>(std::bit_width(asset_.cells));
        const uint32_t wanted = place.is_leaf ? 0 : std::min(place.level + finer, base),
                       last = (1u << (base - wanted)) - 1;
        // In cells of the finest attributes.
        const glm::vec2 cell = place.is_leaf ? place.of_leaf * static_cast<float>(1u << asset_.attribute_cells)
                                             : glm::vec2(place.x << finer, place.y << finer);
        uint32_t page_x = std::min(static_cast<uint32_t>(cell.x) >> (wanted + shift), last),
                 page_y = std::min(static_cast<uint32_t>(cell.y) >> (wanted + shift), last);
        const auto entry = mirror_.stored<uint32_t>(lighting_, LODE_VGI_TABLE,
                                                    asset_.first_attribute_page + place.chart * asset_.attribute_pages +
                                                        PageTree::page_of(base - wanted, page_x, page_y));
        const uint32_t level = entry & 15;
        page_x >>= level - wanted;
        page_y >>= level - wanted;
        const auto in_page = [&](float at, uint32_t page) {
            return (at - static_cast<float>(page << (level + shift))) / static_cast<float>(1u << level);
        };
        const float local_x = in_page(cell.x, page_x), local_y = in_page(cell.y, page_y);
        const uint32_t low_x = std::min(static_cast<uint32_t>(local_x), cells - 1),
                       low_y = std::min(static_cast<uint32_t>(local_y), cells - 1);
        const float f = local_x - static_cast<float>(low_x), g = local_y - static_cast<float>(low_y);
        Around around;
        for (uint32_t k = 0; k < 4; ++k)
            put_sample(uint64_t{entry >> 4} * asset_.attribute_page_words, cells, low_x + k % 2, low_y + k / 2, k,
                       around);
        around.weight = {(1 - f) * (1 - g), f * (1 - g), (1 - f) * g, f * g};
        around.nearest = (f < 0.5f ? size_t{0} : 1) + (g < 0.5f ? size_t{0} : 2);
        return around;
    }
    // first: of the page.
    void put_sample(uint64_t first, uint32_t cells, uint32_t x, uint32_t y, size_t k, Around& to) const {
        PlaceInBlocks place{(y * (cells + 1) + x) * layout_.sample_words};
        if ((layout_.has & LODE_VGI_IN_BLOCKS) != 0) place = place_in_blocks(cells, x, y, layout_);
        to.word[k] = first + place.word;
        if (place.number == PlaceInBlocks::in_plain) {
            to.sample[k] = plain_sample(to.word[k]);
            return;
        }
        std::vector<uint32_t> block(layout_.block_words());
        for (size_t i = 0; i < block.size(); ++i) block[i] = word(to.word[k] + i);
        const uint32_t axes = word(first + layout_.first_axis(cells) + place.block / 8);
        to.sample[k] = block_sample(block, axes >> (4 * (place.block % 8)) & 15, place.number, layout_.has);
    }
    BlockSample plain_sample(uint64_t at) const {
        BlockSample sample;
        const uint32_t packed = word(at);
        sample.normal = packed_normal(packed);
        sample.material = packed >> 16;
        if ((asset_.has & LODE_VGI_HAS_COLOURS) != 0) sample.colour = word(at + 1 + (asset_.has & LODE_VGI_HAS_UVS));
        return sample;
    }
    uint32_t word(uint64_t number) const { return mirror_.stored<uint32_t>(lighting_, LODE_VGI_ATTRIBUTES, number); }

    // weight_of_side of shaders/shared/vgi_surface.glsl.
    void keep_side(const glm::vec3& facing, Around& of) const {
        std::array<float, 4> kept{};
        float sum = 0;
        for (size_t k = 0; k < 4; ++k) {
            const float alike = std::max(glm::dot(of.sample[k].normal, facing), 0.0f);
            kept[k] = of.weight[k] * alike * alike * alike * alike;
            sum += kept[k];
        }
        if (!(sum > 1e-3f)) return;
        for (size_t k = 0; k < 4; ++k) of.weight[k] = kept[k] / sum;
        of.nearest = static_cast<size_t>(std::ranges::max_element(of.weight) - of.weight.begin());
    }

    PulledAttributes at(const ChartPlace& place) const {
        Around of = around(place);
        if (place.is_leaf) keep_side(place.facing, of);
        PulledAttributes pulled;
        glm::vec3 normal(0);
        glm::vec4 colour(0);
        for (size_t k = 0; k < 4; ++k) {
            normal += of.weight[k] * of.sample[k].normal;
            if ((asset_.has & LODE_VGI_HAS_COLOURS) == 0) continue;
            const uint32_t rgba = of.sample[k].colour;
            colour += of.weight[k] * glm::vec4(rgba & 255, rgba >> 8 & 255, rgba >> 16 & 255, rgba >> 24);
        }
        const float length = glm::length(normal);
        if (length > 1e-3f) pulled.normal = normal / length;
        if ((asset_.has & LODE_VGI_HAS_COLOURS) != 0) pulled.colour = glm::u8vec4(colour + 0.5f);
        if ((asset_.has & LODE_VGI_HAS_MATERIALS) != 0) pulled.material = of.sample[of.nearest].material;
        if ((asset_.has & LODE_VGI_HAS_UVS) != 0) pulled.uv = place.uv && one_material(of) ? *place.uv : uv(of);
        return pulled;
    }
    bool one_material(const Around& of) const {
        return std::ranges::all_of(of.sample,
                                   [&](const BlockSample& s) { return s.material == of.sample[0].material; });
    }
    // Across a seam there is nothing in between.
    glm::vec2 uv(const Around& of) const {
        std::array<glm::vec2, 4> uvs;
        glm::vec2 mean(0);
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t packed = word(of.word[k] + 1);
            uvs[k] = {packed & 0xffff, packed >> 16};
            mean += of.weight[k] * uvs[k];
        }
        const std::array<float, 4> edges{glm::distance(uvs[0], uvs[1]), glm::distance(uvs[2], uvs[3]),
                                         glm::distance(uvs[0], uvs[2]), glm::distance(uvs[1], uvs[3])};
        const auto [shortest, longest] = std::ranges::minmax(edges);
        return uv_of(longest > 8 * shortest + 64 ? uvs[of.nearest] : mean);
    }
    // at: as samples have it.
    glm::vec2 uv_of(const glm::vec2& at) const {
        return glm::vec2(asset_.uv_low_x, asset_.uv_low_y) + glm::vec2(asset_.uv_step_x, asset_.uv_step_y) * at;
    }

    const PlanMirror& mirror_;
    const Draw& draw_;
    const gpu::VgiAsset asset_;
    const BlockLayout layout_;
    const uint32_t leaf_block_;
    Draw lighting_;
};

}  // namespace

glm::vec3 pulled_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                        uint32_t index) {
    return Pulling(mirror, draw, input, instance).vertex(index);
}

PulledAttributes pulled_attributes(const PlanMirror& mirror, const Draw& draw, const FrameInput& input,
                                   uint32_t instance, uint32_t index) {
    PulledAttributes pulled = PullingAttributes(mirror, draw).at(index);
    if ((index & LODE_VGI_CORNER) != 0) pulled.normal = Pulling(mirror, draw, input, instance).normal(index);
    return pulled;
}

}  // namespace lodestone::vgi
