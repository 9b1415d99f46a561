#include "vgi/asset/saturation.h"

#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "base/threads.h"
#include "vgi/asset/error_codes.h"

namespace lodestone::vgi {

Result<void> validate_errors(const Atlas& atlas) {
    const PageTree of_atlas = tree_of(atlas, Layer::geometry);
    const ErrorCodes codes(atlas.extent());
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "atlas: " + what); };
    if (atlas.bounds.size() != size_t{atlas.charts()} * of_atlas.pages()) return wrong("bounds are not one per page");
    std::vector<std::string> faults(atlas.charts());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
            const auto name = [&](GridPoint p) {
                return "chart " + std::to_string(c) + ", sample " + std::to_string(p.x) + ", " + std::to_string(p.y);
            };
            const Bintree tree = bintree_of(atlas, c);
            for (uint32_t depth = 1; depth < tree.depths(); ++depth) {
                tree.for_depth(depth, [&](GridPoint p) {
                    const size_t m = texel_of(atlas, c, p);
                    const auto error = static_cast<double>(codes.error(atlas.sample_errors[m])),
                               radius = static_cast<double>(codes.radius(atlas.sample_radii[m]));
                    tree.for_children(p, [&](GridPoint q) {
                        const size_t child = texel_of(atlas, c, q);
                        const auto its = static_cast<double>(codes.error(atlas.sample_errors[child]));
                        if (its == 0) return;
                        const double reach = (its - error) * least_magnification +
                                             static_cast<double>(codes.radius(atlas.sample_radii[child])) +
                                             glm::length(atlas.point(child) - atlas.point(m));
                        if (its > error || reach > radius) faults[c] = name(p) + ": is not saturated";
                    });
                });
            }
            const PageTree pages = tree_of(atlas, Layer::geometry, c);
            const PageBounds* const of_chart = &atlas.bounds[size_t{c} * of_atlas.pages()];
            for (uint32_t page = 0; page < pages.pages(); ++page) {
                uint32_t level = 0, px = 0, py = 0;
                pages.place(page, &level, &px, &py);
                const PageBounds& bounds = of_chart[page];
                const PageBounds& parent = of_chart[page == 0 ? 0 : pages.parent(page)];
                const std::string place = "chart " + std::to_string(c) + ", page " + std::to_string(page);
                for_own_samples(atlas, c, page, [&](size_t texel) {
                    if (atlas.sample_errors[texel] > bounds.sample_error ||
                        atlas.sample_radii[texel] > bounds.sample_radius)
                        faults[c] = place + ": a sample has a larger code than its page";
                });
                if (!(bounds.error <= parent.error)) faults[c] = place + ": has a larger error than its parent";
                const uint32_t n = pages.cells_per_page();
                for (uint32_t y = py * n; y <= py * n + n; ++y) {
                    for (uint32_t x = px * n; x <= px * n + n; ++x) {
                        const glm::dvec3 off =
                            atlas.point(atlas.texel(c, x << level, y << level)) - glm::dvec3(bounds.centre);
                        if (glm::length(off) > static_cast<double>(bounds.radius))
                            faults[c] = place + ": a sample lies outside its sphere";
                    }
                }
            }
            for (uint32_t page = pages.pages(); page < of_atlas.pages(); ++page) {
                PageBounds wanted = of_chart[of_atlas.parent(page)];
                wanted.sample_error = wanted.sample_radius = 0;
                if (of_chart[page] != wanted)
                    faults[c] = "chart " + std::to_string(c) + ", page " + std::to_string(page) +
                                ": is left out and has other bounds than its parent";
            }
        }
    });
    for (const std::string& fault : faults) {
        if (!fault.empty()) return wrong(fault);
    }
    return {};
}

}  // namespace lodestone::vgi
