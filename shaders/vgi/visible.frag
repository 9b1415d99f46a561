#version 460
#extension GL_GOOGLE_include_directive : require
// What is seen at a pixel, for shaders/vgi/atlas.frag to light it once all triangles are drawn: a few pixels large, each
// of them would be lit with what lies around it, several times over.
//
//   Burns, Hunt, "The visibility buffer: a cache-friendly approach to deferred shading", JCGT 2013. Here it is a place on
//   the atlas: of the triangle nothing has to be known.
#include "shared/vgi_inputs.glsl"

layout(location = 0) out uvec4 out_visible;

void main() {
    out_visible = visible_here();
    if (!is_drawn_here(out_visible, no_own_uvs())) discard;
}
