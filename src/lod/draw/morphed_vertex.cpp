#include "lod/draw/morphed_vertex.h"

#include "shaders/shared/lod_morph.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

static_assert(sizeof(MeshVertex) == LODE_LOD_VERTEX_WORDS * sizeof(uint32_t));

glm::vec3 morphed_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput&, uint32_t, uint32_t index) {
    const uint32_t first = draw.words[LODE_LOD_WORD_FIRST], staying = draw.words[LODE_LOD_WORD_STAYING];
    const auto morphing = static_cast<float>(draw.words[LODE_LOD_WORD_ARRIVED] - staying);
    glm::vec3 position(0);
    for (float left = 1; left > 0; index = mirror.stored<uint32_t>(draw, LODE_LOD_PARENTS, first + index)) {
        const float away = index < staying ? 0 : static_cast<float>(index - staying + 1) / (morphing + 1);
        const auto vertex = mirror.stored<MeshVertex>(draw, LODE_LOD_VERTICES, first + index);
        position += left * (1 - away) * glm::vec3(vertex.position[0], vertex.position[1], vertex.position[2]);
        left *= away;
    }
    return position;
}

}  // namespace lodestone
