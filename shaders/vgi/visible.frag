#version 460
#extension GL_GOOGLE_include_directive : require
// What is seen at a pixel, for shaders/vgi/atlas.frag to light it once all triangles are drawn: a few pixels large, each
// of them would be lit with what lies around it, several times over.
//
//   Burns, Hunt, "The visibility buffer: a cache-friendly approach to deferred shading", JCGT 2013. Here it is a place on
//   the atlas: of the triangle nothing has to be known.
#include "shared/frame.glsl"
#include "shared/octahedral.glsl"
#include "shared/vgi_texels.h"

// As in shared/vgi_vertex.glsl.
layout(location = 0) in vec3 in_place_and_measure;
layout(location = 1) flat in uvec3 in_numbers;
layout(location = 2) in vec3 in_normal;

// Place in the chart, 16 bits each way; chart | level << 28; instance; what the debug view asks for, or
// the normal of triangles of LODE_VGI_CORNER_LEVEL and LODE_VGI_LEAF_LEVEL.
layout(location = 0) out uvec4 out_visible;

void main() {
    uint more = in_numbers.y >= LODE_VGI_LEAF_LEVEL ? packSnorm2x16(folded(in_normal)) : 0u;
    if (debug_view() == LODE_DEBUG_ERROR || debug_view() == LODE_DEBUG_STRETCH)
        more = floatBitsToUint(in_place_and_measure.z);
    if (debug_view() == LODE_DEBUG_TRIANGLE) more = uint(gl_PrimitiveID);
    if (debug_view() == LODE_DEBUG_MISSES) more = LODE_MARK_OF_PRIMITIVE;
    out_visible = uvec4(packUnorm2x16(in_place_and_measure.xy), in_numbers.x | in_numbers.y << 28, in_numbers.z, more);
}
