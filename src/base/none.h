// The index that stands for none.
#pragma once

#include <cstdint>

namespace lodestone {

inline constexpr uint32_t none = ~0u;  // in place of an index where there is none

}  // namespace lodestone
