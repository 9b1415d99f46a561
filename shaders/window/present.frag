#version 460
// The window's picture of one or two panes. Panes hold sRGB values as they are shown.
layout(set = 0, binding = 0) uniform sampler2D panes[2];

layout(push_constant, std430) uniform Composition {
    float split;      // share of the width that shows the first pane; 1: all of it
    uint difference;  // 1: how much the panes differ, four times as bright
} composition;

layout(location = 0) in vec2 in_place;
layout(location = 0) out vec4 out_colour;

void main() {
    const vec3 first = textureLod(panes[0], in_place, 0.0).rgb, second = textureLod(panes[1], in_place, 0.0).rgb;
    vec3 colour = in_place.x < composition.split ? first : second;
    if (composition.difference != 0u) colour = min(4.0 * abs(first - second), vec3(1.0));
    const float line = abs(in_place.x - composition.split) * float(textureSize(panes[0], 0).x);
    if (composition.split < 1.0 && composition.difference == 0u && line < 1.0) colour = vec3(1.0, 0.82, 0.29);
    out_colour = vec4(colour, 1.0);
}
