// One sample of virtual geometry images, pulled from its page; it moves to its place while the eye comes nearer, so that
// none appears with a jump (sample_errors.h).
#ifndef LODESTONE_VGI_SAMPLE_GLSL
#define LODESTONE_VGI_SAMPLE_GLSL

#include "shared/frame.glsl"
#include "shared/octahedral.glsl"
#include "shared/vgi.glsl"
#include "shared/vgi_cut.h"

struct PulledSample {
    vec4 world;
    vec2 place;   // in the chart, 0 .. 1
    uint chart;
    uint level;   // of the page
    float measure;  // Surface::error or Surface::stretch, where the debug view asks for it
    vec3 normal;    // object space; of leaves alone
    vec2 uv;        // of leaves alone, where they have some
};

const uint leaf_block = LODE_VGI_LEAF_BLOCK(leaves_have_uvs);
const float morph_share = 1.0 - 1.0 / 1.0905077326652577;  // 1 - 1 / error_ratio

// In views[0], as lode_metric_within has it.
float distance_metric(vec3 seen) {
    vec4 forward = frame.views[0].forward;
    float cosine = 2.0 * forward.w * forward.w - 1.0;  // of twice the angle to the corners
    return lode_distance_metric(dot(seen, forward.xyz), length(seen), 1.0, cosine, 1.0 - cosine * cosine);
}

// How far a sample, or a leaf, has come to its place, 0 .. 1. at: its place, lattice units. codes: z | error << 16 | radius << 24.
float arrived(vec3 at, uint codes, InstanceConstants instance, VgiAsset asset) {
    float magnification = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_MAGNIFICATION]);
    uint code = draw_constants.words[LODE_VGI_WORD_ASSET] * 512u;
    float error = decoded_at(code + ((codes >> 16) & 255u)) * magnification * instance.scale;
    float radius = decoded_at(code + 256u + (codes >> 24)) * instance.scale;
    vec3 world = (instance.object_to_world * vec4(vec3(asset.origin_x, asset.origin_y, asset.origin_z) + asset.step * at, 1.0)).xyz;
    // Always of the eye that chose the samples, in every view.
    vec3 seen = world - frame.views[0].eye.xyz;
    return error == 0.0 ? 1.0 : clamp((error + radius - distance_metric(seen)) / (morph_share * error), 0.0, 1.0);
}

// Where a corner of charts is on its way from where its parent is; lattice units.
vec3 moved_corner(uint number, InstanceConstants instance, VgiAsset asset) {
    vec3 point = vec3(0.0);
    bool moves = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_MAGNIFICATION]) > 0.0;
    for (float share = 1.0; share > 0.0;) {
        uvec4 corner = corner_at(asset.first_corner + number);
        vec3 own = lattice(corner.xy);
        float t = moves && corner.z != number ? arrived(own, corner.y, instance, asset) : 1.0;
        point += share * t * own;
        share *= 1.0 - t;
        number = corner.z;
    }
    return point;
}
// Corner k of a chart, where the corners of charts have parents.
uint corner_of_chart(uint chart, uint k, VgiAsset asset) { return corner_at(asset.first_corners_of_charts + chart)[k]; }

// index: without LODE_VGI_CORNER.
PulledSample pull_corner(uint index, InstanceConstants instance) {
    VgiAsset asset = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]);
    uint of_chart = index % LODE_VGI_CORNER_STEP, k = of_chart & 3u;
    PulledSample s;
    s.chart = of_chart >> 2;
    uint number = corner_of_chart(s.chart, k, asset);
    for (uint step = index / LODE_VGI_CORNER_STEP; step > 0u; --step)
        number = corner_at(asset.first_corner + number).z;
    vec3 origin = vec3(asset.origin_x, asset.origin_y, asset.origin_z);
    s.world = instance.object_to_world * vec4(origin + asset.step * moved_corner(number, instance, asset), 1.0);
    s.place = vec2(k == 1u || k == 2u ? 1.0 : 0.0, k >= 2u ? 1.0 : 0.0);
    s.level = LODE_VGI_CORNER_LEVEL;
    s.normal = vec3(0.0);
    s.measure = 0.0;
    s.uv = vec2(0.0);
    return s;
}

// How much of its way a leaf's vertex has before it, as where it starts is seen from its place; units of the leaves'
// lattice. It goes as the leaves that have it appear: no farther than the one that has come less far.
vec3 way_of_leaf(uint number, InstanceConstants instance, VgiAsset asset) {
    uint morph = leaf_at(LODE_VGI_LEAF_MORPHS(number, leaf_block))[number & 3u], side = morph & 7u;
    uvec2 own = leaf_at(LODE_VGI_LEAF_HEADER(number, leaf_block)).xy;
    uvec4 sides = leaf_at(LODE_VGI_LEAF_HEADER(number, leaf_block) + (side >> 1));
    uvec2 other = (side & 1u) != 0u ? sides.zw : sides.xy;
    float t = min(arrived(lattice(own), own.y, instance, asset), arrived(lattice(other), other.y, instance, asset));
    vec3 off = vec3(bitfieldExtract(int(morph), 11, 7), bitfieldExtract(int(morph), 18, 7), bitfieldExtract(int(morph), 25, 7));
    return (1.0 - t) * float(1u << (2u * (morph >> 8 & 7u))) * off;
}

// number: the index without LODE_VGI_LEAF and LODE_VGI_LEAF_MOVES. moves: whether it may not have come to its place.
PulledSample pull_leaf(uint number, bool moves, InstanceConstants instance) {
    VgiAsset asset = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]);
    uvec4 vertex = leaf_at(LODE_VGI_LEAF_TEXEL(number, leaf_block));
    vec3 at = vec3(float(vertex.x & 0x1fffffu), float(vertex.x >> 21 | (vertex.y & 0x3ffu) << 11), float(vertex.y >> 10 & 0x1fffffu));
    if (moves) at += way_of_leaf(number, instance, asset);
    PulledSample s;
    s.world = instance.object_to_world * vec4(vec3(asset.origin_x, asset.origin_y, asset.origin_z) + asset.leaf_step * at, 1.0);
    s.place = vec2(float(vertex.z & 0x3fffu), float(vertex.z >> 14 & 0x3fffu)) / float(LODE_VGI_LEAF_PLACES);
    s.chart = vertex.z >> 28 | (vertex.w >> 16) << 4;
    s.level = LODE_VGI_LEAF_LEVEL;
    s.normal = unfolded(vec2(bitfieldExtract(int(vertex.w), 0, 8), bitfieldExtract(int(vertex.w), 8, 8)) / 127.0);
    s.measure = 0.0;
    s.uv = vec2(0.0);
    if (has_fragments && leaves_have_uvs != 0u) {
        uint uv = leaf_at(LODE_VGI_LEAF_MORPHS(number, leaf_block) + 1u)[number & 3u];
        s.uv = vec2(asset.uv_low_x, asset.uv_low_y) + vec2(asset.uv_step_x, asset.uv_step_y) * vec2(float(uv & 0xffffu), float(uv >> 16));
    }
    return s;
}

// p: in the page, which must be of the sample's own level, or the coarsest. corners: whether it may be a corner of the page.
PulledSample pull_sample(uint slot, ivec2 p, bool corners, InstanceConstants instance) {
    VgiAsset asset = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]);
    int row = int(asset.page_cells) + 1;
    uvec2 header = slot_at(slot + asset.header_shift);
    uint level = header.x >> 28;
    uint first = slot * LODE_VGI_PAGE_TEXELS(asset.page_cells);
    uvec2 texel = geometry_at(first + uint(p.y * row + p.x));
    vec3 sample_point = lattice(texel);
    vec3 origin = vec3(asset.origin_x, asset.origin_y, asset.origin_z);

    float magnification = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_MAGNIFICATION]);
    bool corner = corners && ((p.x | p.y) & (int(asset.page_cells) - 1)) == 0;
    uint chart = header.x & 0x0fffffffu;
    vec2 place = vec2((uvec2(header.y & 0xffffu, header.y >> 16) * asset.page_cells + uvec2(p)) << level) /
                 float(asset.cells);
    if (corner && asset.first_corners_of_charts != LODE_VGI_NO_CORNERS && place == round(place)) {
        uint k = place.y == 0.0 ? uint(place.x) : 3u - uint(place.x);
        sample_point = moved_corner(corner_of_chart(chart, k, asset), instance, asset);
    } else if (magnification > 0.0 && !corner) {
        float t = arrived(sample_point, texel.y, instance, asset);
        // Ends of the hypotenuse it halves; in the same page (vgi/asset/bintree.h).
        int h = 1 << findLSB(uint(p.x | p.y | int(asset.page_cells)));
        bool odd_x = (p.x & h) != 0, odd_y = (p.y & h) != 0;
        ivec2 away = odd_x && odd_y ? ((((p.x - h) / (2 * h) + (p.y - h) / (2 * h)) & 1) == 0 ? ivec2(h, h) : ivec2(h, -h))
                   : odd_x          ? ivec2(h, 0)
                                    : ivec2(0, h);
        ivec2 a = p - away, b = p + away;
        vec3 middle = 0.5 * (lattice(geometry_at(first + uint(a.y * row + a.x))) +
                             lattice(geometry_at(first + uint(b.y * row + b.x))));
        sample_point = middle + (sample_point - middle) * t;
    }
    PulledSample s;
    s.world = instance.object_to_world * vec4(origin + asset.step * sample_point, 1.0);
    s.place = place;
    s.chart = chart;
    s.level = level;
    s.measure = 0.0;
    s.normal = vec3(0.0);
    s.uv = vec2(0.0);
    if (debug_view() == LODE_DEBUG_ERROR) {
        float pixel = pixel_at(s.world.xyz, instance.scale);
        float error = decoded_at(draw_constants.words[LODE_VGI_WORD_ASSET] * 512u + ((texel.y >> 16) & 255u));
        s.measure = corner ? 0.0 : error / pixel;
    }
    if (debug_view() == LODE_DEBUG_STRETCH) {
        ivec2 low = max(p - 1, ivec2(0)), high = min(p + 1, ivec2(row - 1));
        vec3 along_x = (lattice(geometry_at(first + uint(p.y * row + high.x))) - lattice(geometry_at(first + uint(p.y * row + low.x)))) / float(high.x - low.x);
        vec3 along_y = (lattice(geometry_at(first + uint(high.y * row + p.x))) - lattice(geometry_at(first + uint(low.y * row + p.x)))) / float(high.y - low.y);
        float cells = float(1u << asset.attribute_cells) / float(asset.cells);
        s.measure = asset.step * sqrt(0.5 * (dot(along_x, along_x) + dot(along_y, along_y))) / float(1u << level) /
                       (cells * uintBitsToFloat(spacing_at(asset.first_chart + s.chart)));
    }
    return s;
}

#endif
