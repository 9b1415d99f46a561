#version 460
#extension GL_GOOGLE_include_directive : require
// What is all around, where there is no surface. alpha: nothing covers the pixel.
#include "frame/environment.glsl"

layout(location = 0) out vec4 out_colour;

void main() {
    vec2 place = gl_FragCoord.xy / vec2(frame.views[0].target_width, frame.views[0].target_height);
    vec4 far = frame.views[0].clip_to_world * vec4(2.0 * place - 1.0, 0.0, 1.0);
    out_colour = vec4(textureLod(environment, far.xyz - frame.views[0].eye.xyz * far.w, 0.0).rgb, 0.0);
}
