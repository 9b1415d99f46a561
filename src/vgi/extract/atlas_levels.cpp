#include "vgi/extract/atlas_levels.h"

#include <algorithm>

#include "vgi/asset/leaves/leaves.h"
#include "vgi/extract/baked_images.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {

AtlasLevels::AtlasLevels(const Atlas& about, std::span<const float> errors, uint64_t leaf_triangles)
    : leaf_triangles_(leaf_triangles) {
    for (uint32_t level = 0; level < about.levels(); ++level) triangles_.push_back(about.triangles_at(level));
    if (has_source()) errors_.push_back(static_cast<float>(leaf_rounding(about)));
    for (const float error : errors) errors_.push_back(errors_.empty() ? error : std::max(error, errors_.back()));
}

uint32_t AtlasLevels::level_for_triangles(uint64_t triangles) const {
    if (has_source() && leaf_triangles_ <= triangles) return 0;
    const auto few = std::ranges::find_if(triangles_, [&](uint64_t n) { return n <= triangles; });
    const auto level = static_cast<uint32_t>(std::min(few, triangles_.end() - 1) - triangles_.begin());
    return level + (has_source() ? 1 : 0);
}

uint32_t AtlasLevels::level_for_error(double error) const {
    const auto above = std::ranges::upper_bound(errors_, error, {}, [](float e) { return static_cast<double>(e); });
    const uint32_t level = above == errors_.begin() ? 0 : static_cast<uint32_t>(above - errors_.begin()) - 1;
    // Samples may be denser than the source.
    return has_source() && triangles_at(level) >= leaf_triangles_ ? 0 : level;
}

AtlasLevels levels_of(const Atlas& whole) { return {whole, whole.errors, leaf_triangles(whole)}; }

TriMesh extract_level(const Atlas& whole, const AtlasLevels& levels, uint32_t level) {
    return levels.is_source(level) ? extract_leaves(whole) : extract_samples(whole, levels.of_samples(level));
}

Result<TriMesh> extract_with_textures(const Atlas& whole, const AtlasLevels& levels, uint32_t level,
                                      uint32_t most_texels) {
    const auto places = ChartPlaces::fit(whole, most_texels);
    if (!places) return tl::unexpected(places.error());
    ExtractedMesh extracted;
    if (levels.is_source(level)) {
        extracted = extract_source(whole, &*places);
    } else {
        extracted.mesh = extract_samples(whole, levels.of_samples(level), &*places);
        extracted.is_sample.assign(extracted.mesh.wedge_count(), true);
    }
    use_baked_images(whole, *places, extracted);
    return std::move(extracted.mesh);
}

}  // namespace lodestone::vgi
