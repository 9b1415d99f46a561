#include "lod/draw/morphed_vertex.h"

#include "shaders/shared/lod_morph.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

static_assert(sizeof(MeshVertex) == LODE_LOD_VERTEX_WORDS * sizeof(uint32_t));

glm::vec3 morphed_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput&, uint32_t, uint32_t index) {
    const uint32_t first = draw.words[LODE_LOD_WORD_FIRST], staying = draw.words[LODE_LOD_WORD_STAYING];
    const auto morphing = static_cast<float>(draw.words[LODE_LOD_WORD_ARRIVED] - staying);
    glm::vec3 position(0);
    const auto ancestry = [&](uint32_t word) {
        return mirror.stored<uint32_t>(draw, LODE_LOD_PARENTS, (first + index) * LODE_LOD_PARENT_WORDS + word);
    };
    for (float left = 1; left > 0; index = ancestry(0)) {
        const uint32_t wedge = ancestry(1);
        const float away = wedge < staying ? 0 : static_cast<float>(wedge - staying + 1) / (morphing + 1);
        const auto vertex = mirror.stored<MeshVertex>(draw, LODE_LOD_VERTICES, first + index);
        position += left * (1 - away) * glm::vec3(vertex.position[0], vertex.position[1], vertex.position[2]);
        left *= away;
    }
    return position;
}

}  // namespace lodestone
