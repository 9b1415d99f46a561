// What a figure was measured on.
#pragma once

#include <string>

namespace lodestone {

std::string cpu_name();       // as the kernel names it, "unknown" where it does not
std::string source_commit();  // of the build, "unknown" outside a checkout

}  // namespace lodestone
