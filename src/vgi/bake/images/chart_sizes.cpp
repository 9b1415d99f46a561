#include "vgi/bake/images/chart_sizes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/structures/disjoint_sets.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

constexpr double clusters_of_small = 4;  // components with a smaller share have more than that
// Along a side, at least. The lattice is chosen by the error of samples, and samples of few charts take next to
// nothing; of many they may be coarser.
constexpr uint32_t fewest_cells = 8, fewest_of_many = 4, many_charts = 256;

struct Component {
    double area = 0;
    size_t charts = 0, triangles = 0;
};

// Charts that hang together.
DisjointSets joined_charts(const ChartComplex& patches, size_t count) {
    DisjointSets joined(count);
    for (const Arc& arc : patches.arcs) {
        if (arc.right != none) joined.join(arc.left, arc.right);
    }
    return joined;
}

// A component's charts and texels.
struct Textured {
    double charts = 0, texels = 0;
};
// Of each chart: its component.
std::vector<Textured> textured_components(std::span<const double> texels, const ChartComplex& patches) {
    const auto count = static_cast<uint32_t>(texels.size());
    DisjointSets joined = joined_charts(patches, count);
    std::vector<Textured> components(count);  // by their lowest chart
    for (uint32_t c = 0; c < count; ++c) {
        Textured& component = components[joined.find(c)];
        component.charts += 1;
        component.texels += texels[c];
    }
    std::vector<Textured> of_charts;
    for (uint32_t c = 0; c < count; ++c) of_charts.push_back(components[joined.find(c)]);
    return of_charts;
}

// Whether tables with a place for every page of `most` cells for each chart are far larger than what is in them.
// cells: per chart.
bool is_wide(std::span<const uint32_t> cells, uint32_t most) {
    constexpr uint64_t always = 1 << 20, most_places_for_a_page = 32;
    uint64_t pages = 0;
    for (const uint32_t own : cells) pages += PageTree{std::min(own, most)}.pages();
    return cells.size() * uint64_t{PageTree{most}.pages()} > std::max(always, most_places_for_a_page * pages);
}

}  // namespace

ChartSizes chart_sizes(const Surface& surface, const std::vector<std::vector<uint32_t>>& members,
                       const ChartComplex& patches, const SizesWanted& wanted) {
    const auto count = static_cast<uint32_t>(members.size());
    DisjointSets joined = joined_charts(patches, count);
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
    const uint32_t fewest = count > many_charts ? fewest_of_many : fewest_cells;
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
        if (sizes.cells <= fewest || texels <= wanted.most_texels) return sizes;
    }
}

ChartSizes sizes_by_triangles(std::span<const double> triangles, const ChartComplex& patches,
                              const SizesWanted& wanted) {
    // Places between samples take memory while an atlas is baked, and where charts have several pages when it is drawn.
    constexpr double most_places_for_a_sample = 16;
    const auto count = static_cast<uint32_t>(triangles.size());
    const uint32_t fewest = std::min(count > many_charts ? 2 : fewest_cells, wanted.cells);
    std::vector<uint32_t> cells(count);
    double samples = 0;
    for (uint32_t c = 0; c < count; ++c) {
        uint32_t& own = cells[c] = fewest;
        const double most_samples = wanted.needed_for_a_triangle * triangles[c];
        while (own < wanted.cells && std::pow(2 * own + 1, 2) <= most_samples) own *= 2;
        samples += std::pow(own + 1, 2);
    }
    uint32_t most = *std::ranges::max_element(cells);
    while (most > fewest && count * std::pow(most + 1, 2) > most_places_for_a_sample * samples) most /= 2;
    // Of each component the most that one of its charts has.
    DisjointSets joined = joined_charts(patches, count);
    std::vector<uint32_t> of_component(count, std::min(most, page_cells));
    for (uint32_t c = 0; c < count; ++c) {
        cells[c] = std::min(cells[c], most);
        uint32_t& of = of_component[joined.find(c)];
        of = std::max(of, cells[c]);
    }
    ChartSizes sizes{most, {}, {}};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t whole = of_component[joined.find(c)], square = std::min(whole, page_cells);
        const uint32_t own = std::max(cells[c], 2 * whole / square);  // in each square of leaves 3^2
        sizes.trimmed_levels.push_back(static_cast<uint8_t>(std::countr_zero(most / whole)));
        sizes.unsampled_levels.push_back(static_cast<uint8_t>(std::countr_zero(whole / own)));
    }
    return sizes;
}

ChartSizes texture_sizes(std::span<const double> texels, const ChartComplex& patches, const ChartSizes& positions) {
    // Somewhat fewer samples than texels will do. With more, bytes are better spent on the quality of those there are.
    constexpr double enough = 0.75;
    constexpr uint32_t most_cells = 4096;
    const auto count = static_cast<uint32_t>(texels.size());
    const std::vector<Textured> components = textured_components(texels, patches);
    std::vector<uint32_t> cells(count);
    for (uint32_t c = 0; c < count; ++c) {
        cells[c] = positions.cells >> positions.trimmed_levels[c];
        const auto samples = [&] { return components[c].charts * cells[c] * cells[c]; };
        while (cells[c] < most_cells && samples() < enough * components[c].texels) cells[c] *= 2;
    }
    uint32_t most = *std::ranges::max_element(cells);
    while (most > positions.cells && is_wide(cells, most)) most /= 2;
    ChartSizes sizes{most, {}};
    for (const uint32_t own : cells) {
        const uint32_t whole_pages = std::clamp(own, std::min(most, page_cells), most);
        sizes.trimmed_levels.push_back(static_cast<uint8_t>(std::countr_zero(most / whole_pages)));
    }
    return sizes;
}

std::vector<double> samples_per_texel(std::span<const double> texels, const ChartComplex& patches,
                                      const ChartSizes& sizes) {
    const std::vector<Textured> components = textured_components(texels, patches);
    std::vector<double> ratios;
    for (size_t c = 0; c < texels.size(); ++c) {
        const double cells = sizes.cells >> sizes.trimmed_levels[c];
        ratios.push_back(components[c].texels > 0 ? components[c].charts * cells * cells / components[c].texels : 0);
    }
    return ratios;
}

}  // namespace lodestone::vgi
