// What vertices of virtual geometry images pass on to shaders/vgi/atlas.frag, whichever stage makes them.
#ifndef LODESTONE_VGI_VERTEX_GLSL
#define LODESTONE_VGI_VERTEX_GLSL

#include "shared/vgi_sample.glsl"

// Packed: rasterisers set up four numbers at the price of one.
layout(location = 0) out vec4 out_position_and_lod;
layout(location = 1) out vec4 out_place_and_measures;  // as in PulledSample
layout(location = 2) flat out uvec3 out_numbers;       // chart; level of the page the last corner is from; first material
layout(location = 3) flat out mat3 out_normal_to_world;

// The depth pre-pass and the colour pass must agree to the last bit, and so must charts and nodes along their borders.
invariant gl_Position;

// id: of the instance.
void pass_on(PulledSample s, uint id) {
    gl_Position = frame.views[draw_constants.view].world_to_clip * s.world;
    if (!has_fragments) return;
    out_position_and_lod = vec4(s.world.xyz, s.lod);
    out_place_and_measures = vec4(s.place, s.measures);
    out_numbers = uvec3(s.chart, s.level, instances[id].first_material);
    out_normal_to_world = mat3(instances[id].normal_to_world);
}

#endif
