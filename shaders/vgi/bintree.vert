#version 460
#extension GL_GOOGLE_include_directive : require
// Samples of virtual geometry images, pulled from their pages; each moves to its place while the eye comes nearer, so
// that none appears with a jump (sample_errors.h).
#include "shared/frame.glsl"
#include "shared/vgi.glsl"

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec2 out_place;        // in the chart, 0 .. 1
layout(location = 2) flat out uint out_chart;
layout(location = 3) flat out uint out_level;   // of the page the last corner is from
layout(location = 4) flat out uint out_first_material;
layout(location = 5) out float out_lod;         // level of the attributes whose samples are as far apart as pixels
layout(location = 6) flat out mat3 out_normal_to_world;

// The depth pre-pass and the colour pass must agree to the last bit, and so must charts along their borders.
invariant gl_Position;

const float morph_share = 1.0 - 1.0 / 1.0905077326652577;  // 1 - 1 / error_ratio

vec3 lattice(uvec2 texel) { return vec3(float(texel.x & 0xffffu), float(texel.x >> 16), float(texel.y & 0xffffu)); }

void main() {
    uint id = instance_ids[gl_InstanceIndex];
    mat4 to_world = instances[id].object_to_world;
    VgiAsset asset = assets[draw_constants.words[LODE_VGI_WORD_ASSET]];
    uint slot = uint(gl_VertexIndex) / LODE_VGI_PAGE_TEXELS, place = uint(gl_VertexIndex) % LODE_VGI_PAGE_TEXELS;
    int row = int(asset.page_cells) + 1;
    ivec2 p = ivec2(int(place) % row, int(place) / row);
    uvec2 header = slots[slot];
    uint level = header.x >> 28;
    uvec2 texel = geometry_at(slot * LODE_VGI_PAGE_TEXELS + place);
    vec3 sample_point = lattice(texel);
    vec3 origin = vec3(asset.origin_x, asset.origin_y, asset.origin_z);

    float magnification = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_MAGNIFICATION]);
    bool corner = (p.x % int(asset.page_cells)) == 0 && (p.y % int(asset.page_cells)) == 0;
    if (magnification > 0.0 && !corner) {
        float scale = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_SCALE]);
        uint code = draw_constants.words[LODE_VGI_WORD_ASSET] * 512u;
        float error = codes[code + ((texel.y >> 16) & 255u)] * magnification * scale;
        float radius = codes[code + 256u + (texel.y >> 24)] * scale;
        vec3 world = (to_world * vec4(origin + asset.step * sample_point, 1.0)).xyz;
        // Always of the eye that chose the samples, in every view.
        float t = clamp((error + radius - distance(world, frame.views[0].eye.xyz)) / (morph_share * error), 0.0, 1.0);
        // Ends of the hypotenuse it halves; in the same page (vgi/bintree.h).
        int h = 1 << findLSB(uint(p.x | p.y | int(asset.page_cells)));
        bool odd_x = (p.x & h) != 0, odd_y = (p.y & h) != 0;
        ivec2 away = odd_x && odd_y ? ((((p.x - h) / (2 * h) + (p.y - h) / (2 * h)) & 1) == 0 ? ivec2(h, h) : ivec2(h, -h))
                   : odd_x          ? ivec2(h, 0)
                                    : ivec2(0, h);
        ivec2 a = p - away, b = p + away;
        uint first = slot * LODE_VGI_PAGE_TEXELS;
        vec3 middle = 0.5 * (lattice(geometry_at(first + uint(a.y * row + a.x))) +
                             lattice(geometry_at(first + uint(b.y * row + b.x))));
        sample_point = middle + (sample_point - middle) * t;
    }
    vec4 world = to_world * vec4(origin + asset.step * sample_point, 1.0);
    gl_Position = frame.views[draw_constants.view].world_to_clip * world;
    out_position = world.xyz;
    uvec2 page = uvec2(header.y & 0xffffu, header.y >> 16);
    out_place = vec2((page * asset.page_cells + uvec2(p)) << level) / float(asset.cells);
    out_chart = header.x & 0x0fffffffu;
    out_level = level;
    out_first_material = instances[id].first_material;
    // Not from derivatives in the fragment shader: those of thin triangles tell nothing.
    float pixel = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_PIXEL]) *
                  distance(world.xyz, frame.views[draw_constants.view].eye.xyz);
    out_lod = log2(max(pixel, 1e-30) / sample_spacing[asset.first_chart + out_chart]);
    out_normal_to_world = mat3(instances[id].normal_to_world);
}
