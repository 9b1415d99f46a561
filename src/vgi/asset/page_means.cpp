#include "vgi/asset/page_means.h"

#include <array>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "base/looks/srgb.h"
#include "vgi/asset/codec/page_plane.h"

namespace lodestone::vgi {

namespace {

// Means of octahedral coordinates are as good as those of directions, and closer to what page_plane.h expects of them,
// but for the folds of the map: this is the cosine of how far they may be apart.
constexpr float near_enough = 0.999f;

glm::vec3 direction_of(int32_t u, int32_t v) {
    return unpack_octahedral({static_cast<int8_t>(u), static_cast<int8_t>(v)});
}

// Means of one page's samples.
class Means {
public:
    Means(const Page& page, std::span<const Channel> channels, int32_t n) : page_(page), channels_(channels), n_(n) {}

    int32_t plain(size_t channel, int32_t x, int32_t y) const {
        const Plane plane{page_.values.data(), static_cast<uint32_t>(channel), n_, 0, channels_[channel]};
        if (channels_[channel].srgb) {
            const auto [light, all] =
                weighed<float>(x, y, [&](int32_t u, int32_t v) { return linear_of_byte(plane.at(u, v)); });
            return srgb_byte_of(light / static_cast<float>(all));
        }
        const auto [sum, weights] = weighed<int32_t>(x, y, [&](int32_t u, int32_t v) { return plane.at(u, v); });
        return Plane::rounded(sum, weights);
    }
    // Of the two channels that begin with this one.
    std::array<int32_t, 2> direction(size_t channel, int32_t x, int32_t y) {
        find_directions(channel);
        const std::array<int32_t, 2> of_coordinates{plain(channel, x, y), plain(channel + 1, x, y)};
        const auto at = [&](int32_t u, int32_t v) { return directions_[static_cast<size_t>(v * (n_ + 1) + u)]; };
        glm::vec3 sum = weighed<glm::vec3>(x, y, at).first;
        const float length = glm::length(sum);
        if (length > 1e-2f) {
            sum /= length;
        } else {
            sum = at(x, y);
        }
        if (glm::dot(direction_of(of_coordinates[0], of_coordinates[1]), sum) >= near_enough) return of_coordinates;
        const auto [u, v] = pack_octahedral(sum);
        return {u, v};
    }

private:
    // The sum of what is around a sample, and its weights. Of two on opposite sides the sum is taken first: it is the
    // same from either side of a border.
    template <class Value, class At>
    std::pair<Value, int32_t> weighed(int32_t x, int32_t y, At&& value) const {
        const bool in_x = x > 0 && x < n_;
        const bool in_y = y > 0 && y < n_;
        const auto own = [](const Value& v) { return static_cast<Value>(Value(own_weight) * v); };
        const auto along_x = [&](int32_t row) {
            return in_x ? own(value(x, row)) + (value(x - 1, row) + value(x + 1, row)) : value(x, row);
        };
        const Value middle = along_x(y);
        const int32_t weights = (in_x ? own_weight + 2 : 1) * (in_y ? own_weight + 2 : 1);
        return {in_y ? own(middle) + (along_x(y - 1) + along_x(y + 1)) : middle, weights};
    }
    void find_directions(size_t channel) {
        if (!directions_.empty() && channel == directions_of_) return;
        directions_of_ = channel;
        directions_.clear();
        const Plane u{page_.values.data(), static_cast<uint32_t>(channel), n_, 0, channels_[channel]},
            v{page_.values.data(), static_cast<uint32_t>(channel + 1), n_, 0, channels_[channel + 1]};
        for (int32_t y = 0; y <= n_; ++y) {
            for (int32_t x = 0; x <= n_; ++x) directions_.push_back(direction_of(u.at(x, y), v.at(x, y)));
        }
    }

    const Page& page_;
    const std::span<const Channel> channels_;
    const int32_t n_;
    size_t directions_of_ = 0;
    std::vector<glm::vec3> directions_;
};

// From its four children.
void make_parent(const PageTree& tree, std::span<const Channel> channels, uint32_t number, std::span<Page> pages) {
    const auto n = static_cast<int32_t>(tree.cells_per_page());
    Page& parent = pages[number];
    for (int32_t k = 0; k < 4; ++k) {
        const Page& page = pages[tree.member(number + 1, static_cast<uint32_t>(k))];
        parent.values.resize(page.values.size());
        Means means(page, channels, n);
        const int32_t left = k % 2 * n / 2, top = k / 2 * n / 2;
        for (size_t c = 0; c < channels.size(); ++c) {
            const bool pair = channels[c].averaged && channels[c].kind == Channel::Kind::direction;
            const auto put = [&](size_t channel, int32_t x, int32_t y, int32_t value) {
                const Plane plane{parent.values.data(), static_cast<uint32_t>(channel), n, 0, channels[channel]};
                parent.values[plane.index(left + x / 2, top + y / 2)] = static_cast<uint16_t>(value);
            };
            const Plane child{page.values.data(), static_cast<uint32_t>(c), n, 0, channels[c]};
            for (int32_t y = 0; y <= n; y += 2) {
                for (int32_t x = 0; x <= n; x += 2) {
                    if (pair) {
                        const auto [u, v] = means.direction(c, x, y);
                        put(c, x, y, u);
                        put(c + 1, x, y, v);
                    } else {
                        put(c, x, y, channels[c].averaged ? means.plain(c, x, y) : child.at(x, y));
                    }
                }
            }
            c += pair;
        }
    }
}

}  // namespace

void make_parents(const PageTree& tree, std::span<const Channel> channels, std::span<Page> pages) {
    // Children come after their parents.
    for (uint32_t p = tree.pages() - tree.pages_per_side(0) * tree.pages_per_side(0); p-- > 0;)
        make_parent(tree, channels, p, pages);
}

}  // namespace lodestone::vgi
