#include "vgi/draw/leaves/leaf_runs.h"

#include "vgi/asset/triangle_bounds.h"

namespace lodestone::vgi {

std::vector<PageBounds> leaf_runs(const Atlas& about, const LeafPart& part) {
    std::vector<PageBounds> runs;
    runs.reserve((part.triangles.size() + leaf_run_triangles - 1) / leaf_run_triangles);
    std::vector<TriangleCorners> places, lattice;
    for (const auto& triangle : part.triangles) {
        TriangleCorners &place = places.emplace_back(), &point = lattice.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
            const auto& p = part.vertices[triangle[k]].position;
            place[k] = about.leaf_point(p);
            point[k] = {p[0], p[1], p[2]};
        }
        if (places.size() < leaf_run_triangles && &triangle != &part.triangles.back()) continue;
        // Rounded up by what single precision loses of places.
        put_sphere(places, about.extent() * 1e-6, runs.emplace_back());
        put_cone(lattice, 0, runs.back());
        places.clear();
        lattice.clear();
    }
    return runs;
}

}  // namespace lodestone::vgi
