// Nodes of a grid cut, as cut_grid (vgi/study/grid_cut.h) numbers and tests them, for the passes that make one on the device.
// Passes over lists take an entry by invocation (LODE_EACH_ENTRY); node_of makes the entry's instance the one that is cut.
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
layout(set = 1, binding = LODE_CUT_LISTS, std430) buffer CutListBlock { VgiCutList lists[]; };
layout(set = 1, binding = LODE_CUT_ENTRIES, std430) buffer CutEntryBlock { uint entries[]; };
layout(set = 1, binding = LODE_CUT_LEAVES, std430) buffer CutLeafBlock { uint leaves[]; };
layout(set = 1, binding = LODE_CUT_RECORDS, std430) buffer CutRecordBlock { uint records[]; };
layout(set = 1, binding = LODE_CUT_FINDINGS, std430) buffer CutFindingBlock { uint findings[]; };

struct Node {
    uint level, chart, x, y;  // as in grid_cut.cpp; chart LODE_CUT_ABSENT where the surface ends
};

layout(constant_id = LODE_CUT_SLOT_STATES) const uint slot_states = 1u;
layout(constant_id = LODE_CUT_SLOT_RECORDS) const uint slot_records = 1u;

uint instance;  // that is cut: begin and node_of set it

// Of its charts, as NodeTree has them.
uint levels, node_top, page_shift, base_level;

void begin(uint of) {
    instance = of;
    VgiAsset asset = asset_at(cuts[instance].asset);
    levels = uint(findMSB(asset.cells));
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
uint parts_of(Node n) { return n.level - 1u < node_top ? 4u : 1u; }
// k: 0 .. parts_of - 1
Node part_of(Node n, uint k) {
    uint more = n.level - 1u < node_top ? 1u : 0u;
    return Node(n.level - 1u, n.chart, (n.x << more) + (k & more), (n.y << more) + (k >> 1u));
}
// The node whose state has this number; from then on `instance` is its.
Node node_of(uint state) {
    begin(state / slot_states);
    uint place = state - cuts[instance].first_state, nodes = nodes_per_chart(), chart = place / nodes;
    uint number = place - chart * nodes;
    if (number < levels - node_top) return Node(levels - number, chart, 0u, 0u);
    uint within = number - (levels - node_top), shift = uint(findMSB(3u * within + 1u)) / 2u;
    uint at = within - ((1u << (2u * shift)) - 1u) / 3u;
    return Node(node_top - shift, chart, at & ((1u << shift) - 1u), at >> shift);
}
uint depth_of(Node n) { return levels - n.level; }

// For each entry of the dispatch's list that is this invocation's: mostly one. A pass appends nothing to its own list.
#define LODE_EACH_ENTRY(at)                                                                                     \
    for (uint list = draw_constants.words[LODE_CUT_WORD_LIST], i = gl_GlobalInvocationID.x, at;                 \
         i < lists[list].entries && (at = entries[lists[list].first + i]) != LODE_CUT_ABSENT;                   \
         i += gl_NumWorkGroups.x * LODE_CUT_GROUP)

// Workgroups for so many entries.
uint groups_for(uint count) { return (count + LODE_CUT_GROUP - 1u) / LODE_CUT_GROUP; }
// Dispatches over a list take so many workgroups more; past the most that a row may have, each goes on with other entries.
void raise_groups(uint list, uint before, uint now) {
    now = min(now, LODE_CUT_MOST_GROUPS);
    if (now > before) atomicAdd(lists[list].groups_x, now - before);
}
// A node to the end of a list.
void append(uint list, uint state) {
    uint at = atomicAdd(lists[list].entries, 1u);
    entries[lists[list].first + at] = state;
    if (at % LODE_CUT_GROUP != 0u) return;
    raise_groups(list, groups_for(at), groups_for(at) + 1u);
    if (list >= LODE_CUT_DEPTHS) return;
    uint all = atomicAdd(lists[LODE_CUT_ALL].entries, 1u);
    raise_groups(LODE_CUT_ALL, all, all + 1u);
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
    if (mask == 0u) return 0u;
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
