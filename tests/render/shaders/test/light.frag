#version 460
#extension GL_GOOGLE_include_directive : require
// Red as the first word of what is visible says, green where its third word and the depth are what was drawn.
#include "shared/frame.glsl"

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec4 visible = texelFetch(visibility, pixel, 0);
    if (visible.z == LODE_NOTHING_VISIBLE) discard;
    bool good = visible.z == 7u && texelFetch(scene_depth, pixel, 0).r == 0.5;
    out_colour = vec4(float(visible.x) / 255.0, good ? 1.0 : 0.0, 0.0, 1.0);
}
