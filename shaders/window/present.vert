#version 460
// A triangle that covers the window.
layout(location = 0) out vec2 out_place;  // 0 .. 1 over the window

void main() {
    out_place = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    gl_Position = vec4(out_place * 2.0 - 1.0, 0.0, 1.0);
}
