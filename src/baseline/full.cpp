#include "baseline/full.h"

#include <meshoptimizer.h>

namespace lodestone {

FixedLevels full_level(std::span<const MeshVertex> vertices, std::span<const uint32_t> indices) {
    struct Store {
        std::vector<MeshVertex> vertices;
        std::vector<uint32_t> indices;
    };
    const auto store = std::make_shared<Store>();
    for (size_t i = 0; i + 2 < indices.size(); i += 3) {
        const uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
        if (a != b && b != c && c != a) store->indices.insert(store->indices.end(), {a, b, c});
    }
    meshopt_optimizeVertexCache(store->indices.data(), store->indices.data(), store->indices.size(), vertices.size());
    store->vertices.resize(vertices.size());
    const size_t used =
        meshopt_optimizeVertexFetch(store->vertices.data(), store->indices.data(), store->indices.size(),
                                    vertices.data(), vertices.size(), sizeof(MeshVertex));
    store->vertices.resize(used);
    return {store->vertices, {{store->indices, 0}}, store};
}

}  // namespace lodestone
