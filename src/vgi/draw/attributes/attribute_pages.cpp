#include "vgi/draw/attributes/attribute_pages.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "frame/screen_error.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/triangle_bounds.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

// Pixels between samples that are drawn. Shaders take a level up to twice as fine, where it is there; half a level is
// not asked for.
static constexpr float most_apart = 1.4142136f;

// By a map that takes the axes of a plane to a and b: its greater singular value.
static double greatest_stretch(const glm::dvec3& a, const glm::dvec3& b) {
    const double both = glm::dot(a, a) + glm::dot(b, b), apart = glm::dot(a, a) - glm::dot(b, b),
                 along = glm::dot(a, b);
    return std::sqrt((both + std::sqrt(apart * apart + 4 * along * along)) / 2);
}

uint32_t attribute_words(const AtlasAttributes& attributes) {
    return 1u + (attributes.uvs ? 1u : 0u) + (attributes.colours ? 1u : 0u) + (attributes.surfaces ? 1u : 0u) +
           (attributes.emissions ? 1u : 0u);
}

uint32_t attributes_of_samples(const AtlasAttributes& has) {
    return (has.uvs ? LODE_VGI_HAS_UVS : 0u) | (has.colours ? LODE_VGI_HAS_COLOURS : 0u) |
           (has.materials ? LODE_VGI_HAS_MATERIALS : 0u) | (has.surfaces ? LODE_VGI_HAS_SURFACES : 0u) |
           (has.emissions ? LODE_VGI_HAS_EMISSIONS : 0u) | (has.baked ? LODE_VGI_BAKED : 0u) |
           (has.mapped_normals ? LODE_VGI_MAPPED_NORMALS : 0u);
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

// The cells of a coarsest page, n along a side, that part (x, y) of 1 << shift a side has something of.
static PageBounds bounds_of_part(const Atlas& about, const GeometryPage& coarsest, uint32_t n, uint32_t shift,
                                 uint32_t x, uint32_t y, float off) {
    constexpr double turned = 0.35;  // 20 degrees
    const auto at = [&](uint32_t u, uint32_t v) {
        const GeometryTexel& t = coarsest[size_t{v} * (n + 1) + u];
        return about.lattice_point({t.x, t.y, t.z});
    };
    const auto first = [&](uint32_t k) { return k * n >> shift; };
    const auto last = [&](uint32_t k) { return std::max(first(k) + 1, (k + 1) * n >> shift); };
    std::vector<TriangleCorners> triangles;
    for (uint32_t v = first(y); v < last(y); ++v) {
        for (uint32_t u = first(x); u < last(x); ++u) {
            const auto halves = cell_triangles(true, at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1));
            triangles.insert(triangles.end(), halves.begin(), halves.end());
        }
    }
    PageBounds bounds;
    put_sphere(triangles, static_cast<double>(off), bounds);
    put_cone(triangles, turned, bounds);
    return bounds;
}

ChartSpacing spacing_of(const Atlas& about, const GeometryPage& coarsest, float off) {
    const PageTree tree = tree_of(about, Layer::geometry);
    const uint32_t n = tree.cells_per_page(), row = n + 1, splits = ChartSpacing::splits;
    const auto at = [&](uint32_t x, uint32_t y) {
        const GeometryTexel& t = coarsest[size_t{y} * row + x];
        return glm::dvec3(t.x, t.y, t.z) * about.step;
    };
    ChartSpacing spacing;
    double area = 0;
    for (uint32_t y = 0; y < n; ++y) {
        for (uint32_t x = 0; x < n; ++x) {
            const glm::dvec3 a = at(x, y), b = at(x + 1, y), c = at(x, y + 1), d = at(x + 1, y + 1);
            area += glm::length(glm::cross(d - a, c - b)) / 2;
            const double widest = greatest_stretch((b - a + d - c) / 2.0, (c - a + d - b) / 2.0);
            // A cell may be smaller than a part, or larger.
            const uint32_t first_x = (x << splits) / n, last_x = std::max(first_x + 1, ((x + 1) << splits) / n),
                           first_y = (y << splits) / n, last_y = std::max(first_y + 1, ((y + 1) << splits) / n);
            for (uint32_t v = first_y; v < last_y; ++v) {
                for (uint32_t u = first_x; u < last_x; ++u) {
                    float& of_part = spacing.widest[PageTree::page_of(splits, u, v)];
                    of_part = std::max(of_part, static_cast<float>(widest * n / about.attribute_cells));
                }
            }
        }
    }
    for (uint32_t shift = splits; shift-- > 0;) {
        for (uint32_t y = 0; y < 2u << shift; ++y) {
            for (uint32_t x = 0; x < 2u << shift; ++x) {
                float& of_four = spacing.widest[PageTree::page_of(shift, x / 2, y / 2)];
                of_four = std::max(of_four, spacing.widest[PageTree::page_of(shift + 1, x, y)]);
            }
        }
    }
    spacing.mean = static_cast<float>(std::max(std::sqrt(area), about.step) / about.attribute_cells);
    // What is stretched more is hardly seen, and would come before all else.
    for (float& of_part : spacing.widest) of_part = std::min(of_part, ChartSpacing::most_stretch * spacing.mean);
    spacing.bounds_splits = std::min(ChartSpacing::splits, tree_of(about, Layer::attributes).base_level());
    for (uint32_t shift = 0; shift <= spacing.bounds_splits; ++shift) {
        for (uint32_t y = 0; y < 1u << shift; ++y) {
            for (uint32_t x = 0; x < 1u << shift; ++x)
                spacing.bounds.push_back(bounds_of_part(about, coarsest, n, shift, x, y, off));
        }
    }
    return spacing;
}

void AttributePages::want(const Atlas& about, std::span<const ChartSpacing> spacing, const CutRequest& request,
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
            const uint32_t shift = tree_.base_level() - level;
            const PageBounds& bounds = spacing[chart].bounds_of(shift, x, y);
            if (visibility.seen(1, place) == 0 || visibility.seen(1, bounds) == 0) continue;
            const float away =
                request.distance
                    ? *request.distance
                    : std::max(
                          glm::distance(glm::vec3(request.object_to_world * glm::vec4(bounds.centre, 1)), view.eye) -
                              bounds.radius * scale - request.margin.distance,
                          view.near_plane);
            const float apart = spacing[chart].widest_of(shift, x, y),
                        pixels = apart * static_cast<float>(1u << level) * scale * view.focal_px / away;
            // Of its parent another part may need this level.
            if (level < tree_.base_level() && 2 * pixels <= most_apart) continue;
            const uint32_t number = chart * tree_.pages() + tree_.page(level, x, y);
            if (!holds(number)) {
                demand.ask(number, 2 * pixels);  // what is drawn there is its parent
                continue;
            }
            demand.touch(number);
            if (level == 0 || pixels <= most_apart) continue;
            for (uint32_t k = 0; k < 4; ++k) stack.push_back({level - 1, 2 * x + k % 2, 2 * y + k / 2});
        }
    }
}

}  // namespace lodestone::vgi
