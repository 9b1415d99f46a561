#include "vgi/draw/pulled_vertex.h"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>

#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

glm::vec3 pulled_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                        uint32_t index) {
    const uint32_t number = draw.words[LODE_VGI_WORD_ASSET];
    const auto asset = mirror.stored<gpu::VgiAsset>(draw, LODE_VGI_ASSETS, number);
    const uint32_t slot = index / LODE_VGI_PAGE_TEXELS, place = index % LODE_VGI_PAGE_TEXELS,
                   row = asset.page_cells + 1;
    const GridPoint p{static_cast<int32_t>(place % row), static_cast<int32_t>(place / row)};
    const auto texel_at = [&](GridPoint q) {
        return mirror.stored<GeometryTexel>(
            draw, LODE_VGI_GEOMETRY,
            uint64_t{slot} * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>(q.y) * row + static_cast<uint32_t>(q.x));
    };
    const auto lattice = [](const GeometryTexel& t) { return glm::vec3(t.x, t.y, t.z); };
    const glm::vec3 origin(asset.origin_x, asset.origin_y, asset.origin_z);
    const GeometryTexel texel = texel_at(p);
    glm::vec3 point = lattice(texel);
    const Bintree tree{static_cast<int32_t>(asset.page_cells)};
    const auto magnification = std::bit_cast<float>(draw.words[LODE_VGI_WORD_MAGNIFICATION]);
    if (magnification > 0 && !tree.is_corner(p)) {
        const auto scale = std::bit_cast<float>(draw.words[LODE_VGI_WORD_SCALE]);
        const float error =
            mirror.stored<float>(draw, LODE_VGI_CODES, number * 512 + texel.error) * magnification * scale;
        const float radius = mirror.stored<float>(draw, LODE_VGI_CODES, number * 512 + 256 + texel.radius) * scale;
        const glm::vec3 world(input.instances[instance].object_to_world * glm::vec4(origin + asset.step * point, 1));
        constexpr auto morph_share = static_cast<float>(1 - 1 / error_ratio);
        const float away = distance_metric(input.views[0], world);
        const float t = error == 0 ? 1 : std::clamp((error + radius - away) / (morph_share * error), 0.0f, 1.0f);
        const auto [a, b] = tree.hypotenuse(p);
        const glm::vec3 middle = 0.5f * (lattice(texel_at(a)) + lattice(texel_at(b)));
        point = middle + (point - middle) * t;
    }
    return origin + asset.step * point;
}

}  // namespace lodestone::vgi
