// What leaves are off by beside samples.
#include "vgi/bake/images/leaves/side_errors.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaf_triangles.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

// A leaf is drawn beside the samples of a square only where the square's own leaf is not wanted: then what it is drawn
// as is no farther from the source than that leaf's error says. A tenth is allowed between the places that were
// measured.
TEST(SideErrors, AreHeldByTheLeafAcross) {
    const TriMesh source = fixtures::repaired(Shape::cliff, 20000);
    const Atlas atlas = small_atlas(source, 4, 40, true);
    std::vector<uint32_t> vertices;
    for (const Triangle& t : source.triangles) {
        for (const uint32_t w : t) vertices.push_back(source.wedge_vertex[w]);
    }
    const ClosestSurface surface(source.positions, vertices);
    const ErrorCodes codes(atlas.extent());
    const uint32_t cells = atlas.cells_of(0) / atlas.leaves_per_side(0);
    Random random(7);
    double worst = 0;
    size_t looked = 0, beyond = 0;
    for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
        for_leaf_squares(atlas, chart, [&](const Atlas::Tile& square, uint32_t leaf) {
            const auto sample = [&](GridPoint p) {
                return atlas.point(atlas.texel(chart, square.x * cells + static_cast<uint32_t>(p.x),
                                               square.y * cells + static_cast<uint32_t>(p.y)));
            };
            for (uint32_t s = 0; s < 4; ++s) {
                const uint32_t across = leaf_across(atlas, square, s).leaf;
                if (across == ~0u || !atlas.has_leaf(leaf) || !atlas.has_leaf(across)) continue;
                LeafBorder border;
                border.sampled[s] = border.corner_sampled[s] = border.corner_sampled[(s + 1) % 4] = true;
                const double error = static_cast<double>(codes.error(atlas.leaves[across].error));
                for (uint32_t p = leaf == 0 ? 0 : atlas.leaves[leaf - 1].parts_end; p < atlas.leaves[leaf].parts_end;
                     ++p) {
                    const LeafPart part = decoded_leaf(atlas, p);
                    const auto own = [&](uint32_t v) { return atlas.leaf_point(part.vertices[v].position); };
                    const auto look = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
                        for (int n = 0; n < 4; ++n) {
                            const double u = random.unit(), v = random.unit() * (1 - u);
                            const double off = surface.closest(a * (1 - u - v) + b * u + c * v).distance;
                            ++looked;
                            beyond += off > error;
                            worst = std::max(worst, off / error);
                        }
                    };
                    for_drawn_triangles(part, border, static_cast<int32_t>(cells), own, sample, look);
                }
            }
        });
    }
    EXPECT_GT(looked, 50000u);
    EXPECT_LT(worst, 1.1) << beyond << " of " << looked;
}

}  // namespace
}  // namespace lodestone::vgi
