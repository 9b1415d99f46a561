// The surface at a place of an atlas: normals, texture coordinates, colours and materials from the images of attributes, at
// their own level: as fine as pixels are, or as what is there. Leaves have normals and texture coordinates of their own.
#ifndef LODESTONE_VGI_SURFACE_GLSL
#define LODESTONE_VGI_SURFACE_GLSL

#include "shared/materials.glsl"
#include "shared/vgi_attributes.glsl"
#include "shared/vgi_place.glsl"

// Whether the visibility buffer tells of a leaf, or of a triangle that stands for many charts.
bool of_leaf(uvec4 visible) {
    return leaves_alone || ((kinds & LODE_VGI_KINDS_OF_LEAVES) != 0u && visible.y >> 28 == LODE_VGI_LEAF_LEVEL);
}
bool of_corners(uvec4 visible) { return (kinds & LODE_VGI_KIND_CORNERS) != 0u && visible.y >> 28 == LODE_VGI_CORNER_LEVEL; }

// Whether the visibility buffer holds a normal: of the source's triangles, or of what stands for many charts.
bool has_normal(uvec4 visible) {
    return (of_leaf(visible) || of_corners(visible)) && debug_view() != LODE_DEBUG_ERROR &&
           debug_view() != LODE_DEBUG_STRETCH && debug_view() != LODE_DEBUG_TRIANGLE && debug_view() != LODE_DEBUG_MISSES;
}

// How much four samples around a place of a leaf count, of `weight` by where it lies: the more, the more they face the way
// that the leaf does there. Across an edge of the source inside their cell is another side, and nothing in between.
//   Petschnigg, Szeliski, Agrawala, Cohen, Hoppe, Toyama, "Digital photography with flash and no-flash image pairs",
//   SIGGRAPH 2004: a bilateral filter that goes by another image, the joint one.
vec4 weight_of_side(vec4 weight, mat4x3 directions, vec3 facing) {
    vec4 kept;
    for (int k = 0; k < 4; ++k) {
        float alike = max(dot(normalize(directions[k]), facing), 0.0);
        kept[k] = weight[k] * alike * alike * alike * alike;
    }
    float sum = dot(kept, vec4(1.0));
    return sum > 1e-3 ? kept / sum : weight;
}

// Whether anything of a leaf is looked up in samples: its normal is its own, but for what maps of normals make of it.
const bool more_than_normals = (ever & LODE_VGI_MORE_THAN_NORMALS) != 0u;

// Texture coordinates of a leaf's triangle, as leaves hold them: samples know of seams only where they lie.
struct OwnUvs {
    bool there;
    vec2 at;
    float span;    // how they change to the next pixel, whichever way is least
    vec3 tangent;  // world space: which way the first grows along the surface, where the scene has maps of normals
    bool turned;   // whether the second grows to the right of it, seen from where the normal points
};
OwnUvs no_own_uvs() { return OwnUvs(false, vec2(0.0), 0.0, vec3(0.0), false); }
// As shaders/vgi/visible_uvs.frag writes them, and back: texture coordinates and their span as floats; the tangent,
// 15 bits to each of two octahedral coordinates, whether it is turned, whether there are any. Without a tangent: 0.
#define LODE_OWN_UVS_TURNED 0x40000000u
#define LODE_OWN_UVS_THERE 0x80000000u
uvec4 packed_uvs(OwnUvs own) {
    if (!own.there) return uvec4(0u);
    uint more = LODE_OWN_UVS_THERE | (own.turned ? LODE_OWN_UVS_TURNED : 0u);
    if (dot(own.tangent, own.tangent) > 0.0) {
        uvec2 at = uvec2(round(clamp(folded(normalize(own.tangent)) * 16383.0 + 16384.0, 1.0, 32767.0)));
        more |= at.x | at.y << 15;
    }
    return uvec4(floatBitsToUint(own.at), floatBitsToUint(own.span), more);
}
OwnUvs unpacked_uvs(uvec4 words) {
    uvec2 at = uvec2(words.w & 0x7fffu, words.w >> 15 & 0x7fffu);
    return OwnUvs((words.w & LODE_OWN_UVS_THERE) != 0u, uintBitsToFloat(words.xy), uintBitsToFloat(words.z),
                  at.x == 0u ? vec3(0.0) : unfolded((vec2(at) - 16384.0) / 16383.0),
                  (words.w & LODE_OWN_UVS_TURNED) != 0u);
}

// log2 of the samples of attributes that a pixel spans. told: as the visibility buffer has it. Where it is not told, on the
// average over the chart.
float fitting_level(uint told, uint chart, vec3 world, InstanceConstants instance, VgiAsset asset) {
    if (told != LODE_VGI_ANY_FIT) return float(int(told) - LODE_VGI_FIT_BELOW) / 8.0;
    return log2(pixel_at(world, instance.scale) / uintBitsToFloat(spacing_at(asset.first_chart + chart)));
}

// Four samples of attributes around a place of a chart (0 .. 1), of the finest level there is of those no finer than pixels.
struct AttributeCell {
    AttributeSample at[4];
    vec2 inside;           // the cell, 0 .. 1
    FoundPage page;
    int fit;               // the level wanted, if pages had as many
    uint wanted, small;    // of pages; then levels below the coarsest page
};
AttributeCell attribute_cell(vec2 place, uint chart, float lod, VgiAsset asset) {
    AttributeCell cell;
    uint attribute_cells = 1u << asset.attribute_cells, cells = min(attribute_cells, LODE_VGI_PAGE_CELLS);
    uint base = uint(findMSB(attribute_cells) - findMSB(cells));
    cell.fit = max(0, int(floor(lod)));
    cell.wanted = min(uint(cell.fit), base);
    cell.page = find_page(asset.first_attribute_page + chart * asset.attribute_pages, place, base, cell.wanted);
    // Coarser than the coarsest page: a small level.
    cell.small = uint(clamp(cell.fit - int(base), 0, findMSB(cells)));
    uint read_cells = cells >> cell.small;
    uint first = cell.small == 0u ? cell.page.slot * asset.attribute_page_words
                                  : attribute_words * (asset.first_mip_tail + chart * LODE_VGI_SMALL_FIRST(cells, uint(findMSB(cells)) + 1u) +
                                                       LODE_VGI_SMALL_FIRST(cells, cell.small));
    vec2 local = cell.page.place * float(read_cells);
    ivec2 low = min(ivec2(local), ivec2(int(read_cells) - 1));
    cell.inside = local - vec2(low);
    for (int k = 0; k < 4; ++k) {
        uvec2 p = uvec2(low) + uvec2(k & 1, k >> 1);
        if (in_blocks && cell.small == 0u) {
            cell.at[k] = sample_of_blocks(first, read_cells, p);
        } else {
            cell.at[k] = plain_sample(first, read_cells, p);
        }
    }
    return cell;
}

// visible: as shaders/vgi/visible.frag writes it. world: where that is.
Surface atlas_surface(uvec4 visible, OwnUvs own, vec4 world, InstanceConstants instance, VgiAsset asset) {
    uint chart = visible.y & LODE_VGI_CHART_MASK, told = visible.y >> LODE_VGI_FIT_SHIFT & 255u;
    vec2 place = unpackUnorm2x16(visible.x);
    bool is_leaf = of_leaf(visible);
    vec3 facing = has_normal(visible) ? unfolded(unpackSnorm2x16(visible.w)) : vec3(0.0);
    if (of_corners(visible)) {
        // What is drawn is up to the pixel error off. Of charts that lie over each other the eye sees the nearest to it: they are
        // looked for half a pixel nearer to it.
        vec3 to_eye = normalize(frame.views[draw_constants.view].eye.xyz - world.xyz);
        vec3 lifted = world.xyz + 0.5 * pixel_at(world.xyz, 1.0) * to_eye;
        float quarter_pixel = 0.25 * pixel_at(world.xyz, instance.scale) / asset.step;
        ChartPlace there = chart_at(lattice_of(lifted, instance, asset), facing, quarter_pixel, asset);
        chart = there.chart;
        place = there.place;
    }
    float lod = fitting_level(told, chart, world.xyz, instance, asset);
    uint has = asset.has & ever;
    // Where a pixel spans all of a chart there is no place to find in it.
    if (!is_leaf && lod < float(asset.attribute_cells)) place = surface_place(place, chart, world.xyz, lod, instance, asset);
    AttributeCell cell = attribute_cell(place, chart, lod, asset);
    AttributeSample at[4] = cell.at;
    vec2 f = cell.inside;
    vec4 weight = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    mat4x3 directions;
    for (int k = 0; k < 4; ++k) directions[k] = direction_at(at[k]);
    if (more_than_normals && is_leaf && has_normal(visible)) weight = weight_of_side(weight, directions, normalize(facing));
    int nearest = 0;
    for (int k = 1; k < 4; ++k) nearest = weight[k] > weight[nearest] ? k : nearest;

    vec3 normal = directions * weight;
    // What maps of normals make of a leaf's is in the samples alone.
    if (is_leaf && has_normal(visible) && (has & LODE_VGI_MAPPED_NORMALS) == 0u) normal = facing;
    Surface s;
    s.front = (visible.z & LODE_VGI_FROM_BEHIND) == 0u;
    s.position = world.xyz;
    s.normal = normalize(mat3(instance.normal_to_world) * normal);
    s.baked = (ever & LODE_VGI_BAKED) != 0u && (has & LODE_VGI_BAKED) != 0u;
    s.colour = vec4(1.0);
    if ((ever & LODE_VGI_HAS_COLOURS) != 0u && (has & LODE_VGI_HAS_COLOURS) != 0u) {
        s.colour = vec4(0.0);
        for (int k = 0; k < 4; ++k) {
            vec4 colour = colour_at(at[k], 1u + (asset.has & LODE_VGI_HAS_UVS));
            if (s.baked) colour.rgb = linear_from_srgb(colour.rgb);
            s.colour += weight[k] * colour;
        }
    }
    s.baked_surface = s.baked_emission = vec3(1.0);
    uint next = 1u + (asset.has & LODE_VGI_HAS_UVS) + ((asset.has & LODE_VGI_HAS_COLOURS) != 0u ? 1u : 0u);
    if ((ever & LODE_VGI_HAS_SURFACES) != 0u && (has & LODE_VGI_HAS_SURFACES) != 0u) {
        s.baked_surface = vec3(0.0);
        for (int k = 0; k < 4; ++k)
            s.baked_surface += weight[k] * surface_at(at[k], next);
        ++next;
    }
    if ((ever & LODE_VGI_HAS_EMISSIONS) != 0u && (has & LODE_VGI_HAS_EMISSIONS) != 0u) {
        s.baked_emission = vec3(0.0);
        for (int k = 0; k < 4; ++k)
            s.baked_emission += weight[k] * linear_from_srgb(emission_at(at[k], next));
    }
    s.material = instance.first_material;
    uvec4 materials = uvec4(0u);
    if ((ever & LODE_VGI_HAS_MATERIALS) != 0u && (has & LODE_VGI_HAS_MATERIALS) != 0u) {
        for (int k = 0; k < 4; ++k) materials[k] = material_at(at[k]);
        s.material += materials[nearest];
    }
    s.uv = s.second_uv = no_uvs();
    s.tangent = vec4(0.0);
    // Between materials a triangle's own would be looked up in the other's texture: the sample that is nearest tells both.
    if (leaves_have_uvs != 0u && own.there && (has & LODE_VGI_HAS_UVS) != 0u && materials == materials.xxxx) {
        s.uv = UvSet(own.at, vec2(own.span, 0.0), vec2(0.0, own.span), mat2x3(own.tangent, cross(s.normal, own.tangent) * (own.turned ? -1.0 : 1.0)));
    } else if ((ever & LODE_VGI_HAS_UVS) != 0u && (has & LODE_VGI_HAS_UVS) != 0u) {
        vec2 uvs[4];
        for (int k = 0; k < 4; ++k) {
            uint word = attributes_at(at[k].first + 1u);
            uvs[k] = vec2(float(word & 0xffffu), float(word >> 16));
        }
        // Along the cell's edges. Across a seam they are of quite unlike length, and there is nothing in between.
        vec4 edge = vec4(distance(uvs[0], uvs[1]), distance(uvs[2], uvs[3]), distance(uvs[0], uvs[2]), distance(uvs[1], uvs[3]));
        float shortest = min(min(edge.x, edge.y), min(edge.z, edge.w)), longest = max(max(edge.x, edge.y), max(edge.z, edge.w));
        bool torn = longest > 8.0 * shortest + 64.0;
        vec2 uv = torn ? uvs[nearest]
                      : weight.x * uvs[0] + weight.y * uvs[1] + weight.z * uvs[2] + weight.w * uvs[3];
        vec2 uv_step = vec2(asset.uv_step_x, asset.uv_step_y);
        // A pixel spans so much of a cell.
        float uv_span = shortest * exp2(lod - float(cell.page.level + cell.small)) * min(uv_step.x, uv_step.y);
        s.uv.dx = vec2(uv_span, 0.0);
        s.uv.dy = vec2(0.0, uv_span);
        s.uv.at = vec2(asset.uv_low_x, asset.uv_low_y) + uv_step * uv;
        if (scene_has(1u << LODE_TEXTURE_NORMAL) && !torn) {
            PositionPage page = position_page(place, chart, level_of_positions(cell.fit, asset), asset);
            SurfaceCell here = surface_cell(page.first, asset.page_cells, page.found.place * float(asset.page_cells), page.stride);
            mat3 to_world = mat3(instance.object_to_world);
            s.uv.along = along_of(to_world * here.along_x, to_world * here.along_y,
                                  uv_step * mix(uvs[1] - uvs[0], uvs[3] - uvs[2], f.y),
                                  uv_step * mix(uvs[2] - uvs[0], uvs[3] - uvs[1], f.x));
        }
    }
    s.level = is_leaf ? 0.0 : float(visible.y >> 28) / max(float(asset.attribute_cells), 1.0);
    s.leaf = is_leaf ? 1u : 0u;
    s.chart = chart + 1u;
    s.page = cell.page.slot + 1u;
    s.missing = float(cell.page.level - cell.wanted);
    s.error = s.stretch = uintBitsToFloat(visible.w);
    s.triangle = s.mark = visible.w;
    return s;
}

#endif
