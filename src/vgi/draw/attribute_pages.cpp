#include "vgi/draw/attribute_pages.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "frame/screen_error.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

uint32_t attribute_words(const AtlasAttributes& attributes) {
    return 1u + (attributes.uvs ? 1u : 0u) + (attributes.colours ? 1u : 0u) + (attributes.surfaces ? 1u : 0u) +
           (attributes.emissions ? 1u : 0u);
}

AttributePage packed_attributes(const Page& page, const PageTree& tree, const AtlasAttributes& attributes,
                                uint32_t texel_words) {
    LODE_CHECK(texel_words >= attribute_words(attributes), texel_words);
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side();
    AttributePage packed(count * texel_words, 0);
    for (size_t i = 0; i < count; ++i) {
        size_t channel = 0;
        const auto next = [&] { return uint32_t{page.values[channel++ * count + i]}; };
        uint32_t* words = &packed[i * texel_words];
        uint32_t* more = words + 1;
        const uint32_t x = next() & 255, y = next() & 255;
        *words = x | y << 8;
        if (attributes.uvs) {
            const uint32_t u = next(), v = next();
            *more++ = u | v << 16;
        }
        const auto put_bytes = [&](bool there, uint32_t bytes) {
            for (uint32_t k = 0; k < bytes && there; ++k) *more |= next() << (8 * k);
            more += there;
        };
        put_bytes(attributes.colours, 4);
        put_bytes(attributes.surfaces, 3);
        put_bytes(attributes.emissions, 3);
        if (attributes.materials) *words |= next() << 16;
    }
    return packed;
}

AttributePages::AttributePages(const Atlas& about) : tree_(tree_of(about, Layer::attributes)) {
    entries_.resize(size_t{about.charts()} * tree_.pages());
}

void AttributePages::put(uint32_t number, std::shared_ptr<const AttributePage> texels, uint32_t slot) {
    LODE_CHECK(texels != nullptr && !holds(number), number);
    entries_[number] = {std::move(texels), slot, PageState::resident};
}

void AttributePages::drop(uint32_t number) {
    LODE_CHECK(holds(number), number);
    entries_[number] = {};
}

void AttributePages::set_state(uint32_t number, PageState state) {
    LODE_CHECK(!holds(number) && state != PageState::resident, number);
    entries_[number].state = state;
}

Page unpacked_attributes(const AttributePage& packed, const PageTree& tree, const AtlasAttributes& attributes) {
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side(), words = packed.size() / count;
    Page page;
    page.values.resize(count * channels_of(attributes, Layer::attributes).size());
    for (size_t i = 0; i < count; ++i) {
        size_t channel = 0;
        const auto put = [&](uint32_t value) { page.values[channel++ * count + i] = static_cast<uint16_t>(value); };
        const uint32_t* word = &packed[i * words];
        const uint32_t first = *word++;
        // Normals keep their sign.
        put(static_cast<uint32_t>(static_cast<int8_t>(first & 255)));
        put(static_cast<uint32_t>(static_cast<int8_t>(first >> 8 & 255)));
        if (attributes.uvs) {
            put(*word & 0xffff);
            put(*word++ >> 16);
        }
        const auto put_bytes = [&](bool there, uint32_t bytes) {
            for (uint32_t k = 0; k < bytes && there; ++k) put(*word >> (8 * k) & 255);
            word += there;
        };
        put_bytes(attributes.colours, 4);
        put_bytes(attributes.surfaces, 3);
        put_bytes(attributes.emissions, 3);
        if (attributes.materials) put(first >> 16);
    }
    return page;
}

float spacing_of(const Atlas& about, const GeometryPage& coarsest) {
    const PageTree tree = tree_of(about, Layer::geometry);
    const size_t n = tree.cells_per_page(), row = n + 1;
    const auto at = [&](size_t x, size_t y) {
        const GeometryTexel& t = coarsest[y * row + x];
        return glm::dvec3(t.x, t.y, t.z) * about.step;
    };
    double area = 0;
    for (size_t y = 0; y < n; ++y) {
        for (size_t x = 0; x < n; ++x)
            area += glm::length(glm::cross(at(x + 1, y + 1) - at(x, y), at(x, y + 1) - at(x + 1, y))) / 2;
    }
    return static_cast<float>(std::max(std::sqrt(area), about.step) / about.attribute_cells);
}

void AttributePages::want(const Atlas& about, std::span<const float> spacing, const CutRequest& request,
                          std::span<const uint32_t> charts, PageDemand& demand) const {
    const PageTree geometry = tree_of(about, Layer::geometry);
    const Visibility visibility(request, about);
    const View& view = request.sets_levels();
    const float scale = largest_scale(request.object_to_world);
    struct Part {
        uint32_t level, x, y;
    };
    std::vector<Part> stack;
    for (const uint32_t chart : charts) {
        stack.assign(1, {tree_.base_level(), 0, 0});
        while (!stack.empty()) {
            const auto [level, x, y] = stack.back();
            stack.pop_back();
            // The page of positions that covers the same part, or more.
            const uint32_t side = tree_.pages_per_side(level);
            uint32_t covering = 0;
            while (geometry.pages_per_side(covering) > side) ++covering;
            const uint32_t pages = geometry.pages_per_side(covering);
            const uint32_t place =
                chart * geometry.pages() + geometry.page(covering, x * pages / side, y * pages / side);
            if (visibility.seen(1, place) == 0) continue;
            const PageBounds& bounds = about.bounds[place];
            const float away =
                request.distance
                    ? *request.distance
                    : std::max(
                          glm::distance(glm::vec3(request.object_to_world * glm::vec4(bounds.centre, 1)), view.eye) -
                              bounds.radius * scale - request.margin.distance,
                          view.near_plane);
            const float pixels = spacing[chart] * static_cast<float>(1u << level) * scale * view.focal_px / away;
            const uint32_t number = chart * tree_.pages() + tree_.page(level, x, y);
            if (!holds(number)) {
                demand.ask(number, 2 * pixels);  // what is drawn there is its parent
                continue;
            }
            demand.touch(number);
            // Shaders take the nearest level.
            if (level == 0 || pixels <= 1.4142136f) continue;
            for (uint32_t k = 0; k < 4; ++k) stack.push_back({level - 1, 2 * x + k % 2, 2 * y + k / 2});
        }
    }
}

}  // namespace lodestone::vgi
