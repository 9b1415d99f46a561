#include "report/image_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "base/looks/srgb.h"
#include "base/threads.h"

namespace lodestone {

namespace {

std::vector<double> luminance(const Picture& picture) {
    std::vector<double> y(size_t{picture.width} * picture.height);
    for (size_t i = 0; i < y.size(); ++i) {
        const uint8_t* c = &picture.colour[i * 4];
        y[i] = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    }
    return y;
}

// Gaussian of 11 taps, sigma 1.5, along rows and columns; windows are cut at the border and weighted anew.
std::vector<double> blurred(const std::vector<double>& values, uint32_t width, uint32_t height) {
    std::array<double, 11> weight{};
    for (int k = 0; k < 11; ++k) weight[static_cast<size_t>(k)] = std::exp(-(k - 5) * (k - 5) / (2 * 1.5 * 1.5));
    const auto pass = [&](const std::vector<double>& in, bool rows) {
        std::vector<double> out(in.size());
        parallel_for(height, 16, [&](size_t begin, size_t end) {
            for (size_t y = begin; y < end; ++y) {
                for (size_t x = 0; x < width; ++x) {
                    double sum = 0, total = 0;
                    for (int k = -5; k <= 5; ++k) {
                        const ptrdiff_t px = static_cast<ptrdiff_t>(x) + (rows ? k : 0),
                                        py = static_cast<ptrdiff_t>(y) + (rows ? 0 : k);
                        if (px < 0 || py < 0 || px >= static_cast<ptrdiff_t>(width) ||
                            py >= static_cast<ptrdiff_t>(height))
                            continue;
                        const double w = weight[static_cast<size_t>(k + 5)];
                        sum += w * in[static_cast<size_t>(py) * width + static_cast<size_t>(px)];
                        total += w;
                    }
                    out[y * width + x] = sum / total;
                }
            }
        });
        return out;
    };
    return pass(pass(values, true), false);
}

bool covered(const Picture& picture, size_t i) { return picture.colour[i * 4 + 3] > 0; }
bool same_size(const Picture& a, const Picture& b) { return a.width == b.width && a.height == b.height; }

// Whether a surface goes on from what one pixel shows of it to what the next one shows. Where it does, it lies between
// the rays through the two, and so nowhere farther than a pixel from the way from place to place, and ends nowhere so
// near to it. Where a part of it ends in front of another, that way leads through the open.
bool goes_on(const PixelPlaces::Place& a, const PixelPlaces::Place& b, const ClosestSurface& surface,
             const ClosestSurface* rims) {
    const double apart = glm::distance(a.world, b.world) * std::max(a.pixels_per_unit, b.pixels_per_unit);
    const auto steps = static_cast<uint32_t>(std::clamp(std::ceil(apart), 4.0, 64.0));
    for (uint32_t i = 0; i <= steps; ++i) {
        const double share = static_cast<double>(i) / steps;
        const double pixel = glm::mix(1 / a.pixels_per_unit, 1 / b.pixels_per_unit, share);
        const glm::dvec3 at = glm::mix(a.world, b.world, share);
        const auto is_near = [&](const ClosestSurface& to) {
            return to.closest(at, ClosestSurface::no_hint, pixel).distance <= pixel;
        };
        if (!is_near(surface) || (rims != nullptr && is_near(*rims))) return false;
    }
    return true;
}

// same(x, y, x2, y2): of pixels beside each other, whether one sheet covers both.
template <class Same>
uint64_t leaks(const Picture& picture, const Picture& full, double pixel_error, const Same& same) {
    LODE_CHECK(same_size(picture, full), picture.width, full.width);
    const size_t side = std::min(full.width, full.height),
                 around = std::min(side, static_cast<size_t>(std::ceil(pixel_error)) + 2);
    const auto is_covered = [&](size_t x, size_t y) { return covered(full, y * full.width + x); };
    const auto is_inside = [&](size_t x, size_t y, const auto& test) {
        for (size_t row = y - around; row <= y + around; ++row) {
            for (size_t column = x - around; column <= x + around; ++column) {
                if (!test(column, row)) return false;
            }
        }
        return true;
    };
    uint64_t count = 0;
    for (size_t y = around; y + around < full.height; ++y) {
        for (size_t x = around; x + around < full.width; ++x) {
            if (covered(picture, y * full.width + x) || !is_inside(x, y, is_covered)) continue;
            const auto is_same = [&](size_t column, size_t row) {
                return (column == x + around || same(column, row, column + 1, row)) &&
                       (row == y + around || same(column, row, column, row + 1));
            };
            count += is_inside(x, y, is_same) ? 1 : 0;
        }
    }
    return count;
}

// drawn: the surface that `from` shows.
double one_way_deviation(const Picture& from, const ClosestSurface& drawn, const ClosestSurface& to, const View& view) {
    const PixelPlaces places(view);
    std::vector<double> row_largest(from.height, 0);
    parallel_for(from.height, 4, [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) {
            uint32_t hint = ClosestSurface::no_hint;
            for (size_t x = 0; x < from.width; ++x) {
                if (!covered(from, y * from.width + x)) continue;
                const auto [world, pixels] = places.of(from, x, y);
                const ClosestSurface::Hit hit = to.closest(world, hint);
                hint = hit.triangle;
                if (hit.distance * pixels <= row_largest[y]) continue;
                // Of a triangle seen edge on a rasteriser may tell a depth that none of its points has.
                const glm::dvec3 shown = drawn.closest(world).point;
                row_largest[y] = std::max(row_largest[y], to.closest(shown, hint).distance * pixels);
            }
        }
    });
    return *std::max_element(row_largest.begin(), row_largest.end());
}

}  // namespace

Picture downsampled(const Picture& picture, uint32_t factor) {
    LODE_CHECK(factor > 0 && picture.width % factor == 0 && picture.height % factor == 0, factor, picture.width,
               picture.height);
    std::array<double, 256> linear{};
    for (size_t i = 0; i < 256; ++i) linear[i] = linear_from_srgb(static_cast<double>(i) / 255);
    Picture small;
    small.width = picture.width / factor;
    small.height = picture.height / factor;
    small.colour.resize(size_t{4} * small.width * small.height);
    small.depth.resize(size_t{small.width} * small.height);
    const double count = double{1} * factor * factor;
    for (size_t y = 0; y < small.height; ++y) {
        for (size_t x = 0; x < small.width; ++x) {
            std::array<double, 4> sum{};
            float nearest = 0;
            for (size_t k = 0; k < size_t{factor} * factor; ++k) {
                const size_t i = (y * factor + k / factor) * picture.width + x * factor + k % factor;
                for (size_t c = 0; c < 3; ++c) sum[c] += linear[picture.colour[i * 4 + c]];
                sum[3] += picture.colour[i * 4 + 3];
                nearest = std::max(nearest, picture.depth[i]);
            }
            const size_t o = y * small.width + x;
            for (size_t c = 0; c < 3; ++c)
                small.colour[o * 4 + c] = static_cast<uint8_t>(std::lround(255 * srgb_from_linear(sum[c] / count)));
            small.colour[o * 4 + 3] = static_cast<uint8_t>(std::ceil(sum[3] / count));
            small.depth[o] = nearest;
        }
    }
    return small;
}

std::vector<uint8_t> covered_union(const Picture& a, const Picture& b) {
    LODE_CHECK(same_size(a, b), a.width, b.width);
    std::vector<uint8_t> mask(size_t{a.width} * a.height);
    for (size_t i = 0; i < mask.size(); ++i) mask[i] = covered(a, i) || covered(b, i) ? 1 : 0;
    return mask;
}

double psnr_db(const Picture& a, const Picture& b, const std::vector<uint8_t>& mask) {
    LODE_CHECK(same_size(a, b), a.width, b.width);
    const std::vector<double> ya = luminance(a), yb = luminance(b);
    double sum = 0, count = 0;
    for (size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0) continue;
        sum += (ya[i] - yb[i]) * (ya[i] - yb[i]);
        ++count;
    }
    if (sum <= 0) return most_psnr_db;
    return std::min(most_psnr_db, 10 * std::log10(255 * 255 / (sum / count)));
}

double ssim(const Picture& a, const Picture& b, const std::vector<uint8_t>& mask) {
    LODE_CHECK(same_size(a, b), a.width, b.width);
    const std::vector<double> ya = luminance(a), yb = luminance(b);
    const auto product = [](const std::vector<double>& p, const std::vector<double>& q) {
        std::vector<double> out(p.size());
        for (size_t i = 0; i < p.size(); ++i) out[i] = p[i] * q[i];
        return out;
    };
    const auto mean_of = [&](const std::vector<double>& values) { return blurred(values, a.width, a.height); };
    const auto ma = mean_of(ya), mb = mean_of(yb), maa = mean_of(product(ya, ya)), mbb = mean_of(product(yb, yb)),
               mab = mean_of(product(ya, yb));
    constexpr double c1 = (0.01 * 255) * (0.01 * 255), c2 = (0.03 * 255) * (0.03 * 255);
    double sum = 0, count = 0;
    for (size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0) continue;
        const double va = maa[i] - ma[i] * ma[i], vb = mbb[i] - mb[i] * mb[i], cov = mab[i] - ma[i] * mb[i];
        sum += (2 * ma[i] * mb[i] + c1) * (2 * cov + c2) / ((ma[i] * ma[i] + mb[i] * mb[i] + c1) * (va + vb + c2));
        ++count;
    }
    return count > 0 ? sum / count : 1;
}

Picture difference_map(const Picture& a, const Picture& b) {
    LODE_CHECK(same_size(a, b), a.width, b.width);
    const std::vector<double> ya = luminance(a), yb = luminance(b);
    Picture map{a.width, a.height, {}, {}};
    map.colour.reserve(ya.size() * 4);
    for (size_t i = 0; i < ya.size(); ++i) {
        if (!covered(a, i) && !covered(b, i)) {
            map.colour.insert(map.colour.end(), {12, 16, 28, 255});
            continue;
        }
        // Red, then green, then blue rise, each over a third of a quarter of the range.
        const double t = std::min(1.0, std::abs(ya[i] - yb[i]) / 64) * 3;
        for (int k = 0; k < 3; ++k)
            map.colour.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(t - k, 0.0, 1.0))));
        map.colour.push_back(255);
    }
    return map;
}

uint64_t background_leaks(const Picture& picture, const Picture& full, double pixel_error) {
    return leaks(picture, full, pixel_error, [](size_t, size_t, size_t, size_t) { return true; });
}

std::unique_ptr<ClosestSurface> rims_of(std::span<const glm::vec3> corners) {
    using Edge = std::array<float, 6>;
    std::vector<Edge> edges;
    edges.reserve(corners.size());
    for (size_t i = 0; i < corners.size(); ++i) {
        std::array ends{corners[i], corners[i % 3 == 2 ? i - 2 : i + 1]};
        if (ends[0] == ends[1]) continue;
        const auto key = [](const glm::vec3& p) { return std::tie(p.x, p.y, p.z); };
        if (key(ends[1]) < key(ends[0])) std::swap(ends[0], ends[1]);
        edges.push_back({ends[0].x, ends[0].y, ends[0].z, ends[1].x, ends[1].y, ends[1].z});
    }
    std::ranges::sort(edges);
    std::vector<glm::vec3> positions;
    std::vector<uint32_t> indices;
    for (size_t i = 0, end = 0; i < edges.size(); i = end) {
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end - i > 1) continue;
        const auto first = static_cast<uint32_t>(positions.size());
        const Edge& e = edges[i];
        positions.insert(positions.end(), {{e[0], e[1], e[2]}, {e[3], e[4], e[5]}});
        indices.insert(indices.end(), {first, first + 1, first + 1});
    }
    return indices.empty() ? nullptr : std::make_unique<ClosestSurface>(positions, indices);
}

uint64_t cracks(const Picture& picture, const Picture& full, const ClosestSurface& full_surface,
                const ClosestSurface* rims, const View& view, double pixel_error) {
    LODE_CHECK(view.width == full.width && view.height == full.height, full.width, view.width);
    const PixelPlaces places(view);
    return leaks(picture, full, pixel_error, [&](size_t x, size_t y, size_t x2, size_t y2) {
        return goes_on(places.of(full, x, y), places.of(full, x2, y2), full_surface, rims);
    });
}

PixelPlaces::PixelPlaces(const View& view)
    : view_(&view),
      world_to_view_(view.world_to_view),
      clip_to_world_(glm::inverse(glm::dmat4(view.view_to_clip) * world_to_view_)) {}

PixelPlaces::Place PixelPlaces::of(const Picture& picture, size_t x, size_t y) const {
    const glm::dvec4 clip((static_cast<double>(x) + 0.5) / picture.width * 2 - 1,
                          (static_cast<double>(y) + 0.5) / picture.height * 2 - 1,
                          static_cast<double>(picture.depth[y * picture.width + x]), 1);
    const glm::dvec4 at = clip_to_world_ * clip;
    const glm::dvec3 world = glm::dvec3(at) / at.w;
    const double depth = -(world_to_view_ * glm::dvec4(world, 1)).z;
    return {world, static_cast<double>(view_->focal_px) / std::max(depth, static_cast<double>(view_->near_plane))};
}

double max_pixel_deviation(const Picture& picture, const ClosestSurface& surface, const Picture& full,
                           const ClosestSurface& full_surface, const View& view) {
    LODE_CHECK(same_size(picture, full) && view.width == full.width && view.height == full.height, picture.width,
               full.width, view.width);
    return std::max(one_way_deviation(picture, surface, full_surface, view),
                    one_way_deviation(full, full_surface, surface, view));
}

}  // namespace lodestone
