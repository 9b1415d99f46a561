#version 460
layout(location = 0) out uvec4 out_visible;
void main() { out_visible = uvec4(64u * (uint(gl_PrimitiveID) + 1u), 0u, 7u, 0u); }
