#include "vgi/bake/images/chart_leaves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <optional>
#include <span>

#include "base/check.h"
#include "mesh/distance/closest_point.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/images/chart_error.h"
#include "vgi/bake/images/leaves/side_errors.h"

namespace lodestone::vgi {

namespace {

constexpr int64_t side_length = int64_t{1} << 30;  // of a chart; places are integers up to it

// An arc as a side of a chart: where its vertices lie along it, and where any place of it is on the surface. Whichever
// chart asks, the answer is the same.
class ArcPlaces {
public:
    ArcPlaces(const Surface& surface, const Arc& arc, bool reversed)
        : surface_(surface), arc_(arc), reversed_(reversed) {
        for (const double place : places_along(arc, surface.positions))
            at_.push_back(std::clamp<int64_t>(std::llround(place * static_cast<double>(side_length)), 0, side_length));
        at_.front() = 0;
        at_.back() = side_length;
    }
    // Calls visit(vertex of the surface, place along the side).
    template <class Visit>
    void for_vertices(Visit&& visit) const {
        for (size_t i = 0; i < at_.size(); ++i) visit(arc_.vertices[i], along(at_[i]));
    }
    // place: along the side.
    glm::dvec3 point(int64_t place) const {
        const int64_t wanted = along(place);
        const auto next = std::ranges::upper_bound(at_, wanted);
        const size_t i = std::clamp<ptrdiff_t>(next - at_.begin() - 1, 0, static_cast<ptrdiff_t>(at_.size()) - 2);
        const glm::dvec3 &p = surface_.positions[arc_.vertices[i]], &q = surface_.positions[arc_.vertices[i + 1]];
        const int64_t step = std::max<int64_t>(at_[i + 1] - at_[i], 1);
        const double share = static_cast<double>(wanted - at_[i]) / static_cast<double>(step);
        return share <= 0 ? p : share >= 1 ? q : p + (q - p) * share;
    }
    // The nearest of the places that divide the side into so many steps.
    int64_t nearest_step(int64_t place, int64_t steps) const {
        const int64_t step = (along(place) * steps + side_length / 2) / side_length;
        return reversed_ ? steps - step : step;
    }

private:
    int64_t along(int64_t place) const { return reversed_ ? side_length - place : place; }
    const Surface& surface_;
    const Arc& arc_;
    const bool reversed_;
    std::vector<int64_t> at_;  // per vertex, in the arc's direction
};

using Place = std::array<int64_t, 2>;

// A chart's source triangles, cut along the sides of squares.
class ChartCutting {
public:
    ChartCutting(const ResampleInput& input, const Atlas& atlas, const SampleDepths& depths, uint32_t quad,
                 const Chart& chart)
        : cells_(atlas.cells_of(quad)),
          per_side_(atlas.leaves_per_side(quad)),
          square_(side_length / per_side_),
          mesh_(chart.patch) {
        for_leaf_squares(atlas, quad, [&](const Atlas::Tile&, uint32_t leaf) { depths_.push_back(depths.of(leaf)); });
        for (glm::dvec2& at : mesh_.flat) {
            for (int k = 0; k < 2; ++k) {
                const int64_t place = std::llround(at[k] * static_cast<double>(side_length));
                at[k] = static_cast<double>(std::clamp<int64_t>(place, 1, side_length - 1));
            }
        }
        const auto number = mesh_.numbers();
        for (uint32_t s = 0; s < 4; ++s) {
            const Side& side = input.patches.sides[quad][s];
            arcs_.emplace_back(input.surface, input.patches.arcs[side.arc], side.reversed);
            arcs_.back().for_vertices([&](uint32_t vertex, int64_t along) {
                const auto [x, y] = on_side(s, along, side_length);
                mesh_.flat[number.at(vertex)] = glm::dvec2(x, y);
            });
        }
        // A line cuts a triangle into no more than three; more are signs of places that are not told apart.
        const size_t lines = 2 * (per_side_ - 1), most = chart.patch.triangles.size() * (3 * lines + 1) * 4 + 1024;
        for (int axis = 0; axis < 2 && is_cut_; ++axis) cut_across(axis, most);
    }

    const ChartMesh& mesh() const { return mesh_; }
    Place place(uint32_t vertex) const {
        return {static_cast<int64_t>(mesh_.flat[vertex].x), static_cast<int64_t>(mesh_.flat[vertex].y)};
    }
    // Triangles by square; nothing where squares are not what they should be: each all covered, with a corner in each
    // corner, and all its edges to others along its sides. That is so but for triangles as thin as places are apart.
    std::optional<std::vector<std::vector<uint32_t>>> by_square() const {
        if (!is_cut_) return std::nullopt;
        std::vector<std::vector<uint32_t>> all(size_t{per_side_} * per_side_);
        std::vector<uint32_t> square(mesh_.triangles.size());
        for (uint32_t t = 0; t < square.size(); ++t) {
            const auto& v = mesh_.triangles[t].vertices;
            const Place a = place(v[0]), b = place(v[1]), c = place(v[2]);
            const auto in = [&](size_t k) {
                return std::clamp<int64_t>((a[k] + b[k] + c[k]) / 3 / square_, 0, per_side_ - 1);
            };
            square[t] = static_cast<uint32_t>(in(1) * per_side_ + in(0));
            all[square[t]].push_back(t);
        }
        for (uint32_t i = 0; i < all.size(); ++i) {
            if (!is_whole(i, all[i], square)) return std::nullopt;
        }
        return all;
    }
    // Where a vertex lies of a square: LeafVertex::border and LeafVertex::step.
    void place_on_border(uint32_t vertex, uint32_t square, LeafVertex& v) const {
        const Place p = place(vertex);
        const auto [low, high] = extent(square);
        const bool left = p[0] == low[0], right = p[0] == high[0], bottom = p[1] == low[1], top = p[1] == high[1];
        if ((left || right) && (bottom || top)) {
            v.border = bottom ? (left ? 5 : 6) : (right ? 7 : 8);
        } else if (left || right || bottom || top) {
            const size_t along = left || right ? 1 : 0;
            v.border = bottom ? 1 : right ? 2 : top ? 3 : 4;
            const int64_t first = low[along] / square_ * (cells_ / per_side_);
            const uint32_t level = depths_[square].sides[v.border - 1u];
            v.step = static_cast<uint8_t>((nearest_step(p, along, cells_ >> level) << level) - first);
        }
    }

private:
    std::array<Place, 2> extent(uint32_t square) const {
        const Place low{square % per_side_ * square_, square / per_side_ * square_};
        return {low, {low[0] + square_, low[1] + square_}};
    }
    // Of so many of the whole chart, on the side of a square that runs along an axis.
    int64_t nearest_step(const Place& p, size_t along, int64_t cells) const {
        const int64_t other = p[1 - along];
        if (other != 0 && other != side_length) return (p[along] * cells + side_length / 2) / side_length;
        // Sides 2 and 3 run back.
        const uint32_t s = along == 0 ? (other == 0 ? 0 : 2) : (other == 0 ? 3 : 1);
        if (s < 2) return arcs_[s].nearest_step(p[along], cells);
        return cells - arcs_[s].nearest_step(side_length - p[along], cells);
    }

    // Splits every edge where it crosses a line between squares.
    void cut_across(int axis, size_t most_triangles) {
        for (uint32_t h = 0; h < mesh_.twin.size() && is_cut_; ++h) {
            for (;;) {
                is_cut_ = mesh_.triangles.size() <= most_triangles;
                if (!is_cut_) break;
                const auto a = static_cast<int64_t>(mesh_.flat[mesh_.from(h)][axis]),
                           b = static_cast<int64_t>(mesh_.flat[mesh_.to(h)][axis]);
                const int64_t line = (std::min(a, b) / square_ + 1) * square_;
                if (line >= std::max(a, b)) break;
                split(h, axis, line);
            }
        }
    }
    void split(uint32_t h, int axis, int64_t line) {
        const glm::dvec2 a = mesh_.flat[mesh_.from(h)], b = mesh_.flat[mesh_.to(h)];
        const double share = (static_cast<double>(line) - a[axis]) / (b[axis] - a[axis]);
        const bool rim = mesh_.twin[h] == none;
        const uint32_t middle = mesh_.split_edge(h, share, share);
        glm::dvec2& at = mesh_.flat[middle];
        at[axis] = static_cast<double>(line);
        at[1 - axis] = std::round(at[1 - axis]);
        if (!rim) return;
        const auto last = static_cast<double>(side_length);
        const uint32_t s = axis == 0 ? (at.y == 0 ? 0 : 2) : (at.x == last ? 1 : 3);
        mesh_.positions[middle] = arcs_[s].point(s < 2 ? line : side_length - line);
    }

    bool is_whole(uint32_t number, const std::vector<uint32_t>& triangles, const std::vector<uint32_t>& square) const {
        const auto [low, high] = extent(number);
        std::array<int64_t, 4> covered{};
        std::array<std::vector<uint32_t>, 4> corners;
        for (const uint32_t t : triangles) {
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t h = 3 * t + k, v = mesh_.from(h);
                const Place p = place(v), q = place(mesh_.to(h));
                if (p[0] < low[0] || p[1] < low[1] || p[0] > high[0] || p[1] > high[1]) return false;
                LeafVertex at;
                place_on_border(v, number, at);
                if (at.is_corner()) corners[at.border - 5u].push_back(v);
                if (mesh_.twin[h] != none && square[mesh_.twin[h] / 3] == number) continue;
                // Along a side, the way that sides run.
                const bool along[4] = {p[1] == low[1] && q[1] == low[1], p[0] == high[0] && q[0] == high[0],
                                       p[1] == high[1] && q[1] == high[1], p[0] == low[0] && q[0] == low[0]};
                const int64_t by[4] = {q[0] - p[0], q[1] - p[1], p[0] - q[0], p[1] - q[1]};
                uint32_t s = 0;
                while (s < 4 && !(along[s] && by[s] >= 0)) ++s;
                if (s == 4) return false;
                covered[s] += by[s];
            }
        }
        for (uint32_t s = 0; s < 4; ++s) {
            if (covered[s] != square_ || corners[s].empty()) return false;
            if (std::ranges::any_of(corners[s], [&](uint32_t v) { return v != corners[s][0]; })) return false;
        }
        return true;
    }

    const uint32_t cells_, per_side_;
    const int64_t square_;
    ChartMesh mesh_;               // its places are integers
    std::vector<ArcPlaces> arcs_;  // by side
    std::vector<SquareDepths> depths_;
    bool is_cut_ = true;
};

// What the finest samples are off by, by square: they are linear between lines of the lattice, the source between its
// edges, so the largest distance is where two of these cross, or at a vertex.
class SquareErrors {
public:
    SquareErrors(const Atlas& atlas, uint32_t quad, const ChartMesh& patch)
        : atlas_(atlas),
          quad_(quad),
          cells_(atlas.cells_of(quad) >> atlas.unsampled_levels[quad]),
          per_side_(atlas.leaves_per_side(quad)),
          patch_(patch),
          squared_(size_t{per_side_} * per_side_, 0) {
        for (uint32_t v = 0; v < patch.positions.size(); ++v) {
            const double d =
                squared_distance_near(atlas, quad, glm::clamp(patch.flat[v], 0.0, 1.0), 1, patch.positions[v]);
            note(patch.flat[v] * static_cast<double>(cells_), d);
        }
        for (uint32_t h = 0; h < patch.twin.size(); ++h) {
            if (patch.twin[h] == none || h < patch.twin[h]) along_edge(h);
        }
    }
    // Object units; rounding samples to their lattice included.
    double of(uint32_t square) const { return std::max(std::sqrt(squared_[square]), atlas_.step * 0.8661); }

private:
    void note(const glm::dvec2& place, double squared) {
        const double size = static_cast<double>(cells_) / per_side_, near = 1e-6;
        const auto in = [&](double at) {
            return static_cast<uint32_t>(std::clamp(std::floor(at / size), 0.0, per_side_ - 1.0));
        };
        for (const uint32_t y : {in(place.y - near), in(place.y + near)}) {
            for (const uint32_t x : {in(place.x - near), in(place.x + near)}) {
                double& known = squared_[size_t{y} * per_side_ + x];
                known = std::max(known, squared);
            }
        }
    }

    // Where it crosses lines of the lattice, diagonals of cells included.
    void along_edge(uint32_t h) {
        const auto n = static_cast<double>(cells_);
        const glm::dvec2 a = patch_.flat[patch_.from(h)] * n, b = patch_.flat[patch_.to(h)] * n;
        const auto family = [&](double from, double to, bool falling, bool rising) {
            const double low = std::min(from, to), high = std::max(from, to);
            for (double line = std::floor(low) + 1; line < high; line += 1) {
                const double share = (line - from) / (to - from);
                const glm::dvec2 at = a + (b - a) * share;
                if (rising || falling) {
                    const auto x = static_cast<uint32_t>(std::max(at.x, 0.0)),
                               y = static_cast<uint32_t>(std::max(at.y, 0.0));
                    if (rising_diagonal(x, y) != rising) continue;
                }
                crossing(h, share, at);
            }
        };
        family(a.x, b.x, false, false);
        family(a.y, b.y, false, false);
        family(a.x - a.y, b.x - b.y, false, true);
        family(a.x + a.y, b.x + b.y, true, false);
    }
    void crossing(uint32_t h, double share, const glm::dvec2& at) {
        const glm::dvec3 &from = patch_.positions[patch_.from(h)], &to = patch_.positions[patch_.to(h)];
        const glm::dvec3 point = from + (to - from) * share;
        const glm::dvec2 place = glm::clamp(at / static_cast<double>(cells_), 0.0, 1.0);
        const glm::dvec3 drawn = image_point(atlas_, quad_, 0, place);
        const auto square = [](const glm::dvec3& v) { return glm::dot(v, v); };
        const double together = square(drawn - point);
        if (together <= at_most(at)) return;
        double back = together;
        for (const uint32_t g : {h, patch_.twin[h]}) {
            if (g == none) continue;
            const auto& v = patch_.triangles[g / 3].vertices;
            back = std::min(back, square(closest_on_triangle(drawn, patch_.positions[v[0]], patch_.positions[v[1]],
                                                             patch_.positions[v[2]]) -
                                         drawn));
        }
        note(at, std::max(back, std::min(together, squared_distance_near(atlas_, quad_, place, 0, point))));
    }
    // Of the square, so far.
    double at_most(const glm::dvec2& at) const {
        const double size = static_cast<double>(cells_) / per_side_;
        const auto in = [&](double k) {
            return static_cast<size_t>(std::clamp(std::floor(k / size), 0.0, per_side_ - 1.0));
        };
        return squared_[in(at.y) * per_side_ + in(at.x)];
    }

    const Atlas& atlas_;
    const uint32_t quad_, cells_, per_side_;  // cells between samples of the chart's own
    const ChartMesh& patch_;
    std::vector<double> squared_;
};

// Triangles of a leaf as parts.
class PartMaker {
public:
    PartMaker(const ResampleInput& input, const Atlas& atlas, const ChartCutting& cutting)
        : input_(input), atlas_(atlas), cutting_(cutting) {}

    // Appends the parts of a leaf, coded.
    void add(uint32_t square, std::vector<uint32_t> triangles, ByteLists& coded) {
        // Near ones follow each other: by the bits of their places, in turn.
        std::vector<uint64_t> key(triangles.size());
        std::vector<uint32_t> order(triangles.size());
        std::iota(order.begin(), order.end(), 0u);
        for (size_t i = 0; i < triangles.size(); ++i) key[i] = morton(triangles[i]);
        std::ranges::stable_sort(order, {}, [&](uint32_t i) { return key[i]; });
        made_.clear();
        for (const uint32_t i : order) {
            std::array<LeafVertex, 3> corners;
            for (uint32_t k = 0; k < 3; ++k) corners[k] = vertex(triangles[i], k, square);
            if (part_.triangles.size() == most_leaf_triangles || part_.vertices.size() + 3 > most_leaf_vertices)
                close(coded);
            std::array<uint8_t, 3> numbers{};
            for (uint32_t k = 0; k < 3; ++k)
                numbers[k] = number(cutting_.mesh().from(3 * triangles[i] + k), corners[k]);
            part_.triangles.push_back(numbers);
        }
        close(coded);
    }
    // Of the last leaf.
    std::span<const LeafPart> made() const { return made_; }

private:
    uint64_t morton(uint32_t triangle) const {
        uint64_t key = 0;
        Place sum{};
        for (uint32_t k = 0; k < 3; ++k) {
            const Place p = cutting_.place(cutting_.mesh().from(3 * triangle + k));
            sum = {sum[0] + p[0], sum[1] + p[1]};
        }
        for (int bit = 31; bit >= 0; --bit) {
            for (const size_t axis : {size_t{1}, size_t{0}})
                key = key << 1 | (static_cast<uint64_t>(sum[axis]) >> bit & 1);
        }
        return key;
    }

    LeafVertex vertex(uint32_t triangle, uint32_t corner, uint32_t square) const {
        const ChartMesh& mesh = cutting_.mesh();
        const uint32_t v = mesh.from(3 * triangle + corner);
        LeafVertex leaf;
        const double fine = 1u << atlas_.leaf_shift;
        const glm::dvec3 at = glm::clamp(glm::round((mesh.positions[v] - atlas_.origin) / (atlas_.step / fine)), 0.0,
                                         double{1u << leaf_bits} - 1);
        for (int k = 0; k < 3; ++k) leaf.position[static_cast<size_t>(k)] = static_cast<uint32_t>(at[k]);
        const Place place = cutting_.place(v);
        for (size_t k = 0; k < 2; ++k)
            leaf.place[k] = static_cast<uint16_t>((place[k] * leaf_places + side_length / 2) / side_length);
        cutting_.place_on_border(v, square, leaf);
        const SurfaceTriangle& t = mesh.triangles[triangle];
        leaf.attributes = source_attributes(input_, atlas_, t.source, glm::dvec2(mesh.places.of(t)[corner]));
        if (atlas_.attributes.baked) leaf.attributes.colour = TexelAttributes().colour;
        return leaf;
    }

    // Of the part's vertices, the one at a vertex of the mesh with these attributes.
    uint8_t number(uint32_t vertex, const LeafVertex& leaf) {
        for (size_t i = 0; i < part_.vertices.size(); ++i) {
            if (of_[i] == vertex && part_.vertices[i].attributes == leaf.attributes) return static_cast<uint8_t>(i);
        }
        part_.vertices.push_back(leaf);
        of_.push_back(vertex);
        return static_cast<uint8_t>(part_.vertices.size() - 1);
    }
    void close(ByteLists& coded) {
        if (part_.triangles.empty()) return;
        coded.add(encode_leaf(in_coding_order(part_), atlas_.attributes));
        made_.push_back(std::move(part_));
        part_ = {};
        of_.clear();
    }

    const ResampleInput& input_;
    const Atlas& atlas_;
    const ChartCutting& cutting_;
    LeafPart part_;
    std::vector<LeafPart> made_;
    std::vector<uint32_t> of_;  // per vertex of the part: that of the mesh
};

// Of the sphere around the middle of a square that holds its samples and its leaf.
double radius_of(const Atlas& atlas, uint32_t quad, uint32_t square, const ChartCutting& cutting,
                 const std::vector<uint32_t>& triangles) {
    const uint32_t per_side = atlas.leaves_per_side(quad), n = atlas.cells_of(quad) / per_side,
                   left = square % per_side * n, top = square / per_side * n;
    const glm::dvec3 middle = atlas.point(atlas.texel(quad, left + n / 2, top + n / 2));
    double radius = 0;
    for (uint32_t y = top; y <= top + n; ++y) {
        for (uint32_t x = left; x <= left + n; ++x)
            radius = std::max(radius, glm::distance(middle, atlas.point(atlas.texel(quad, x, y))));
    }
    for (const uint32_t t : triangles) {
        for (const uint32_t v : cutting.mesh().triangles[t].vertices)
            radius = std::max(radius, glm::distance(middle, cutting.mesh().positions[v]));
    }
    return radius * (1 + rounding) + atlas.step;
}

}  // namespace

ChartLeaves make_leaves(const ResampleInput& input, const Atlas& atlas, const SampleDepths& depths, uint32_t quad,
                        const Chart& chart) {
    const uint32_t per_side = atlas.leaves_per_side(quad), squares = per_side * per_side;
    ChartLeaves leaves{std::vector<double>(squares, 0),
                       std::vector<double>(squares, 0),
                       std::vector<std::array<double, 4>>(squares),
                       std::vector<uint32_t>(squares, 0),
                       {}};
    const ChartCutting cutting(input, atlas, depths, quad, chart);
    const auto triangles = cutting.by_square();
    if (!triangles) return leaves;
    const SquareErrors errors(atlas, quad, chart.patch);
    PartMaker maker(input, atlas, cutting);
    for (uint32_t i = 0; i < squares; ++i) {
        leaves.errors[i] = errors.of(i);
        leaves.radii[i] = radius_of(atlas, quad, i, cutting, (*triangles)[i]);
        maker.add(i, (*triangles)[i], leaves.coded);
        leaves.parts[i] = static_cast<uint32_t>(maker.made().size());
        leaves.sides[i] = side_errors(atlas, depths, {quad, i % per_side, i / per_side}, maker.made());
    }
    leaves.coded.shrink_to_fit();
    return leaves;
}

namespace {

// The code of the error from which on the samples of a square take about as many triangles as its leaf does.
uint8_t error_worth(const Atlas& atlas, uint32_t quad, uint32_t square, uint64_t leaf_triangles) {
    const uint32_t per_side = atlas.leaves_per_side(quad), n = atlas.cells_of(quad) / per_side,
                   left = square % per_side * n, top = square / per_side * n;
    std::vector<uint8_t> errors;
    for (uint32_t y = top; y <= top + n; ++y) {
        for (uint32_t x = left; x <= left + n; ++x) {
            const uint8_t code = atlas.sample_errors[atlas.texel(quad, x, y)];
            if (code < 255) errors.push_back(code);  // but for corners of the chart
        }
    }
    // A sample takes two triangles, and has parents with smaller errors of their own.
    const uint64_t samples = leaf_triangles / 4;
    if (samples >= errors.size()) return 0;
    std::ranges::nth_element(errors, errors.begin() + static_cast<ptrdiff_t>(samples), std::greater<>());
    return errors[samples];
}

// Where a leaf would be off by more beside the samples of a square than these are, the square's leaf is drawn, too.
// sides: per square of all charts, ChartLeaves::sides.
void raise_by_sides(const std::vector<std::array<double, 4>>& sides, Atlas& atlas) {
    const ErrorCodes codes(atlas.extent());
    const auto raise = [&](const Atlas::Tile& square, uint32_t leaf) {
        for (uint32_t s = 0; s < 4; ++s) {
            const uint32_t across = leaf_across(atlas, square, s).leaf;
            if (across == ~0u || atlas.leaves[across].error == 0) continue;
            uint8_t& error = atlas.leaves[across].error;
            error = std::max(error, codes.of_error(std::min(sides[leaf][s], atlas.extent())));
        }
    };
    for (uint32_t c = 0; c < atlas.charts(); ++c) for_leaf_squares(atlas, c, raise);
}

}  // namespace

void take_leaves(std::vector<ChartLeaves> charts, Atlas& atlas) {
    LODE_CHECK(charts.size() == atlas.charts(), charts.size());
    const ErrorCodes codes(atlas.extent());
    size_t lists = 0, bytes = 0;
    for (const ChartLeaves& of : charts) {
        lists += of.coded.size();
        bytes += of.coded.bytes().size();
    }
    atlas.leaf_parts.reserve(lists, bytes);
    std::vector<std::array<double, 4>> sides;
    uint32_t parts = 0;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        ChartLeaves& of = charts[c];
        const uint32_t per_side = atlas.leaves_per_side(c), n = atlas.cells_of(c) / per_side;
        size_t first = 0;
        for (uint32_t i = 0; i < per_side * per_side; ++i) {
            Leaf leaf;
            leaf.position = atlas.positions[atlas.texel(c, i % per_side * n + n / 2, i / per_side * n + n / 2)];
            if (of.parts[i] > 0) {
                uint64_t triangles = 0;
                for (uint32_t p = 0; p < of.parts[i]; ++p) triangles += triangles_in_leaf(of.coded[first + p]);
                // A leaf is never off by more; it may be drawn sooner, where it takes fewer triangles.
                leaf.error = std::max(codes.of_error(std::min(of.errors[i], atlas.extent())),
                                      error_worth(atlas, c, i, triangles));
                leaf.radius = codes.of_radius(of.radii[i]);
            }
            leaf.parts_end = parts += of.parts[i];
            first += of.parts[i];
            atlas.leaves.push_back(leaf);
        }
        atlas.leaf_parts.add(of.coded);
        sides.insert(sides.end(), of.sides.begin(), of.sides.end());
        of = {};
    }
    raise_by_sides(sides, atlas);
}

}  // namespace lodestone::vgi
