#include "vgi/page_means.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "mesh/packed_vertices.h"
#include "vgi/page_plane.h"

namespace lodestone::vgi {

namespace {

size_t group_end(std::span<const Channel> channels, size_t first) {
    size_t end = first;
    while (end < channels.size() && channels[end].group == channels[first].group) ++end;
    return end;
}

PageDifferences differences_of(const Page& page, std::span<const Channel> channels, size_t channel, int32_t n) {
    PageDifferences differences(n);
    const Plane plane{page.values.data(), static_cast<uint32_t>(channel), n, channels[channel]};
    plane.for_order(false, [&](int32_t x, int32_t y, uint16_t expected) {
        differences.at(x, y) = static_cast<int8_t>(page.values[plane.index(x, y)] - expected);
    });
    return differences;
}

bool fits(int32_t value, const Channel& channel) {
    return channel.is_signed ? std::abs(value) <= 127 : value >= 0 && value <= 255;
}

glm::vec3 direction_of(int32_t u, int32_t v) {
    const auto wide = [](int32_t w) { return static_cast<int16_t>(w * 32767 / 127); };
    return unpack_normal({wide(u), wide(v)});
}

// Which means of a page are wanted: of the group's channels, sample by sample.
class Means {
public:
    Means(const Page& page, std::span<const Channel> channels, size_t first, int32_t n)
        : page_(page), channels_(channels), first_(first), end_(group_end(channels, first)), n_(n) {
        for (size_t c = first; c < end_; ++c) differences_.push_back(differences_of(page, channels, c, n));
        if (channels[first].kind != Channel::Kind::direction) return;
        for (int32_t y = 0; y <= n; ++y) {
            for (int32_t x = 0; x <= n; ++x) directions_.push_back(direction_of(at(first, x, y), at(first + 1, x, y)));
        }
    }

    // Of the group's channels; the sample itself where the mean is of no use.
    void take(int32_t x, int32_t y, std::span<uint16_t> means) const {
        bool good = true;
        for (size_t c = first_; c < end_; ++c) {
            const int32_t mean = at(c, x, y) + differences_[c - first_].to_mean(x, y);
            good = good && fits(mean, channels_[c]);
            means[c - first_] = static_cast<uint16_t>(mean);
        }
        if (good && !directions_.empty()) {
            const auto as_signed = [&](size_t k) { return int32_t{static_cast<int16_t>(means[k])}; };
            const glm::vec3 around = around_of(x, y);
            good = glm::dot(direction_of(as_signed(0), as_signed(1)), around) >= glm::dot(direction(x, y), around);
        }
        for (size_t c = first_; c < end_ && !good; ++c) means[c - first_] = page_.values[index(c, x, y)];
    }

private:
    size_t index(size_t channel, int32_t x, int32_t y) const {
        return (channel * static_cast<size_t>(n_ + 1) + static_cast<size_t>(y)) * static_cast<size_t>(n_ + 1) +
               static_cast<size_t>(x);
    }
    int32_t at(size_t channel, int32_t x, int32_t y) const {
        const uint16_t v = page_.values[index(channel, x, y)];
        return channels_[channel].is_signed ? static_cast<int16_t>(v) : v;
    }
    const glm::vec3& direction(int32_t x, int32_t y) const {
        return directions_[static_cast<size_t>(y * (n_ + 1) + x)];
    }
    // What a mean should point to: along a border of the border alone. The same from whichever side it is seen.
    glm::vec3 around_of(int32_t x, int32_t y) const {
        const bool in_x = x > 0 && x<n_, in_y = y> 0 && y < n_;
        const auto along_x = [&](int32_t at_y) {
            const glm::vec3& middle = direction(x, at_y);
            return in_x ? (direction(x - 1, at_y) + direction(x + 1, at_y)) + (middle + middle) : middle;
        };
        const glm::vec3 middle = along_x(y);
        return in_y ? (along_x(y - 1) + along_x(y + 1)) + (middle + middle) : middle;
    }

    const Page& page_;
    const std::span<const Channel> channels_;
    const size_t first_, end_;
    const int32_t n_;
    std::vector<PageDifferences> differences_;
    std::vector<glm::vec3> directions_;
};

// Calls visit(index in the page, index in the parent) for the samples of a channel that both have.
template <class Visit>
void for_shared(size_t channel, int32_t n, uint32_t member, Visit&& visit) {
    const auto size = static_cast<size_t>(n), row = size + 1, left = member % 2 * size / 2, top = member / 2 * size / 2;
    for (size_t y = 0; y <= size; y += 2) {
        for (size_t x = 0; x <= size; x += 2)
            visit((channel * row + y) * row + x, (channel * row + top + y / 2) * row + left + x / 2);
    }
}

}  // namespace

int32_t PageDifferences::to_mean(int32_t x, int32_t y) const {
    const bool in_x = x > 0 && x<n_, in_y = y> 0 && y < n_;
    const auto across = [&](int32_t at_y) { return at(x - 1, at_y) + at(x + 1, at_y); };
    if (in_x && in_y)
        return Plane::rounded(4 * (across(y) + at(x, y - 1) + at(x, y + 1)) + across(y - 1) + across(y + 1), 16);
    if (in_x) return Plane::rounded(across(y), 4);
    if (in_y) return Plane::rounded(at(x, y - 1) + at(x, y + 1), 4);
    return 0;
}

Page parent_of(const PageTree& tree, std::span<const Channel> channels, std::span<const Page, 4> children) {
    const auto n = static_cast<int32_t>(tree.cells_per_page());
    Page parent;
    parent.values.resize(children[0].values.size());
    for (uint32_t k = 0; k < 4; ++k) {
        for (size_t c = 0; c < channels.size();) {
            if (!channels[c].averaged) {
                for_shared(c, n, k, [&](size_t mine, size_t its) { parent.values[its] = children[k].values[mine]; });
                ++c;
                continue;
            }
            const Means means(children[k], channels, c, n);
            const size_t end = group_end(channels, c), row = static_cast<size_t>(n) + 1, plane = row * row;
            std::array<uint16_t, 4> mean{};
            LODE_CHECK(end - c <= mean.size(), end - c);
            for_shared(c, n, k, [&](size_t mine, size_t its) {
                const size_t place = mine - c * plane;
                means.take(static_cast<int32_t>(place % row), static_cast<int32_t>(place / row), mean);
                for (size_t g = c; g < end; ++g) parent.values[its + (g - c) * plane] = mean[g - c];
            });
            c = end;
        }
    }
    return parent;
}

KeptSamples kept_samples(const PageTree& tree, std::span<const Channel> channels, size_t first, uint32_t page,
                         const Page& samples, const Page& parent) {
    const auto n = static_cast<int32_t>(tree.cells_per_page());
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const auto size = static_cast<size_t>(n), row = size + 1;
    const size_t end = group_end(channels, first);
    std::vector<PageDifferences> differences;
    for (size_t c = first; c < end; ++c) differences.push_back(differences_of(samples, channels, c, n));
    KeptSamples kept;
    for_shared(first, n, px % 2 + py % 2 * 2, [&](size_t mine, size_t its) {
        const size_t place = mine - first * row * row;
        bool all = true;
        for (size_t c = first; c < end; ++c) {
            const size_t plane = (c - first) * row * row;
            const int32_t off =
                differences[c - first].to_mean(static_cast<int32_t>(place % row), static_cast<int32_t>(place / row));
            all = all && parent.values[its + plane] == static_cast<uint16_t>(samples.values[mine + plane] + off);
        }
        kept.push_back(all ? 0 : 1);
    });
    return kept;
}

void take_means_back(std::span<const Channel> channels, size_t channel, const PageDifferences& differences,
                     std::span<const uint8_t> kept, int32_t cells, Page& page) {
    size_t next = 0;
    const Plane plane{page.values.data(), static_cast<uint32_t>(channel), cells, channels[channel]};
    for (int32_t y = 0; y <= cells; y += 2) {
        for (int32_t x = 0; x <= cells; x += 2) {
            if (kept[next++] == 0) page.values[plane.index(x, y)] -= static_cast<uint16_t>(differences.to_mean(x, y));
        }
    }
}

}  // namespace lodestone::vgi
