#include "vgi/study/patch_indices.h"

#include <array>

#include "shaders/shared/vgi_texels.h"
#include "vgi/study/grid_patch.h"

namespace lodestone::vgi {

std::vector<uint32_t> patch_indices(const PlanMirror& mirror, const Draw& draw) {
    std::vector<uint32_t> indices;
    if (mirror.recipe().pipelines[draw.pipeline].patch_vertices == 0) return indices;
    const auto asset = mirror.stored<gpu::VgiAsset>(draw, LODE_VGI_ASSETS, draw.words[LODE_VGI_WORD_ASSET]);
    std::array<uint32_t, LODE_VGI_PATCH_WORDS> words;
    for (uint32_t i = 0; i < draw.count; ++i) {
        for (uint32_t k = 0; k < words.size(); ++k) {
            words[k] = mirror.stored<uint32_t>(
                draw, LODE_VGI_PATCHES,
                uint64_t{draw.words[LODE_VGI_WORD_PATCH]} + uint64_t{draw.first_vertex + i} * LODE_VGI_PATCH_WORDS + k);
        }
        GridPatch::of_words(words).append_indices(asset.cells, asset.page_cells, indices);
    }
    return indices;
}

}  // namespace lodestone::vgi
