// An atlas of a few charts, for tests.
#pragma once

#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/bake/bake.h"

namespace lodestone::vgi {

inline Atlas small_atlas(const TriMesh& mesh, uint32_t cells, uint32_t clusters = 8, bool leaves = false) {
    AtlasOptions options;
    options.clusters.clusters = clusters;
    options.cells = cells;
    options.leaves = leaves;
    options.error_samples = 1000;
    AtlasReport report;
    auto atlas = make_atlas(mesh, options, report);
    EXPECT_TRUE(atlas) << atlas.error().message;
    return atlas ? std::move(*atlas) : Atlas{};
}

// Charts that end at different depths, with leaves.
inline Atlas uneven_atlas(uint32_t clusters) {
    AtlasOptions options;
    options.clusters.clusters = clusters;
    options.leaves = true;
    options.samples_per_triangle = 0.75;
    options.error_samples = 1000;
    AtlasReport report;
    auto atlas = make_atlas(fixtures::uneven_rock(), options, report);
    EXPECT_TRUE(atlas) << atlas.error().message;
    return atlas ? std::move(*atlas) : Atlas{};
}

// Moves the first point of parts of leaves that `which` names, so that it is no longer where neighbours have it.
template <class Which>
void move_points(Atlas& atlas, Which&& which) {
    ByteLists parts;
    for (size_t p = 0; p < atlas.leaf_parts.size(); ++p) {
        LeafPart part = *decode_leaf(atlas.leaf_parts[p], atlas.attributes);
        if (which(p)) part.vertices[0].position[0] ^= 1;
        parts.add(encode_leaf(part, atlas.attributes));
    }
    atlas.leaf_parts = std::move(parts);
}

}  // namespace lodestone::vgi
