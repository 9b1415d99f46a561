// Samples of attributes, as they are or in blocks of 4 x 4 (vgi/draw/attributes/attribute_blocks.h).
#ifndef LODESTONE_VGI_ATTRIBUTES_GLSL
#define LODESTONE_VGI_ATTRIBUTES_GLSL

#include "shared/octahedral.glsl"
#include "shared/vgi.glsl"

// LODE_VGI_HAS_...: what any asset of the scene has that is drawn with. Software rasterisers run every branch.
layout(constant_id = LODE_VGI_EVER_CONSTANT) const uint ever = 7u;
layout(constant_id = LODE_VGI_WORDS_CONSTANT) const uint attribute_words = 1u;  // of a sample

const bool in_blocks = (ever & LODE_VGI_IN_BLOCKS) != 0u;
const uint no_block = ~0u;

// Its first word, or of its block; of this its number, or no_block; and the axis of the block's normals.
struct AttributeSample {
    uint first, number, axis;
};

// first: word of a page or of a small level, of `cells` a side.
AttributeSample plain_sample(uint first, uint cells, uvec2 p) {
    return AttributeSample(first + attribute_words * (p.y * (cells + 1u) + p.x), no_block, 2u);
}
AttributeSample sample_of_blocks(uint first, uint cells, uvec2 p) {
    if (p.x == 0u || p.y == 0u || p.x == cells || p.y == cells) {
        uint step = p.y == 0u ? p.x : p.x == cells ? cells + p.y : p.y == cells ? 3u * cells - p.x : 4u * cells - p.y;
        return AttributeSample(first + attribute_words * step, no_block, 2u);
    }
    uvec2 q = p - 1u;
    uint block = (q.y >> 2) * LODE_VGI_BLOCKS_ALONG(cells) + (q.x >> 2);
    uint axes = attributes_at(first + LODE_VGI_BLOCK_AXES(cells, attribute_words) + (block >> 3));
    return AttributeSample(first + LODE_VGI_BLOCKS(cells, attribute_words) + LODE_VGI_BLOCK_WORDS(ever) * block,
                           (q.y & 3u) << 2 | (q.x & 3u), axes >> (4u * (block & 7u)) & 15u);
}

// A number of a block, 0 .. 255.
uint number_of_block(uint word, uint number) {
    uint low = attributes_at(word), high = attributes_at(word + 1u), bit = 3u * number + 16u;
    uint code = (bit >= 32u ? high >> (bit - 32u) : bit > 29u ? low >> bit | high << (32u - bit) : low >> bit) & 7u;
    uint first = low & 255u, last = low >> 8 & 255u;
    return code == 0u ? first : code == 1u ? last : ((8u - code) * first + (code - 1u) * last) / 7u;
}
// Three of numbers, one after the other; 0 .. 1.
vec3 numbers_of_block(uint word, uint number) {
    return vec3(number_of_block(word, number), number_of_block(word + 2u, number), number_of_block(word + 4u, number)) / 255.0;
}
// Red, green and blue, 0 .. 1.
vec3 colour_of_block(uint word, uint number) {
    uint ends = attributes_at(word), code = attributes_at(word + 1u) >> (2u * number) & 3u;
    uvec3 first = uvec3(ends >> 11, ends >> 5, ends) & uvec3(31u, 63u, 31u), last = uvec3(ends >> 27, ends >> 21, ends >> 16) & uvec3(31u, 63u, 31u);
    first = first << uvec3(3u, 2u, 3u) | first >> uvec3(2u, 4u, 2u);
    last = last << uvec3(3u, 2u, 3u) | last >> uvec3(2u, 4u, 2u);
    uvec3 value = code == 0u ? first : code == 1u ? last : code == 2u ? (2u * first + last + 1u) / 3u : (first + 2u * last + 1u) / 3u;
    return vec3(value) / 255.0;
}

// Not of unit length: it is a mean of several that is wanted.
vec3 direction_of(uint word) {
    return unfolded(vec2(bitfieldExtract(int(word), 0, 8), bitfieldExtract(int(word), 8, 8)) / 127.0);
}
vec3 direction_at(AttributeSample s) {
    if (!in_blocks || s.number == no_block) return direction_of(attributes_at(s.first));
    vec2 at = vec2(number_of_block(s.first, s.number), number_of_block(s.first + 2u, s.number)) - 128.0;
    vec3 n = unfolded(at / 127.0);
    if (s.axis >= 3u) n.yz = -n.yz;
    uint k = s.axis % 3u;
    return k == 2u ? n : k == 1u ? n.yzx : n.zxy;
}
uint material_at(AttributeSample s) {
    if (!in_blocks || s.number == no_block) return attributes_at(s.first) >> 16;
    uint at = s.first + LODE_VGI_BLOCK_MATERIALS, code = attributes_at(at + 2u) >> (2u * s.number) & 3u;
    return attributes_at(at + (code >> 1)) >> (16u * (code & 1u)) & 0xffffu;
}
// word: of a plain sample.
vec4 colour_at(AttributeSample s, uint word) {
    if (!in_blocks || s.number == no_block) return unpackUnorm4x8(attributes_at(s.first + word));
    float alpha = 1.0;
    if ((ever & LODE_VGI_ALPHA_IN_BLOCKS) != 0u)
        alpha = float(number_of_block(s.first + LODE_VGI_BLOCK_ALPHA(ever), s.number)) / 255.0;
    return vec4(numbers_of_block(s.first + LODE_VGI_BLOCK_COLOURS(ever), s.number), alpha);
}
vec3 surface_at(AttributeSample s, uint word) {
    if (!in_blocks || s.number == no_block) return unpackUnorm4x8(attributes_at(s.first + word)).rgb;
    return numbers_of_block(s.first + LODE_VGI_BLOCK_SURFACES(ever), s.number);
}
vec3 emission_at(AttributeSample s, uint word) {
    if (!in_blocks || s.number == no_block) return unpackUnorm4x8(attributes_at(s.first + word)).rgb;
    return colour_of_block(s.first + LODE_VGI_BLOCK_EMISSIONS(ever), s.number);
}

#endif
