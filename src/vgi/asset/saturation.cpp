#include "vgi/asset/saturation.h"

#include <glm/geometric.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/threads.h"
#include "vgi/asset/corners.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/sample_depths.h"

namespace lodestone::vgi {

namespace {

// What is wrong with the errors and bounds of a chart; empty where nothing is.
class ChartErrorCheck {
public:
    ChartErrorCheck(const Atlas& atlas, const SampleDepths& depths, uint32_t chart)
        : atlas_(atlas),
          depths_(depths),
          chart_(chart),
          of_atlas_(tree_of(atlas, Layer::geometry)),
          pages_(tree_of(atlas, Layer::geometry, chart)),
          codes_(atlas.extent()),
          bounds_(std::span(atlas.bounds).subspan(size_t{chart} * of_atlas_.pages(), of_atlas_.pages())) {}

    std::string run() {
        check_samples();
        check_absent();
        for (uint32_t page = 0; page < pages_.pages(); ++page) check_page(page);
        for (uint32_t page = pages_.pages(); page < of_atlas_.pages(); ++page) {
            PageBounds wanted = bounds_[of_atlas_.parent(page)];
            wanted.sample_error = wanted.sample_radius = 0;
            if (bounds_[page] != wanted) fault_ = name(page) + "is left out and has other bounds than its parent";
        }
        return fault_;
    }

private:
    std::string name(uint32_t page) const {
        return "chart " + std::to_string(chart_) + ", page " + std::to_string(page) + ": ";
    }

    void check_samples() {
        const Bintree tree = bintree_of(atlas_, chart_);
        for (uint32_t depth = 1; depth < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint p) {
                tree.for_children(p, [&](GridPoint q) {
                    if (!is_saturated(p, q))
                        fault_ = "chart " + std::to_string(chart_) + ", sample " + std::to_string(p.x) + ", " +
                                 std::to_string(p.y) + ": is not saturated";
                });
            });
        }
    }
    // Samples that are not there say so, and no others do.
    void check_absent() {
        const std::vector<bool> absent = absent_samples(atlas_, depths_, chart_);
        const size_t first = atlas_.texel(chart_, 0, 0);
        for (size_t i = 0; i < absent.size(); ++i) {
            const bool says_so = atlas_.sample_radii[first + i] == ErrorCodes::absent;
            if (says_so != absent[i] || (says_so && atlas_.sample_errors[first + i] != 0))
                fault_ = "chart " + std::to_string(chart_) + ", sample " + std::to_string(i) +
                         ": is there, or not, other than its error and radius say";
        }
    }
    bool is_saturated(GridPoint p, GridPoint child) const {
        const size_t m = texel_of(atlas_, chart_, p), its = texel_of(atlas_, chart_, child);
        const auto error = static_cast<double>(codes_.error(atlas_.sample_errors[m])),
                   radius = static_cast<double>(codes_.radius(atlas_.sample_radii[m])),
                   its_error = static_cast<double>(codes_.error(atlas_.sample_errors[its]));
        if (its_error == 0) return true;
        const double reach = (its_error - error) * least_magnification +
                             static_cast<double>(codes_.radius(atlas_.sample_radii[its])) +
                             glm::length(atlas_.point(its) - atlas_.point(m));
        const bool is_everywhere = atlas_.sample_radii[m] == ErrorCodes::everywhere;
        return !(its_error > error || (reach > radius && !is_everywhere));
    }

    void check_page(uint32_t page) {
        const PageBounds& bounds = bounds_[page];
        const PageBounds& parent = bounds_[page == 0 ? 0 : pages_.parent(page)];
        for_own_samples(atlas_, chart_, page, [&](size_t texel) {
            if (atlas_.sample_errors[texel] > bounds.sample_error || atlas_.sample_radii[texel] > bounds.sample_radius)
                fault_ = name(page) + "a sample has a larger code than its page";
        });
        if (!(bounds.error <= parent.error)) fault_ = name(page) + "has a larger error than its parent";
        uint32_t level = 0, px = 0, py = 0;
        pages_.place(page, &level, &px, &py);
        const uint32_t n = pages_.cells_per_page();
        for (uint32_t y = py * n; y <= py * n + n; ++y) {
            for (uint32_t x = px * n; x <= px * n + n; ++x) {
                const glm::dvec3 off =
                    atlas_.point(atlas_.texel(chart_, x << level, y << level)) - glm::dvec3(bounds.centre);
                if (glm::length(off) > static_cast<double>(bounds.radius))
                    fault_ = name(page) + "a sample lies outside its sphere";
            }
        }
    }

    const Atlas& atlas_;
    const SampleDepths& depths_;
    const uint32_t chart_;
    const PageTree of_atlas_, pages_;
    const ErrorCodes codes_;
    const std::span<const PageBounds> bounds_;  // of the chart
    std::string fault_;
};

}  // namespace

Result<void> validate_errors(const Atlas& atlas) {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "atlas: " + what); };
    if (atlas.bounds.size() != size_t{atlas.charts()} * tree_of(atlas, Layer::geometry).pages())
        return wrong("bounds are not one per page");
    const SampleDepths depths(atlas);
    std::vector<std::string> faults(atlas.charts());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) faults[c] = ChartErrorCheck(atlas, depths, static_cast<uint32_t>(c)).run();
    });
    for (const std::string& fault : faults) {
        if (!fault.empty()) return wrong(fault);
    }
    if (auto good = validate_corner_errors(atlas); !good) return wrong(good.error().message);
    return {};
}

}  // namespace lodestone::vgi
