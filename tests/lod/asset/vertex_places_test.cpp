#include "lod/asset/vertex_places.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {
namespace {

// More wedges than indices of 16 bits.
const ProgressiveMesh& large() {
    static const ProgressiveMesh pm = [] {
        const TriMesh mesh = fixtures::repaired(Shape::rock, 160000);
        const auto list = make_quadric_simplifier()->simplify(mesh, {});
        return *bake_progressive_mesh(mesh, *list, {"static"});
    }();
    return pm;
}

TEST(VertexPlaces, AreEachTakenOnce) {
    std::vector<uint32_t> places = vertex_places(large(), 0);
    ASSERT_GT(places.size(), region_wedges);
    std::ranges::sort(places);
    for (uint32_t i = 0; i < places.size(); ++i) ASSERT_EQ(places[i], i);
}

// Device: vertices are shaded anew where indices do not agree above 16 bits.
TEST(VertexPlaces, OfNeighboursAgreeAbove16BitsAtEveryLevel) {
    const CacheModel device = *cache_model_named("nvidia");
    CacheModel limitless = device;
    limitless.batch_index_bits = 0;
    const std::vector<uint32_t> places = vertex_places(large(), 0);
    PmCursor cursor(large(), 0);
    for (const uint32_t triangles : {160000u, 80000u, 20000u, 4000u}) {
        cursor.goto_level(large().level_for_triangles(triangles));
        const auto drawn = cursor.drawn_indices();
        const double best = simulate(limitless, drawn).acmr();
        EXPECT_LT(simulate(device, placed(drawn, places)).acmr(), 1.15 * best) << triangles;
        if (triangles > 100000) { EXPECT_GT(simulate(device, drawn).acmr(), 1.8 * best); }
    }
}

}  // namespace
}  // namespace lodestone
