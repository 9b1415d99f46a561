#version 460
#extension GL_GOOGLE_include_directive : require
// Normals, texture coordinates, colours and materials from the images of attributes, at their own level: as fine as
// pixels are, or as what is there.
#include "shared/lighting.glsl"
#include "shared/vgi.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec2 in_place;
layout(location = 2) flat in uint in_chart;
layout(location = 3) flat in uint in_level;
layout(location = 4) flat in uint in_instance;

layout(location = 0) out vec4 out_colour;

vec3 normal_of(uint word) {
    ivec2 packed_normal = ivec2(bitfieldExtract(int(word), 0, 8), bitfieldExtract(int(word), 8, 8));
    return unpack_normal(vec2(packed_normal) / 127.0);
}

void main() {
    uint asset_number = draw_constants.words[LODE_VGI_WORD_ASSET];
    VgiAsset asset = assets[asset_number];
    vec2 at = in_place * float(asset.attribute_cells);
    // The level whose samples are as far apart as pixels are. Not from derivatives: those of thin triangles tell nothing.
    float pixel = uintBitsToFloat(draw_constants.words[LODE_VGI_WORD_PIXEL]) *
                  distance(in_position, frame.views[draw_constants.view].eye.xyz);
    int fit = max(0, int(floor(log2(pixel / sample_spacing[asset.first_chart + in_chart]) + 0.5)));
    uint cells = min(asset.attribute_cells, LODE_VGI_PAGE_SIDE - 1u);
    uint base = uint(findMSB(asset.attribute_cells) - findMSB(cells));
    uint wanted = min(uint(fit), base);

    uint side = asset.attribute_cells / cells >> wanted, before = base - wanted;
    uvec2 page = min(uvec2(at / float(cells << wanted)), uvec2(side - 1u));
    uint entry = page_table[asset.first_table + in_chart * asset.attribute_pages +
                            ((1u << (2u * before)) - 1u) / 3u + page.y * side + page.x];
    uint slot = entry >> 4, level = entry & 15u;
    page >>= level - wanted;
    vec2 local = clamp(at / float(1u << level) - vec2(page * cells), vec2(0.0), vec2(cells));
    // Coarser than the coarsest page: every so many of its samples.
    int stride = 1 << clamp(fit - int(level), 0, findMSB(cells));
    ivec2 low = min(ivec2(local / float(stride)) * stride, ivec2(int(cells) - stride));
    vec2 f = (local - vec2(low)) / float(stride);

    uint words = draw_constants.words[LODE_VGI_WORD_TEXEL_WORDS], row = cells + 1u, first = slot * LODE_VGI_PAGE_TEXELS * words;
    uvec4 texel = first + words * (uint(low.y) * row + uint(low.x) +
                                   uint(stride) * uvec4(0u, 1u, row, row + 1u));
    vec4 weight = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    int nearest = (f.x < 0.5 ? 0 : 1) + (f.y < 0.5 ? 0 : 2);

    uint word0[4];
    vec3 normal = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        word0[k] = attributes_at(texel[k]);
        normal += weight[k] * normal_of(word0[k]);
    }
    Surface s;
    s.position = in_position;
    s.normal = normalize(mat3(instances[in_instance].normal_to_world) * normal);
    s.uv = vec2(0.0);
    if ((asset.attributes & 1u) != 0u) {
        vec2 uvs[4];
        for (int k = 0; k < 4; ++k) {
            uint word = attributes_at(texel[k] + 1u);
            uvs[k] = vec2(float(word & 0xffffu), float(word >> 16));
        }
        vec2 spread = max(max(uvs[0], uvs[1]), max(uvs[2], uvs[3])) - min(min(uvs[0], uvs[1]), min(uvs[2], uvs[3]));
        vec2 uv = uvs[nearest];
        // Across a seam there is nothing in between.
        if (max(spread.x, spread.y) < 512.0)
            uv = weight.x * uvs[0] + weight.y * uvs[1] + weight.z * uvs[2] + weight.w * uvs[3];
        s.uv = vec2(asset.uv_low_x, asset.uv_low_y) + vec2(asset.uv_step_x, asset.uv_step_y) * uv;
    }
    s.colour = vec4(1.0);
    if ((asset.attributes & 2u) != 0u) {
        s.colour = vec4(0.0);
        for (int k = 0; k < 4; ++k)
            s.colour += weight[k] * unpackUnorm4x8(attributes_at(texel[k] + 1u + (asset.attributes & 1u)));
    }
    s.material = instances[in_instance].first_material;
    if ((asset.attributes & 4u) != 0u) s.material += word0[nearest] >> 16;
    s.level = float(in_level) / max(float(asset.levels) - 1.0, 1.0);
    s.chart = in_chart + 1u;
    s.page = slot + 1u;
    s.missing = float(level - wanted);
    s.triangle = uint(gl_PrimitiveID);
    out_colour = vec4(lit(s), 1.0);  // alpha marks coverage
}
