#include "vgi/unwrap/packing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/check.h"

namespace lodestone::vgi {

namespace {

// A rectangle's shape changes by at most this factor; what is left of its cell stays empty.
constexpr double most_change = 1.3;
// Strips that are weighed against each other have heights up to so many times those of their rectangles.
constexpr double highest_strip = 4;
constexpr int most_trials = 40;  // of the scale

// One square: rectangles upright, the highest first.
class Square {
public:
    Square(std::span<const WantedRectangle> wanted, std::vector<uint32_t> members, double gutter)
        : members_(std::move(members)), gutter_(gutter) {
        const auto height = [&](uint32_t r) { return std::max(wanted[r].width, wanted[r].height); };
        std::ranges::stable_sort(members_, std::greater<>(), height);
        area_.push_back(0);
        flat_.push_back(0);
        high_.push_back(0);
        for (const uint32_t r : members_) {
            const double area = wanted[r].width * wanted[r].height, h = height(r);
            heights_.push_back(h);
            area_.push_back(area_.back() + area);
            flat_.push_back(flat_.back() + area / (h * h));
            high_.push_back(high_.back() + area * h * h);
        }
    }

    // The largest scale at which strips fit, and the strips. False where gutters alone do not fit.
    bool choose_strips() {
        double low = 0, high = std::sqrt(1 / area_.back());
        scale_ = high;
        if (cut_strips() <= 1) return true;
        std::vector<Strip> best;
        for (int trial = 0; trial < most_trials && high - low > 1e-4 * high; ++trial) {
            scale_ = (low + high) / 2;
            const bool fit = cut_strips() <= 1;
            (fit ? low : high) = scale_;
            if (fit) best = strips_;
        }
        scale_ = low;
        strips_ = std::move(best);
        return low > 0;
    }

    void place(std::span<const WantedRectangle> wanted, uint32_t square, std::vector<PackedRectangle>& packed) const {
        double used = 0;
        for (const Strip& strip : strips_) used += strip.height;
        // What is left goes to all strips alike.
        const double spare = (1 - static_cast<double>(strips_.size()) * gutter_) / used;
        double y = gutter_ / 2;
        for (const Strip& strip : strips_) {
            const double height = strip.height * spare;
            double x = gutter_ / 2;
            for (size_t i = strip.begin; i < strip.end; ++i) {
                const double width = area_of(i) * scale_ * scale_ / strip.height;
                const WantedRectangle& r = wanted[members_[i]];
                PackedRectangle& to = packed[members_[i]];
                to = {square, r.width > r.height, x, y, width, height};
                keep_shape(r, to);
                x += width + gutter_;
            }
            y += height + gutter_;
        }
    }

private:
    struct Strip {
        size_t begin = 0, end = 0;  // of members_
        double height = 0;          // without the gutter
    };

    double area_of(size_t i) const { return area_[i + 1] - area_[i]; }

    // Members begin .. end - 1 side by side fill the width; infinite where gutters alone are wider.
    double strip_height(size_t begin, size_t end) const {
        const double room = 1 - static_cast<double>(end - begin) * gutter_;
        return room > 0 ? (area_[end] - area_[begin]) * scale_ * scale_ / room
                        : std::numeric_limits<double>::infinity();
    }

    // Strips of this scale whose shapes change least. Returns how high they are together.
    double cut_strips() {
        const size_t count = members_.size();
        std::vector<double> least(count + 1, std::numeric_limits<double>::infinity());
        std::vector<size_t> from(count + 1, 0);
        least[0] = 0;
        for (size_t begin = 0; begin < count; ++begin) {
            const double own = heights_[begin] * scale_;
            for (size_t end = begin + 1; end <= count; ++end) {
                const double height = strip_height(begin, end);
                if (end > begin + 1 && height > highest_strip * own) break;
                const double squared = height * height / (scale_ * scale_);
                const double cost = squared * (flat_[end] - flat_[begin]) + (high_[end] - high_[begin]) / squared;
                if (least[begin] + cost < least[end]) {
                    least[end] = least[begin] + cost;
                    from[end] = begin;
                }
            }
        }
        strips_.clear();
        double whole = 0;
        for (size_t end = count; end > 0; end = from[end]) {
            if (!std::isfinite(least[end])) return std::numeric_limits<double>::infinity();
            strips_.push_back({from[end], end, strip_height(from[end], end)});
            whole += strips_.back().height + gutter_;
        }
        std::ranges::reverse(strips_);
        return whole;
    }

    // Makes a cell that has another shape than its rectangle smaller.
    static void keep_shape(const WantedRectangle& wanted, PackedRectangle& cell) {
        const double shape = cell.turned ? wanted.height / wanted.width : wanted.width / wanted.height;
        cell.width = std::min(cell.width, cell.height * shape * most_change * most_change);
        cell.height = std::min(cell.height, cell.width / shape * most_change * most_change);
    }

    std::vector<uint32_t> members_;
    const double gutter_;
    double scale_ = 0;
    std::vector<double> heights_;             // of members, wanted
    std::vector<double> area_, flat_, high_;  // sums over members before: area, area / height^2, area * height^2
    std::vector<Strip> strips_;
};

}  // namespace

std::optional<std::vector<PackedRectangle>> pack(std::span<const WantedRectangle> wanted, uint32_t squares,
                                                 double gutter) {
    LODE_CHECK(squares >= 1 && gutter >= 0, squares, gutter);
    if (gutter >= 1) return std::nullopt;
    double whole = 0, before = 0;
    for (const WantedRectangle& r : wanted) whole += r.width * r.height;
    std::vector<std::vector<uint32_t>> members(squares);
    for (uint32_t i = 0; i < wanted.size(); ++i) {
        const double area = wanted[i].width * wanted[i].height;
        const auto square = static_cast<uint32_t>((before + area / 2) / whole * squares);
        members[std::min(square, squares - 1)].push_back(i);
        before += area;
    }
    std::vector<PackedRectangle> packed(wanted.size());
    for (uint32_t s = 0; s < squares; ++s) {
        if (members[s].empty()) continue;
        Square square(wanted, std::move(members[s]), gutter);
        if (!square.choose_strips()) return std::nullopt;
        square.place(wanted, s, packed);
    }
    return packed;
}

}  // namespace lodestone::vgi
