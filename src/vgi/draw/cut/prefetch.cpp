#include "vgi/draw/cut/prefetch.h"

#include <algorithm>
#include <vector>

#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

// Parts of the leaf in the square of a page that is there.
void prefetch_leaf(const Residency& residency, const RefinementTest& wanted, uint32_t number,
                   const PageDemand& wanted_now, PageDemand& prefetched) {
    const uint32_t leaf = residency.topology().leaf(number);
    if (leaf == ~0u) return;
    const Leaf& of = residency.about().leaves[leaf];
    const GeometryTexel texel = texel_of(of);
    if (!wanted(texel)) return;
    for (uint32_t p = residency.about().first_part(leaf); p < of.parts_end; ++p) {
        const uint32_t unit = residency.pages() + p;
        if (!residency.holds_leaf_part(p) && wanted_now.wish(unit) == 0)
            prefetched.ask(unit, std::min(wanted.excess(texel) * 1e-3f, 1e-2f));
    }
}

}  // namespace

void prefetch(const Residency& residency, const CutRequest& request, std::span<const uint32_t> charts,
              const PageDemand& wanted_now, PageDemand& prefetched) {
    const Visibility visibility(request, residency.about());
    const RefinementTest wanted(request, residency.about());
    const PageTree& tree = residency.tree();
    const auto leaf_may_be = [&](uint32_t number) {
        return wanted.may_be(residency.about().bounds[number], residency.topology().leaves_below(number));
    };
    const auto may_be_below = [&](uint32_t number) {
        return wanted.may_be(residency.about().bounds[number], residency.below(number)) || leaf_may_be(number);
    };
    std::vector<uint32_t> open;
    for (const uint32_t chart : charts) {
        open.assign(1, 0);
        while (!open.empty()) {
            const uint32_t page = open.back(), number = residency.number(chart, page);
            open.pop_back();
            const PageBounds& bounds = residency.about().bounds[number];
            // The sphere holds all finer pages, too, and none of them has larger errors.
            if (visibility.seen(1, number) == 0) continue;
            if (residency.holds(number)) {
                prefetch_leaf(residency, wanted, number, wanted_now, prefetched);
                if (tree.level(page) == 0 || !may_be_below(number)) continue;
                for (uint32_t k = 0; k < 4; ++k) open.push_back(tree.member(page + 1, k));
            } else if (wanted_now.wish(number) == 0 && (wanted.may_be(bounds) || leaf_may_be(number))) {
                prefetched.ask(number, std::min(wanted.excess(bounds) * 1e-3f, 1e-2f));
            }
        }
    }
}

}  // namespace lodestone::vgi
