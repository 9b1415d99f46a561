// What vertices of virtual geometry images pass on to fragments (shared/vgi_inputs.glsl), whichever stage makes them.
#ifndef LODESTONE_VGI_VERTEX_GLSL
#define LODESTONE_VGI_VERTEX_GLSL

#include "shared/vgi_sample.glsl"

layout(location = 0) out vec3 out_place_and_measure;  // as in PulledSample
layout(location = 1) flat out uvec3 out_numbers;      // chart; level of the page the first corner is from | log2 of cells of attributes << 4; instance
layout(location = 2) out vec3 out_normal;             // as in PulledSample
layout(location = 3) out vec2 out_uv;                 // as in PulledSample

// Charts and nodes must agree along their borders to the last bit.
invariant gl_Position;

// id: of the instance.
void pass_on(PulledSample s, uint id) {
    gl_Position = frame.views[draw_constants.view].world_to_clip * s.world;
    if (!has_fragments) return;
    out_place_and_measure = vec3(s.place, s.measure);
    out_numbers = uvec3(s.chart, s.level | asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]).attribute_cells << 4, id);
    out_normal = s.normal;
    out_uv = s.uv;
}

#endif
