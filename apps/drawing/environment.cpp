#include "apps/drawing/environment.h"

#include <glm/geometric.hpp>

#include "light/panorama.h"
#include "light/prefilter.h"
#include "light/sky.h"
#include "render/renderer.h"

namespace lodestone {

Result<std::shared_ptr<const Environment>> environment_of(const Scene& scene) {
    if (scene.environment == no_environment) return nullptr;
    if (scene.environment == built_in_sky) {
        const ShadingOptions usual;
        SkyLook look;
        look.ground = usual.ground_colour;
        const glm::vec3 light = scene.light_direction.value_or(usual.light_direction);
        return std::make_shared<const Environment>(make_environment(ClearSky(glm::normalize(-light), look)));
    }
    const auto panorama = read_panorama(scene.environment);
    if (!panorama) return tl::unexpected(panorama.error());
    return std::make_shared<const Environment>(
        make_environment([&](const glm::vec3& direction) { return panorama->towards(direction); },
                         panorama->points_for(environment_side)));
}

}  // namespace lodestone
