#version 460
#extension GL_GOOGLE_include_directive : require
// Lights what is seen (shaders/vgi/visible.frag).
#include "shared/lighting.glsl"
#include "shared/vgi_surface.glsl"

layout(location = 0) out vec4 out_colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec4 visible = texelFetch(visibility, pixel, 0);
    if (visible.z == LODE_NOTHING_VISIBLE) discard;
    InstanceConstants instance = instance_at(visible.z & ~LODE_VGI_FROM_BEHIND);
    vec4 clip = vec4(gl_FragCoord.xy / vec2(textureSize(scene_depth, 0)) * 2.0 - 1.0, texelFetch(scene_depth, pixel, 0).r, 1.0);
    vec4 world = frame.views[draw_constants.view].clip_to_world * clip;
    // What the visibility buffer holds is drawn, whatever its material: lines show what is blended, too.
    OwnUvs own = no_own_uvs();
    if (leaves_have_uvs != 0u) own = unpacked_uvs(texelFetch(further_visibility, pixel, 0));
    Surface s = atlas_surface(visible, own, world / world.w, instance, asset_at(instance.asset));
    out_colour = vec4(lit(s, look_of(s)), 1.0);
}
