#include "vgi/study/grid_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "frame/screen_error.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"
#include "vgi/study/grid_patch.h"

namespace lodestone::vgi {

namespace {

// Between levels of neighbours: so far, a corner of the finer is a sample of the coarser.
constexpr uint32_t most_difference = most_node_shift;

// Nodes of a chart by level. Levels up to `top` have nodes of 8 x 8 cells, each divided into four; above, the whole
// chart is one node of fewer cells, divided into one of twice as many along a side.
struct NodeTree {
    uint32_t levels;  // log2 of the chart's cells
    uint32_t top;

    explicit NodeTree(uint32_t cells)
        : levels(static_cast<uint32_t>(std::countr_zero(cells))),
          top(levels > most_node_shift ? levels - most_node_shift : 0) {}
    uint32_t nodes() const { return levels - top + ((1u << (2 * top + 2)) - 1) / 3; }
    uint32_t per_side_shift(uint32_t level) const { return level < top ? top - level : 0; }
    uint32_t per_side(uint32_t level) const { return 1u << per_side_shift(level); }
    uint32_t cell_shift(uint32_t level) const { return std::min(most_node_shift, levels - level); }
    uint32_t size_shift(uint32_t level) const { return level + cell_shift(level); }  // log2 of its finest cells
    uint32_t number(uint32_t level, uint32_t x, uint32_t y) const {
        if (level > top) return levels - level;
        const uint32_t shift = per_side_shift(level);
        return levels - top + ((1u << (2 * shift)) - 1) / 3 + (y << shift) + x;
    }
};

class GridCut {
public:
    GridCut(const Residency& residency, const CutRequest& request, PageDemand& demand, GridOutput output, GridRule rule)
        : residency_(residency),
          about_(residency.about()),
          request_(request),
          demand_(demand),
          output_(output),
          rule_(rule),
          visibility_(request, about_),
          wanted_(request, about_),
          nodes_(about_.cells),
          pages_(residency.tree()),
          page_shift_(static_cast<uint32_t>(std::countr_zero(pages_.cells_per_page()))),
          base_(pages_.base_level()),
          state_(size_t{about_.charts()} * nodes_.nodes(), 0),
          mask_(state_.size(), 0) {}

    Cut run() {
        find_wanted();
        close_wanted();
        divide();
        each_run_of_charts([&](uint32_t chart, Found&) { see({nodes_.levels, {chart, 0, 0}}, visibility_.all()); });
        auto found = each_run_of_charts([&](uint32_t chart, Found& to) { draw({nodes_.levels, {chart, 0, 0}}, to); });
        CutParts parts;
        std::vector<const CutParts*> made;
        Cut cut;
        for (auto& f : found) {
            made.push_back(&f->parts);
            cut.triangles += f->triangles;
            demand_.add_marked(f->marked);
        }
        parts.add(made);
        cut.parts = parts.take();
        return cut;
    }

private:
    enum : uint8_t { wants = 1, divided = 2 };
    struct Node {
        uint32_t level;
        Atlas::Tile at;
    };
    struct Found {
        std::vector<Node> wanted;
        std::vector<uint32_t> marked;  // pages
        CutParts parts;
        uint64_t triangles = 0;
    };

    size_t index(const Node& n) const {
        return size_t{n.at.chart} * nodes_.nodes() + nodes_.number(n.level, n.at.x, n.at.y);
    }
    // Its ancestor of a level, or itself.
    Node up(const Node& n, uint32_t level) const {
        const uint32_t shift = nodes_.per_side_shift(n.level) - nodes_.per_side_shift(level);
        return {level, {n.at.chart, n.at.x >> shift, n.at.y >> shift}};
    }
    bool exists(const Node& n) const {
        return n.level == nodes_.levels || (state_[index(up(n, n.level + 1))] & divided) != 0;
    }
    // The page of a level, or of the coarsest, that holds the node's lowest corner's part.
    uint32_t page(const Node& n, uint32_t level) const {
        level = std::min(level, base_);
        const uint32_t down = level + page_shift_, size = nodes_.size_shift(n.level);
        return residency_.number(n.at.chart, pages_.page(level, (n.at.x << size) >> down, (n.at.y << size) >> down));
    }
    uint32_t seen(const Node& n, uint32_t mask) const {
        return visibility_.seen(mask, page(n, n.level > 2 ? n.level - 2 : 0));
    }
    template <class Visit>
    void children(const Node& n, Visit&& visit) const {
        const uint32_t level = n.level - 1, more = level < nodes_.top ? 1 : 0;
        for (uint32_t y = 0; y <= more; ++y) {
            for (uint32_t x = 0; x <= more; ++x)
                visit(Node{level, {n.at.chart, (n.at.x << more) + x, (n.at.y << more) + y}});
        }
    }
    template <class Work>
    std::vector<std::optional<Found>> each_run_of_charts(Work&& work) {
        constexpr size_t at_once = 16;
        std::vector<std::optional<Found>> found((about_.charts() + at_once - 1) / at_once);
        parallel_for(about_.charts(), at_once, [&](size_t begin, size_t end) {
            Found& mine = found[begin / at_once].emplace();
            for (size_t chart = begin; chart < end; ++chart) work(static_cast<uint32_t>(chart), mine);
        });
        return found;
    }

    // First: the nodes that some view sees and that have a wanted sample of the next finer level.
    void find_wanted() {
        by_level_.resize(nodes_.levels + 1);
        const auto found = each_run_of_charts([&](uint32_t chart, Found& to) {
            look_into({nodes_.levels, {chart, 0, 0}}, visibility_.all(), to.wanted);
        });
        for (const auto& f : found) {
            for (const Node& n : f->wanted) want(n);
        }
    }
    void look_into(const Node& n, uint32_t mask, std::vector<Node>& to) const {
        if (n.level == 0 || n.level <= request_.forced_level) return;
        mask = seen(n, mask);
        if (mask == 0) return;
        const uint32_t number = page(n, n.level - 1);
        const bool forced = request_.forced_level >= 0;
        if (!forced && rule_ == GridRule::by_area) {
            if (pixels_across(n) <= pixels_per_cell * request_.pixel_error * (1u << nodes_.cell_shift(n.level))) return;
            to.push_back(n);
            if (residency_.entry(number).texels != nullptr)
                children(n, [&](const Node& child) { look_into(child, mask, to); });
            return;
        }
        if (!forced && !wanted_.may_be(about_.bounds[number], residency_.below(number))) return;
        if (forced || wants_division(n, number)) to.push_back(n);
        if (residency_.entry(number).texels == nullptr) return;
        children(n, [&](const Node& child) { look_into(child, mask, to); });
    }
    // Side of a square that covers as many pixels as the box around the node's sphere, at most.
    double pixels_across(const Node& n) const {
        const PageBounds& bounds = about_.bounds[page(n, n.level > 2 ? n.level - 2 : 0)];
        // The finest pages hold nodes of levels 2, 1 and 0; parts of them are as much smaller as they are fewer cells.
        const double share = n.level < 2 ? std::ldexp(1.0, static_cast<int>(n.level) - 2) : 1.0;
        const View& view = request_.sets_levels();
        const double scale = static_cast<double>(largest_scale(request_.object_to_world));
        const double radius = static_cast<double>(bounds.radius) * scale;
        const glm::vec3 centre(request_.object_to_world * glm::vec4(bounds.centre, 1));
        const double away = static_cast<double>(glm::distance(centre, view.eye)) - radius -
                            static_cast<double>(request_.margin.distance);
        const double near = static_cast<double>(view.near_plane);
        return 2 * radius * share * static_cast<double>(view.focal_px) / std::max(away, near);
    }
    bool wants_division(const Node& n, uint32_t number) const {
        if (!wanted_.may_be(about_.bounds[number])) return false;
        const GeometryTexel* texels = residency_.entry(number).first;
        if (texels == nullptr) return true;  // it may be: that is all that is known
        // Samples of level n.level - 1, in the page's own steps.
        const uint32_t level = n.level - 1, page_level = std::min(level, base_), step = 1u << (level - page_level);
        const uint32_t down = page_level + page_shift_, size = nodes_.size_shift(n.level);
        const auto local = [&](uint32_t at) {
            const uint32_t first = at << size;
            return (first - (first >> down << down)) >> page_level;
        };
        const uint32_t x0 = local(n.at.x), y0 = local(n.at.y), row = pages_.samples_per_side(),
                       count = 2u << nodes_.cell_shift(n.level);
        for (uint32_t j = 0; j <= count; ++j) {
            for (uint32_t i = 1 - (j & 1); i <= count; i += 2 - (j & 1)) {
                if (wanted_(texels[(y0 + j * step) * row + x0 + i * step])) return true;
            }
        }
        return false;
    }

    void want(const Node& n) {
        uint8_t& state = state_[index(n)];
        if ((state & wants) != 0) return;
        state |= wants;
        by_level_[n.level].push_back(n);
    }
    // What has to be divided for a node to be: the nodes it is part of, and what would be too coarse beside its parts.
    template <class Visit>
    void for_needed(const Node& n, Visit&& visit) const {
        if (n.level < nodes_.levels) visit(up(n, n.level + 1));
        const uint32_t coarse = n.level + most_difference;
        if (coarse > nodes_.levels) return;
        for (uint32_t side = 0; side < 4; ++side) {
            const Atlas::Tile to = about_.across(n.at, side, nodes_.per_side(n.level));
            if (to.chart != ~0u) visit(up({n.level, to}, coarse));
        }
    }
    // Second: everything that is needed for those.
    void close_wanted() {
        for (uint32_t level = 1; level <= nodes_.levels; ++level) {
            for (size_t i = 0; i < by_level_[level].size(); ++i)
                for_needed(Node(by_level_[level][i]), [&](const Node& needed) { want(needed); });
        }
    }

    // Third: whatever can be divided, from what pages are there.
    void divide() {
        for (uint32_t level = nodes_.levels; level > 0; --level) {
            for (const Node& n : by_level_[level]) {
                bool may = true;
                for_needed(n, [&](const Node& needed) { may = may && (state_[index(needed)] & divided) != 0; });
                if (!may) continue;
                const uint32_t number = page(n, level - 1);
                if (residency_.entry(number).texels == nullptr) {
                    demand_.ask(number, wish_for(wanted_.excess(about_.bounds[number]), seen(n, 1)));
                } else {
                    state_[index(n)] |= divided;
                }
            }
        }
    }

    // Fourth: which views see what is left.
    void see(const Node& n, uint32_t mask) {
        mask = seen(n, mask);
        mask_[index(n)] = mask;
        if (mask != 0 && (state_[index(n)] & divided) != 0) children(n, [&](const Node& child) { see(child, mask); });
    }

    // Levels that the node across a side is coarser; 0 where nothing of it is drawn.
    uint32_t coarser_across(const Node& n, uint32_t side) const {
        const Atlas::Tile to = about_.across(n.at, side, nodes_.per_side(n.level));
        if (to.chart == ~0u) return 0;
        Node other{n.level, to};
        while (!exists(other)) other = up(other, other.level + 1);
        if (mask_[index(other)] == 0) return 0;
        LODE_CHECK(other.level <= n.level + most_difference, n.level, other.level);
        return other.level - n.level;
    }

    // Last: what is divided no further.
    void draw(const Node& n, Found& to) {
        const uint32_t mask = mask_[index(n)];
        if (mask == 0) return;
        if ((state_[index(n)] & divided) != 0) {
            children(n, [&](const Node& child) { draw(child, to); });
            return;
        }
        GridPatch patch;
        patch.level = n.level;
        patch.cell_shift = nodes_.cell_shift(n.level);
        for (uint32_t side = 0; side < 4; ++side) patch.coarser[side] = coarser_across(n, side);
        patch.x = n.at.x << nodes_.size_shift(n.level);
        patch.y = n.at.y << nodes_.size_shift(n.level);
        const uint32_t first = std::min(n.level, base_);
        for (uint32_t level = first; level <= base_; ++level) {
            const uint32_t number = page(n, level);
            if (demand_.mark(number)) to.marked.push_back(number);
            patch.slots[level - first] = residency_.entry(number).slot;
        }
        if ((mask & 1) != 0) to.triangles += patch.triangles();
        if (output_ == GridOutput::patches) {
            patch.append_words(to.parts.list(mask));
        } else {
            patch.append_indices(about_.cells, pages_.cells_per_page(), to.parts.list(mask));
        }
    }

    const Residency& residency_;
    const Atlas& about_;
    const CutRequest& request_;
    PageDemand& demand_;
    const GridOutput output_;
    const GridRule rule_;
    const Visibility visibility_;
    const RefinementTest wanted_;
    const NodeTree nodes_;
    const PageTree pages_;
    const uint32_t page_shift_, base_;
    std::vector<uint8_t> state_;               // per node of all charts
    std::vector<uint32_t> mask_;               // of nodes that exist: the views that see them
    std::vector<std::vector<Node>> by_level_;  // that are to be divided
};

}  // namespace

Cut cut_grid(const Residency& residency, const CutRequest& request, PageDemand& demand, GridOutput output,
             GridRule rule) {
    LODE_CHECK(!request.views.empty() && request.views.size() < 32 && demand.pages() == residency.units());
    return GridCut(residency, request, demand, output, rule).run();
}

}  // namespace lodestone::vgi
