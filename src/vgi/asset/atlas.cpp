#include "vgi/asset/atlas.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "base/check.h"
#include "base/structures/disjoint_sets.h"
#include "vgi/asset/pages.h"
#include "vgi/asset/sample_depths.h"

namespace lodestone::vgi {

std::array<int8_t, 2> pack_octahedral(const glm::vec3& unit) {
    const auto packed = pack_normal(unit);
    const auto narrow = [](int16_t v) { return static_cast<int8_t>(std::lround(v * (127.0 / 32767))); };
    return {narrow(packed[0]), narrow(packed[1])};
}
glm::vec3 unpack_octahedral(const std::array<int8_t, 2>& packed) {
    const auto wide = [](int8_t v) { return static_cast<int16_t>(std::lround(v * (32767.0 / 127))); };
    return unpack_normal({wide(packed[0]), wide(packed[1])});
}

uint32_t Atlas::levels() const { return static_cast<uint32_t>(std::bit_width(cells)); }

void Atlas::lay_out(std::vector<uint8_t> levels_left_out, std::vector<uint8_t> attribute_levels_left_out) {
    LODE_CHECK(levels_left_out.size() == attribute_levels_left_out.size(), levels_left_out.size());
    trimmed_levels = std::move(levels_left_out);
    trimmed_attribute_levels = std::move(attribute_levels_left_out);
    const auto count = static_cast<uint32_t>(trimmed_levels.size());
    cluster.resize(count);
    dense.assign(count, 0);
    unsampled_levels.assign(count, 0);
    unsampled_attribute_levels.assign(count, 0);
    first_texel.assign(1, 0);
    first_attribute_texel.assign(1, 0);
    first_leaf.assign(1, 0);
    const auto squared = [](size_t n) { return n * n; };
    for (uint32_t c = 0; c < count; ++c) {
        LODE_CHECK(cells_of(c) > 0 && attribute_cells_of(c) >= cells_of(c), c);
        first_texel.push_back(first_texel.back() + squared(cells_of(c) + 1));
        first_attribute_texel.push_back(first_attribute_texel.back() + squared(attribute_cells_of(c) + 1));
        first_leaf.push_back(first_leaf.back() + leaves_per_side(c) * leaves_per_side(c));
    }
}

uint32_t Atlas::leaves_per_side(uint32_t chart) const {
    return tree_of(*this, Layer::geometry, chart).pages_per_side(0);
}

void Atlas::make_room() {
    positions.resize(texels());
    sample_errors.resize(texels());
    sample_radii.resize(texels());
    normals.resize(attribute_texels());
    if (attributes.uvs) uvs.resize(attribute_texels());
    if (attributes.colours) colours.resize(attribute_texels());
    if (attributes.surfaces) surfaces.resize(attribute_texels());
    if (attributes.emissions) emissions.resize(attribute_texels());
    if (attributes.materials) materials.resize(attribute_texels());
}

uint64_t Atlas::triangles_at(uint32_t level) const {
    const SampleDepths depths(*this);
    uint64_t count = 0;
    for (uint32_t c = 0; c < charts(); ++c) {
        const uint32_t own = std::max<uint32_t>(own_level(c, level), unsampled_levels[c]);
        if (depths.is_even(*this, c)) {
            const uint64_t n = cells_of(c) >> own;
            count += 2 * n * n;
        } else {
            for_level_triangles(*this, depths, c, own, [&](GridPoint, GridPoint, GridPoint) { ++count; });
        }
    }
    return count;
}

glm::vec3 Atlas::normal(size_t texel) const { return unpack_octahedral(normals[texel]); }

Atlas::Tile Atlas::across(Tile from, uint32_t side, uint32_t per_side) const {
    const uint32_t last = per_side - 1;
    const auto [chart, x, y] = from;
    const bool inside = side == 0 ? y > 0 : side == 1 ? x < last : side == 2 ? y < last : x > 0;
    if (inside) return {chart, side == 1 ? x + 1 : side == 3 ? x - 1 : x, side == 2 ? y + 1 : side == 0 ? y - 1 : y};
    const GluedSide& other = sides[size_t{chart} * 4 + side];
    if (other.chart == ~0u) return {~0u, 0, 0};
    // Step k of one side is step last - k of the other, counted in squares.
    const uint32_t along = side == 0 ? x : side == 1 ? y : side == 2 ? last - x : last - y;
    const auto [u, v] = on_side(other.side, last - along, last);
    return {other.chart, u, v};
}

uint32_t Atlas::level_for_error(double error) const {
    uint32_t level = 0;
    while (level + 1 < errors.size() && static_cast<double>(errors[level + 1]) <= error) ++level;
    return level;
}

Result<void> Atlas::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "atlas: " + what); };
    if (cells < 2 || cells > attribute_cells || attribute_cells > 4096 || !std::has_single_bit(cells) ||
        !std::has_single_bit(attribute_cells))
        return wrong("cells are no powers of two, or fewer for attributes than for positions");
    if (!(step > 0)) return wrong("the lattice has no step");
    if (trimmed_levels.size() != charts() || trimmed_attribute_levels.size() != charts() || dense.size() != charts() ||
        unsampled_levels.size() != charts() || unsampled_attribute_levels.size() != charts() ||
        first_texel.size() != charts() + size_t{1} || first_attribute_texel.size() != first_texel.size())
        return wrong("charts are not laid out");
    if (sides.size() != size_t{charts()} * 4 || positions.size() != texels() || sample_errors.size() != texels() ||
        sample_radii.size() != texels() || normals.size() != attribute_texels() ||
        (!uvs.empty() && uvs.size() != attribute_texels()) ||
        (!colours.empty() && colours.size() != attribute_texels()) ||
        (!surfaces.empty() && surfaces.size() != attribute_texels()) ||
        (!emissions.empty() && emissions.size() != attribute_texels()) ||
        (!materials.empty() && materials.size() != attribute_texels()))
        return wrong("an image has the wrong size");
    if (!errors.empty() && (errors.size() != levels() || !std::is_sorted(errors.begin(), errors.end())))
        return wrong("errors fall, or are not one per level");
    if (!leaves.empty() && (leaves.size() != first_leaf.back() || leaf_parts.size() != leaf_part_count()))
        return wrong("leaves are not one per square");
    for (const uint16_t m : materials) {
        if (m >= material_table.size()) return wrong("a material is out of range");
    }
    if (auto good = validate_gluing(); !good) return good;
    if (auto good = validate_depths(); !good) return good;
    for (uint32_t c = 0; c < charts(); ++c) {
        for (uint32_t s = 0; s < 4; ++s) {
            const GluedSide& other = sides[size_t{c} * 4 + s];
            if (other.chart == ~0u) continue;
            const uint32_t n = cells_of(c);
            for (uint32_t k = 0; k <= n; ++k) {
                const auto [x, y] = on_side(s, k, n);
                const auto [u, v] = on_side(other.side, n - k, n);
                const size_t mine = texel(c, x, y), its = texel(other.chart, u, v);
                if (positions[mine] != positions[its] || sample_errors[mine] != sample_errors[its] ||
                    sample_radii[mine] != sample_radii[its])
                    return wrong("chart " + std::to_string(c) + ", side " + std::to_string(s) + ": sample " +
                                 std::to_string(k) + " differs from the one it is glued to");
            }
        }
    }
    return {};
}

Result<void> Atlas::validate_depths() const {
    for (uint32_t c = 0; c < charts(); ++c) {
        const PageTree of_positions = tree_of(*this, Layer::geometry, c),
                       of_attributes = tree_of(*this, Layer::attributes, c);
        const auto deep = [](const PageTree& tree) {
            return static_cast<uint32_t>(std::bit_width(tree.cells_per_page())) - 1;
        };
        const uint32_t most = deep(of_positions) - 1,
                       most_of_attributes = of_attributes.base_level() > 0 ? 0 : deep(of_attributes) - 1;
        if (unsampled_levels[c] > most || unsampled_attribute_levels[c] > most_of_attributes)
            return fail(Fault::invariant, "atlas: chart " + std::to_string(c) + ": has too few samples of its own");
    }
    return {};
}

Result<void> Atlas::validate_gluing() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "atlas: " + what); };
    if (sides.size() != size_t{charts()} * 4) return wrong("sides are not four per chart");
    for (uint32_t c = 0; c < charts(); ++c) {
        for (uint32_t s = 0; s < 4; ++s) {
            const GluedSide& other = sides[size_t{c} * 4 + s];
            if (other.chart == ~0u) continue;
            const std::string place = "chart " + std::to_string(c) + ", side " + std::to_string(s);
            if (other.chart >= charts() || other.side > 3) return wrong(place + ": is glued to nothing");
            if (other == GluedSide{c, s}) return wrong(place + ": is glued to itself");
            if (sides[size_t{other.chart} * 4 + other.side] != GluedSide{c, s})
                return wrong(place + ": is glued to a side that is glued elsewhere");
            if (trimmed_levels[c] != trimmed_levels[other.chart] ||
                trimmed_attribute_levels[c] != trimmed_attribute_levels[other.chart] || dense[c] != dense[other.chart])
                return wrong(place + ": is glued to a chart that leaves out other levels, or is dense where it is not");
        }
    }
    return {};
}

}  // namespace lodestone::vgi
