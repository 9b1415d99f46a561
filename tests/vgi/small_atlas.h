// An atlas of a few charts, for tests.
#pragma once

#include <gtest/gtest.h>

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

}  // namespace lodestone::vgi
