// What GLFW knows of Vulkan: the one place besides window.cpp that calls it.
#pragma once

#include <vector>

#include "render/vulkan/vulkan.h"

namespace lodestone {

// Instance extensions a window needs. Starts GLFW; throws VulkanFailure where there is no display.
std::vector<const char*> surface_extensions();

}  // namespace lodestone
