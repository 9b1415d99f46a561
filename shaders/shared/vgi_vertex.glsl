// What vertices of virtual geometry images pass on to shaders/vgi/atlas.frag, whichever stage makes them.
#ifndef LODESTONE_VGI_VERTEX_GLSL
#define LODESTONE_VGI_VERTEX_GLSL

#include "shared/vgi_sample.glsl"

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec2 out_place;  // as in PulledSample
layout(location = 2) flat out uint out_chart;
layout(location = 3) flat out uint out_level;   // of the page the last corner is from
layout(location = 4) flat out uint out_first_material;
layout(location = 5) out float out_lod;
layout(location = 6) flat out mat3 out_normal_to_world;
layout(location = 9) out vec2 out_measures;  // as PulledSample's

// The depth pre-pass and the colour pass must agree to the last bit, and so must charts and nodes along their borders.
invariant gl_Position;

// id: of the instance.
void pass_on(PulledSample s, uint id) {
    gl_Position = frame.views[draw_constants.view].world_to_clip * s.world;
    out_position = s.world.xyz;
    out_place = s.place;
    out_chart = s.chart;
    out_level = s.level;
    out_first_material = instances[id].first_material;
    out_lod = s.lod;
    out_measures = s.measures;
    out_normal_to_world = mat3(instances[id].normal_to_world);
}

#endif
