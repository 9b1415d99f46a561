// Vulkan calls of this test program that answer what a test wants: the loader's functions, with ours before them.
#pragma once

#include <vulkan/vulkan.h>

#include <string>

namespace lodestone {

// The next `times` calls answer `result` and do nothing, but for `skipped` calls before them. One call at a time.
void inject(const std::string& call, VkResult result, int times = 1, int skipped = 0);
// What surfaces can do, and which formats they have, from now on; null for the truth.
using Capabilities = void (*)(VkSurfaceCapabilitiesKHR&);
using Format = void (*)(VkSurfaceFormatKHR&);  // for each of them
void pretend(Capabilities capabilities, Format format);
int injected();             // how many did, since inject()
long device_allocations();  // VkDeviceMemory that lives

}  // namespace lodestone
