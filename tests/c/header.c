#include "lodestone.h"

#include <assert.h>

// Sizes that programs are built with: they never shrink.
static_assert(sizeof(lodestone_vertex) == 40, "a vertex of a cut has 40 bytes");
