#include "vgi/draw/cut/bintree_cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/vec2.hpp>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaf_triangles.h"
#include "vgi/draw/corners/corner_front.h"
#include "vgi/draw/cut/visibility.h"
#include "vgi/draw/leaves/leaf_front.h"
#include "vgi/draw/leaves/leaf_runs.h"

namespace lodestone::vgi {

namespace {

// A square of 2^level finest cells, as wide as it is apart from others of its level; it is there as the two triangles
// either side of its diagonal.
struct Square {
    uint32_t level, x, y;
    std::array<uint32_t, 4> corners;  // indices: of (x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)
};

// The cut before this one, of the same charts.
struct Before {
    const CachedCharts& charts;
    const RefinementChange& counted;
    Motion motion;     // since then
    uint64_t updates;  // Residency::updates, then
};

constexpr size_t charts_at_once = 16;  // whose triangles follow each other, and that one thread cuts
constexpr uint32_t least_kept = 48;    // indices in a square that is kept

class ChartCut {
public:
    // demand: pages of the charts run here are marked in it. kept: takes what is made. before: null for a cut from
    // scratch.
    ChartCut(const Residency& residency, const Visibility& visibility, const RefinementTest& wanted,
             const CutRequest& request, PageDemand& demand, CachedCharts& kept, const Before* before)
        : residency_(residency),
          visibility_(visibility),
          leaves_(residency, wanted, request),
          wanted_(wanted),
          forced_level_(request.forced_level),
          demand_(demand),
          kept_(kept),
          before_(before),
          tree_(residency.tree()),
          n_(tree_.cells_per_page()),
          page_shift_(static_cast<uint32_t>(std::countr_zero(tree_.cells_per_page()))),
          base_(tree_.base_level()) {}

    // place: among those run here, rising; charts between are left out.
    void run(uint32_t chart, size_t place) {
        kept_.first.resize(place + 1, static_cast<uint32_t>(kept_.squares.size()));
        Kept old;
        if (before_ != nullptr) old = {before_->charts.first[place], before_->charts.first[place + 1]};
        chart_ = chart;
        first_page_ = residency_.number(chart, 0);
        const auto first_chart = static_cast<uint32_t>(chart - place);
        first_own_ = residency_.number(first_chart, 0);
        end_own_ = residency_.number(std::min(first_chart + uint32_t{charts_at_once}, residency_.about().charts()), 0);
        leaf_level_ = page_shift_ + residency_.about().trimmed_levels[chart];
        const uint32_t mask = visibility_.seen(visibility_.all(), first_page_);
        if (mask == 0) return;
        mark(first_page_);
        const Entry& e = residency_.entry(first_page_);
        const Square whole{
            base_ + page_shift_, 0, 0, {index(e, 0, 0), index(e, n_, 0), index(e, n_, n_), index(e, 0, n_)}};
        Whole all;
        all.mask = mask;
        all.old = old;
        draw(whole, centres_around(whole), all);
        put(all.fan, mask);
    }
    void end() { kept_.first.resize(charts_at_once + 1, static_cast<uint32_t>(kept_.squares.size())); }

    uint64_t taken_over() const { return taken_over_; }  // triangles
    // What it used and missed, once nobody marks pages any more.
    void add_to(PageDemand& demand) const {
        demand.add_marked(marked_);
        for (const uint32_t page : across_) demand.touch(page);
        for (const auto& [page, wish] : asked_) demand.ask(page, wish);
    }

private:
    using Entry = Residency::Entry;

    uint32_t index(const Entry& entry, uint32_t x, uint32_t y) const {
        return entry.slot * LODE_VGI_PAGE_TEXELS(n_) + y * (n_ + 1) + x;
    }

    static constexpr uint32_t nothing = ~0u;
    // Indices of a square's centre and of the middles of its sides, those that are in the cut.
    struct Samples {
        const GeometryTexel* texel;  // of the centre
        uint32_t centre;
        std::array<uint32_t, 4> middle{nothing, nothing, nothing, nothing};
    };

    // Triangles of one square, put into their list all at once.
    class Fan {
    public:
        void add(uint32_t a, uint32_t b, uint32_t c) {
            indices_[count_] = a;
            indices_[count_ + 1] = b;
            indices_[count_ + 2] = c;
            count_ += 3;
        }
        bool empty() const { return count_ == 0; }
        void move_to(std::vector<uint32_t>& list) {
            list.insert(list.end(), indices_.begin(), indices_.begin() + count_);
            count_ = 0;
        }

    private:
        std::array<uint32_t, 24> indices_;
        uint32_t count_ = 0;
    };

    void put(Fan& fan, uint32_t mask) {
        if (!fan.empty()) fan.move_to(kept_.parts.list(mask));
    }

    // Only pages of charts that are run here may be marked; those of others, beside leaves, are left to add_to().
    void mark(uint32_t page) {
        if (page < residency_.pages() && (page < first_own_ || page >= end_own_)) {
            across_.push_back(page);
        } else if (demand_.mark(page)) {
            marked_.push_back(page);
        }
    }
    void touch(uint32_t page) {
        mark(page);
        if (page != last_touched_) kept_.touched.push_back(last_touched_ = page);
    }

    // As the square of a page is seen; other squares are seen as the one they are part of.
    uint32_t seen(uint32_t level, uint32_t x, uint32_t y, uint32_t mask, Slack& slack) const {
        if (level < page_shift_ || level >= base_ + page_shift_) return mask;
        return visibility_.seen(mask, first_page_ + tree_.page(level - page_shift_, x, y), slack);
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
        const ptrdiff_t row = ptrdiff_t{centres.step} * (n_ + 1);
        for (ptrdiff_t k = -1; k <= 3; ++k) __builtin_prefetch(texel + k * row);
    }

    // Kept squares of the cut before, as many as there are in one of them.
    struct Kept {
        uint32_t first = 0, end = 0;
    };
    const CachedSquare* find_kept(Kept among, const Square& square) const {
        for (uint32_t i = among.first; i < among.end; i += 1 + before_->charts.squares[i].squares) {
            const CachedSquare& old = before_->charts.squares[i];
            if (old.x == square.x && old.y == square.y && old.level == square.level) return &old;
        }
        return nullptr;
    }
    bool is_as_it_was(const CachedSquare& was, const Square& square, const Centres& centres, uint32_t looked_at) const {
        return was.slack.allowed_motion > 0 && was.looked_at == looked_at && was.corners == square.corners &&
               was.beside_leaves == beside_leaves_in(square) &&
               residency_.changed_at(centres.number) <= before_->updates &&
               was.slack.holds_after(before_->motion, before_->counted.of(was.centre));
    }
    void take_over(const CachedSquare& old) {
        const std::vector<uint32_t>& from = *before_->charts.parts.find(old.drawn_for);
        std::vector<uint32_t>& to = kept_.parts.list(old.drawn_for);
        const uint32_t indices_on = static_cast<uint32_t>(to.size()) - old.first_index,
                       touched_on = static_cast<uint32_t>(kept_.touched.size()) - old.first_touched;
        to.insert(to.end(), from.begin() + old.first_index, from.begin() + old.first_index + old.indices);
        taken_over_ += old.indices / 3;
        const auto pages = std::span(before_->charts.touched).subspan(old.first_touched, old.touched);
        kept_.touched.insert(kept_.touched.end(), pages.begin(), pages.end());
        for (const uint32_t page : pages) mark(page);
        last_touched_ = pages.back();
        for (const CachedSquare& each : std::span(&old, 1 + old.squares)) {
            CachedSquare& moved = kept_.squares.emplace_back(each);
            moved.first_index += indices_on;
            moved.first_touched += touched_on;
            moved.slack = each.slack.after(before_->motion, before_->counted.of(each.centre));
        }
    }

    // In the bintree a square's centre splits both its triangles, into four around it, and the middle of a side the one
    // that has the side; a quarter is a square again once both middles beside it are in the cut. Its own centre cannot
    // be before: errors are saturated.

    // What a square is part of.
    struct Whole {
        uint32_t mask;  // of views that its triangles are for
        Slack slack;
        Fan fan;   // its triangles that are not yet in their list
        Kept old;  // squares in it that the cut before has
    };

    void draw(const Square& square, const Centres& centres, Whole& whole) {
        const CachedSquare* const was = find_kept(whole.old, square);
        if (was != nullptr && is_as_it_was(*was, square, centres, whole.mask)) {
            put(whole.fan, whole.mask);
            const auto place = kept_.squares.size();
            take_over(*was);
            whole.slack.add(kept_.squares[place].slack);
            if (was->drawn_for != whole.mask) whole.slack.add_none();
            return;
        }
        Whole part;
        part.mask = seen(square.level, square.x, square.y, whole.mask, part.slack);
        Samples in;
        if (part.mask != 0 && square.level == leaf_level_ && draw_page_square(square, whole, part)) {
            // No sample inside is drawn.
        } else if (part.mask != 0 && square.level > 0 && find(square, centres, part.mask, in, part.slack)) {
            if (was != nullptr) {
                part.old.first = static_cast<uint32_t>(was - before_->charts.squares.data()) + 1;
                part.old.end = part.old.first + was->squares;
            }
            put(whole.fan, whole.mask);
            divide(square, centres, in, whole.mask, part);
        } else if (part.mask != 0) {
            Fan& fan = part.mask == whole.mask ? whole.fan : part.fan;
            const auto& corner = square.corners;
            const uint32_t from = rising_diagonal(square.x, square.y) ? 0 : 1;
            fan.add(corner[from], corner[from + 1], corner[from + 2]);
            fan.add(corner[from + 2], corner[(from + 3) % 4], corner[from]);
            put(part.fan, part.mask);
        }
        whole.slack.add(part.slack);
        if (part.mask != 0 && part.mask != whole.mask) whole.slack.add_none();
    }

    // Of a finest page: draws the leaf, or finds out what leaves ask for in it.
    bool draw_page_square(const Square& square, Whole& whole, Whole& part) {
        const uint32_t number = first_page_ + tree_.page(leaf_level_ - page_shift_, square.x, square.y);
        if (draw_leaf(number, square, whole, part)) return true;
        beside_leaves_ = leaves_.beside_wanted(number, part.slack);
        square_of_page_ = residency_.topology().square(number);
        return false;
    }
    // What is known of it inside such a square.
    uint16_t beside_leaves_in(const Square& square) const {
        return square.level < leaf_level_ ? static_cast<uint16_t>(beside_leaves_) : uint16_t{0};
    }
    // Draws the leaf where it is wanted and all it needs is there.
    bool draw_leaf(uint32_t number, const Square& square, Whole& whole, Whole& part) {
        if (!leaves_.wants(number, part.slack)) return false;
        const Entry& entry = residency_.entry(number);
        if (!entry.leaf_usable()) {
            need_leaf(number, part.mask, part.slack);
            return false;
        }
        put(whole.fan, whole.mask);
        touch(number);
        for (uint32_t side = 0; side < 4; ++side) {
            if (const uint32_t across = residency_.neighbour(number, side); across != ~0u) touch(across);
        }
        const LeafBorder border = leaves_.border(number, part.slack);
        const bool arrived = leaves_.has_arrived(number, border, part.slack);
        // Where each vertex is in its own place, it is known where each run of triangles is.
        const bool in_runs = visibility_.leaves_out() && arrived && border == LeafBorder{};
        const Atlas& about = residency_.about();
        const uint32_t leaf = residency_.topology().leaf(number);
        for (uint32_t p = about.first_part(leaf); p < about.leaves[leaf].parts_end; ++p) {
            const Residency::LeafEntry& of = residency_.leaf_part(p);
            touch(residency_.pages() + p);
            const uint32_t first =
                of.slot * LODE_VGI_LEAF_VERTICES | LODE_VGI_LEAF | (arrived ? 0u : LODE_VGI_LEAF_MOVES);
            if (in_runs) {
                draw_runs(*of.part, first, part);
            } else {
                draw_beside(of.part->part, first, border, entry, square.corners, kept_.parts.list(part.mask));
            }
        }
        return true;
    }
    // A leaf's part as it is drawn beside what is around it. first: index of the part's first vertex; entry, corners:
    // of the page in whose square it is.
    void draw_beside(const LeafPart& leaf, uint32_t first, const LeafBorder& border, const Entry& entry,
                     const std::array<uint32_t, 4>& corners, std::vector<uint32_t>& list) const {
        const auto cells = static_cast<int32_t>(n_);
        const auto sample = [&](GridPoint p) {
            if (p.x % cells == 0 && p.y % cells == 0)
                return corners[p.y == 0 ? (p.x == 0 ? 0 : 1) : (p.x == 0 ? 3 : 2)];
            return index(entry, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y));
        };
        // The first vertex tells how a triangle is lit (shaders/vgi/visible.frag): as samples, where it has one.
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            const auto is_leaf = [](uint32_t i) { return (i & LODE_VGI_LEAF) != 0; };
            if (!is_leaf(a) || (is_leaf(b) && is_leaf(c))) {
                list.insert(list.end(), {a, b, c});
            } else if (!is_leaf(b)) {
                list.insert(list.end(), {b, c, a});
            } else {
                list.insert(list.end(), {c, a, b});
            }
        };
        for_drawn_triangles(
            leaf, border, cells, [&](uint32_t v) { return first + v; }, sample, add);
    }
    // Draws the runs of a leaf's part that are seen. first: index of the part's first vertex.
    void draw_runs(const DrawnLeafPart& drawn, uint32_t first, Whole& part) {
        const auto& triangles = drawn.part.triangles;
        for (size_t r = 0; r < drawn.runs.size(); ++r) {
            const uint32_t mask = visibility_.seen(part.mask, drawn.runs[r], part.slack);
            if (mask == 0) continue;
            if (mask != part.mask) part.slack.add_none();
            std::vector<uint32_t>& list = kept_.parts.list(mask);
            const size_t begin = r * leaf_run_triangles, end = std::min(begin + leaf_run_triangles, triangles.size());
            for (size_t t = begin; t < end; ++t) {
                const auto& [a, b, c] = triangles[t];
                list.insert(list.end(), {first + a, first + b, first + c});
            }
        }
    }
    // Asks for what a leaf lacks to be drawn. What there is of it stays: where there is room for no more leaves, parts
    // of two would else push each other out for ever.
    void need_leaf(uint32_t number, uint32_t mask, Slack& slack) {
        slack.add_none();
        const Entry& entry = residency_.entry(number);
        if (entry.usable != 0x1f) {
            need(number, mask);
            for (uint32_t side = 0; side < 4; ++side) need(residency_.neighbour(number, side), mask);
        }
        if ((entry.usable & 1) == 0) return;
        const Atlas& about = residency_.about();
        const uint32_t leaf = residency_.topology().leaf(number);
        for (uint32_t p = about.first_part(leaf); p < about.leaves[leaf].parts_end; ++p) {
            if (residency_.holds_leaf_part(p)) {
                touch(residency_.pages() + p);
            } else {
                ask(residency_.pages() + p, leaves_.excess(leaf), mask);
            }
        }
    }

    // in: of the square, whose centre is in the cut. part: with nothing drawn.
    void divide(const Square& square, const Centres& centres, const Samples& in, uint32_t looked_at, Whole& part) {
        const Begin begin{kept_.squares.size(), kept_.parts.list(part.mask).size(), kept_.touched.size()};
        kept_.squares.emplace_back();
        last_touched_ = nothing;
        touch(centres.number);

        const auto& corner = square.corners;
        Centres finer;
        if (square.level > 1) {
            const Square first_quarter{square.level - 1, 2 * square.x, 2 * square.y, {}};
            finer = centres_around(first_quarter);
            prefetch(finer, first_quarter);
        }
        // In turn around the centre: triangles that follow each other share vertices.
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t after = in.middle[k], before = in.middle[(k + 3) % 4];
            if (after == nothing) part.fan.add(in.centre, corner[k], corner[(k + 1) % 4]);
            if (after == nothing && before == nothing) continue;
            Square quarter{square.level - 1, 2 * square.x + (k == 1 || k == 2), 2 * square.y + (k >= 2), {}};
            if (after != nothing && before != nothing) {
                quarter.corners[k] = corner[k];
                quarter.corners[(k + 1) % 4] = after;
                quarter.corners[(k + 2) % 4] = in.centre;
                quarter.corners[(k + 3) % 4] = before;
                draw(quarter, finer, part);
            } else if (after != nothing) {
                draw_half(quarter, {in.centre, corner[k], after}, part);
            } else {
                draw_half(quarter, {in.centre, before, corner[k]}, part);
            }
        }
        put(part.fan, part.mask);
        keep(square, in, looked_at, part, begin);
    }

    // The triangle of a quarter that has but one of the middles beside it.
    void draw_half(const Square& quarter, const std::array<uint32_t, 3>& triangle, Whole& part) {
        const uint32_t half_mask = seen(quarter.level, quarter.x, quarter.y, part.mask, part.slack);
        if (half_mask == 0) return;
        Fan half;
        Fan& to = half_mask == part.mask ? part.fan : half;
        to.add(triangle[0], triangle[1], triangle[2]);
        if (half_mask == part.mask) return;
        put(half, half_mask);
        part.slack.add_none();
    }

    // Where in the lists of `kept_` a square's own part begins.
    struct Begin {
        size_t square, index, touched;
    };
    // Notes a square that is drawn for the next cut to take over, if it is large enough or holds such.
    void keep(const Square& square, const Samples& in, uint32_t looked_at, const Whole& part, const Begin& begin) {
        const size_t indices = kept_.parts.list(part.mask).size() - begin.index;
        const size_t squares = kept_.squares.size() - begin.square - 1;
        if (indices < least_kept && squares == 0) {
            kept_.squares.pop_back();
            return;
        }
        CachedSquare& kept = kept_.squares[begin.square];
        kept.corners = square.corners;
        kept.level = static_cast<uint16_t>(square.level);
        kept.x = static_cast<uint16_t>(square.x);
        kept.y = static_cast<uint16_t>(square.y);
        kept.beside_leaves = beside_leaves_in(square);
        kept.looked_at = looked_at;
        kept.drawn_for = part.mask;
        kept.centre = *in.texel;
        kept.slack = part.slack;
        kept.first_index = static_cast<uint32_t>(begin.index);
        kept.indices = static_cast<uint32_t>(indices);
        kept.first_touched = static_cast<uint32_t>(begin.touched);
        kept.touched = static_cast<uint32_t>(kept_.touched.size() - begin.touched);
        kept.squares = static_cast<uint32_t>(squares);
    }

    // A sample of a square, in steps of half its width from where its side 0 begins: the centre at (1, 1), or the
    // middle of a side.
    struct InSquare {
        const Square& square;
        uint32_t x, y;
    };
    // Whether leaves ask for it.
    bool is_asked_for(const InSquare& sample, Slack& slack) const {
        const auto& [square, x, y] = sample;
        // In halves of the square, or in cells of the finest page that it is in.
        if (square.level > leaf_level_) {
            const uint32_t half = square.level - 1 - leaf_level_;
            return leaves_.ask_for_corner(chart_, (2 * square.x + x) << half, (2 * square.y + y) << half, slack);
        }
        const uint32_t finest = leaf_level_ - page_shift_;
        if (beside_leaves_ == 0 || square.level <= finest) return false;
        const uint32_t half = square.level - 1 - finest, deep = leaf_level_ - square.level;
        const uint32_t left = square.x & ((1u << deep) - 1), top = square.y & ((1u << deep) - 1);
        const uint8_t asked =
            residency_.topology().beside_leaves().at(square_of_page_, (2 * left + x) << half, (2 * top + y) << half);
        return (asked & beside_leaves_) != 0;
    }

    // Whether a square's centre is in the cut; then also which of the middles are.
    bool find(const Square& square, const Centres& centres, uint32_t mask, Samples& in, Slack& slack) {
        const auto& [level, number, entry_at, step, left, top] = centres;
        const glm::uvec2 at = centres.of(square);
        const uint32_t lx = at.x, ly = at.y;
        const Entry& entry = *entry_at;
        if (entry.first == nullptr) {
            guess(number, {square, 1, 1}, mask, slack);
            return false;
        }
        const uint32_t row = n_ + 1;
        const GeometryTexel* const centre = entry.first + ly * row + lx;
        if (!is_wanted(*centre, {square, 1, 1}, slack)) return false;
        touch(number);
        if ((entry.usable & 1) == 0) {
            need(number, mask, slack);
            return false;
        }
        in.texel = centre;
        in.centre = index(entry, lx, ly);
        if (ly > step) {
            if (is_wanted(centre[-static_cast<ptrdiff_t>(step * row)], {square, 1, 0}, slack))
                in.middle[0] = in.centre - step * row;
        } else {
            in.middle[0] = take_on_border({left + lx, top + ly - step}, {square, 1, 0}, mask, slack);
        }
        if (lx + step < n_) {
            if (is_wanted(centre[step], {square, 2, 1}, slack)) in.middle[1] = in.centre + step;
        } else {
            in.middle[1] = take_on_border({left + lx + step, top + ly}, {square, 2, 1}, mask, slack);
        }
        if (ly + step < n_) {
            if (is_wanted(centre[step * row], {square, 1, 2}, slack)) in.middle[2] = in.centre + step * row;
        } else {
            in.middle[2] = take_on_border({left + lx, top + ly + step}, {square, 1, 2}, mask, slack);
        }
        if (lx > step) {
            if (is_wanted(centre[-static_cast<ptrdiff_t>(step)], {square, 0, 1}, slack))
                in.middle[3] = in.centre - step;
        } else {
            in.middle[3] = take_on_border({left + lx - step, top + ly}, {square, 0, 1}, mask, slack);
        }
        return true;
    }
    bool is_wanted(const GeometryTexel& texel, const InSquare& sample, Slack& slack) const {
        if (forced_level_ >= 0)
            return static_cast<int64_t>(sample.square.level) - 1 >= forced_level_ && texel.radius != ErrorCodes::absent;
        const float left = wanted_.left_of_reach(texel);
        if (left > 0) {
            slack.farther = std::min(slack.farther, left);
            return true;
        }
        slack.nearer = std::min(slack.nearer, -left);
        return is_asked_for(sample, slack);
    }

    // The index of a sample on a page's border, which needs the page across as well, or nothing. at: in steps of its
    // page's level. Whichever side it is met from, it is the same index.
    uint32_t take_on_border(glm::uvec2 at, const InSquare& sample, uint32_t mask, Slack& slack) {
        const uint32_t level = sample.square.level - 1, page_level = std::min(level, base_),
                       side_shift = base_ - page_level, last = (1u << side_shift) - 1,
                       px = std::min(at.x >> page_shift_, last), py = std::min(at.y >> page_shift_, last),
                       lx = at.x - (px << page_shift_), ly = at.y - (py << page_shift_);
        const uint32_t number = first_page_ + PageTree::page_of(side_shift, px, py);
        const Entry& entry = residency_.entry(number);
        const uint32_t needed =
            1u | (ly == 0 ? 2u : 0u) | (lx == n_ ? 4u : 0u) | (ly == n_ ? 8u : 0u) | (lx == 0 ? 16u : 0u);
        if (entry.first == nullptr) {
            guess(number, sample, mask, slack);
            return nothing;
        }
        if (!is_wanted(entry.first[ly * (n_ + 1) + lx], sample, slack)) return nothing;
        touch(number);
        if ((entry.usable & needed) != needed) {
            for (uint32_t side = 0; side < 4; ++side) {
                if ((needed >> (side + 1) & 1) != 0) need(residency_.neighbour(number, side), mask, slack);
            }
            need(number, mask, slack);
            return nothing;
        }
        return index(entry, lx, ly);
    }

    // What a page that is not there holds is not known, but what its parent leaves out is.
    void guess(uint32_t number, const InSquare& sample, uint32_t mask, Slack& slack) {
        const uint32_t parent = first_page_ + tree_.parent(number - first_page_);
        if (residency_.entry(parent).texels == nullptr) {  // its turn comes first
            slack.add_none();
            return;
        }
        const PageBounds& bounds = residency_.about().bounds[number];
        if (!(forced_level_ >= 0 ? static_cast<int64_t>(sample.square.level) - 1 >= forced_level_
                                 : wanted_.may_be(bounds, slack) || is_asked_for(sample, slack)))
            return;
        ask(number, wanted_.excess(bounds), mask);
        slack.add_none();  // pages are asked for anew by every cut
    }
    // Something that makes the page usable is missing: the first such thing is asked for.
    void need(uint32_t number, uint32_t mask, Slack& slack) {
        slack.add_none();
        need(number, mask);
    }
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
    const LeafFront leaves_;
    const RefinementTest& wanted_;
    const int64_t forced_level_;
    PageDemand& demand_;
    std::vector<uint32_t> marked_;  // pages, by this
    std::vector<uint32_t> across_;  // pages of charts that are run elsewhere
    CachedCharts& kept_;
    const Before* const before_;
    std::vector<std::pair<uint32_t, float>> asked_;
    uint64_t taken_over_ = 0;  // triangles
    uint32_t last_touched_ = nothing;
    const PageTree tree_;
    const uint32_t n_;
    const uint32_t page_shift_, base_;
    uint32_t chart_ = 0, first_page_ = 0, leaf_level_ = 0;  // at hand
    uint32_t first_own_ = 0, end_own_ = 0;                  // pages of charts that are run here
    uint32_t square_of_page_ = 0, beside_leaves_ = 0;  // of the finest page at hand: Atlas::leaves; beside_wanted()
};

// Where the charts of each group begin, and the end. Charts of a group are cut together; only groups with a chart that
// is seen are looked at.
std::vector<size_t> groups_of(std::span<const uint32_t> charts) {
    std::vector<size_t> first;
    for (size_t i = 0; i < charts.size(); ++i) {
        if (i == 0 || charts[i] / charts_at_once != charts[i - 1] / charts_at_once) first.push_back(i);
    }
    first.push_back(charts.size());
    return first;
}

Cut cut_of(CutParts& parts) {
    Cut cut;
    cut.parts = parts.take();
    for (const auto& [mask, indices] : cut.parts) cut.triangles += (mask & 1) != 0 ? indices.size() / 3 : 0;
    return cut;
}

// What changed since the cut before, if this one can go on from it.
struct Changes {
    Motion seen;
    RefinementChange counted;
};
std::optional<Changes> changes_since(const IncrementalCut& kept, const PageTopology& topology, int64_t forced_level,
                                     const Visibility& visibility, const RefinementTest& wanted) {
    if (kept.topology != &topology || kept.forced_level != forced_level) return {};
    const std::optional<Motion> seen = visibility.since(*kept.visibility);
    const std::optional<RefinementChange> counted = RefinementChange::between(*kept.wanted, wanted);
    if (!seen || !counted) return {};
    return Changes{*seen, *counted};
}

// The triangles of all groups, in their order, behind those in `parts`. What the groups found out goes to `demand` and
// `kept`.
Cut joined(std::span<const std::optional<ChartCut>> groups, std::span<const uint32_t> charts,
           std::span<const size_t> first_of_group, CutParts parts, PageDemand& demand, IncrementalCut& kept) {
    kept.taken_over = 0;
    std::vector<const CutParts*> made;
    for (size_t g = 0; g < groups.size(); ++g) {
        made.push_back(&kept.charts[charts[first_of_group[g]] / charts_at_once].parts);
        kept.taken_over += groups[g]->taken_over();
        groups[g]->add_to(demand);
    }
    parts.add(made);
    return cut_of(parts);
}

}  // namespace

Cut cut_bintree(const Residency& residency, const CutRequest& request, std::span<const uint32_t> seen,
                PageDemand& demand, IncrementalCut& kept) {
    LODE_CHECK(!request.views.empty() && request.views.size() < 32 && demand.pages() == residency.units());
    const Visibility visibility(request, residency.about());
    const RefinementTest wanted(request, residency.about());
    const CornerFront front(residency.topology().corners(), residency.about(), wanted, request.forced_level >= 0);
    const std::vector<uint32_t> charts = front.whole_of(seen);
    CutParts corners;
    if (request.distance) {
        corners.list(visibility.all()) = front.triangles();
    } else {
        front.add_triangles(visibility, wanted, corners);
    }
    if (charts.empty()) {
        kept.topology = nullptr;
        return cut_of(corners);
    }
    const int64_t forced_level = request.forced_leaves ? -2 : request.forced_level;
    const auto changes = changes_since(kept, residency.topology(), forced_level, visibility, wanted);
    const uint32_t before = kept.cuts++;
    std::swap(kept.charts, kept.before);
    kept.charts.resize((residency.about().charts() + charts_at_once - 1) / charts_at_once);
    kept.before.resize(kept.charts.size());
    const std::vector<size_t> first_of_group = groups_of(charts);
    std::vector<std::optional<ChartCut>> done(first_of_group.size() - 1);
    parallel_for(done.size(), 1, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; ++g) {
            const size_t group = charts[first_of_group[g]] / charts_at_once;
            CachedCharts& made = kept.charts[group];
            made.clear();
            made.cut = kept.cuts;
            std::optional<Before> old;
            if (changes && kept.before[group].cut == before) {
                old.emplace(Before{kept.before[group], changes->counted,
                                   larger(changes->seen, changes->counted.motion()), kept.updates});
            }
            ChartCut& cut =
                done[g].emplace(residency, visibility, wanted, request, demand, made, old ? &*old : nullptr);
            for (size_t i = first_of_group[g]; i < first_of_group[g + 1]; ++i)
                cut.run(charts[i], charts[i] % charts_at_once);
            cut.end();
        }
    });
    kept.visibility = visibility;
    kept.wanted = wanted;
    kept.topology = &residency.topology();
    kept.updates = residency.updates();
    kept.forced_level = forced_level;
    return joined(done, charts, first_of_group, std::move(corners), demand, kept);
}

}  // namespace lodestone::vgi
