#include "vgi/bake/images/corners/corner_motion.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <iterator>
#include <numeric>

#include "base/check.h"
#include "base/threads.h"
#include "mesh/distance/closest_point.h"

namespace lodestone::vgi {

// Corners of one component, by their numbers in the order in which they went; those that stay come last.
class CornerMotion::Component {
public:
    Component(const CornerMotion& all, std::span<const uint32_t> of, std::span<const uint32_t> order,
              std::span<const CornerFate> fates)
        : all_(all), count_(static_cast<uint32_t>(of.size())), parents_(count_), drawn_(count_) {
        std::vector<uint32_t> corners(order.begin(), order.end());
        std::ranges::copy_if(of, std::back_inserter(corners), [&](uint32_t v) { return fates[v].parent == v; });
        LODE_CHECK(corners.size() == count_, corners.size(), count_);
        std::vector<std::pair<uint32_t, uint32_t>> numbers;
        for (uint32_t i = 0; i < count_; ++i) numbers.emplace_back(corners[i], i);
        std::ranges::sort(numbers);
        const auto number = [&](uint32_t corner) {
            return std::ranges::lower_bound(numbers, corner, {}, &std::pair<uint32_t, uint32_t>::first)->second;
        };
        for (uint32_t i = 0; i < count_; ++i) {
            parents_[i] = number(fates[corners[i]].parent);
            drawn_[i].own = all.positions_[corners[i]];
            for (const uint32_t half : all.first_[corners[i]]) {
                const auto& [a, b, c] = all.halves_[half].corners;
                halves_.push_back({half, {number(a), number(b), number(c)}});
            }
        }
    }

    // Corners [begin, end) are half way, those before are gone. The first corner that is better not with them, as
    // something is farther off than `most`, object units; `end` where nothing is.
    uint32_t first_too_early(uint32_t begin, uint32_t end, double most) {
        place(begin, end);
        std::vector<const Moved*> moving;
        std::vector<glm::vec3> drawn;
        for (const Moved& half : halves_) {
            if (!is_flat(half)) {
                for (const uint32_t v : half.corners) drawn.emplace_back(drawn_[v].at);
            }
            if (last_of(half) != none) moving.push_back(&half);
        }
        if (drawn.empty()) return end;
        std::vector<uint32_t> indices(drawn.size());
        std::iota(indices.begin(), indices.end(), 0u);
        const ClosestSurface surface(drawn, indices);
        std::vector<uint32_t> found(moving.size(), end);
        parallel_for(moving.size(), 32, [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i) {
                if (is_far(*moving[i], surface, most)) found[i] = last_of(*moving[i]);
            }
        });
        return found.empty() ? end : *std::ranges::min_element(found);
    }

private:
    static constexpr uint32_t none = ~0u;
    struct Drawn {
        glm::dvec3 own, at;    // place of its own, and where it is drawn
        uint32_t as = 0;       // in whose place it is drawn, were none moving
        uint32_t last = none;  // the last that moves of those that it moves with
    };
    struct Moved {
        uint32_t half;
        std::array<uint32_t, 3> corners;
    };

    void place(uint32_t begin, uint32_t end) {
        for (uint32_t i = count_; i-- > 0;) {
            Drawn& d = drawn_[i];
            const Drawn& parent = drawn_[parents_[i]];
            d.as = i < begin ? parent.as : i;
            d.last = i >= end ? none : i < begin || parent.last != none ? parent.last : i;
            d.at = i >= end ? d.own : i < begin ? parent.at : 0.5 * (d.own + parent.at);
        }
    }
    bool is_flat(const Moved& half) const {
        const uint32_t a = drawn_[half.corners[0]].as, b = drawn_[half.corners[1]].as, c = drawn_[half.corners[2]].as;
        return a == b || b == c || c == a;
    }
    uint32_t last_of(const Moved& half) const {
        uint32_t last = none;
        for (const uint32_t v : half.corners) {
            const uint32_t its = drawn_[v].last;
            if (its != none && (last == none || its > last)) last = its;
        }
        return last;
    }
    // Of its triangle from the charts, or of its points from what is drawn.
    bool is_far(const Moved& half, const ClosestSurface& surface, double most) const {
        const auto at = [&](size_t k) { return drawn_[half.corners[k]].at; };
        uint32_t near = ClosestSurface::no_hint;
        if (!is_flat(half) && all_.charts_.squared_off({at(0), at(1), at(2)}, most * most, near) > most * most)
            return true;
        near = ClosestSurface::no_hint;
        for (const glm::dvec3& point : all_.halves_[half.half].points) {
            if (glm::distance(closest_on_triangle(point, at(0), at(1), at(2)), point) <= most) continue;
            const ClosestSurface::Hit hit = surface.closest(point, near, most);
            if (hit.distance > most) return true;
            near = hit.triangle;
        }
        return false;
    }

    const CornerMotion& all_;
    const uint32_t count_;
    std::vector<uint32_t> parents_;
    std::vector<Drawn> drawn_;
    std::vector<Moved> halves_;
};

CornerMotion::CornerMotion(const Atlas& atlas, const MeasuredCharts& charts, std::span<const uint32_t> of,
                           std::span<const glm::dvec3> positions)
    : charts_(charts), positions_(positions), codes_(atlas.extent()), first_(positions.size()) {
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const auto corner = [&](uint32_t k) { return of[4 * c + k]; };
        Half lower{{corner(0), corner(1), corner(2)}, {}}, upper{{corner(0), corner(2), corner(3)}, {}};
        const uint32_t half = atlas.cells_of(c) / 2;
        for (uint32_t y = 0; y <= 2; ++y) {
            for (uint32_t x = 0; x <= 2; ++x)
                (x >= y ? lower : upper).points.push_back(atlas.point(atlas.texel(c, x * half, y * half)));
        }
        for (Half* its : {&lower, &upper}) {
            first_[corner(0)].push_back(static_cast<uint32_t>(halves_.size()));
            halves_.push_back(std::move(*its));
        }
    }
}

void CornerMotion::hold(std::span<const uint32_t> corners, std::span<const uint32_t> order,
                        std::span<const CornerFate> fates, std::span<uint8_t> codes) const {
    Component component(*this, corners, order, fates);
    const auto count = static_cast<uint32_t>(order.size());
    for (uint32_t begin = 0; begin < count;) {
        const uint8_t code = codes[begin];
        const auto end = static_cast<uint32_t>(std::ranges::upper_bound(codes, code) - codes.begin());
        // The smallest is of corners that no view wants, the largest of those that all do.
        const bool moves = code > 0 && code < 255;
        const uint32_t early =
            moves ? component.first_too_early(begin, end, static_cast<double>(codes_.error(code))) : end;
        for (uint32_t i = early; i < end; ++i) ++codes[i];
        if (early == end) begin = end;
    }
}

}  // namespace lodestone::vgi
