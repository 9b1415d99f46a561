#version 460
#extension GL_GOOGLE_include_directive : require
// A triangle per three vertices, pulled from nowhere: a strip of triangles across the picture.
#include "shared/frame.glsl"

invariant gl_Position;

void main() {
    uint triangle = gl_VertexIndex / 3, corner = gl_VertexIndex % 3;
    vec2 p = vec2(-0.9 + 0.4 * float(triangle), -0.5) + (corner == 0 ? vec2(0.0) : corner == 1 ? vec2(0.3, 0.0) : vec2(0.0, 0.3));
    gl_Position = vec4(p.x, -p.y, 0.5, 1.0);
}
