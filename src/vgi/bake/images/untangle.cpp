#include "vgi/bake/images/untangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

namespace lodestone::vgi {

namespace {

constexpr std::array<int, 4> reaches{3, 6, 12, 24};  // cells around a fold that may move, one after the other
// Of a chart's cells, where it is no height field: with more the surface is rougher than its samples.
constexpr double most_folded = 1.0 / 64;
// Points of the lattice to a cell of a height field's chart, as seen along its axis: with fewer folds are of rounding.
constexpr double fewest_points = 16;
constexpr double most_left = 0.25;  // of the folds, by the first turn through the reaches: else the next are in vain
constexpr int most_sweeps = 100;
constexpr size_t moves_per_sample = 8;  // tried in all, of a chart's samples: what is not in order then will not be
constexpr double least_move = 0.05;     // of a step of the lattice: a sweep in which nothing moves further is the last
constexpr double most_outside = 0.5;    // weight: a sample at a concave border may have to lie outside of all triangles
constexpr double most_longer = 2;       // times the longest edge of a region, where it is no height field
constexpr double least_cosine = 0.05;   // between the plane of a region and the surface in it

// Twice the area of a triangle around a vertex, as the vertex moves: constant + dot(slope, vertex).
struct Area {
    double constant;
    glm::dvec2 slope;
    double at(const glm::dvec2& p) const { return constant + glm::dot(slope, p); }
    // The height of the vertex above the edge across from it, the same way.
    Area height() const {
        const double edge = glm::length(slope);
        return edge > 0 ? Area{constant / edge, slope / edge} : *this;
    }
};

// Where the lowest of the heights is highest. It exists: the ring is closed.
std::optional<glm::dvec2> fairest(std::span<const Area> triangles) {
    std::vector<Area> heights;
    for (const Area& triangle : triangles) heights.push_back(triangle.height());
    std::optional<glm::dvec2> best;
    double best_least = 0;
    for (size_t i = 0; i < heights.size(); ++i) {
        for (size_t j = i + 1; j < heights.size(); ++j) {
            for (size_t k = j + 1; k < heights.size(); ++k) {
                // Where these three are equal.
                const glm::dvec2 a = heights[i].slope - heights[j].slope, b = heights[i].slope - heights[k].slope;
                const double u = heights[j].constant - heights[i].constant,
                             v = heights[k].constant - heights[i].constant;
                const double det = cross(a, b);
                if (std::abs(det) <= 1e-12 * (glm::length(a) * glm::length(b))) continue;
                const glm::dvec2 p((u * b.y - v * a.y) / det, (v * a.x - u * b.x) / det);
                const double equal = heights[i].at(p);
                if (best && equal <= best_least) continue;
                const double slack = 1e-9 * (std::abs(equal) + std::abs(heights[i].constant));
                if (std::ranges::any_of(heights, [&](const Area& height) { return height.at(p) < equal - slack; }))
                    continue;
                best = p;
                best_least = equal;
            }
        }
    }
    return best;
}

using Corners = std::array<int, 3>;  // samples

// Whether a sample lies inside a chart of `row` samples to a row.
bool inside(int sample, int row) {
    const int x = sample % row, y = sample / row;
    return x > 0 && y > 0 && x + 1 < row && y + 1 < row;
}

// A part of a chart's grid as it is seen in a plane, to be put in order there.
class PlaneRegion {
public:
    // row: samples to a row of the chart's grid, which `triangles` are of. moves_left: counted down with every move
    // that is tried; at 0 none is.
    PlaneRegion(std::vector<Corners> triangles, int row, size_t& moves_left)
        : triangles_(std::move(triangles)), row_(row), moves_left_(moves_left) {
        index_.assign(static_cast<size_t>(row) * static_cast<size_t>(row), none);
        for (uint32_t t = 0; t < triangles_.size(); ++t) {
            for (const int s : triangles_[t]) {
                uint32_t& i = index_[static_cast<size_t>(s)];
                if (i == none) {
                    i = static_cast<uint32_t>(samples_.size());
                    samples_.push_back(s);
                    ring_.emplace_back();
                }
                ring_[i].push_back(t);
            }
        }
    }
    const std::vector<Corners>& triangles() const { return triangles_; }
    const std::vector<int>& samples() const { return samples_; }

    // Where the samples lie, in their order; those inside the region may move. Until every triangle is as large as what
    // rounding by a step may take from it, times `margin`, or nothing more can be done.
    void put_in_order(std::vector<glm::dvec2>& flat, double step, double margin) const {
        const auto is_good = [&](const Corners& t) {
            double longest = 0;
            for (size_t k = 0; k < 3; ++k)
                longest = std::max(longest, glm::distance(at(flat, t[k]), at(flat, t[(k + 1) % 3])));
            return area(flat, t) >= margin * step * longest;
        };
        sweep(flat, is_good, step,
              [](const glm::dvec2& best, const glm::dvec2&, std::span<const Area>) { return best; });
    }

    // From lattice point to lattice point, until every triangle has an area.
    void put_in_order_on(const glm::dvec2& origin, double step, std::vector<glm::dvec2>& flat) const {
        const auto lattice = [&](const glm::dvec2& p) { return (p - origin) / step; };
        for (glm::dvec2& p : flat) p = origin + glm::round(lattice(p)) * step;
        // Of the four points around the best place the one where the smallest area is largest.
        const auto nearby = [&](const glm::dvec2& best, const glm::dvec2& now, std::span<const Area> areas) {
            const auto least = [&](const glm::dvec2& p) {
                double smallest = areas[0].at(p);
                for (const Area& a : areas) smallest = std::min(smallest, a.at(p));
                return smallest;
            };
            glm::dvec2 chosen = now;
            for (const int u : {0, 1}) {
                for (const int v : {0, 1}) {
                    const glm::dvec2 p = origin + (glm::floor(lattice(best)) + glm::dvec2(u, v)) * step;
                    if (least(p) > least(chosen)) chosen = p;
                }
            }
            if (least(chosen) > 0.5 * step * step) return chosen;
            // Where all areas are long and narrow there may be none, and others far from there.
            for (const glm::dvec2& q : lattice_points(areas, lattice, step)) {
                const glm::dvec2 p = origin + q * step;
                if (least(p) > least(chosen)) chosen = p;
            }
            return chosen;
        };
        // Where that does not do, what is around becomes larger than it need be and makes room.
        const auto larger_than = [&](double squares) {
            return [&flat, step, squares, this](const Corners& t) { return area(flat, t) > squares * step * step; };
        };
        for (const double squares : {0.5, 3.5, 0.5, 15.5, 0.5, 63.5, 0.5}) {
            sweep(flat, larger_than(squares), step, nearby);
            if (std::ranges::all_of(triangles_, larger_than(0.5))) return;
        }
    }

private:
    const glm::dvec2& at(const std::vector<glm::dvec2>& flat, int sample) const {
        return flat[index_[static_cast<size_t>(sample)]];
    }
    // Twice.
    double area(const std::vector<glm::dvec2>& flat, const Corners& t) const {
        return cross(at(flat, t[1]) - at(flat, t[0]), at(flat, t[2]) - at(flat, t[0]));
    }
    // Free are those inside the region and the chart; each has four or eight triangles around it.
    bool is_free(size_t i) const {
        const int x = samples_[i] % row_, y = samples_[i] / row_;
        return inside(samples_[i], row_) && ring_[i].size() == ((x + y) % 2 == 0 ? 8u : 4u);
    }
    // Points of the lattice where all areas are at least one of its squares: of each of its columns the one in the
    // middle.
    template <class Lattice>
    static std::vector<glm::dvec2> lattice_points(std::span<const Area> areas, const Lattice& lattice, double step) {
        constexpr double most_columns = 1000;
        const double square = step * step;
        double low = std::numeric_limits<double>::infinity(), high = -low;
        std::vector<Area> on;  // the same of lattice points, by squares
        for (const Area& area : areas) {
            const glm::dvec2 zero = -lattice(glm::dvec2(0)) * step;  // the lattice's origin
            on.push_back({area.at(zero) / square, area.slope / step});
        }
        for (size_t i = 0; i < on.size(); ++i) {
            for (size_t j = i + 1; j < on.size(); ++j) {
                const double det = cross(on[i].slope, on[j].slope);
                if (std::abs(det) < 0.5) continue;  // whole numbers
                const double u = 1 - on[i].constant, v = 1 - on[j].constant;
                const glm::dvec2 p((u * on[j].slope.y - v * on[i].slope.y) / det,
                                   (v * on[i].slope.x - u * on[j].slope.x) / det);
                if (std::ranges::any_of(on, [&](const Area& area) { return area.at(p) < 1 - 1e-6; })) continue;
                low = std::min(low, p.x);
                high = std::max(high, p.x);
            }
        }
        std::vector<glm::dvec2> points;
        if (!(high - low < most_columns)) return points;
        for (double x = std::ceil(low - 1e-6); x <= high + 1e-6; ++x) {
            double bottom = -std::numeric_limits<double>::infinity(), top = -bottom;
            for (const Area& area : on) {
                const double rest = 1 - area.constant - area.slope.x * x;  // slope.y * y is at least this
                if (area.slope.y > 0.5) {
                    bottom = std::max(bottom, rest / area.slope.y);
                } else if (area.slope.y < -0.5) {
                    top = std::min(top, rest / area.slope.y);
                } else if (rest > 1e-6) {
                    top = -std::numeric_limits<double>::infinity();
                }
            }
            const double first = std::ceil(bottom - 1e-6), last = std::floor(top + 1e-6);
            if (first <= last) points.emplace_back(x, std::floor((first + last) / 2));
        }
        return points;
    }
    // choose: where a sample goes, by its best place, the one it has, and the areas around it.
    template <class IsGood, class Choose>
    void sweep(std::vector<glm::dvec2>& flat, const IsGood& is_good, double step, const Choose& choose) const {
        std::vector<Area> areas;
        bool moving = true;
        for (int sweeps = 0; sweeps < most_sweeps && moving; ++sweeps) {
            moving = false;
            for (size_t turn = 0; turn < samples_.size(); ++turn) {
                const size_t i = sweeps % 2 == 0 ? turn : samples_.size() - 1 - turn;  // to and fro
                if (!is_free(i)) continue;
                if (std::ranges::all_of(ring_[i], [&](uint32_t t) { return is_good(triangles_[t]); })) continue;
                if (moves_left_ == 0) return;
                --moves_left_;
                areas.clear();
                for (const uint32_t t : ring_[i]) {
                    size_t k = 0;
                    while (triangles_[t][k] != samples_[i]) ++k;
                    const glm::dvec2 &a = at(flat, triangles_[t][(k + 1) % 3]),
                                     &b = at(flat, triangles_[t][(k + 2) % 3]);
                    // cross(b - a, p - a)
                    const glm::dvec2 e = b - a;
                    areas.push_back({-cross(e, a), {-e.y, e.x}});
                }
                const auto best = fairest(areas);
                if (!best) continue;
                const glm::dvec2 chosen = choose(*best, flat[i], areas);
                moving = moving || glm::distance(chosen, flat[i]) > least_move * step;
                flat[i] = chosen;
            }
        }
    }

    std::vector<Corners> triangles_;
    int row_;
    size_t& moves_left_;
    std::vector<int> samples_;
    std::vector<std::vector<uint32_t>> ring_;  // per sample of the region: its triangles
    std::vector<uint32_t> index_;              // per sample of the chart: which of the region's it is
};

class Unfolding {
public:
    Unfolding(const ChartMesh& patch, std::span<SurfaceSample> places, uint32_t cells, const Atlas& atlas,
              const std::optional<glm::dvec3>& up)
        : patch_(patch),
          places_(places),
          atlas_(atlas),
          n_(static_cast<int>(cells)),
          up_(up),
          moves_left_(moves_per_sample * places.size()) {
        for (size_t i = 0; i < places.size(); ++i) {
            points_.push_back(rounded(places[i].point));
            normals_.push_back(up ? *up : normal_of(places[i].triangle));
        }
    }

    Untangled run() {
        Untangled result;
        std::vector<bool> moved(places_.size(), false);
        std::vector<bool> folded = folded_cells();
        const auto count = [&] { return static_cast<uint32_t>(std::ranges::count(folded, true)); };
        result.before = result.left = count();
        if (result.before == 0) return result;
        if (up_ ? points_per_cell() < fewest_points : result.before > most_folded * static_cast<double>(folded.size()))
            return result;
        for (const bool with_margin : {false, true, false}) {
            if (with_margin && result.left > most_left * result.before + 8) break;
            for (const int reach : reaches) {
                // Of other meshes than height fields many are true edges of the surface.
                if (result.left == 0 || moves_left_ == 0 || (!up_ && (with_margin || reach > reaches[0]))) break;
                for (const std::vector<int>& region : regions(folded, reach)) unfold_region(region, with_margin, moved);
                folded = folded_cells();
                result.left = count();
            }
        }
        for (uint32_t i = 0; i < moved.size(); ++i) {
            if (moved[i]) result.moved.push_back(i);
        }
        return result;
    }

private:
    int sample(int x, int y) const { return y * (n_ + 1) + x; }
    glm::dvec3 rounded(const glm::dvec3& p) const { return atlas_.origin + atlas_.rounded(p) * atlas_.step; }
    glm::dvec3 normal_of(uint32_t triangle) const {
        const auto& v = patch_.triangles[triangle].vertices;
        const glm::dvec3 area = area_vector(patch_.positions[v[0]], patch_.positions[v[1]], patch_.positions[v[2]]);
        const double length = glm::length(area);
        return length > 0 ? area / length : area;
    }
    std::array<Corners, 2> triangles_of(int cell) const {
        const int x = cell % n_, y = cell / n_;
        const int a = sample(x, y), b = sample(x + 1, y), c = sample(x + 1, y + 1), d = sample(x, y + 1);
        return cell_triangles(rising_diagonal(static_cast<uint32_t>(x), static_cast<uint32_t>(y)), a, b, c, d);
    }
    bool is_folded(const Corners& t) const {
        const auto [a, b, c] = t;
        // Twice an area along an axis is a whole number of the lattice's squares.
        const double least = up_ ? 1.5 * atlas_.step * atlas_.step : 0;
        return glm::dot(area_vector(point_of(a), point_of(b), point_of(c)), normal(a) + normal(b) + normal(c)) <= least;
    }
    const glm::dvec3& point_of(int sample) const { return points_[static_cast<size_t>(sample)]; }
    const glm::dvec3& normal(int sample) const { return normals_[static_cast<size_t>(sample)]; }

    double points_per_cell() const {
        double twice = 0;
        for (int cell = 0; cell < n_ * n_; ++cell) {
            for (const auto& [a, b, c] : triangles_of(cell))
                twice += glm::dot(area_vector(point_of(a), point_of(b), point_of(c)), *up_);
        }
        return twice / 2 / (atlas_.step * atlas_.step * n_ * n_);
    }

    std::vector<bool> folded_cells() const {
        std::vector<bool> folded(static_cast<size_t>(n_) * static_cast<size_t>(n_));
        for (int cell = 0; cell < n_ * n_; ++cell)
            folded[static_cast<size_t>(cell)] =
                std::ranges::any_of(triangles_of(cell), [&](const Corners& t) { return is_folded(t); });
        return folded;
    }

    // Cells up to `reach` from folded ones, those that hang together in one list.
    std::vector<std::vector<int>> regions(const std::vector<bool>& folded, int reach) const {
        std::vector<uint8_t> near(folded.size(), 0);
        const auto around = [&](int cell, int by, auto&& visit) {
            const int x = cell % n_, y = cell / n_;
            for (int v = std::max(0, y - by); v <= std::min(n_ - 1, y + by); ++v) {
                for (int u = std::max(0, x - by); u <= std::min(n_ - 1, x + by); ++u) visit(v * n_ + u);
            }
        };
        for (int cell = 0; cell < n_ * n_; ++cell) {
            if (folded[static_cast<size_t>(cell)])
                around(cell, reach, [&](int other) { near[static_cast<size_t>(other)] = 1; });
        }
        std::vector<std::vector<int>> found;
        for (int cell = 0; cell < n_ * n_; ++cell) {
            if (near[static_cast<size_t>(cell)] == 0) continue;
            std::vector<int> region{cell};
            near[static_cast<size_t>(cell)] = 0;
            for (size_t i = 0; i < region.size(); ++i) {
                around(region[i], 1, [&](int other) {
                    if (near[static_cast<size_t>(other)] == 0) return;
                    near[static_cast<size_t>(other)] = 0;
                    region.push_back(other);
                });
            }
            found.push_back(std::move(region));
        }
        return found;
    }

    // Seen along the mean normal, where the surface must be a height field. with_margin: triangles are made large
    // enough for rounding, which where all are small may leave none so.
    void unfold_region(const std::vector<int>& cells, bool with_margin, std::vector<bool>& moved) {
        std::vector<Corners> triangles;
        for (const int cell : cells) {
            const auto both = triangles_of(cell);
            triangles.insert(triangles.end(), both.begin(), both.end());
        }
        const PlaneRegion region(std::move(triangles), n_ + 1, moves_left_);
        glm::dvec3 up(0);
        for (const int s : region.samples()) up += normal(s);
        if (!(glm::length(up) > 0)) return;
        up = glm::normalize(up);
        if (std::ranges::any_of(region.samples(), [&](int s) { return glm::dot(normal(s), up) < least_cosine; }))
            return;
        const glm::dvec3 aside = std::abs(up.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 right = glm::normalize(glm::cross(aside, up)), forward = glm::cross(up, right);
        const auto seen = [&](const glm::dvec3& p) { return glm::dvec2(glm::dot(p, right), glm::dot(p, forward)); };
        std::vector<glm::dvec2> flat;
        for (const int s : region.samples()) flat.push_back(seen(point_of(s)));
        // Along an axis places are seen as they will be rounded.
        if (!up_ || with_margin) region.put_in_order(flat, atlas_.step, with_margin ? 1 : 0.25);
        if (up_) region.put_in_order_on(seen(atlas_.origin), atlas_.step, flat);
        keep(region, flat, seen, up, moved);
    }

    // Puts samples on the surface where they are seen, if that leaves fewer folds and does not tear them apart.
    template <class Seen>
    void keep(const PlaneRegion& region, const std::vector<glm::dvec2>& flat, const Seen& seen, const glm::dvec3& up,
              std::vector<bool>& moved) {
        const auto folds = [&] {
            return std::ranges::count_if(region.triangles(), [&](const Corners& t) { return is_folded(t); });
        };
        // In space: a surface that hangs over has other parts of it where a sample is to be seen.
        const auto longest = [&] {
            double length = 0;
            for (const Corners& t : region.triangles()) {
                for (size_t k = 0; k < 3; ++k)
                    length = std::max(length, glm::distance(point_of(t[k]), point_of(t[(k + 1) % 3])));
            }
            return length;
        };
        struct Was {
            size_t sample;
            SurfaceSample place;
            glm::dvec3 point, normal;
        };
        std::vector<Was> was;
        const auto before = folds();
        const double longest_before = longest();
        for (size_t i = 0; i < flat.size(); ++i) {
            const auto s = static_cast<size_t>(region.samples()[i]);
            if (!inside(region.samples()[i], n_ + 1) || glm::distance(seen(points_[s]), flat[i]) < atlas_.step / 4)
                continue;
            const auto place = find(places_[s].triangle, flat[i], seen, up);
            if (!place) continue;
            was.push_back({s, places_[s], points_[s], normals_[s]});
            places_[s] = *place;
            points_[s] = rounded(place->point);
            if (!up_) normals_[s] = normal_of(place->triangle);
        }
        const bool better = folds() < before && (up_ || longest() <= most_longer * longest_before);
        for (const Was& w : was) {
            if (better) {
                moved[w.sample] = true;
                continue;
            }
            places_[w.sample] = w.place;
            points_[w.sample] = w.point;
            normals_[w.sample] = w.normal;
        }
    }

    // The triangle that holds a place, or, just outside of the chart, the one that it is least outside of.
    template <class Seen>
    std::optional<SurfaceSample> find_anywhere(const glm::dvec2& wanted, const Seen& seen, const glm::dvec3& up) const {
        std::optional<SurfaceSample> best;
        double outside = most_outside;
        for (uint32_t t = 0; t < patch_.triangles.size(); ++t) {
            if (glm::dot(normal_of(t), up) <= 0) continue;
            const glm::dvec3 weights = weights_of(t, wanted, seen);
            const double off = -std::min({weights.x, weights.y, weights.z, 0.0});
            if (off >= outside) continue;
            outside = off;
            best = SurfaceSample(patch_, t, weights);
        }
        return best;
    }

    // Of the corners of a triangle, at a place in the plane.
    template <class Seen>
    glm::dvec3 weights_of(uint32_t triangle, const glm::dvec2& wanted, const Seen& seen) const {
        glm::dvec2 corner[3];
        for (uint32_t k = 0; k < 3; ++k) corner[k] = seen(patch_.positions[patch_.from(triangle * 3 + k)]);
        const double twice = cross(corner[1] - corner[0], corner[2] - corner[0]);
        glm::dvec3 weights;
        for (int k = 0; k < 3; ++k) {  // of the corner across from edge k
            const glm::dvec2 &a = corner[k], &b = corner[(k + 1) % 3];
            weights[(k + 2) % 3] = cross(b - a, wanted - a) / twice;
        }
        return weights;
    }

    // Walks from triangle to triangle towards a place in the plane.
    template <class Seen>
    std::optional<SurfaceSample> find(uint32_t triangle, const glm::dvec2& wanted, const Seen& seen,
                                      const glm::dvec3& up) const {
        for (int steps = 0; steps < 4 * n_; ++steps) {
            if (glm::dot(normal_of(triangle), up) <= 0) return std::nullopt;
            const glm::dvec3 weights = weights_of(triangle, wanted, seen);
            uint32_t least = 0;
            for (uint32_t k = 1; k < 3; ++k) {
                if (weights[static_cast<int>(k)] < weights[static_cast<int>(least)]) least = k;
            }
            if (weights[static_cast<int>(least)] >= -1e-9)
                return SurfaceSample(patch_, triangle, glm::clamp(weights, 0.0, 1.0));
            const uint32_t across = patch_.twin[triangle * 3 + (least + 1) % 3];
            if (across == none) return find_anywhere(wanted, seen, up);
            triangle = across / 3;
        }
        return std::nullopt;
    }

    const ChartMesh& patch_;
    std::span<SurfaceSample> places_;
    const Atlas& atlas_;
    const int n_;  // cells
    const std::optional<glm::dvec3> up_;
    size_t moves_left_;
    std::vector<glm::dvec3> points_, normals_;  // per sample: rounded; of the surface where it lies
};

}  // namespace

SurfaceSample::SurfaceSample(const ChartMesh& patch, uint32_t in_triangle, const glm::dvec3& by_weights)
    : triangle(in_triangle), weights(by_weights) {
    const auto& v = patch.triangles[triangle].vertices;
    point = patch.positions[v[0]] * weights.x + patch.positions[v[1]] * weights.y + patch.positions[v[2]] * weights.z;
}

std::optional<glm::dvec3> height_axis(const TriMesh& mesh) {
    for (int k = 0; k < 3; ++k) {
        size_t towards = 0, away = 0;
        for (size_t t = 0; t < mesh.triangle_count() && (towards == 0 || away == 0); ++t) {
            const double along = area_vector(glm::dvec3(mesh.position_of(t, 0)), glm::dvec3(mesh.position_of(t, 1)),
                                             glm::dvec3(mesh.position_of(t, 2)))[k];
            towards += along > 0;
            away += along <= 0;
        }
        glm::dvec3 axis(0);
        axis[k] = towards > 0 ? 1 : -1;
        if ((away == 0) != (towards == 0)) return axis;
    }
    return std::nullopt;
}

Untangled untangle(const ChartMesh& patch, std::span<SurfaceSample> places, uint32_t cells, const Atlas& lattice,
                   const std::optional<glm::dvec3>& up) {
    return Unfolding(patch, places, cells, lattice, up).run();
}

}  // namespace lodestone::vgi
