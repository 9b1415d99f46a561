// The list of backends, in this one place.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/workplace.h"
#include "frame/frame_source.h"

namespace lodestone {

std::vector<std::string> backend_names();
// The face orders a backend can draw the scene with: the orders every asset holds for `lod`, one empty name for the
// others.
std::vector<std::string> orders_of(const std::string& backend, const ReadyScene& scene);

// order: for `lod`; empty for the first of each asset. Fault::usage for an unknown backend.
Result<std::unique_ptr<FrameSource>> open_backend(const std::string& backend, const std::string& order,
                                                  const ReadyScene& scene, const Progress& progress);

}  // namespace lodestone
