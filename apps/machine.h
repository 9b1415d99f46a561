// What a figure was measured on, and what a bake has to live in.
#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

std::string cpu_name();       // as the kernel names it, "unknown" where it does not
std::string source_commit();  // of the build, "unknown" outside a checkout
uint64_t available_memory();  // bytes that programs may still take, as the kernel tells; 2 GiB where it does not

}  // namespace lodestone
