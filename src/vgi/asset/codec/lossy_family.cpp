#include "vgi/asset/codec/lossy_family.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/check.h"
#include "vgi/asset/codec/lossy_numbers.h"

namespace lodestone::vgi {

namespace {

// Of a step: what is nearer to 0 than this becomes 0, and all else is rounded towards 0 a bit; 0.5 would be exact.
constexpr int64_t rounded_up = 6, rounded_of = 16;
constexpr int32_t most_number = 32000;

// Brightness and two differences; back without loss.
std::array<int32_t, 3> to_differences(const std::array<int32_t, 3>& c) {
    const int32_t orange = c[0] - c[2], middle = c[2] + (orange >> 1), green = c[1] - middle;
    return {middle + (green >> 1), orange, green};
}
std::array<int32_t, 3> from_differences(const std::array<int32_t, 3>& d) {
    const int32_t middle = d[0] - (d[2] >> 1), blue = middle - (d[1] >> 1);
    return {blue + d[1], d[2] + middle, blue};
}

int16_t divided(int64_t number, int64_t step) {
    const int64_t size = (std::abs(number) * rounded_of + step * rounded_up) / (step * rounded_of);
    const auto limited = static_cast<int16_t>(std::min<int64_t>(size, most_number));
    return number < 0 ? static_cast<int16_t>(-limited) : limited;
}
int32_t multiplied(int16_t number, int32_t step) {
    return std::clamp(int32_t{number} * step, -largest_coefficient, largest_coefficient);
}
// Sixteenths, rounded the same way up and down.
int32_t whole_of(int32_t sixteenths) { return sixteenths < 0 ? -((-sixteenths + 8) >> 4) : (sixteenths + 8) >> 4; }

// A page of twice as many cells, from one, by subdivision of cubic B-splines, row by row: what rounding to steps has
// left in the samples is evened out. On a side of the page it is by samples of that side alone.
class Doubled {
public:
    // Of rows, so many samples from `first` on, which is even.
    Doubled(const Page& page, size_t channel, uint32_t cells, bool is_signed, uint32_t first, uint32_t count)
        : samples_(page.values.data() + channel * (cells + 1) * (cells + 1)),
          cells_(cells),
          is_signed_(is_signed),
          first_(first),
          row_(cells + 3) {
        for (Across& across : across_) across.sums.resize(count);
    }
    // Sums of samples, 256 to a unit. Least time is taken where rows follow each other.
    void row(uint32_t y, std::vector<int32_t>& sums) {
        const uint32_t i = y / 2;
        const std::vector<int32_t>& here = across(i);
        sums.resize(here.size());
        if (y % 2 != 0) {
            const std::vector<int32_t>& next = across(i + 1);
            for (size_t x = 0; x < sums.size(); ++x) sums[x] = 8 * (here[x] + next[x]);
        } else if (i == 0 || i == cells_) {
            for (size_t x = 0; x < sums.size(); ++x) sums[x] = 16 * here[x];
        } else {
            const std::vector<int32_t>&before = across(i - 1), &next = across(i + 1);
            for (size_t x = 0; x < sums.size(); ++x) sums[x] = 12 * here[x] + 2 * (before[x] + next[x]);
        }
    }

private:
    // A row of the page, doubled along itself; 16 to a unit.
    struct Across {
        uint32_t row = ~0u;
        std::vector<int32_t> sums;
    };
    const std::vector<int32_t>& across(uint32_t row) {
        Across& kept = across_[row % across_.size()];
        if (std::exchange(kept.row, row) == row) return kept.sums;
        const uint16_t* samples = samples_ + size_t{row} * (cells_ + 1);
        int32_t* known = row_.data() + 1;
        for (size_t i = 0; i <= cells_; ++i) known[i] = is_signed_ ? static_cast<int16_t>(samples[i]) : samples[i];
        const size_t begin = first_ / 2, evens = (kept.sums.size() + 1) / 2, odds = kept.sums.size() / 2;
        int32_t* sums = kept.sums.data();
        for (size_t i = 0; i < evens; ++i) {
            const int32_t* at = known + begin + i;
            sums[2 * i] = 12 * at[0] + 2 * (at[-1] + at[1]);
        }
        for (size_t i = 0; i < odds; ++i) sums[2 * i + 1] = 8 * (known[begin + i] + known[begin + i + 1]);
        if (begin == 0) sums[0] = 16 * known[0];
        if (begin + evens > cells_) sums[2 * (cells_ - begin)] = 16 * known[cells_];
        return kept.sums;
    }
    const uint16_t* samples_;
    uint32_t cells_;
    bool is_signed_;
    uint32_t first_;
    std::vector<int32_t> row_;  // of the page, with one more on either side
    std::array<Across, 3> across_;
};

}  // namespace

LossyFamily::LossyFamily(const PageTree& tree, std::span<const Channel> channels, uint32_t family)
    : tree_(tree), family_(family), side_(tree.cells_per_page() * (family == 0 ? 1 : 2)) {
    size_t components = 0;
    const uint32_t level = tree.level(tree.member(family, 0));
    const auto is_like = [&](const Group& group, size_t channel, uint32_t count) {
        return channels[group.channel].group == channels[channel].group && group.count == count;
    };
    for (size_t c = 0; c < channels.size();) {
        const Channel& channel = channels[c];
        const uint32_t count = channel.srgb ? 3 : 1;
        if (channel.step > 0) {
            const auto step = static_cast<int32_t>(channel.step_of(level));
            // A step of brightness tells on three channels, one of a difference on less than one.
            const std::array<int32_t, 3> of_colours{std::max(step * 37 / 64, 1), step * 90 / 64, step * 74 / 64};
            const bool follows = !groups_.empty() && is_like(groups_.back(), c, count);
            const uint32_t kind = groups_.empty() ? 0 : groups_.back().kind + (follows ? 0 : 2);
            groups_.push_back({c, count, kind, follows, count == 3 ? of_colours : Numbers{step, 0, 0},
                               channel.is_signed ? -127 : 0, channel.is_signed ? 127 : 255, components});
            components += count;
        }
        c += count;
    }
    components_.resize(components);
    for (Component& component : components_) {
        component.border.resize(size_t{4} * side_);
        component.blocks.resize(size_t{64} * blocks_per_side() * blocks_per_side());
    }
}

size_t LossyFamily::border_number(uint32_t x, uint32_t y) const {
    if (y == 0 && x < side_) return x;
    if (x == side_ && y < side_) return side_ + y;
    if (y == side_ && x > 0) return 2 * side_ + (side_ - x);
    return 3 * side_ + (side_ - y);
}

LossyFamily::Part LossyFamily::part_of(const Group& group, uint32_t member) const {
    const uint32_t n = tree_.cells_per_page();
    return {member % 2 * n, member / 2 * n, n, group.count};
}

// Of what has a parent.
void LossyFamily::expect(const Group& group, const Page* parent, Part& part) const {
    std::vector<int32_t> sums;
    const uint32_t n = tree_.cells_per_page(), before = part.x % 2;
    for (uint32_t k = 0; k < group.count; ++k) {
        Doubled doubled(*parent, group.channel + k, n, group.low < 0, part.x - before, before + part.cells + 1);
        for (uint32_t y = part.y; y <= part.y + part.cells; ++y) {
            doubled.row(y, sums);
            int32_t* values = &part.values[k][part.at(part.x, y)];
            for (size_t x = before; x < sums.size(); ++x)
                values[x - before] = std::clamp((sums[x] + 128) >> 8, group.low, group.high);
        }
    }
}

// Of the coarsest page, once its border is known.
void LossyFamily::expect_inside(const Group& group, Part& part) const {
    const auto n = static_cast<int32_t>(side_);
    for (uint32_t k = 0; k < group.count; ++k) {
        auto& values = part.values[k];
        const auto at = [&](int32_t x, int32_t y) {
            return values[part.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y))];
        };
        for (int32_t y = 1; y < n; ++y) {
            for (int32_t x = 1; x < n; ++x) {
                const int32_t across = n * ((n - x) * at(0, y) + x * at(n, y)),
                              down = n * ((n - y) * at(x, 0) + y * at(x, n)),
                              corners = (n - x) * ((n - y) * at(0, 0) + y * at(0, n)) +
                                        x * ((n - y) * at(n, 0) + y * at(n, n));
                const int32_t sum = across + down - corners;
                values[part.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y))] =
                    std::clamp((sum + n * n / 2) / (n * n), group.low, group.high);
            }
        }
    }
}

// Calls visit(x, y) for the border of the coarsest page, when what is expected there is set.
template <class Visit>
void LossyFamily::along_base_border(const Group& group, Part& part, Visit&& visit) const {
    const int32_t middle = group.low < 0 ? 0 : 128;
    for (const auto& [x, y] : {std::array{0u, 0u}, {side_, 0u}, {side_, side_}, {0u, side_}}) {
        for (uint32_t k = 0; k < group.count; ++k) part.values[k][part.at(x, y)] = middle;
        visit(x, y);
    }
    for (uint32_t half = side_ / 2; half > 0; half /= 2) {
        for (uint32_t s = 0; s < 4; ++s) {
            for (uint32_t step = half; step < side_; step += 2 * half) {
                const auto [x, y] = on_side(s, step, side_);
                const auto [ax, ay] = on_side(s, step - half, side_);
                const auto [bx, by] = on_side(s, step + half, side_);
                for (uint32_t k = 0; k < group.count; ++k) {
                    auto& values = part.values[k];
                    values[part.at(x, y)] = (values[part.at(ax, ay)] + values[part.at(bx, by)] + 1) >> 1;
                }
                visit(x, y);
            }
        }
    }
}

LossyFamily::Numbers LossyFamily::border_residual(const Group& group, uint32_t x, uint32_t y) const {
    Numbers residual{};
    for (uint32_t k = 0; k < group.count; ++k)
        residual[k] = whole_of(
            multiplied(components_[group.component + k].border[border_number(x, y)], border_step(group, k, x, y)));
    return residual;
}

inline void LossyFamily::add(const Group& group, const Numbers& residual, Part& part, size_t at) {
    const Numbers off = group.count == 3 ? from_differences(residual) : residual;
    for (uint32_t k = 0; k < group.count; ++k)
        part.values[k][at] = std::clamp(part.values[k][at] + off[k], group.low, group.high);
}

void LossyFamily::add_border(const Group& group, Part& part) const {
    for (uint32_t y = part.y; y <= part.y + part.cells; ++y) {
        const uint32_t step = y == 0 || y == side_ ? 1 : part.cells;
        for (uint32_t x = part.x; x <= part.x + part.cells; x += step) {
            if (on_border(x, y)) add(group, border_residual(group, x, y), part, part.at(x, y));
        }
    }
}

// The numbers of a block; false where all are 0.
bool LossyFamily::block_residual(const Group& group, uint32_t k, size_t block, Block& residual) const {
    const int16_t* numbers = &components_[group.component + k].blocks[64 * block];
    int32_t any = 0;
    for (size_t i = 0; i < 64; ++i) any |= numbers[i];
    if (any == 0) return false;
    for (size_t i = 0; i < 64; ++i) residual[i] = multiplied(numbers[i], group.steps[k]);
    residual = untransformed(residual);
    return true;
}

void LossyFamily::add_blocks(const Group& group, Part& part) const {
    const uint32_t blocks = blocks_per_side();
    // Blocks lie inside the border: they begin at samples 1, 9, ...
    const auto first_of = [](uint32_t at) { return at == 0 ? 0 : (at - 1) / block_side; };
    const uint32_t last_x = std::min(part.x + part.cells, side_ - 1), last_y = std::min(part.y + part.cells, side_ - 1);
    for (uint32_t by = first_of(part.y); by < blocks && by * block_side + 1 <= last_y; ++by) {
        for (uint32_t bx = first_of(part.x); bx < blocks && bx * block_side + 1 <= last_x; ++bx) {
            std::array<Block, 3> residual{};
            bool any = false;
            for (uint32_t k = 0; k < group.count; ++k)
                any = block_residual(group, k, size_t{by} * blocks + bx, residual[k]) || any;
            if (!any) continue;
            const uint32_t left = bx * block_side + 1, top = by * block_side + 1;
            const uint32_t x_end = std::min(left + block_side - 1, last_x) + 1,
                           y_end = std::min(top + block_side - 1, last_y) + 1;
            for (uint32_t y = std::max(top, part.y); y < y_end; ++y) {
                for (uint32_t x = std::max(left, part.x); x < x_end; ++x) {
                    const size_t i = size_t{y - top} * block_side + (x - left);
                    add(group, {residual[0][i], residual[1][i], residual[2][i]}, part, part.at(x, y));
                }
            }
        }
    }
}

void LossyFamily::put(uint32_t member, const Page* parent, Page& samples) const {
    LODE_CHECK(is_base() == (parent == nullptr) && member < PageTree::members(family_), member);
    const size_t size = size_t{tree_.samples_per_side()} * tree_.samples_per_side();
    for (const Group& group : groups_) {
        Part part = part_of(group, member);
        if (is_base()) {
            along_base_border(group, part, [&](uint32_t x, uint32_t y) {
                add(group, border_residual(group, x, y), part, part.at(x, y));
            });
            expect_inside(group, part);
        } else {
            expect(group, parent, part);
            add_border(group, part);
        }
        add_blocks(group, part);
        for (uint32_t k = 0; k < group.count; ++k) {
            std::ranges::transform(part.values[k],
                                   samples.values.begin() + static_cast<ptrdiff_t>((group.channel + k) * size),
                                   [](int32_t value) { return static_cast<uint16_t>(value); });
        }
    }
}

LossyFamily::Part LossyFamily::original_of(const Group& group, std::span<const Page> pages) const {
    Part part(0, 0, side_, group.count);
    const uint32_t n = tree_.cells_per_page();
    for (uint32_t m = 0; m < PageTree::members(family_); ++m) {
        const Page& page = pages[tree_.member(family_, m)];
        for (uint32_t k = 0; k < group.count; ++k) {
            const uint16_t* samples = page.values.data() + (group.channel + k) * (n + 1) * (n + 1);
            for (uint32_t y = 0; y <= n; ++y) {
                for (uint32_t x = 0; x <= n; ++x)
                    part.values[k][part.at(m % 2 * n + x, m / 2 * n + y)] =
                        group.low < 0 ? static_cast<int16_t>(samples[y * (n + 1) + x]) : samples[y * (n + 1) + x];
            }
        }
    }
    return part;
}

void LossyFamily::take_border(const Group& group, const Part& original, Part& part) {
    const auto take_at = [&](uint32_t x, uint32_t y) {
        Numbers off{};
        const size_t at = part.at(x, y);
        for (uint32_t k = 0; k < group.count; ++k) off[k] = original.values[k][at] - part.values[k][at];
        if (group.count == 3) off = to_differences(off);
        for (uint32_t k = 0; k < group.count; ++k) {
            components_[group.component + k].border[border_number(x, y)] =
                divided(int64_t{off[k]} * 16, border_step(group, k, x, y));
        }
        if (is_base()) add(group, border_residual(group, x, y), part, at);
    };
    if (is_base()) {
        along_base_border(group, part, take_at);
        return;
    }
    for (uint32_t s = 0; s < 4; ++s) {
        for (uint32_t step = 0; step < side_; ++step) {
            const auto [x, y] = on_side(s, step, side_);
            take_at(x, y);
        }
    }
}

void LossyFamily::take_blocks(const Group& group, const Part& original, const Part& expected) {
    const uint32_t blocks = blocks_per_side();
    for (uint32_t b = 0; b < blocks * blocks; ++b) {
        std::array<Block, 3> residual{};
        for (uint32_t i = 0; i < 64; ++i) {
            // Beyond the last sample inside it goes on as it is.
            const uint32_t x = std::min(b % blocks * block_side + 1 + i % 8, side_ - 1),
                           y = std::min(b / blocks * block_side + 1 + i / 8, side_ - 1);
            const size_t at = original.at(x, y);
            Numbers off{};
            for (uint32_t k = 0; k < group.count; ++k) off[k] = original.values[k][at] - expected.values[k][at];
            if (group.count == 3) off = to_differences(off);
            for (uint32_t k = 0; k < group.count; ++k) residual[k][i] = off[k];
        }
        for (uint32_t k = 0; k < group.count; ++k) {
            const auto coefficients = transformed(residual[k]);
            for (size_t i = 0; i < 64; ++i) {
                components_[group.component + k].blocks[size_t{64} * b + i] =
                    divided(coefficients[i], int64_t{group.steps[k]} * 2048);
            }
        }
    }
}

void LossyFamily::take(std::span<const Page> pages, const Page* parent) {
    LODE_CHECK(is_base() == (parent == nullptr));
    for (const Group& group : groups_) {
        const Part original = original_of(group, pages);
        Part part(0, 0, side_, group.count);
        if (!is_base()) expect(group, parent, part);
        take_border(group, original, part);
        if (is_base()) expect_inside(group, part);
        take_blocks(group, original, part);
    }
}

template <class Coder>
void LossyFamily::code(Coder& coder, std::vector<Component>& components) const {
    constexpr uint32_t most_kinds = 16;
    std::array<LossyNumbers, most_kinds> models;
    const auto model = [&](const Group& group, uint32_t k) -> LossyNumbers& {
        const uint32_t kind = group.kind + (k > 0 ? 1 : 0);
        LODE_CHECK(kind < most_kinds, kind);
        return models[kind];
    };
    for (const Group& group : groups_) {
        for (uint32_t k = 0; k < group.count; ++k) {
            int32_t before = 0, before_that = 0;
            for (int16_t& number : components[group.component + k].border) {
                model(group, k).code_border(coder, before, before_that, number);
                before_that = before;
                before = number;
            }
        }
    }
    const uint32_t blocks = blocks_per_side();
    std::vector<uint8_t> has(components.size() * blocks * blocks, 0);
    for (uint32_t b = 0; b < blocks * blocks; ++b) {
        for (const Group& group : groups_) {
            for (uint32_t k = 0; k < group.count; ++k) {
                const size_t component = group.component + k;
                const auto had = [&](size_t c, uint32_t block) { return uint32_t{has[c * blocks * blocks + block]}; };
                // What goes before it in a colour, or in the same kind.
                const bool follows = k > 0 || group.follows;
                const uint32_t around = (b % blocks > 0 ? had(component, b - 1) : 0) +
                                        (b >= blocks ? had(component, b - blocks) : 0) +
                                        (follows ? 3 * had(component - 1, b) : 0);
                const auto numbers = std::span<int16_t, 64>(&components[component].blocks[size_t{64} * b], 64);
                bool any = std::ranges::any_of(numbers, [](int16_t number) { return number != 0; });
                LossyNumbers& numbers_model = model(group, k);
                numbers_model.code_any(coder, around, any);
                has[component * blocks * blocks + b] = any ? 1 : 0;
                if (any) numbers_model.code_block(coder, numbers);
            }
        }
    }
}

void LossyFamily::encode(std::vector<std::byte>& bytes) const {
    RangeEncoder coder;
    std::vector<Component> components = components_;
    code(coder, components);
    coder.finish(bytes);
}

bool LossyFamily::decode(std::span<const std::byte> bytes) {
    RangeDecoder coder(bytes);
    code(coder, components_);
    return coder.at_end();
}

}  // namespace lodestone::vgi
