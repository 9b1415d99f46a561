#include "vgi/asset/pages.h"

#include <array>
#include <bit>

#include "vgi/asset/page_means.h"

namespace lodestone::vgi {

namespace {

// Calls visit(channel, get, set) for the numbers of a texel in the order of channels_of; get and set take the texel.
template <class Images, class Visit>
void for_channels(Images& a, Layer layer, Visit&& visit) {
    size_t channel = 0;
    // Of arrays of numbers, and of plain numbers.
    const auto each = [&](auto& image, int count) {
        for (int k = 0; k < count; ++k)
            visit(
                channel++, [&image, k ](size_t texel) -> auto& { return image[texel][static_cast<size_t>(k)]; });
    };
    const auto one = [&](auto& image) {
        visit(
            channel++, [&image](size_t texel) -> auto& { return image[texel]; });
    };
    const auto each_colour = [&](auto& image) {
        for (int k = 0; k < 4; ++k)
            visit(
                channel++, [&image, k ](size_t texel) -> auto& { return image[texel][k]; });
    };
    if (layer == Layer::geometry) {
        each(a.positions, 3);
        one(a.sample_errors);
        one(a.sample_radii);
        return;
    }
    each(a.normals, 2);
    if (a.attributes.uvs) each(a.uvs, 2);
    if (a.attributes.colours) each_colour(a.colours);
    if (a.attributes.surfaces) each(a.surfaces, 3);
    if (a.attributes.emissions) each(a.emissions, 3);
    if (a.attributes.materials) one(a.materials);
}

// Calls visit(local index, texel) for every sample of a page.
template <class Visit>
void for_samples(const Atlas& atlas, Layer layer, uint32_t chart, uint32_t page, Visit&& visit) {
    const PageTree tree = tree_of(atlas, layer, chart);
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const uint32_t n = tree.cells_per_page();
    size_t i = 0;
    for (uint32_t y = py * n; y <= py * n + n; ++y) {
        for (uint32_t x = px * n; x <= px * n + n; ++x, ++i) {
            visit(i, layer == Layer::geometry ? atlas.texel(chart, x << level, y << level)
                                              : atlas.attribute_texel(chart, x << level, y << level));
        }
    }
}

}  // namespace

uint32_t PageTree::base_level() const {
    return static_cast<uint32_t>(std::bit_width(cells) - std::bit_width(cells_per_page()));
}
uint32_t PageTree::pages() const {
    uint32_t count = 0;
    for (uint32_t level = 0; level <= base_level(); ++level) count += pages_per_side(level) * pages_per_side(level);
    return count;
}
void PageTree::place(uint32_t page, uint32_t* level, uint32_t* x, uint32_t* y) const {
    *level = base_level();
    for (;; --*level) {
        const uint32_t side = pages_per_side(*level);
        if (page < side * side) {
            *x = page % side;
            *y = page / side;
            return;
        }
        page -= side * side;
    }
}
uint32_t PageTree::level(uint32_t page) const {
    uint32_t level = 0, x = 0, y = 0;
    place(page, &level, &x, &y);
    return level;
}
uint32_t PageTree::parent(uint32_t number) const {
    uint32_t level = 0, x = 0, y = 0;
    place(number, &level, &x, &y);
    return page(level + 1, x / 2, y / 2);
}

uint32_t PageTree::member(uint32_t family, uint32_t k) const {
    if (family == 0) return 0;
    uint32_t level = 0, x = 0, y = 0;
    place(family - 1, &level, &x, &y);
    return page(level - 1, 2 * x + k % 2, 2 * y + k / 2);
}

PageTree tree_of(const Atlas& atlas, Layer layer) {
    return {layer == Layer::geometry ? atlas.cells : atlas.attribute_cells};
}
PageTree tree_of(const Atlas& atlas, Layer layer, uint32_t chart) {
    if (layer == Layer::geometry) return {atlas.cells_of(chart), atlas.unsampled_levels[chart]};
    return {atlas.attribute_cells_of(chart), atlas.unsampled_attribute_levels[chart]};
}

// Of a quality of textures: 1 at 100, and twice as large for ten less.
static uint32_t step_of(uint32_t quality) {
    constexpr std::array<uint32_t, 10> sixteenths{16, 17, 18, 20, 21, 23, 24, 26, 28, 30};
    if (quality == 0) return 0;
    const uint32_t below = 100 - quality;
    return sixteenths[below % 10] << (below / 10);
}

std::vector<Channel> channels_of(const AtlasAttributes& attributes, Layer layer, bool dense) {
    using Kind = Channel::Kind;
    constexpr Channel lattice{0, true, false, Kind::smooth}, error{1, false, false, Kind::error},
        radius{2, false, false, Kind::radius}, uv{1, true, false}, material{3, true, false, Kind::name};
    // Steps in halves of what the quality says. Lit pictures show best what normals are off by, and hardly what
    // roughness is.
    constexpr uint32_t steps_per_step = 2;
    // Sixteenths. With finer steps there is so much to code that coding without loss takes fewer bytes.
    constexpr uint32_t least_step = 16, least_step_of_normals = 48;
    constexpr Channel normal{0, false, true, Kind::direction, true, false, 1},
        colour{2, false, false, Kind::amount, true, true, 2}, alpha{2, false, false, Kind::amount, true, false, 1},
        surface{4, false, false, Kind::amount, true, false, 6}, emission{5, false, false, Kind::amount, true, true, 2};
    if (layer == Layer::geometry) return {lattice, lattice, lattice, error, radius};
    std::vector<Channel> channels{normal, normal};
    if (attributes.uvs) channels.insert(channels.end(), 2, uv);
    if (attributes.colours) channels.insert(channels.end(), {colour, colour, colour, alpha});
    if (attributes.surfaces) channels.insert(channels.end(), 3, surface);
    if (attributes.emissions) channels.insert(channels.end(), 3, emission);
    if (attributes.materials) channels.push_back(material);
    const uint32_t step = step_of(attributes.texture_quality),
                   finest_step = dense ? step_of(attributes.dense_quality) : step;
    for (Channel& channel : channels) {
        const auto of = [&](uint32_t whole) {
            const uint32_t least = channel.kind == Kind::direction ? least_step_of_normals : least_step;
            return channel.step * whole == 0 ? 0 : std::max(channel.step * whole / steps_per_step, least);
        };
        channel.finest_step = of(finest_step);
        channel.step = of(step);
    }
    return channels;
}

Page read_page(const Atlas& atlas, Layer layer, uint32_t chart, uint32_t page) {
    const PageTree tree = tree_of(atlas, layer);
    const size_t samples = size_t{tree.samples_per_side()} * tree.samples_per_side();
    Page result;
    result.values.resize(samples * channels_of(atlas.attributes, layer).size());
    for_channels(atlas, layer, [&](size_t channel, const auto& at) {
        for_samples(atlas, layer, chart, page, [&](size_t i, size_t texel) {
            // The sign is kept. NOLINTNEXTLINE(bugprone-signed-char-misuse)
            result.values[channel * samples + i] = static_cast<uint16_t>(at(texel));
        });
    });
    return result;
}

void write_page(Atlas& atlas, Layer layer, uint32_t chart, uint32_t page, const Page& samples) {
    const PageTree tree = tree_of(atlas, layer);
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side();
    for_channels(atlas, layer, [&](size_t channel, const auto& at) {
        for_samples(atlas, layer, chart, page, [&](size_t i, size_t texel) {
            auto& value = at(texel);
            value = static_cast<std::remove_reference_t<decltype(value)>>(samples.values[channel * count + i]);
        });
    });
}

std::vector<Page> read_pages(const Atlas& atlas, Layer layer, uint32_t chart) {
    const PageTree tree = tree_of(atlas, layer, chart);
    std::vector<Page> pages(tree.pages());
    for (uint32_t p = tree.page(0, 0, 0); p < tree.pages(); ++p) pages[p] = read_page(atlas, layer, chart, p);
    make_parents(tree, channels_of(atlas.attributes, layer), pages);
    return pages;
}

}  // namespace lodestone::vgi
