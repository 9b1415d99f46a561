#version 460
layout(location = 0) out vec4 out_colour;
void main() { out_colour = vec4(1.0, 0.5, 0.25, 1.0); }
