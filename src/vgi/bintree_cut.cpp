#include "vgi/bintree_cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/vec2.hpp>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/visibility.h"

namespace lodestone::vgi {

namespace {

// A square of 2^level finest cells, as wide as it is apart from others of its level; it is there as the two triangles
// either side of its diagonal.
struct Square {
    uint32_t level, x, y;
    std::array<uint32_t, 4> corners;  // indices: of (x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)
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
          n_(tree_.cells_per_page()),
          page_shift_(static_cast<uint32_t>(std::countr_zero(tree_.cells_per_page()))),
          base_(tree_.base_level()) {}

    void run(uint32_t chart) {
        first_page_ = residency_.number(chart, 0);
        const uint32_t mask = visibility_.seen(visibility_.all(), first_page_);
        if (mask == 0) return;
        touched_[first_page_] = 1;
        const Entry& e = residency_.entry(first_page_);
        const Square whole{
            base_ + page_shift_, 0, 0, {index(e, 0, 0), index(e, n_, 0), index(e, n_, n_), index(e, 0, n_)}};
        draw(whole, centres_around(whole), mask);
    }

    const CutParts& parts() const { return parts_; }
    // Pages asked for, with PageDemand::wanted.
    const std::vector<std::pair<uint32_t, float>>& asked() const { return asked_; }

private:
    using Entry = Residency::Entry;

    uint32_t index(const Entry& entry, uint32_t x, uint32_t y) const {
        return entry.slot * LODE_VGI_PAGE_TEXELS + y * (n_ + 1) + x;
    }

    // Triangles of one square, put into their list all at once.
    class Fan {
    public:
        void add(uint32_t a, uint32_t b, uint32_t c) {
            indices_[count_] = a;
            indices_[count_ + 1] = b;
            indices_[count_ + 2] = c;
            count_ += 3;
        }
        void put(std::vector<uint32_t>& list) const {
            list.insert(list.end(), indices_.begin(), indices_.begin() + count_);
        }

    private:
        std::array<uint32_t, 24> indices_;
        uint32_t count_ = 0;
    };

    // As the square of a page is seen; other squares are seen as the one they are part of.
    uint32_t seen(uint32_t level, uint32_t x, uint32_t y, uint32_t mask) const {
        if (level < page_shift_ || level >= base_ + page_shift_) return mask;
        return visibility_.seen(mask, first_page_ + tree_.page(level - page_shift_, x, y));
    }

    // Where the centres of squares lie: in one page for all four quarters of a square, in steps of its level.
    struct Centres {
        uint32_t level = 0, number = 0;
        const Entry* entry = nullptr;
        uint32_t step = 1, left = 0, top = 0;
        glm::uvec2 of(const Square& square) const {
            return {(2 * square.x + 1) * step - left, (2 * square.y + 1) * step - top};
        }
    };
    // square: of level 1 at least.
    Centres centres_around(const Square& square) const {
        Centres c;
        c.level = square.level - 1;
        const uint32_t page_level = std::min(c.level, base_);
        c.step = 1u << (c.level - page_level);
        const uint32_t px = (2 * square.x + 1) * c.step >> page_shift_, py = (2 * square.y + 1) * c.step >> page_shift_;
        c.left = px << page_shift_;
        c.top = py << page_shift_;
        c.number = first_page_ + PageTree::page_of(base_ - page_level, px, py);
        c.entry = &residency_.entry(c.number);
        return c;
    }
    void prefetch(const Centres& centres, const Square& first_quarter) const {
        if (centres.entry->first == nullptr) return;
        const glm::uvec2 at = centres.of(first_quarter);
        const GeometryTexel* const texel = centres.entry->first + at.y * (n_ + 1) + at.x;
        __builtin_prefetch(texel);
        __builtin_prefetch(texel + 2 * size_t{centres.step} * (n_ + 1));
    }

    // In the bintree a square's centre splits both its triangles, into four around it, and the middle of a side the one
    // that has the side; a quarter is a square again once both middles beside it are in the cut. Its own centre cannot
    // be before: errors are saturated.
    void draw(const Square& square, const Centres& centres, uint32_t mask) {
        mask = seen(square.level, square.x, square.y, mask);
        if (mask == 0) return;
        const auto& corner = square.corners;
        Fan fan;
        Samples in;
        if (square.level == 0 || !find(centres, centres.of(square), mask, in)) {
            const uint32_t from = rising_diagonal(square.x, square.y) ? 0 : 1;
            fan.add(corner[from], corner[from + 1], corner[from + 2]);
            fan.add(corner[from + 2], corner[(from + 3) % 4], corner[from]);
            fan.put(parts_.list(mask));
            return;
        }
        Centres finer;
        if (square.level > 1) {
            const Square first_quarter{square.level - 1, 2 * square.x, 2 * square.y, {}};
            finer = centres_around(first_quarter);
            prefetch(finer, first_quarter);
        }
        // In turn around the centre: triangles that follow each other share vertices.
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t after = in.middle[k], before = in.middle[(k + 3) % 4];
            if (after == nothing) fan.add(in.centre, corner[k], corner[(k + 1) % 4]);
            if (after == nothing && before == nothing) continue;
            Square quarter{square.level - 1, 2 * square.x + (k == 1 || k == 2), 2 * square.y + (k >= 2), {}};
            if (after != nothing && before != nothing) {
                quarter.corners[k] = corner[k];
                quarter.corners[(k + 1) % 4] = after;
                quarter.corners[(k + 2) % 4] = in.centre;
                quarter.corners[(k + 3) % 4] = before;
                fan.put(parts_.list(mask));
                fan = {};
                draw(quarter, finer, mask);
                continue;
            }
            const uint32_t half_mask = seen(quarter.level, quarter.x, quarter.y, mask);
            if (half_mask == 0) continue;
            Fan half;
            Fan& to = half_mask == mask ? fan : half;
            if (after != nothing) {
                to.add(in.centre, corner[k], after);
            } else {
                to.add(in.centre, before, corner[k]);
            }
            if (half_mask != mask) half.put(parts_.list(half_mask));
        }
        fan.put(parts_.list(mask));
    }

    static constexpr uint32_t nothing = ~0u;
    // Indices of a square's centre and of the middles of its sides, those that are in the cut.
    struct Samples {
        uint32_t centre = nothing;
        std::array<uint32_t, 4> middle{nothing, nothing, nothing, nothing};
    };

    // Whether a square's centre is in the cut; then also which of the middles are. at: the centre in its page.
    bool find(const Centres& centres, const glm::uvec2& at, uint32_t mask, Samples& in) {
        const auto& [level, number, entry_at, step, left, top] = centres;
        const uint32_t lx = at.x, ly = at.y;
        const Entry& entry = *entry_at;
        if (entry.first == nullptr) {
            guess(number, level, mask);
            return false;
        }
        const uint32_t row = n_ + 1;
        const GeometryTexel* const centre = entry.first + ly * row + lx;
        if (!is_wanted(*centre, level)) return false;
        touched_[number] = 1;
        if ((entry.usable & 1) == 0) {
            need(number, mask);
            return false;
        }
        in.centre = index(entry, lx, ly);
        if (ly > step) {
            if (is_wanted(centre[-static_cast<ptrdiff_t>(step * row)], level)) in.middle[0] = in.centre - step * row;
        } else {
            in.middle[0] = take_on_border({left + lx, top + ly - step}, level, mask);
        }
        if (lx + step < n_) {
            if (is_wanted(centre[step], level)) in.middle[1] = in.centre + step;
        } else {
            in.middle[1] = take_on_border({left + lx + step, top + ly}, level, mask);
        }
        if (ly + step < n_) {
            if (is_wanted(centre[step * row], level)) in.middle[2] = in.centre + step * row;
        } else {
            in.middle[2] = take_on_border({left + lx, top + ly + step}, level, mask);
        }
        if (lx > step) {
            if (is_wanted(centre[-static_cast<ptrdiff_t>(step)], level)) in.middle[3] = in.centre - step;
        } else {
            in.middle[3] = take_on_border({left + lx - step, top + ly}, level, mask);
        }
        return true;
    }
    bool is_wanted(const GeometryTexel& texel, uint32_t level) const {
        return forced_level_ >= 0 ? static_cast<int64_t>(level) >= forced_level_ : wanted_(texel);
    }

    // The index of a sample on a page's border, which needs the page across as well, or nothing. at: in steps of its
    // page's level. Whichever side it is met from, it is the same index.
    uint32_t take_on_border(glm::uvec2 at, uint32_t level, uint32_t mask) {
        const uint32_t page_level = std::min(level, base_), side_shift = base_ - page_level,
                       last = (1u << side_shift) - 1, px = std::min(at.x >> page_shift_, last),
                       py = std::min(at.y >> page_shift_, last), lx = at.x - (px << page_shift_),
                       ly = at.y - (py << page_shift_);
        const uint32_t number = first_page_ + PageTree::page_of(side_shift, px, py);
        const Entry& entry = residency_.entry(number);
        const uint32_t needed =
            1u | (ly == 0 ? 2u : 0u) | (lx == n_ ? 4u : 0u) | (ly == n_ ? 8u : 0u) | (lx == 0 ? 16u : 0u);
        if (entry.first == nullptr) {
            guess(number, level, mask);
            return nothing;
        }
        if (!is_wanted(entry.first[ly * (n_ + 1) + lx], level)) return nothing;
        touched_[number] = 1;
        if ((entry.usable & needed) != needed) {
            for (uint32_t side = 0; side < 4; ++side) {
                if ((needed >> (side + 1) & 1) != 0) need(residency_.neighbour(number, side), mask);
            }
            need(number, mask);
            return nothing;
        }
        return index(entry, lx, ly);
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
    const uint32_t n_;
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
