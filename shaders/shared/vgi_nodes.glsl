// Nodes of a grid cut, as cut_grid (vgi/study/grid_cut.h) numbers and tests them, for the passes that make one on the device.
// gl_WorkGroupID.y is the instance. Passes over nodes go by invocation (own_node), those over charts by workgroup.
#ifndef LODESTONE_VGI_NODES_GLSL
#define LODESTONE_VGI_NODES_GLSL

#include "shared/draw_constants.h"
#include "shared/texels.glsl"
#include "shared/vgi_cut.h"
#include "shared/vgi_assets.glsl"

layout(local_size_x = LODE_CUT_GROUP) in;

LODE_POOL(LODE_VGI_GEOMETRY, geometry, uvec2, 2)
LODE_TEXELS(LODE_VGI_CODES, code, uint)
LODE_TEXELS(LODE_VGI_TABLE, page, uint)
layout(set = 1, binding = LODE_CUT_INSTANCES, std430) readonly buffer CutInstanceBlock { VgiCutInstance cuts[]; };
layout(set = 1, binding = LODE_CUT_BOUNDS, std430) readonly buffer CutPageBlock { VgiCutPage bounds[]; };
layout(set = 1, binding = LODE_CUT_SIDES, std430) readonly buffer CutSideBlock { uint sides[]; };
layout(set = 1, binding = LODE_CUT_STATES, std430) buffer CutStateBlock { uint states[]; };
layout(set = 1, binding = LODE_CUT_LEAVES, std430) buffer CutLeafBlock { uint leaves[]; };
layout(set = 1, binding = LODE_CUT_RECORDS, std430) writeonly buffer CutRecordBlock { uint records[]; };
layout(set = 1, binding = LODE_CUT_FINDINGS, std430) buffer CutFindingBlock { uint findings[]; };

struct Node {
    uint level, chart, x, y;  // as in grid_cut.cpp; chart LODE_CUT_ABSENT where the surface ends
};

uint instance = gl_WorkGroupID.y;  // that is cut

// Of its charts, as NodeTree has them.
uint levels, node_top, page_shift, base_level;

void begin() {
    VgiAsset asset = asset_at(cuts[instance].asset);
    levels = asset.levels - 1u;
    node_top = levels > 3u ? levels - 3u : 0u;
    page_shift = uint(findMSB(asset.page_cells));
    base_level = levels - page_shift;
}

uint nodes_per_chart() { return levels - node_top + ((1u << (2u * node_top + 2u)) - 1u) / 3u; }
uint side_shift(uint level) { return level < node_top ? node_top - level : 0u; }
uint cell_shift(uint level) { return min(3u, levels - level); }
uint size_shift(uint level) { return level + cell_shift(level); }
uint state_of(Node n) {
    uint shift = side_shift(n.level);
    uint number = n.level > node_top ? levels - n.level
                                     : levels - node_top + ((1u << (2u * shift)) - 1u) / 3u + (n.y << shift) + n.x;
    return cuts[instance].first_state + n.chart * nodes_per_chart() + number;
}
Node up(Node n, uint level) {
    uint shift = side_shift(n.level) - side_shift(level);
    return Node(level, n.chart, n.x >> shift, n.y >> shift);
}
uint own_group() { return gl_WorkGroupID.z * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
// The node of the dispatch's level that this invocation works on, nodes of a chart in a row; false where there is none.
bool own_node(out Node n) {
    uint level = draw_constants.words[LODE_CUT_WORD_LEVEL], shift = side_shift(level);
    uint id = own_group() * LODE_CUT_GROUP + gl_LocalInvocationID.x;
    n = Node(level, id >> (2u * shift), id & ((1u << shift) - 1u), (id >> shift) & ((1u << shift) - 1u));
    return level <= levels && n.chart < cuts[instance].charts;
}
// As Atlas::across.
Node across(Node n, uint side) {
    uint last = (1u << side_shift(n.level)) - 1u;
    bool inside = side == 0u ? n.y > 0u : side == 1u ? n.x < last : side == 2u ? n.y < last : n.x > 0u;
    if (inside) {
        return Node(n.level, n.chart, side == 1u ? n.x + 1u : side == 3u ? n.x - 1u : n.x,
                    side == 2u ? n.y + 1u : side == 0u ? n.y - 1u : n.y);
    }
    uint other = sides[(cuts[instance].first_chart + n.chart) * 4u + side];
    if (other == LODE_CUT_ABSENT) return Node(n.level, LODE_CUT_ABSENT, 0u, 0u);
    uint along = side == 0u ? n.x : side == 1u ? n.y : side == 2u ? last - n.x : last - n.y;
    uint from = last - along, to_side = other >> 30, chart = other & 0x3fffffffu;
    if (to_side == 0u) return Node(n.level, chart, from, 0u);
    if (to_side == 1u) return Node(n.level, chart, last, from);
    if (to_side == 2u) return Node(n.level, chart, last - from, last);
    return Node(n.level, chart, 0u, last - from);
}
// What has to be divided for a node to be: the nodes it is part of, and what would be too coarse beside its parts.
// k: 0 .. 4; false where there is no such node.
bool needed_for(Node n, uint k, out Node needed) {
    if (k == 0u) {
        needed = n.level < levels ? up(n, n.level + 1u) : n;
        return n.level < levels;
    }
    needed = across(n, k - 1u);
    uint coarse = n.level + 3u;
    if (coarse > levels || needed.chart == LODE_CUT_ABSENT) return false;
    needed = up(needed, coarse);
    return true;
}
// The page of a level, or of the coarsest, that holds the node's lowest corner's part; of all pages of positions.
uint page_of(Node n, uint level) {
    level = min(level, base_level);
    uint down = level + page_shift, size = size_shift(n.level), shift = base_level - level;
    uint page = ((1u << (2u * shift)) - 1u) / 3u + ((n.y << size) >> down << shift) + ((n.x << size) >> down);
    return cuts[instance].first_page + n.chart * cuts[instance].pages + page;
}
// Of that page; LODE_CUT_ABSENT where it is not there.
uint slot_of(uint number, uint level) {
    uint entry = page_at(number);
    return (entry & 15u) == min(level, base_level) ? entry >> 4 : LODE_CUT_ABSENT;
}

// As Visibility::seen.
uint seen(Node n, uint mask) {
    VgiCutPage page = bounds[page_of(n, n.level > 2u ? n.level - 2u : 0u)];
    for (uint rest = mask; rest != 0u; rest &= rest - 1u) {
        uint v = uint(findLSB(rest));
        for (uint k = 0u; k < 6u; ++k) {
            uint at = (v * 6u + k) * 4u;
            if (lode_outside(cuts[instance].planes[at], cuts[instance].planes[at + 1u], cuts[instance].planes[at + 2u],
                             cuts[instance].planes[at + 3u], page.centre_x, page.centre_y, page.centre_z, page.radius))
                mask &= ~(1u << v);
        }
    }
    if ((mask & 1u) != 0u && cuts[instance].cones != 0u && page.cosine > 0.0 &&
        lode_turned_away(page.axis_x, page.axis_y, page.axis_z, page.cosine, page.sine_squared,
                         page.centre_x - cuts[instance].eye_x, page.centre_y - cuts[instance].eye_y,
                         page.centre_z - cuts[instance].eye_z, page.radius))
        mask &= ~1u;
    return mask;
}

// An affine map's columns, and where a point goes, as lode_metric_within takes it.
struct SeenFromEye {
    vec3 x, y, z, offset;
};
SeenFromEye of_lattice() {
    float m[12] = cuts[instance].lattice;
    return SeenFromEye(vec3(m[0], m[1], m[2]), vec3(m[3], m[4], m[5]), vec3(m[6], m[7], m[8]), vec3(m[9], m[10], m[11]));
}
SeenFromEye of_object() {
    float m[12] = cuts[instance].object;
    return SeenFromEye(vec3(m[0], m[1], m[2]), vec3(m[3], m[4], m[5]), vec3(m[6], m[7], m[8]), vec3(m[9], m[10], m[11]));
}
vec3 mapped(SeenFromEye map, vec3 p) {
    return vec3(lode_mapped(map.offset.x, map.x.x, map.y.x, map.z.x, p.x, p.y, p.z),
                lode_mapped(map.offset.y, map.x.y, map.y.y, map.z.y, p.x, p.y, p.z),
                lode_mapped(map.offset.z, map.x.z, map.y.z, map.z.z, p.x, p.y, p.z));
}

// What codes of errors and radii say.
struct Reaches {
    uint first;  // code
    float magnification, scale;
};
Reaches own_reaches() {
    return Reaches(cuts[instance].asset * 512u, cuts[instance].magnification, cuts[instance].scale);
}
float reach_of(Reaches r, uint code) {
    return lode_reach(uintBitsToFloat(code_at(r.first + code)), r.magnification, r.scale, 0.0);
}
float radius_of(Reaches r, uint code) {
    precise float radius = uintBitsToFloat(code_at(r.first + 256u + code)) * r.scale;
    return radius;
}

#endif
