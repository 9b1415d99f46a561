#include "tiles/tile_tree.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "base/check.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;

bool shows_finest(const Atlas& atlas, const ChartSquare& square, uint32_t level) {
    return atlas.own_level(square.chart, level) == 0;
}

class TreeBuilder {
public:
    TreeBuilder(const Atlas& atlas, uint32_t most_triangles) : atlas_(atlas), most_(most_triangles) {}

    TileTree run() {
        std::vector<ChartSquare> all;
        for (uint32_t c = 0; c < atlas_.charts(); ++c) all.push_back({c, 0, 0, atlas_.cells_of(c)});
        add(std::move(all), atlas_.levels() - 1, no_tile);
        tree_.finest = FinestSurface(atlas_);
        return std::move(tree_);
    }

private:
    uint64_t sum(const std::vector<ChartSquare>& squares, uint32_t level) const {
        uint64_t triangles = 0;
        for (const ChartSquare& s : squares) triangles += triangles_of(atlas_, s, level);
        return triangles;
    }
    bool all_finest(const std::vector<ChartSquare>& squares, uint32_t level) const {
        return std::ranges::all_of(squares, [&](const ChartSquare& s) { return shows_finest(atlas_, s, level); });
    }

    // Leaves are squares that stay whole.
    bool can_be_divided(const ChartSquare& s) const {
        return s.cells > 1 && !(has_leaves(atlas_, s) && s.cells <= leaf_cells(atlas_, s.chart));
    }

    // A tile of these squares at the finest level that it has room for, `level` or finer, and all below it.
    void add(std::vector<ChartSquare> squares, uint32_t level, uint32_t parent) {
        while (level > 0 && sum(squares, level - 1) <= most_) --level;
        // What cannot be divided has nothing between this and its finest.
        if (all_finest(squares, level) || (squares.size() == 1 && !can_be_divided(squares[0]))) level = 0;
        std::sort(squares.begin(), squares.end());
        const auto id = static_cast<uint32_t>(tree_.nodes.size());
        tree_.nodes.push_back({level, parent, {}, squares});
        if (parent != no_tile) tree_.nodes[parent].children.push_back(id);
        if (all_finest(squares, level)) return;
        std::vector<ChartSquare> done, finer;
        for (const ChartSquare& s : squares) {
            if (shows_finest(atlas_, s, level)) {
                done.push_back(s);
            } else {
                add_parts(s, level - 1, finer);
            }
        }
        add_groups(std::move(done), level, id);
        add_groups(std::move(finer), level - 1, id);
    }

    // The square, or quarters of it that have room.
    void add_parts(const ChartSquare& s, uint32_t level, std::vector<ChartSquare>& parts) const {
        if (triangles_of(atlas_, s, level) <= most_ || !can_be_divided(s)) {
            parts.push_back(s);
            return;
        }
        const uint32_t h = s.cells / 2;
        for (const uint32_t dy : {0u, h}) {
            for (const uint32_t dx : {0u, h}) add_parts({s.chart, s.x + dx, s.y + dy, h}, level, parts);
        }
    }

    glm::dvec3 centre(const ChartSquare& s) const {
        return atlas_.point(atlas_.texel(s.chart, s.x + s.cells / 2, s.y + s.cells / 2));
    }

    // Squares that lie together, as many as a tile has room for.
    void add_groups(std::vector<ChartSquare> squares, uint32_t level, uint32_t parent) {
        if (squares.empty()) return;
        const uint64_t triangles = sum(squares, level);
        const uint64_t parts = (triangles + most_ - 1) / most_;
        if (parts <= 1 || squares.size() == 1) {
            add(std::move(squares), level, parent);
            return;
        }
        sort_along_longest_axis(squares);
        // Where the tiles before and behind are as full as can be.
        const size_t parts_before = parts / 2;
        const double wanted =
            static_cast<double>(triangles) * static_cast<double>(parts_before) / static_cast<double>(parts);
        size_t cut = 0;
        double before = 0;
        while (cut + 1 < squares.size()) {
            const double next = before + static_cast<double>(triangles_of(atlas_, squares[cut], level));
            if (cut > 0 && next > wanted) break;
            before = next;
            ++cut;
        }
        const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(cut);
        add_groups({squares.begin(), middle}, level, parent);
        add_groups({middle, squares.end()}, level, parent);
    }

    void sort_along_longest_axis(std::vector<ChartSquare>& squares) const {
        glm::dvec3 low = centre(squares.front()), high = low;
        for (const ChartSquare& s : squares) {
            low = glm::min(low, centre(s));
            high = glm::max(high, centre(s));
        }
        const glm::dvec3 extent = high - low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        std::sort(squares.begin(), squares.end(), [&](const ChartSquare& a, const ChartSquare& b) {
            const double at_a = centre(a)[axis], at_b = centre(b)[axis];
            return at_a != at_b ? at_a < at_b : a < b;
        });
    }

    const Atlas& atlas_;
    const uint64_t most_;
    TileTree tree_;
};

}  // namespace

uint64_t triangles_of(const Atlas& atlas, const ChartSquare& square, uint32_t level) {
    const uint64_t stride = stride_of(atlas, square.chart, level), n = square.cells / stride;
    return stride == 1 ? finest_triangles_in(atlas, square) : 2 * n * n;
}

TileTree make_tile_tree(const Atlas& atlas, uint32_t most_triangles) {
    LODE_CHECK(most_triangles >= least_tile_triangles && most_triangles <= most_tile_triangles, most_triangles);
    return TreeBuilder(atlas, most_triangles).run();
}

std::vector<ClosingSide> closing_sides(const Atlas& atlas, const TileTree& tree, uint32_t tile) {
    const TileNode& node = tree.nodes[tile];
    std::vector<ClosingSide> sides;
    for (uint32_t i = 0; i < node.squares.size(); ++i) {
        const ChartSquare& s = node.squares[i];
        for (uint32_t side = 0; side < 4; ++side) {
            const auto other =
                atlas.across({s.chart, s.x / s.cells, s.y / s.cells}, side, atlas.cells_of(s.chart) / s.cells);
            const ChartSquare there{other.chart, other.x * s.cells, other.y * s.cells, s.cells};
            if (other.chart == ~0u || !std::binary_search(node.squares.begin(), node.squares.end(), there))
                sides.push_back({i, side});
        }
    }
    return sides;
}

std::vector<uint32_t> TileTree::subtree_sizes() const {
    std::vector<uint32_t> sizes(nodes.size(), 1);
    for (size_t i = nodes.size(); i-- > 1;) sizes[nodes[i].parent] += sizes[i];
    return sizes;
}

Result<void> TileTree::validate(const Atlas& atlas) const {
    const auto wrong = [](size_t tile, const char* what) {
        return fail(Fault::invariant, "tile " + std::to_string(tile) + ": " + what);
    };
    const auto area = [](const std::vector<ChartSquare>& squares) {
        return std::accumulate(squares.begin(), squares.end(), uint64_t{0},
                               [](uint64_t sum, const ChartSquare& s) { return sum + uint64_t{s.cells} * s.cells; });
    };
    if (nodes.empty() || nodes[0].squares.size() != atlas.charts()) return wrong(0, "does not show all charts");
    for (size_t i = 0; i < nodes.size(); ++i) {
        const TileNode& node = nodes[i];
        if (!std::is_sorted(node.squares.begin(), node.squares.end())) return wrong(i, "its squares are not sorted");
        if (std::adjacent_find(node.squares.begin(), node.squares.end()) != node.squares.end())
            return wrong(i, "shows a square twice");
        uint64_t below = 0;
        for (const uint32_t child : node.children) {
            if (child <= i || nodes[child].parent != i) return wrong(i, "has a child of another");
            if (nodes[child].level > node.level) return wrong(child, "is coarser than its parent");
            below += area(nodes[child].squares);
            for (const ChartSquare& s : nodes[child].squares) {
                const auto holds = [&](const ChartSquare& p) {
                    return p.chart == s.chart && s.x >= p.x && s.y >= p.y && s.x + s.cells <= p.x + p.cells &&
                           s.y + s.cells <= p.y + p.cells;
                };
                const auto first = std::lower_bound(node.squares.begin(), node.squares.end(), ChartSquare{s.chart});
                const auto after = std::lower_bound(first, node.squares.end(), ChartSquare{s.chart + 1});
                if (!std::any_of(first, after, holds)) return wrong(child, "shows what its parent does not");
            }
        }
        if (!node.children.empty() && below != area(node.squares)) return wrong(i, "is not what its children show");
        if (!node.children.empty()) continue;
        for (const ChartSquare& s : node.squares) {
            if (!shows_finest(atlas, s, node.level)) return wrong(i, "is a leaf and not the finest");
            if (has_leaves(atlas, s) && s.cells < leaf_cells(atlas, s.chart)) return wrong(i, "divides a leaf");
        }
    }
    return {};
}

}  // namespace lodestone::tiles
