#include "baseline/full.h"

#include <meshoptimizer.h>

#include "base/check.h"

namespace lodestone {

FixedLevels full_level(std::span<const MeshVertex> vertices, std::span<const uint32_t> indices,
                       std::span<const FurtherAttributes> further) {
    LODE_CHECK(further.empty() || further.size() == vertices.size(), further.size());
    struct Store {
        std::vector<MeshVertex> vertices;
        std::vector<FurtherAttributes> further;
        std::vector<uint32_t> indices;
    };
    const auto store = std::make_shared<Store>();
    for (size_t i = 0; i + 2 < indices.size(); i += 3) {
        const uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
        if (a != b && b != c && c != a) store->indices.insert(store->indices.end(), {a, b, c});
    }
    meshopt_optimizeVertexCache(store->indices.data(), store->indices.data(), store->indices.size(), vertices.size());
    std::vector<uint32_t> becomes(vertices.size());
    const size_t used =
        meshopt_optimizeVertexFetchRemap(becomes.data(), store->indices.data(), store->indices.size(), vertices.size());
    meshopt_remapIndexBuffer(store->indices.data(), store->indices.data(), store->indices.size(), becomes.data());
    const auto moved = [&](auto& to, const auto& from) {
        to.resize(from.empty() ? 0 : used);
        if (!from.empty())
            meshopt_remapVertexBuffer(to.data(), from.data(), from.size(), sizeof from[0], becomes.data());
    };
    moved(store->vertices, vertices);
    moved(store->further, further);
    return {store->vertices, store->further, {{store->indices, 0}}, store};
}

}  // namespace lodestone
