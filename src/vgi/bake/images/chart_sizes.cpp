#include "vgi/bake/images/chart_sizes.h"

#include <glm/geometric.hpp>

#include "base/structures/disjoint_sets.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

constexpr double clusters_of_small = 4;  // components with a smaller share have more than that
constexpr uint32_t fewest_cells = 8;

struct Component {
    double area = 0;
    size_t charts = 0, triangles = 0;
};

}  // namespace

ChartSizes chart_sizes(const Surface& surface, const std::vector<std::vector<uint32_t>>& members,
                       const ChartComplex& patches, const SizesWanted& wanted) {
    const auto count = static_cast<uint32_t>(members.size());
    DisjointSets joined(count);
    for (const Arc& arc : patches.arcs) {
        if (arc.right != none) joined.join(arc.left, arc.right);
    }
    std::vector<Component> components(count);  // by their lowest chart
    double whole = 0;
    for (uint32_t c = 0; c < count; ++c) {
        Component& component = components[joined.find(c)];
        ++component.charts;
        component.triangles += members[c].size();
        for (const uint32_t t : members[c]) {
            const double area = surface.area(t);
            component.area += area;
            whole += area;
        }
    }
    const auto levels_left_out = [&](const Component& component, uint32_t of_cells) {
        const double share = whole > 0 ? component.area / whole : 1;
        if (share * wanted.clusters >= clusters_of_small) return 0u;
        const double usual = share * wanted.clusters * usual_charts_per_cluster * of_cells * of_cells,
                     needed = wanted.needed_for_a_triangle * static_cast<double>(component.triangles);
        const auto samples = [&](uint32_t levels) {
            return static_cast<double>(component.charts) * (of_cells >> levels) * (of_cells >> levels);
        };
        uint32_t levels = 0;
        while (levels < PageTree{of_cells}.base_level() && samples(levels + 1) >= std::max(usual, needed)) ++levels;
        return levels;
    };
    ChartSizes sizes{wanted.cells, {}};
    for (;; sizes.cells /= 2) {
        sizes.trimmed_levels.clear();
        double texels = 0;
        for (uint32_t c = 0; c < count; ++c) {
            sizes.trimmed_levels.push_back(
                static_cast<uint8_t>(levels_left_out(components[joined.find(c)], sizes.cells)));
            const double row = (sizes.cells >> sizes.trimmed_levels[c]) + 1;
            texels += row * row;
        }
        if (sizes.cells <= fewest_cells || texels <= wanted.most_texels) return sizes;
    }
}

}  // namespace lodestone::vgi
