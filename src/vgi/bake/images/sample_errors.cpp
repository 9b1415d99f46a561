#include "vgi/bake/images/sample_errors.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "base/check.h"
#include "base/threads.h"
#include "mesh/distance/closest_point.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/node_triangles.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/charts/surface.h"
#include "vgi/bake/images/patch_buckets.h"

namespace lodestone::vgi {

namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

// Calls visit(triangle corners) for the triangles of the bintree that p splits.
template <class Visit>
void for_split_triangles(const Bintree& tree, GridPoint p, Visit&& visit) {
    const auto ends = tree.hypotenuse(p);
    const GridPoint &a = ends[0], &b = ends[1];
    tree.for_parents(p, [&](GridPoint apex) {
        // Counter-clockwise in the square.
        const int64_t turn = int64_t{b.x - a.x} * (apex.y - a.y) - int64_t{b.y - a.y} * (apex.x - a.x);
        if (turn > 0) {
            visit(a, b, apex);
        } else {
            visit(b, a, apex);
        }
    });
}

class Measure {
public:
    Measure(Atlas& atlas, uint32_t chart, const ChartMesh& source)
        : atlas_(atlas),
          chart_(chart),
          unsampled_(atlas.unsampled_levels[chart]),
          cells_(atlas.cells_of(chart) >> unsampled_),
          tree_(tree_of(atlas, Layer::geometry, chart)),
          source_(source),
          near_(source, cells_),
          squared_(size_t{cells_ + 1} * (cells_ + 1), 0.0),
          worst_at_(squared_.size()) {
        errors_.levels.assign(atlas.levels() - atlas.trimmed_levels[chart] - unsampled_, 0);
        errors_.pages.assign(tree_.pages(), 0);
    }

    ChartErrors run() {
        const ChartMesh& patch = source_;
        const auto levels = static_cast<uint32_t>(errors_.levels.size()) - 1;
        const auto of_source = [&](const glm::dvec2& flat, const glm::dvec3& point) {
            const glm::dvec2 at = glm::clamp(flat, 0.0, 1.0) * static_cast<double>(cells_);
            finest(at, point);
            for (uint32_t level = 0; level < levels; ++level) look(level, at, point, true);
        };
        for (size_t v = 0; v < patch.positions.size(); ++v) of_source(patch.flat[v], patch.positions[v]);
        for (const SurfaceTriangle& t : patch.triangles) {
            const auto& [a, b, c] = t.vertices;
            of_source((patch.flat[a] + patch.flat[b] + patch.flat[c]) / 3.0,
                      (patch.positions[a] + patch.positions[b] + patch.positions[c]) / 3.0);
        }
        // Where the source has few vertices, its image's samples tell more; of coarse levels some are enough.
        for (uint32_t level = 0; level < levels; ++level) {
            const uint32_t stride = std::max(1u, (1u << level) / 4);
            for (uint32_t y = 0; y <= cells_; y += stride) {
                for (uint32_t x = 0; x <= cells_; x += stride) {
                    // Of these, fewer are enough to look back from.
                    const bool back = x % (2 * stride) == 0 && y % (2 * stride) == 0;
                    look(level, {x, y}, at(x, y), back || stride == 1);
                }
            }
        }
        if (levels > 0) look_back_from_halves();
        const Bintree tree{static_cast<int32_t>(cells_)};
        for (uint32_t depth = 0; depth < tree.depths(); ++depth)
            tree.for_depth(depth, [&](GridPoint sample) { climb(depth / 2, sample); });
        write_codes();
        if (unsampled_ > tree_.base_level()) errors_.pages[0] = errors_.levels.front();
        for (double& e : errors_.levels) e = std::sqrt(e);
        for (double& e : errors_.pages) e = std::sqrt(e);
        // Levels without samples of their own show what the finest of those does.
        errors_.levels.insert(errors_.levels.begin(), unsampled_, errors_.levels.front());
        for (uint32_t page = 1; page < tree_.pages(); ++page) {
            if (tree_.level(page) < unsampled_) errors_.pages[page] = errors_.pages[tree_.parent(page)];
        }
        return std::move(errors_);
    }

private:
    static double square(const glm::dvec3& v) { return glm::dot(v, v); }
    // Of the samples of the chart's own.
    size_t texel(uint32_t x, uint32_t y) const { return atlas_.texel(chart_, x << unsampled_, y << unsampled_); }
    glm::dvec3 at(uint32_t x, uint32_t y) const { return atlas_.point(texel(x, y)); }

    void write_codes() {
        const ErrorCodes codes(atlas_.extent());
        for (uint32_t y = 0; y <= cells_; ++y) {
            for (uint32_t x = 0; x <= cells_; ++x)
                atlas_.sample_errors[texel(x, y)] = codes.of_error(std::sqrt(squared_[y * (cells_ + 1) + x]));
        }
        for (const uint32_t x : {0u, cells_}) {
            for (const uint32_t y : {0u, cells_})
                atlas_.sample_errors[texel(x, y)] = atlas_.sample_radii[texel(x, y)] = ErrorCodes::everywhere;
        }
    }

    // Distance of places that belong together, of the grid of a level: bounds both directions.
    void note(uint32_t level, const glm::dvec2& place, double squared) {
        errors_.levels[level] = std::max(errors_.levels[level], squared);
        const uint32_t size = tree_.cells_per_page() << level;
        level += unsampled_;
        if (level > tree_.base_level()) return;
        const uint32_t last = tree_.pages_per_side(level) - 1;
        const uint32_t x = std::min(last, static_cast<uint32_t>(place.x) / size),
                       y = std::min(last, static_cast<uint32_t>(place.y) / size);
        double& page = errors_.pages[tree_.page(level, x, y)];
        page = std::max(page, squared);
    }

    // The finest grid at the place of a point of the source.
    void finest(const glm::dvec2& place, const glm::dvec3& point) {
        const uint32_t last = cells_ - 1;
        const uint32_t x = std::min(last, static_cast<uint32_t>(place.x)),
                       y = std::min(last, static_cast<uint32_t>(place.y));
        const double fx = place.x - x, fy = place.y - y;
        glm::dvec3 drawn;
        if (rising_diagonal(x, y)) {
            drawn = fx >= fy ? at(x, y) * (1 - fx) + at(x + 1, y) * (fx - fy) + at(x + 1, y + 1) * fy
                             : at(x, y) * (1 - fy) + at(x, y + 1) * (fy - fx) + at(x + 1, y + 1) * fx;
        } else {
            drawn = fx + fy <= 1 ? at(x, y) * (1 - fx - fy) + at(x + 1, y) * fx + at(x, y + 1) * fy
                                 : at(x + 1, y + 1) * (fx + fy - 1) + at(x, y + 1) * (1 - fx) + at(x + 1, y) * (1 - fy);
        }
        note(0, place, square(drawn - point));
    }

    // Squared distance from a point to the source about a place: first by steps from sample to sample of its image,
    // long ones at first, then to what the source has around the best. Never less than to the whole source, but for
    // `most` and `enough` as PatchBuckets::squared_distance has them.
    double squared_to_source(const glm::dvec3& point, const glm::dvec2& place, uint32_t reach, double most,
                             double enough) const {
        const auto last = static_cast<int>(cells_);
        int bx = std::clamp(static_cast<int>(std::lround(place.x)), 0, last),
            by = std::clamp(static_cast<int>(std::lround(place.y)), 0, last);
        const auto to_sample = [&](int x, int y) {
            return square(at(static_cast<uint32_t>(x), static_cast<uint32_t>(y)) - point);
        };
        double best = to_sample(bx, by);
        for (int step = static_cast<int>(reach); step > 0;) {
            const int x = bx, y = by;
            for (const auto& [dx, dy] :
                 {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
                const int nx = x + dx * step, ny = y + dy * step;
                if (nx < 0 || ny < 0 || nx > last || ny > last) continue;
                if (const double d = to_sample(nx, ny); d < best) {
                    best = d;
                    bx = nx;
                    by = ny;
                }
            }
            if (bx == x && by == y) step /= 2;
        }
        return near_.squared_distance(point, static_cast<uint32_t>(bx), static_cast<uint32_t>(by), most, enough);
    }

    size_t number_of(GridPoint sample) const {
        return static_cast<size_t>(sample.y) * (cells_ + 1) + static_cast<size_t>(sample.x);
    }

    // Calls visit(sample, what is drawn at a place, triangle corners) for the triangles there that the centre and the
    // middle of an edge of a cell of level + 1 split, the centre's first.
    template <class Visit>
    void for_triangles_at(uint32_t level, const glm::dvec2& place, Visit&& visit) const {
        const uint32_t half = 1u << level, size = 2 * half, last = cells_ / size - 1;
        const uint32_t cx = std::min(last, static_cast<uint32_t>(place.x) / size),
                       cy = std::min(last, static_cast<uint32_t>(place.y) / size), x = cx * size, y = cy * size;
        const double fx = (place.x - x) / size, fy = (place.y - y) / size;
        const glm::dvec3 corner[4] = {at(x, y), at(x + size, y), at(x + size, y + size), at(x, y + size)};
        const auto sample = [](uint32_t sx, uint32_t sy) {
            return GridPoint{static_cast<int32_t>(sx), static_cast<int32_t>(sy)};
        };
        const auto& [a, b, c, d] = corner;
        const GridPoint centre = sample(x + half, y + half);
        if (rising_diagonal(cx, cy)) {
            if (fx >= fy) {
                visit(centre, a * (1 - fx) + b * (fx - fy) + c * fy, a, b, c);
            } else {
                visit(centre, a * (1 - fy) + d * (fy - fx) + c * fx, a, c, d);
            }
        } else if (fx + fy <= 1) {
            visit(centre, a * (1 - fx - fy) + b * fx + d * fy, a, b, d);
        } else {
            visit(centre, c * (fx + fy - 1) + d * (1 - fx) + b * (1 - fy), b, c, d);
        }
        // Which of the four triangles around the centre: from the middle outwards 0 .. 1, along the edge 0 .. 1.
        const double gx = 2 * fx - 1, gy = 2 * fy - 1, out = std::max(std::abs(gx), std::abs(gy));
        const uint32_t side = std::abs(gx) > std::abs(gy) ? (gx > 0 ? 1 : 3) : (gy > 0 ? 2 : 0);
        const double along = side == 0 ? gx : side == 1 ? gy : side == 2 ? -gx : -gy;  // -out .. out
        const glm::dvec3 &p = corner[side], &q = corner[(side + 1) % 4], middle = at(x + half, y + half);
        const std::array<GridPoint, 4> middles{sample(x + half, y), sample(x + size, y + half),
                                               sample(x + half, y + size), sample(x, y + half)};
        visit(middles[side], middle * (1 - out) + p * ((out - along) / 2) + q * ((out + along) / 2), p, q, middle);
    }

    // How far the point is from the triangles at a place, and, where they are looked back from, how far they are from
    // the source there.
    void look(uint32_t level, const glm::dvec2& place, const glm::dvec3& point, bool back) {
        bool of_centre = true;
        for_triangles_at(level, place,
                         [&](GridPoint sample, const glm::dvec3& drawn, const glm::dvec3& a, const glm::dvec3& b,
                             const glm::dvec3& c) {
                             double& known = squared_[number_of(sample)];
                             const double together = square(drawn - point), before = known;
                             if (together > known)
                                 known = std::max(known, square(closest_on_triangle(point, a, b, c) - point));
                             if (back && together > known)
                                 known = std::max(known, squared_to_source(drawn, place, 1u << level, together, known));
                             if (known > before) worst_at_[number_of(sample)] = place;
                             if (std::exchange(of_centre, false)) note(level + 1, place, together);
                         });
    }

    // How far the triangles at a place are from the source there. only: of this sample, or of all.
    void look_back(uint32_t level, const glm::dvec2& place, std::optional<GridPoint> only = {}) {
        for_triangles_at(level, place, [&](GridPoint sample, const glm::dvec3& drawn, const auto&...) {
            if (only && number_of(*only) != number_of(sample)) return;
            double& known = squared_[number_of(sample)];
            const double squared = squared_to_source(drawn, place, 1u << level, unbounded, known);
            if (squared > known) worst_at_[number_of(sample)] = place;
            known = std::max(known, squared);
        });
    }

    // Triangles of the finest level have few samples and vertices of the source on them.
    void look_back_from_halves() {
        for (uint32_t y = 0; y <= 2 * cells_; ++y) {
            for (uint32_t x = 0; x <= 2 * cells_; ++x) {
                if (x % 2 == 1 || y % 2 == 1) look_back(0, {0.5 * x, 0.5 * y});
            }
        }
    }

    // From the place where the triangles that a sample of a level splits are farthest from the source, of those looked
    // at, on to where they are farther: between two places there may be a crease.
    void climb(uint32_t level, GridPoint sample) {
        for (double far = 0.5 * (1u << level); far > 0.1 * (1u << level); far /= 2) {
            const glm::dvec2 from = worst_at_[number_of(sample)];
            for (const glm::dvec2& off : {glm::dvec2(-far, 0), {far, 0}, {0, -far}, {0, far}}) {
                const glm::dvec2 place = from + off;
                const bool inside = std::min(place.x, place.y) >= 0 && std::max(place.x, place.y) <= cells_;
                if (inside) look_back(level, place, sample);
            }
        }
    }

    Atlas& atlas_;
    const uint32_t chart_, unsampled_, cells_;  // cells between samples of the chart's own
    const PageTree tree_;                       // of all its cells
    const ChartMesh& source_;
    const PatchBuckets near_;
    std::vector<double> squared_;       // per sample: own error so far
    std::vector<glm::dvec2> worst_at_;  // per sample: the place where it was found
    ChartErrors errors_;
};

// Glued samples of a depth take the larger code.
void share(const Atlas& atlas, uint32_t depth, std::vector<uint8_t>& codes) {
    const uint32_t stride = 1u << (depth / 2);
    if (depth % 2 == 1) return;  // centres lie inside
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        for (uint32_t s = 0; s < 4; ++s) {
            const GluedSide& other = atlas.sides[size_t{c} * 4 + s];
            if (other.chart == ~0u || std::pair(other.chart, other.side) < std::pair(c, s)) continue;
            const uint32_t n = atlas.cells_of(c);
            for (uint32_t k = stride; k < n; k += 2 * stride) {
                const auto [x, y] = on_side(s, k, n);
                const auto [u, v] = on_side(other.side, n - k, n);
                uint8_t &mine = codes[atlas.texel(c, x, y)], &its = codes[atlas.texel(other.chart, u, v)];
                mine = its = std::max(mine, its);
            }
        }
    }
}

// A cone of normals: unit axis and half angle in radians; no half angle above pi / 2 is of use.
struct Cone {
    glm::dvec3 axis{0};
    double angle = 4;
};

class ChartBounds {
public:
    ChartBounds(Atlas& atlas, uint32_t chart, const std::vector<double>& errors)
        : atlas_(atlas),
          chart_(chart),
          tree_(tree_of(atlas, Layer::geometry, chart)),
          of_atlas_(tree_of(atlas, Layer::geometry)),
          errors_(errors),
          cones_(tree_.pages()) {
        if (!atlas.leaves.empty()) read_leaves();
    }

    void run() {
        // Children come after their parents.
        for (uint32_t page = tree_.pages(); page-- > 0;) {
            uint32_t level = 0, px = 0, py = 0;
            tree_.place(page, &level, &px, &py);
            const uint32_t size = tree_.cells_per_page() << level, x = px * size, y = py * size;
            PageBounds& bounds = bounds_of(page);
            bound_sphere(x, y, size, bounds);
            for_leaves(level, px, py, [&](const LeafShape& leaf) {
                for (const glm::dvec3& point : leaf.points) {
                    const glm::dvec3 at = atlas_.origin + atlas_.step * point;
                    const double away = glm::distance(at, glm::dvec3(bounds.centre)) * (1 + rounding);
                    bounds.radius = std::max(bounds.radius, static_cast<float>(away + atlas_.extent() * 1e-7));
                }
            });
            for_own_samples(atlas_, chart_, page, [&](size_t texel) {
                bounds.sample_error = std::max(bounds.sample_error, atlas_.sample_errors[texel]);
                bounds.sample_radius = std::max(bounds.sample_radius, atlas_.sample_radii[texel]);
            });
            double error = errors_[page];
            if (level > 0) {
                for_children(level, px, py, [&](uint32_t child) {
                    error = std::max(error, static_cast<double>(bounds_of(child).error));
                });
            }
            bounds.error = std::nextafter(static_cast<float>(error), 1e30f);
            bound_cone(page, level, px, py, bounds);
        }
        // Pages that are left out show what their parents do, and have nothing to be wanted for.
        for (uint32_t page = tree_.pages(); page < of_atlas_.pages(); ++page) {
            PageBounds& bounds = bounds_of(page);
            bounds = bounds_of(of_atlas_.parent(page));
            bounds.sample_error = bounds.sample_radius = 0;
        }
    }

private:
    // What leaves show in place of samples.
    struct LeafShape {
        std::vector<glm::dvec3> points, normals;  // of vertices, lattice points; of triangles, of any length
    };
    void read_leaves() {
        const uint32_t per_side = atlas_.leaves_per_side(chart_);
        for (uint32_t i = 0; i < per_side * per_side; ++i) {
            LeafShape& shape = leaves_.emplace_back();
            const uint32_t leaf = atlas_.first_leaf[chart_] + i;
            for (uint32_t p = atlas_.first_part(leaf); p < atlas_.leaves[leaf].parts_end; ++p) {
                const auto part = decode_leaf(atlas_.leaf_parts[p], atlas_.attributes);
                LODE_CHECK(part.has_value(), p);
                const size_t first = shape.points.size();
                for (const LeafVertex& v : part->vertices)
                    shape.points.push_back(glm::dvec3(v.position[0], v.position[1], v.position[2]) /
                                           static_cast<double>(1u << atlas_.leaf_shift));
                for (const auto& t : part->triangles)
                    shape.normals.push_back(area_vector(shape.points[first + t[0]], shape.points[first + t[1]],
                                                        shape.points[first + t[2]]));
            }
        }
    }
    // Calls visit(shape) for the leaves in a page's square.
    template <class Visit>
    void for_leaves(uint32_t level, uint32_t px, uint32_t py, Visit&& visit) const {
        if (leaves_.empty()) return;
        const uint32_t per_side = tree_.pages_per_side(0);
        for (uint32_t y = py << level; y < (py + 1) << level; ++y) {
            for (uint32_t x = px << level; x < (px + 1) << level; ++x) visit(leaves_[y * per_side + x]);
        }
    }

    PageBounds& bounds_of(uint32_t page) { return atlas_.bounds[size_t{chart_} * of_atlas_.pages() + page]; }
    template <class Visit>
    void for_children(uint32_t level, uint32_t px, uint32_t py, Visit&& visit) const {
        for (uint32_t k = 0; k < 4; ++k) visit(tree_.page(level - 1, 2 * px + k % 2, 2 * py + k / 2));
    }

    void bound_sphere(uint32_t x0, uint32_t y0, uint32_t size, PageBounds& bounds) const {
        std::array<uint16_t, 3> low{65535, 65535, 65535}, high{0, 0, 0};
        const auto all = [&](auto&& visit) {
            for (uint32_t y = y0; y <= y0 + size; ++y) {
                for (uint32_t x = x0; x <= x0 + size; ++x) visit(atlas_.texel(chart_, x, y));
            }
        };
        all([&](size_t texel) {
            for (size_t k = 0; k < 3; ++k) {
                low[k] = std::min(low[k], atlas_.positions[texel][k]);
                high[k] = std::max(high[k], atlas_.positions[texel][k]);
            }
        });
        bounds.centre = glm::vec3(atlas_.origin +
                                  atlas_.step * 0.5 * glm::dvec3(low[0] + high[0], low[1] + high[1], low[2] + high[2]));
        double squared = 0;
        all([&](size_t texel) {
            const glm::dvec3 off = atlas_.point(texel) - glm::dvec3(bounds.centre);
            squared = std::max(squared, glm::dot(off, off));
        });
        bounds.radius = static_cast<float>(std::sqrt(squared) * (1 + rounding) + atlas_.extent() * 1e-7);
    }

    // Triangles of the page's part of the bintree down to its own level; finer ones are in the cones of its children.
    // And those of the nodes of grid cuts that are culled by this page, as they are with nothing collapsed. The tree of
    // a page is that of a chart, only smaller: visit(places in it).
    template <class Visit>
    void for_triangles(uint32_t level, Visit&& visit) const {
        const auto n = static_cast<int32_t>(tree_.cells_per_page());
        for (int32_t y = 0; y < n; ++y) {
            for (int32_t x = 0; x < n; ++x) {
                const GridPoint a{x, y}, b{x + 1, y}, c{x + 1, y + 1}, d{x, y + 1};
                const bool rising = rising_diagonal(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
                for (const auto& t : cell_triangles(rising, a, b, c, d)) visit(t[0], t[1], t[2]);
            }
        }
        const Bintree tree{n};
        for (uint32_t depth = 0; depth < tree.depths(); ++depth)
            tree.for_depth(depth, [&](GridPoint p) { for_split_triangles(tree, p, visit); });
        const int32_t finest = level == 0 ? 1 : std::min(4, n),
                      coarsest = level == tree_.base_level() ? n : std::min(4, n);
        for (int32_t step = finest; step <= coarsest; step *= 2) {
            const int32_t cells = std::min(1 << most_node_shift, n / step);
            for (int32_t y = 0; y < n; y += cells * step) {
                for (int32_t x = 0; x < n; x += cells * step) {
                    const auto in_page = [&](GridPoint p) { return GridPoint{x + p.x * step, y + p.y * step}; };
                    for_node_triangles(cells, {}, [&](GridPoint a, GridPoint b, GridPoint c) {
                        visit(in_page(a), in_page(b), in_page(c));
                    });
                }
            }
        }
    }

    void bound_cone(uint32_t page, uint32_t level, uint32_t px, uint32_t py, PageBounds& bounds) {
        // On the lattice: normals are the same there.
        const uint32_t n = tree_.cells_per_page();
        points_.clear();
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x) {
                const auto& p = atlas_.positions[atlas_.texel(chart_, (px * n + x) << level, (py * n + y) << level)];
                points_.emplace_back(p[0], p[1], p[2]);
            }
        }
        const auto at = [&](GridPoint p) {
            return points_[static_cast<uint32_t>(p.y) * (n + 1) + static_cast<uint32_t>(p.x)];
        };
        normals_.clear();
        glm::dvec3 sum(0);
        for_triangles(level, [&](GridPoint a, GridPoint b, GridPoint c) {
            normals_.push_back(area_vector(at(a), at(b), at(c)));
            sum += normals_.back();
        });
        if (level == 0) {
            for_leaves(level, px, py, [&](const LeafShape& leaf) {
                normals_.insert(normals_.end(), leaf.normals.begin(), leaf.normals.end());
            });
        }
        Cone& cone = cones_[page];
        const double length = glm::length(sum);
        if (length > 0) {
            // The axis as it is stored.
            for (int k = 0; k < 3; ++k)
                bounds.axis[static_cast<size_t>(k)] = static_cast<int8_t>(std::lround(sum[k] / length * 127));
            cone.axis = glm::normalize(glm::dvec3(bounds.axis[0], bounds.axis[1], bounds.axis[2]));
            double least = 1;
            for (const glm::dvec3& normal : normals_) {
                const double size = glm::length(normal);
                if (size > 0) least = std::min(least, glm::dot(normal, cone.axis) / size);
            }
            cone.angle = std::acos(std::clamp(least, -1.0, 1.0));
            if (level > 0) {
                for_children(level, px, py, [&](uint32_t child) {
                    const double apart = std::acos(std::clamp(glm::dot(cone.axis, cones_[child].axis), -1.0, 1.0));
                    cone.angle = std::max(cone.angle, apart + cones_[child].angle);
                });
            }
        }
        const double cosine = cone.angle < 1.57 ? std::cos(cone.angle) : -1;
        bounds.cosine = static_cast<int8_t>(cosine > 0 ? std::floor(cosine * 127 - 1e-9) : -127);
    }

    Atlas& atlas_;
    const uint32_t chart_;
    const PageTree tree_, of_atlas_;  // the chart's own, and that of charts that leave out nothing
    const std::vector<double>& errors_;
    std::vector<Cone> cones_;
    std::vector<LeafShape> leaves_;             // by square; empty where there are none
    std::vector<glm::dvec3> points_, normals_;  // of the page at hand: lattice points; of its triangles
};

}  // namespace

ChartErrors measure_samples(Atlas& atlas, const SampleDepths& depths, uint32_t chart, const Chart& source) {
    ChartErrors errors = Measure(atlas, chart, source.patch).run();
    const std::vector<bool> absent = absent_samples(atlas, depths, chart);
    const size_t first = atlas.texel(chart, 0, 0);
    for (size_t i = 0; i < absent.size(); ++i) {
        if (!absent[i]) continue;
        atlas.sample_errors[first + i] = 0;
        atlas.sample_radii[first + i] = ErrorCodes::absent;
    }
    return errors;
}

namespace {

// visit(chart, its tree, sample) for the samples of a depth.
template <class Visit>
void for_samples_of_depth(const Atlas& atlas, uint32_t depth, const Visit& visit) {
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
            const Bintree tree = bintree_of(atlas, c);
            if (depth < tree.depths()) tree.for_depth(depth, [&](GridPoint p) { visit(c, tree, p); });
        }
    });
}

// Errors of a depth rise above those of its children.
void saturate_errors(Atlas& atlas, const ErrorCodes& codes, uint32_t depth) {
    for_samples_of_depth(atlas, depth, [&](uint32_t c, const Bintree& tree, GridPoint p) {
        uint8_t& code = atlas.sample_errors[texel_of(atlas, c, p)];
        double child = 0;
        tree.for_children(p, [&](GridPoint q) {
            child = std::max<double>(child, codes.error(atlas.sample_errors[texel_of(atlas, c, q)]));
        });
        if (child > 0) code = std::max(code, codes.of_error(std::min(child * error_ratio, atlas.extent())));
        // Samples above leaves are few, and each counts.
        if (atlas.leaves.empty()) code = round_up(code, depth / 2);
    });
    share(atlas, depth, atlas.sample_errors);
}

// Radii of a depth hold its hypotenuse and parents, and what its children ask for.
void saturate_radii(Atlas& atlas, const ErrorCodes& codes, uint32_t depth) {
    for_samples_of_depth(atlas, depth, [&](uint32_t c, const Bintree& tree, GridPoint p) {
        const size_t texel = texel_of(atlas, c, p);
        const glm::dvec3 here = atlas.point(texel);
        const auto away = [&](GridPoint q) { return glm::length(atlas.point(texel_of(atlas, c, q)) - here); };
        const double error = codes.error(atlas.sample_errors[texel]);
        // What is wanted within its radius around a place wants this sample.
        const auto reach = [&](uint8_t its_error, uint8_t its_radius, double distance) {
            return (static_cast<double>(codes.error(its_error)) - error / error_ratio) * least_magnification +
                   static_cast<double>(codes.radius(its_radius)) + distance;
        };
        const auto [a, b] = tree.hypotenuse(p);
        double radius = std::max(away(a), away(b));
        tree.for_parents(p, [&](GridPoint q) { radius = std::max(radius, away(q)); });
        tree.for_children(p, [&](GridPoint q) {
            const size_t child = texel_of(atlas, c, q);
            radius = std::max(radius, reach(atlas.sample_errors[child], atlas.sample_radii[child], away(q)));
        });
        if (atlas.sample_radii[texel] == ErrorCodes::absent) return;
        // A sample that costs nothing is never wanted; neither are its children.
        atlas.sample_radii[texel] = error > 0 ? codes.of_radius(radius * (1 + rounding)) : 0;
    });
    share(atlas, depth, atlas.sample_radii);
}

}  // namespace

void saturate(Atlas& atlas) {
    const ErrorCodes codes(atlas.extent());
    const uint32_t depths = Bintree{static_cast<int32_t>(atlas.cells)}.depths();
    for (uint32_t depth = 0; depth < depths; ++depth) {
        saturate_errors(atlas, codes, depth);
        saturate_radii(atlas, codes, depth);
    }
}

void bound_pages(Atlas& atlas, const std::vector<std::vector<double>>& page_errors) {
    LODE_CHECK(page_errors.size() == atlas.charts(), page_errors.size());
    atlas.bounds.resize(size_t{atlas.charts()} * tree_of(atlas, Layer::geometry).pages());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) ChartBounds(atlas, static_cast<uint32_t>(c), page_errors[c]).run();
    });
}

}  // namespace lodestone::vgi
