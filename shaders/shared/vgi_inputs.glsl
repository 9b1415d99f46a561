// What fragments of virtual geometry images know, from what shared/vgi_vertex.glsl passes on.
#ifndef LODESTONE_VGI_INPUTS_GLSL
#define LODESTONE_VGI_INPUTS_GLSL

#include "shared/vgi_surface.glsl"

layout(location = 0) in vec3 in_place_and_measure;
layout(location = 1) flat in uvec3 in_numbers;
layout(location = 2) in vec3 in_normal;
layout(location = 3) in vec2 in_uv;  // of leaves, where they have some

uint level_here() { return in_numbers.y & 15u; }

// Of a map that takes pixels to a plane the two singular values, the lesser first: how much it changes to the next pixel as
// if the surface faced the eye, and as it is seen.
vec2 spans_of(vec2 dx, vec2 dy) {
    float both = dot(dx, dx) + dot(dy, dy), area = abs(dx.x * dy.y - dx.y * dy.x);
    float greater = 0.5 * (sqrt(both + 2.0 * area) + sqrt(max(both - 2.0 * area, 0.0)));
    return vec2(area / max(greater, 1e-30), greater);
}

// Whether anything is looked up at a place of the atlas.
const bool looks_up = !leaves_alone || more_than_normals || shows_debug_views;

// LODE_VGI_ANY_FIT where the place in the chart does not tell: of triangles that stand for many charts, of lines, and of
// triangles seen from the edge.
uint fit_here() {
    if (!looks_up) return LODE_VGI_ANY_FIT;
    vec2 spans = float(1u << (in_numbers.y >> 4)) * spans_of(dFdx(in_place_and_measure.xy), dFdy(in_place_and_measure.xy));
    if (level_here() == LODE_VGI_CORNER_LEVEL || !(spans.x > 1e-3 * spans.y)) return LODE_VGI_ANY_FIT;
    return min(uint(clamp(8.0 * log2(spans.x) + float(LODE_VGI_FIT_BELOW), 0.0, 254.0)), LODE_VGI_ANY_FIT - 1u);
}

bool front_here() { return gl_FrontFacing != (instance_at(in_numbers.z).mirrored != 0u); }

vec4 world_here() {
    ViewConstants view = frame.views[draw_constants.view];
    vec2 size = vec2(view.target_width, view.target_height);
    vec4 world = view.clip_to_world * vec4(gl_FragCoord.xy / size * 2.0 - 1.0, gl_FragCoord.z, 1.0);
    return world / world.w;
}

// Which way the triangle here faces, object space. What its corners' normals say is of the surface around them: where the
// walls of something hollow are one, of either.
vec3 facing_here() {
    vec3 world = world_here().xyz, right = dFdx(world), down = dFdy(world);
    InstanceConstants instance = instance_at(in_numbers.z);
    vec3 to_eye = cross(down / max(length(down), 1e-30), right / max(length(right), 1e-30));
    vec3 facing = transpose(mat3(instance.object_to_world)) * (front_here() ? to_eye : -to_eye);
    return dot(facing, facing) > 0.0 ? normalize(facing) : vec3(0.0, 0.0, 1.0);
}

// Place in the chart, 16 bits each way; chart | what fits << LODE_VGI_FIT_SHIFT | level << 28; instance, with LODE_VGI_FROM_BEHIND where
// both sides are shown; what the debug view asks for, or the normal of triangles of LODE_VGI_LEAF_LEVEL, or which way those of LODE_VGI_CORNER_LEVEL face.
uvec4 visible_here() {
    uint more = (kinds & LODE_VGI_KINDS_OF_LEAVES) != 0u && level_here() == LODE_VGI_LEAF_LEVEL ? packSnorm2x16(folded(in_normal)) : 0u;
    if ((kinds & LODE_VGI_KIND_CORNERS) != 0u && level_here() == LODE_VGI_CORNER_LEVEL) more = packSnorm2x16(folded(facing_here()));
    if (debug_view() == LODE_DEBUG_ERROR || debug_view() == LODE_DEBUG_STRETCH)
        more = floatBitsToUint(in_place_and_measure.z);
    if (debug_view() == LODE_DEBUG_TRIANGLE) more = uint(gl_PrimitiveID);
    if (debug_view() == LODE_DEBUG_MISSES) more = LODE_MARK_OF_PRIMITIVE;
    uint side = (shows_both_sides() || fragments_have_sides()) && !front_here() ? LODE_VGI_FROM_BEHIND : 0u;
    uint place = looks_up ? packUnorm2x16(in_place_and_measure.xy) : 0u;
    return uvec4(place, in_numbers.x | fit_here() << LODE_VGI_FIT_SHIFT | level_here() << 28, in_numbers.z | side, more);
}

// The texture coordinates of a leaf here; of what is no leaf there are none.
OwnUvs own_uvs_here() {
    OwnUvs own = no_own_uvs();
    if (leaves_have_uvs == 0u) return own;
    vec2 dx = dFdx(in_uv), dy = dFdy(in_uv);
    own.at = in_uv;
    own.span = spans_of(dx, dy).x;
    if (scene_has(1u << LODE_TEXTURE_NORMAL)) {
        vec3 world = world_here().xyz;
        mat2x3 along = along_of(dFdx(world), dFdy(world), dx, dy);
        own.tangent = along[0];
        // Which side the second is on, seen from where the normal points.
        own.turned = dot(cross(along[0], along[1]), mat3(instance_at(in_numbers.z).normal_to_world) * in_normal) < 0.0;
    }
    own.there = level_here() == LODE_VGI_LEAF_LEVEL;
    return own;
}

// What is seen here as a surface.
Surface surface_here(uvec4 visible, OwnUvs own) {
    InstanceConstants instance = instance_at(in_numbers.z);
    return atlas_surface(visible, own, world_here(), instance, asset_at(instance.asset));
}

// The material here: of the sample nearest to what was drawn, which is up to the pixel error off.
uint material_here(uvec4 visible) {
    InstanceConstants instance = instance_at(in_numbers.z);
    VgiAsset asset = asset_at(instance.asset);
    if ((asset.has & ever & LODE_VGI_HAS_MATERIALS) == 0u) return instance.first_material;
    float lod = fitting_level(visible.y >> LODE_VGI_FIT_SHIFT & 255u, in_numbers.x, world_here().xyz, instance, asset);
    AttributeCell cell = attribute_cell(in_place_and_measure.xy, in_numbers.x, lod, asset);
    return instance.first_material + material_at(cell.at[(cell.inside.x < 0.5 ? 0 : 1) + (cell.inside.y < 0.5 ? 0 : 2)]);
}

// Whether the pass draws what is here. Software rasterisers run every branch: where materials differ by their sides alone,
// nothing else is looked up.
bool is_drawn_here(uvec4 visible, OwnUvs own) {
    if (!may_be_absent(front_here())) return true;
    if (scene_has(LODE_LOOKS_MASK | LODE_LOOKS_BLEND)) return is_drawn(look_of(surface_here(visible, own)));
    return is_side_drawn(material_is_two_sided(material_here(visible)), false);
}

#endif
