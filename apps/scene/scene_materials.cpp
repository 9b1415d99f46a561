#include "apps/scene/scene_materials.h"

#include <map>
#include <utility>

namespace lodestone {

namespace {

static_assert(static_cast<int>(SurfaceShading::unlit) == static_cast<int>(Shading::unlit));
static_assert(static_cast<int>(SurfaceAlpha::blend) == static_cast<int>(AlphaMode::blend));
static_assert(static_cast<int>(SurfaceWrap::mirror) == static_cast<int>(Wrap::mirror));
static_assert(std::tuple_size_v<decltype(std::declval<const Material&>().textures())> == texture_roles);

// Colours are sRGB; what else images hold is as it is.
bool is_colour(size_t role) { return role == texture_base_colour || role == texture_emission; }

SurfaceMaterial surface_material(const Material& m) {
    SurfaceMaterial made;
    made.base_colour = m.base_colour;
    made.shading = static_cast<SurfaceShading>(m.shading);
    made.alpha_mode = static_cast<SurfaceAlpha>(m.alpha_mode);
    made.double_sided = m.double_sided;
    made.alpha_cutoff = m.alpha_cutoff;
    made.metallic = m.metallic;
    made.roughness = m.roughness;
    made.normal_scale = m.normal_scale;
    made.occlusion_strength = m.occlusion_strength;
    made.emission = m.emission;
    return made;
}

}  // namespace

void add_materials(const std::vector<Material>& table, const std::vector<Image>& images, MaterialSet& set) {
    if (table.empty()) {
        set.materials.emplace_back();
        return;
    }
    // One that is looked up both ways is there twice.
    std::map<std::pair<int32_t, bool>, int32_t> places;
    for (const Material& m : table) {
        SurfaceMaterial& made = set.materials.emplace_back(surface_material(m));
        const auto textures = m.textures();
        for (size_t role = 0; role < textures.size(); ++role) {
            const Texture& texture = *textures[role];
            if (!texture.there()) continue;
            const auto [place, fresh] = places.try_emplace({texture.image, is_colour(role)}, set.images.size());
            if (fresh) {
                const Image& image = images[static_cast<size_t>(texture.image)];
                set.images.push_back({image.width, image.height, is_colour(role), image.texels});
            }
            made.textures[role] = {
                place->second,
                {static_cast<SurfaceWrap>(texture.wrap[0]), static_cast<SurfaceWrap>(texture.wrap[1])},
                texture.place};
        }
    }
}

MaterialSet gather_materials(const std::vector<Asset>& assets, std::vector<uint32_t>* first_material) {
    MaterialSet set;
    first_material->clear();
    for (const Asset& asset : assets) {
        first_material->push_back(static_cast<uint32_t>(set.materials.size()));
        add_materials(asset.material_table(), asset.images(), set);
    }
    return set;
}

}  // namespace lodestone
