// The tiles of an atlas in memory, and random sets of them that cover the surface.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/random.h"
#include "tiles/check/closed_cuts.h"
#include "tiles/tile_mesh.h"
#include "tiles/tile_tree.h"
#include "vgi/small_atlas.h"

namespace lodestone::tiles {

struct TiledSurface {
    vgi::Atlas atlas;
    TileTree tree;
    std::vector<TileMesh> meshes;  // per tile
};

inline TiledSurface tiled(vgi::Atlas atlas, uint32_t tile_triangles = least_tile_triangles) {
    TiledSurface surface{std::move(atlas), {}, {}};
    surface.tree = make_tile_tree(surface.atlas, tile_triangles);
    const auto valid = surface.tree.validate(surface.atlas);
    EXPECT_TRUE(valid) << valid.error().message;
    for (uint32_t tile = 0; tile < surface.tree.nodes.size(); ++tile)
        surface.meshes.push_back(make_tile_mesh(surface.atlas, surface.tree, tile));
    return surface;
}

inline void add_random_cut(const TileTree& tree, uint32_t tile, double share, Random& random,
                           std::vector<uint32_t>& cut) {
    if (tree.nodes[tile].children.empty() || random.unit() >= share) {
        cut.push_back(tile);
        return;
    }
    for (const uint32_t child : tree.nodes[tile].children) add_random_cut(tree, child, share, random, cut);
}
// The root is mostly gone into.
inline std::vector<uint32_t> random_cut(const TileTree& tree, Random& random) {
    std::vector<uint32_t> cut;
    const double share = random.uniform(0.3, 0.95);
    for (int tries = 0; tries < 4 && cut.size() < 2; ++tries) {
        cut.clear();
        add_random_cut(tree, 0, share, random, cut);
    }
    return cut;
}

// Places of the corners of a tile's triangles, of the first `count` of them.
inline std::vector<uint32_t> corners_of(const TileMesh& mesh, size_t count, Places& places) {
    std::vector<uint32_t> corners;
    for (size_t t = 0; t < std::min(count, mesh.triangles.size()); ++t) {
        for (const uint32_t v : mesh.triangles[t]) {
            const auto& p = mesh.vertices[v].position;
            corners.push_back(
                places.number({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}));
        }
    }
    return corners;
}
inline std::vector<uint32_t> corners_of(const TileMesh& mesh, Places& places) {
    return corners_of(mesh, mesh.triangles.size(), places);
}

// Levels between tiles of a cut, at most.
inline uint32_t largest_step(const TileTree& tree, const std::vector<uint32_t>& cut) {
    uint32_t finest = ~0u, coarsest = 0;
    for (const uint32_t tile : cut) {
        finest = std::min(finest, tree.nodes[tile].level);
        coarsest = std::max(coarsest, tree.nodes[tile].level);
    }
    return coarsest - finest;
}

}  // namespace lodestone::tiles
