// Push constants of every pipeline, declared once for C++ and GLSL. 48 bytes.
#ifndef LODESTONE_DRAW_CONSTANTS_H
#define LODESTONE_DRAW_CONSTANTS_H

#define LODE_NO_MARKS 0xffffffffu

#ifdef __cplusplus
#include <cstdint>
namespace lodestone {
struct DrawConstants {
    uint32_t view;         // index into the views of the frame
    uint32_t first_mark;   // of the draw's triangles in triangle_marks; LODE_NO_MARKS where they have none
    uint32_t reserved[2];
    uint32_t words[8];     // Draw::words, Dispatch::words
    bool operator==(const DrawConstants&) const = default;
};
static_assert(sizeof(DrawConstants) == 48);
}  // namespace lodestone
#else
layout(push_constant, std430) uniform DrawConstants {
    uint view;
    uint first_mark;
    uint reserved0, reserved1;
    uint words[8];
} draw_constants;
#endif

#endif
