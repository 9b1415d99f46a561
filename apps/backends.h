// The list of backends, in this one place.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/workplace.h"
#include "frame/frame_source.h"
#include "frame/plan_mirror.h"

namespace lodestone {

std::vector<std::string> backend_names();
// Fault::usage, naming the option, where there is no such backend.
Result<void> check_backend(const std::string& option, const std::string& name);
// What a scene has to hold for these backends.
SceneNeeds needs_of(const std::vector<std::string>& names);
// The face orders a backend can draw the scene with: the orders every asset holds for `lod`, one empty name for the
// others.
std::vector<std::string> orders_of(const std::string& backend, const ReadyScene& scene);

// order: for `lod`; empty for the first of each asset. Fault::usage for an unknown backend.
Result<std::unique_ptr<FrameSource>> open_backend(const std::string& backend, const std::string& order,
                                                  const ReadyScene& scene, const Progress& progress);

// How its vertices are pulled; empty where they come from vertex buffers.
PlanMirror::Puller puller_of(const std::string& backend);

}  // namespace lodestone
