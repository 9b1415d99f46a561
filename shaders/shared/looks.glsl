// What the materials of the scene ask for.
#ifndef LODESTONE_LOOKS_GLSL
#define LODESTONE_LOOKS_GLSL

#include "shared/materials.h"

layout(constant_id = LODE_LOOKS_CONSTANT) const uint scene_looks = 0x1ffffu;

bool scene_has(uint looks) { return (scene_looks & looks) != 0u; }

#endif
