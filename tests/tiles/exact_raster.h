// Counts the front and the back faces that cover each pixel, without rounding once places are projected: to 1 / 256 of
// a pixel, by the rule that GPUs have (a pixel on an edge belongs to the triangle of which it is a top or a left edge).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "base/random.h"

namespace lodestone::tiles {

class ExactRaster {
public:
    // eye, target: as the points that are drawn.
    ExactRaster(uint32_t size, const glm::dvec3& eye, const glm::dvec3& target)
        : size_(size), eye_(eye), front_(size_t{size} * size), back_(front_.size()) {
        forward_ = glm::normalize(target - eye);
        right_ = glm::normalize(
            glm::cross(forward_, std::abs(forward_.z) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1)));
        up_ = glm::cross(right_, forward_);
    }

    // What stands behind the eye is refused, and the picture then tells nothing.
    bool draw(const std::array<glm::dvec3, 3>& corners) {
        std::array<std::array<int64_t, 2>, 3> p{};
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3 from = corners[k] - eye_;
            const double depth = glm::dot(from, forward_);
            if (depth <= 0) return false;
            const double scale = 256.0 * size_ / depth;  // a field of view of 53 degrees
            p[k] = {std::llround(128.0 * size_ + scale * glm::dot(from, right_)),
                    std::llround(128.0 * size_ + scale * glm::dot(from, up_))};
        }
        int64_t area = cross(p[0], p[1], p[2]);
        if (area == 0) return true;
        auto& counts = area > 0 ? front_ : back_;
        if (area < 0) std::swap(p[1], p[2]);
        cover(p, counts);
        return true;
    }

    struct Counts {
        uint64_t covered = 0, leaks = 0,
                 unequal = 0;  // pixels: of any face; of backs alone; of more of one than the other
    };
    Counts counts() const {
        Counts c;
        for (size_t i = 0; i < front_.size(); ++i) {
            c.covered += front_[i] + back_[i] > 0;
            c.leaks += back_[i] > 0 && front_[i] == 0;
            c.unequal += front_[i] != back_[i];
        }
        return c;
    }

private:
    using Point = std::array<int64_t, 2>;
    static int64_t cross(const Point& a, const Point& b, const Point& c) {
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    }
    // Counter-clockwise with y up: an edge that goes down is a left one, one that goes left a top one.
    static bool owns(const Point& a, const Point& b) { return b[1] < a[1] || (b[1] == a[1] && b[0] < a[0]); }

    void cover(const std::array<Point, 3>& p, std::vector<uint16_t>& counts) const {
        const auto range = [&](size_t axis) {
            const int64_t low = std::min({p[0][axis], p[1][axis], p[2][axis]}),
                          high = std::max({p[0][axis], p[1][axis], p[2][axis]});
            const auto first = std::max<int64_t>(0, (low - 128) / 256 - 1);
            const auto last = std::min<int64_t>(size_ - 1, high / 256 + 1);
            return std::array{first, last};
        };
        const auto [x0, x1] = range(0);
        const auto [y0, y1] = range(1);
        for (int64_t y = y0; y <= y1; ++y) {
            for (int64_t x = x0; x <= x1; ++x) {
                const Point centre = {x * 256 + 128, y * 256 + 128};
                bool in = true;
                for (size_t k = 0; k < 3 && in; ++k) {
                    const Point &a = p[k], &b = p[(k + 1) % 3];
                    const int64_t side = cross(a, b, centre);
                    in = side > 0 || (side == 0 && owns(a, b));
                }
                if (in) ++counts[static_cast<size_t>(y * size_ + x)];
            }
        }
    }

    uint32_t size_;
    glm::dvec3 eye_, forward_, right_, up_;
    std::vector<uint16_t> front_, back_;
};

}  // namespace lodestone::tiles
