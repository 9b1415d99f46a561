// Light from all around that a scene is drawn with.
#pragma once

#include <memory>

#include "apps/scene/scene.h"
#include "base/looks/environment.h"
#include "base/result.h"

namespace lodestone {

// As Scene::environment says; null where it says nothing. Errors as of read_panorama.
Result<std::shared_ptr<const Environment>> environment_of(const Scene& scene);

}  // namespace lodestone
