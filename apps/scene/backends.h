// The list of backends, in this one place.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/scene/workplace.h"
#include "frame/frame_source.h"
#include "frame/plan_mirror.h"
#include "report/rows.h"

namespace lodestone {

std::vector<std::string> backend_names();
// Fault::usage, naming the option, where there is no such backend.
Result<void> check_backend(const std::string& option, const std::string& name);
// What a scene has to hold for these backends. rest: of what the others need.
SceneNeeds needs_of(const std::vector<std::string>& names, Need rest = Need::no);
// Techniques that cannot draw leaves are given samples that stand for them.
void note_rasters(const std::vector<std::string>& rasters, SceneNeeds& needs);
// Fault::usage, naming the option, unless it is one of the backend's (of any's, where that is empty), or empty for the
// usual one.
Result<void> check_raster(const std::string& option, const std::string& name, const std::string& backend);
// The ways a backend can draw the scene, the usual one first: by how triangles are made and moved, and for `lod` by the
// orders that every asset holds.
std::vector<Technique> techniques_of(const std::string& backend, const ReadyScene& scene);

// Choices may be left empty, for the usual ones. Fault::usage for an unknown backend.
Result<std::unique_ptr<FrameSource>> open_backend(const Technique& way, const ReadyScene& scene,
                                                  const Progress& progress);

// How its vertices are pulled; empty where they come from vertex buffers.
PlanMirror::Puller puller_of(const std::string& backend);

}  // namespace lodestone
