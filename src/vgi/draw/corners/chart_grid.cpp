#include "vgi/draw/corners/chart_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <tuple>

#include "base/threads.h"
#include "mesh/distance/distance.h"
#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

namespace {

// Cells along the longest side: about one for each chart that the surface has across, and no more than take a megabyte.
constexpr double least_cells = 4, most_cells = 32;
// Charts that face another way than the nearest ones count up to so many cells away.
constexpr double farthest = 4;
constexpr size_t most_charts = LODE_VGI_GRID_CHARTS;
constexpr int ways = 7;  // any, and along each axis, one way or the other
static_assert(ways < most_charts);

// Some charts, to find the nearest of; none: nothing is.
class Charts {
public:
    // Those with a triangle for which which(twice its area, as a vector) holds.
    template <class Which>
    Charts(const Atlas& about, Which&& which) {
        std::vector<glm::vec3> positions;
        for (const Corner& c : about.corners) positions.emplace_back(c.position[0], c.position[1], c.position[2]);
        std::vector<uint32_t> indices;
        for (uint32_t chart = 0; chart < about.charts(); ++chart) {
            const std::array<uint32_t, 4>& k = about.chart_corners[chart];
            for (const std::array<uint32_t, 3>& t : {std::array{k[0], k[1], k[2]}, {k[0], k[2], k[3]}}) {
                const glm::vec3 &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
                if (!which(glm::cross(b - a, c - a))) continue;
                indices.insert(indices.end(), t.begin(), t.end());
                of_.push_back(chart);
            }
        }
        if (!of_.empty()) surface_.emplace(positions, indices);
    }

    struct Found {
        double distance;  // lattice units
        uint32_t chart;
        bool operator<(const Found& other) const {
            return std::tie(distance, chart) < std::tie(other.distance, other.chart);
        }
    };
    // Nearest to places a cell's side apart, the first so many sides from the lowest corner; x first.
    std::vector<Found> nearest(const glm::uvec3& size, double side, double first) const {
        std::vector<Found> found(size_t{size.x} * size.y * size.z, {infinite, LODE_VGI_NO_CHART});
        if (!surface_) return found;
        parallel_for(size_t{size.y} * size.z, 8, [&](size_t begin, size_t end) {
            for (size_t row = begin; row < end; ++row) {
                uint32_t hint = ClosestSurface::no_hint;
                for (uint32_t x = 0; x < size.x; ++x) {
                    const glm::dvec3 at = glm::dvec3(x, row % size.y, row / size.y) + first;
                    const auto hit = surface_->closest(at * side, hint);
                    hint = hit.triangle;
                    found[row * size.x + x] = {hit.distance, of_[hint]};
                }
            }
        });
        return found;
    }

private:
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    std::vector<uint32_t> of_;  // per triangle
    std::optional<ClosestSurface> surface_;
};

class Grid {
public:
    explicit Grid(const Atlas& about) : about_(about) {
        glm::vec3 high(1);
        for (const Corner& c : about.corners)
            high = glm::max(high, glm::vec3(c.position[0], c.position[1], c.position[2]));
        const double along = std::clamp(std::sqrt(about.charts()), least_cells, most_cells);
        side_ = std::max({high.x, high.y, high.z}) / static_cast<float>(std::floor(along));
        cells_ = glm::min(glm::uvec3(high / side_) + 1u, static_cast<uint32_t>(most_cells));
    }

    std::vector<CornerRecord> table() const {
        const Charts all(about_, [](const glm::vec3&) { return true; });
        const auto at_corners = all.nearest(cells_ + 1u, double{side_}, 0);
        std::vector<std::vector<Charts::Found>> in_middles = {all.nearest(cells_, double{side_}, 0.5)};
        // Those that face along an axis, more or less: whichever way a triangle faces, there are some that face it,
        // too.
        for (int axis = 0; axis < 3; ++axis) {
            for (const float sign : {1.0f, -1.0f}) {
                const Charts facing(about_, [&](const glm::vec3& n) { return sign * n[axis] > 0.5f * glm::length(n); });
                in_middles.push_back(facing.nearest(cells_, double{side_}, 0.5));
            }
        }
        std::vector<CornerRecord> table = {{cells_.x, cells_.y, cells_.z, std::bit_cast<uint32_t>(side_)}};
        for (uint32_t i = 0; i < in_middles[0].size(); ++i) {
            std::vector<Charts::Found> found;
            for (const auto& each : in_middles) found.push_back(each[i]);
            const uint32_t x = i % cells_.x, y = i / cells_.x % cells_.y, z = i / cells_.x / cells_.y;
            for (uint32_t k = 0; k < 8; ++k)
                found.push_back(
                    at_corners[((z + (k >> 2)) * (cells_.y + 1) + y + (k >> 1 & 1)) * (cells_.x + 1) + x + (k & 1)]);
            for (const CornerRecord& part : cell_of(found)) table.push_back(part);
        }
        return table;
    }

private:
    // found: nearest to the middle of all, of those that face each way, and nearest to each corner.
    std::array<CornerRecord, most_charts / 4> cell_of(std::vector<Charts::Found> found) const {
        const double enough = found[0].distance + farthest * double{side_};
        // The nearest of each way before those at corners, so that none is missing.
        std::sort(found.begin() + 1, found.begin() + ways);
        std::sort(found.begin() + ways, found.end());
        std::array<CornerRecord, most_charts / 4> cell;
        for (CornerRecord& part : cell) part.fill(LODE_VGI_NO_CHART);
        size_t count = 0;
        const auto has = [&](uint32_t chart) {
            return std::ranges::any_of(
                cell, [&](const CornerRecord& part) { return std::ranges::find(part, chart) != part.end(); });
        };
        for (const Charts::Found& each : found) {
            if (count == most_charts) break;
            if (each.distance > enough || has(each.chart)) continue;
            cell[count / 4][count % 4] = each.chart;
            ++count;
        }
        return cell;
    }

    const Atlas& about_;
    float side_;
    glm::uvec3 cells_;
};

}  // namespace

std::vector<CornerRecord> chart_grid(const Atlas& about) {
    return about.corners.empty() ? std::vector<CornerRecord>{} : Grid(about).table();
}

}  // namespace lodestone::vgi
