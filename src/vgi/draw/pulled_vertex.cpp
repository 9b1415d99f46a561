#include "vgi/draw/pulled_vertex.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/geometric.hpp>

#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/corner_tree.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

namespace {

glm::vec3 lattice(const GeometryTexel& t) { return {t.x, t.y, t.z}; }

class Pulling {
public:
    Pulling(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance)
        : mirror_(mirror),
          draw_(draw),
          to_world_(input.instances[instance].object_to_world),
          view_(input.views[0]),
          number_(draw.words[LODE_VGI_WORD_ASSET]),
          asset_(mirror.stored<gpu::VgiAsset>(draw, LODE_VGI_ASSETS, number_)),
          origin_(asset_.origin_x, asset_.origin_y, asset_.origin_z),
          magnification_(std::bit_cast<float>(draw.words[LODE_VGI_WORD_MAGNIFICATION])) {}

    glm::vec3 vertex(uint32_t index) const {
        if ((index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0) return leaf(index & ~LODE_VGI_LEAF);
        return origin_ +
               asset_.step * ((index & LODE_VGI_CORNER) != 0 ? corner(index & ~LODE_VGI_CORNER) : sample(index));
    }

private:
    // How far it has come to its place, 0 .. 1.
    float arrived(const GeometryTexel& texel) const {
        const auto scale = std::bit_cast<float>(draw_.words[LODE_VGI_WORD_SCALE]);
        const float error =
            mirror_.stored<float>(draw_, LODE_VGI_CODES, number_ * 512 + texel.error) * magnification_ * scale;
        const float radius = mirror_.stored<float>(draw_, LODE_VGI_CODES, number_ * 512 + 256 + texel.radius) * scale;
        const glm::vec3 world(to_world_ * glm::vec4(origin_ + asset_.step * lattice(texel), 1));
        constexpr auto morph_share = static_cast<float>(1 - 1 / error_ratio);
        const float away = distance_metric(view_, world);
        return error == 0 ? 1 : std::clamp((error + radius - away) / (morph_share * error), 0.0f, 1.0f);
    }

    glm::vec3 corner_point(uint32_t number) const {
        glm::vec3 point(0);
        for (float share = 1; share > 0;) {
            const auto record = mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corner + number);
            const auto texel = std::bit_cast<GeometryTexel>(std::array{record[0], record[1]});
            const float t = magnification_ > 0 && record[2] != number ? arrived(texel) : 1;
            point += share * t * lattice(texel);
            share *= 1 - t;
            number = record[2];
        }
        return point;
    }
    uint32_t corner_of_chart(uint32_t chart, uint32_t k) const {
        return mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corners_of_charts + chart)[k];
    }
    glm::vec3 leaf(uint32_t index) const {
        const auto v = mirror_.stored<std::array<uint32_t, 4>>(draw_, LODE_VGI_LEAVES, index);
        return origin_ + asset_.leaf_step * glm::vec3(v[0] & 0x1fffff, v[0] >> 21 | (v[1] & 0x3ff) << 11, v[1] >> 10);
    }
    glm::vec3 corner(uint32_t index) const {
        const uint32_t of_chart = index >> LODE_VGI_CORNER_STEPS;
        uint32_t number = corner_of_chart(of_chart / 4, of_chart % 4);
        for (uint32_t step = index % (1u << LODE_VGI_CORNER_STEPS); step > 0; --step)
            number = mirror_.stored<CornerRecord>(draw_, LODE_VGI_CORNERS, asset_.first_corner + number)[2];
        return corner_point(number);
    }

    // The corner of its chart that a corner of a page is; 4 where it is none.
    uint32_t corner_at(uint32_t slot, GridPoint p, uint32_t* chart) const {
        const auto header = mirror_.stored<std::array<uint32_t, 2>>(draw_, LODE_VGI_SLOTS, slot);
        const uint32_t level = header[0] >> 28;
        *chart = header[0] & 0x0fffffff;
        const uint32_t x = ((header[1] & 0xffff) * asset_.page_cells + static_cast<uint32_t>(p.x)) << level,
                       y = ((header[1] >> 16) * asset_.page_cells + static_cast<uint32_t>(p.y)) << level;
        if (x % asset_.cells != 0 || y % asset_.cells != 0) return 4;
        return y == 0 ? x / asset_.cells : 3 - x / asset_.cells;
    }

    glm::vec3 sample(uint32_t index) const {
        const uint32_t slot = index / LODE_VGI_PAGE_TEXELS, place = index % LODE_VGI_PAGE_TEXELS,
                       row = asset_.page_cells + 1;
        const GridPoint p{static_cast<int32_t>(place % row), static_cast<int32_t>(place / row)};
        const auto texel_at = [&](GridPoint q) {
            return mirror_.stored<GeometryTexel>(
                draw_, LODE_VGI_GEOMETRY,
                uint64_t{slot} * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>(q.y) * row + static_cast<uint32_t>(q.x));
        };
        const GeometryTexel texel = texel_at(p);
        const glm::vec3 point = lattice(texel);
        const Bintree tree{static_cast<int32_t>(asset_.page_cells)};
        if (tree.is_corner(p)) {
            uint32_t chart = 0;
            const uint32_t k = asset_.first_corners_of_charts == LODE_VGI_NO_CORNERS ? 4 : corner_at(slot, p, &chart);
            return k < 4 ? corner_point(corner_of_chart(chart, k)) : point;
        }
        if (magnification_ <= 0) return point;
        const auto [a, b] = tree.hypotenuse(p);
        const glm::vec3 middle = 0.5f * (lattice(texel_at(a)) + lattice(texel_at(b)));
        return middle + (point - middle) * arrived(texel);
    }

    const PlanMirror& mirror_;
    const Draw& draw_;
    const glm::mat4 to_world_;
    const View& view_;
    const uint32_t number_;
    const gpu::VgiAsset asset_;
    const glm::vec3 origin_;
    const float magnification_;
};

}  // namespace

glm::vec3 pulled_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                        uint32_t index) {
    return Pulling(mirror, draw, input, instance).vertex(index);
}

}  // namespace lodestone::vgi
