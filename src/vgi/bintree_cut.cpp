#include "vgi/bintree_cut.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/visibility.h"

namespace lodestone::vgi {

namespace {

struct Corner {
    int32_t x, y;
    uint32_t index;
};

class ChartCut {
public:
    // touched: as PageDemand's, of which only the pages of the charts run here are written.
    ChartCut(const Residency& residency, const Visibility& visibility, const Wanted& wanted, int64_t forced_level,
             std::vector<uint8_t>& touched)
        : residency_(residency),
          visibility_(visibility),
          wanted_(wanted),
          forced_level_(forced_level),
          touched_(touched),
          tree_(residency.tree()),
          n_(static_cast<int32_t>(tree_.cells_per_page())),
          page_shift_(static_cast<uint32_t>(std::countr_zero(tree_.cells_per_page()))),
          base_(tree_.base_level()) {}

    void run(uint32_t chart) {
        first_page_ = residency_.number(chart, 0);
        const uint32_t mask = visibility_.seen(visibility_.all(), first_page_);
        if (mask == 0) return;
        touched_[first_page_] = 1;
        const auto cells = static_cast<int32_t>(tree_.cells);
        const auto corner = [&](int32_t x, int32_t y) {
            const Entry& e = residency_.entry(first_page_);
            return Corner{x * cells, y * cells,
                          e.slot * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>((y * n_) * (n_ + 1) + x * n_)};
        };
        const Corner a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
        const uint32_t depth = Bintree{cells}.depths();
        split(b, c, a, depth, mask);
        split(d, a, c, depth, mask);
    }

    const CutParts& parts() const { return parts_; }
    // Pages asked for, with PageDemand::wanted.
    const std::vector<std::pair<uint32_t, float>>& asked() const { return asked_; }

private:
    using Entry = Residency::Entry;

    // The triangle with its right angle at `apex`, counter-clockwise apex, a, b. depth: of the sample that would split
    // it, plus one.
    void split(const Corner& apex, const Corner& a, const Corner& b, uint32_t depth, uint32_t mask) {
        if (depth > 0) {
            Corner m{(a.x + b.x) / 2, (a.y + b.y) / 2, 0};
            const uint32_t level = (depth - 1) / 2;
            // The centre of a page's square: what is finer lies in the page.
            if (depth % 2 == 0 && level + 1 < base_ + page_shift_ && level + 1 >= page_shift_) {
                const uint32_t page_level = level + 1 - page_shift_;
                mask = visibility_.seen(mask,
                                        first_page_ + tree_.page(page_level, static_cast<uint32_t>(m.x) >> (level + 1),
                                                                 static_cast<uint32_t>(m.y) >> (level + 1)));
                if (mask == 0) return;
            }
            if (take(m, level, mask)) {
                split(m, apex, a, depth - 1, mask);
                split(m, b, apex, depth - 1, mask);
                return;
            }
        }
        std::vector<uint32_t>& out = parts_.list(mask);
        out.insert(out.end(), {apex.index, a.index, b.index});
    }

    // Whether the sample is in the cut; then also its index.
    bool take(Corner& m, uint32_t level, uint32_t mask) {
        const uint32_t page_level = std::min(level, base_);
        const uint32_t side_shift = base_ - page_level;  // log2 of pages along a side
        const int32_t last = (1 << side_shift) - 1;
        const int32_t sx = m.x >> page_level, sy = m.y >> page_level;
        const int32_t px = std::min(sx >> page_shift_, last), py = std::min(sy >> page_shift_, last);
        const int32_t lx = sx - (px << page_shift_), ly = sy - (py << page_shift_);
        const uint32_t number =
            first_page_ + PageTree::page_of(side_shift, static_cast<uint32_t>(px), static_cast<uint32_t>(py));
        const Entry& entry = residency_.entry(number);
        // On a border the page across is needed as well.
        const uint32_t needed =
            1u | (ly == 0 ? 2u : 0u) | (lx == n_ ? 4u : 0u) | (ly == n_ ? 8u : 0u) | (lx == 0 ? 16u : 0u);
        if (entry.first == nullptr) {
            guess(number, level, mask);
            return false;
        }
        const GeometryTexel& texel = entry.first[ly * (n_ + 1) + lx];
        const bool want = forced_level_ >= 0 ? static_cast<int64_t>(level) >= forced_level_ : wanted_(texel);
        if (!want) return false;
        touched_[number] = 1;
        if ((entry.usable & needed) != needed) {
            for (uint32_t side = 0; side < 4; ++side) {
                if ((needed >> (side + 1) & 1) != 0) need(residency_.neighbour(number, side), mask);
            }
            need(number, mask);
            return false;
        }
        m.index = entry.slot * LODE_VGI_PAGE_TEXELS + static_cast<uint32_t>(ly * (n_ + 1) + lx);
        return true;
    }

    // What a page that is not there holds is not known, but what its parent leaves out is.
    void guess(uint32_t number, uint32_t level, uint32_t mask) {
        const uint32_t parent = first_page_ + tree_.parent(number - first_page_);
        if (residency_.entry(parent).texels == nullptr) return;  // its turn comes first
        const PageBounds& bounds = residency_.about().bounds[number];
        if (forced_level_ >= 0 ? static_cast<int64_t>(level) >= forced_level_ : wanted_.may_be(bounds))
            ask(number, wanted_.excess(bounds), mask);
    }
    // Something that makes the page usable is missing: the first such thing is asked for.
    void need(uint32_t number, uint32_t mask) {
        if (number == ~0u || residency_.usable(number)) return;
        const uint32_t per_chart = tree_.pages(), page = number % per_chart, first = number - page;
        const uint32_t parent = first + tree_.parent(page);  // base pages are always usable
        if (!residency_.usable(parent)) return need(parent, mask);
        if (residency_.entry(number).texels == nullptr)
            return ask(number, wanted_.excess(residency_.about().bounds[number]), mask);
        uint32_t level = 0, x = 0, y = 0;
        tree_.place(page, &level, &x, &y);
        need(residency_.neighbour(parent, y % 2 == 0 ? 0 : 2), mask);
        need(residency_.neighbour(parent, x % 2 == 0 ? 3 : 1), mask);
    }
    void ask(uint32_t number, float excess, uint32_t mask) { asked_.emplace_back(number, wish_for(excess, mask)); }

    const Residency& residency_;
    const Visibility& visibility_;
    const Wanted& wanted_;
    const int64_t forced_level_;
    std::vector<uint8_t>& touched_;
    CutParts parts_;
    std::vector<std::pair<uint32_t, float>> asked_;
    const PageTree tree_;
    const int32_t n_;
    const uint32_t page_shift_, base_;
    uint32_t first_page_ = 0;
};

}  // namespace

Cut cut_bintree(const Residency& residency, const CutRequest& request, PageDemand& demand) {
    LODE_CHECK(!request.views.empty() && request.views.size() < 32 && demand.touched.size() == residency.pages());
    const Visibility visibility(request, residency.about());
    const Wanted wanted(request, residency.about());
    constexpr size_t charts_at_once = 16;
    const size_t charts = residency.about().charts();
    std::vector<std::optional<ChartCut>> done((charts + charts_at_once - 1) / charts_at_once);
    parallel_for(charts, charts_at_once, [&](size_t begin, size_t end) {
        ChartCut& cut =
            done[begin / charts_at_once].emplace(residency, visibility, wanted, request.forced_level, demand.touched);
        for (size_t c = begin; c < end; ++c) cut.run(static_cast<uint32_t>(c));
    });
    CutParts parts;
    for (const auto& part_of : done) {
        parts.add(part_of->parts());
        for (const auto& [page, wish] : part_of->asked()) demand.ask(page, wish);
    }
    Cut result;
    result.parts = parts.take();
    for (const auto& [mask, indices] : result.parts) result.triangles += (mask & 1) != 0 ? indices.size() / 3 : 0;
    return result;
}

}  // namespace lodestone::vgi
