#version 460
#extension GL_GOOGLE_include_directive : require
// A grid cut on the device, first: the nodes of a level that some view sees and that have a wanted sample of the next
// finer level (GridCut::look_into of vgi/grid_cut.cpp). Levels from the coarsest to the finest, a dispatch each.
#include "shared/vgi_nodes.glsl"

// As Wanted::may_be.
bool may_be_wanted(VgiCutPage page, uint error, uint radius) {
    vec3 p = from_object(vec3(page.centre_x, page.centre_y, page.centre_z));
    precise float sphere = page.radius * cuts[instance].scale;
    precise float reach = reach_of(error) + radius_of(radius) + sphere;
    return reach_of(error) > 0.0 && lode_within(reach, p.x, p.y, p.z);
}

// As GridCut::wants_division.
bool wants_division(Node n, uint number) {
    VgiCutPage page = bounds[number];
    if (!may_be_wanted(page, page.codes & 255u, (page.codes >> 8) & 255u)) return false;
    uint slot = page_slots[number];
    if (slot == LODE_CUT_ABSENT) return true;
    uint level = n.level - 1u, page_level = min(level, base_level), stride = 1u << (level - page_level);
    uint down = page_level + page_shift, size = size_shift(n.level);
    uvec2 first = uvec2(n.x, n.y) << size;
    uvec2 low = (first - (first >> down << down)) >> page_level;
    uint row = (1u << page_shift) + 1u, count = 2u << cell_shift(n.level);
    for (uint j = 0u; j <= count; ++j) {
        for (uint i = 1u - (j & 1u); i <= count; i += 2u - (j & 1u)) {
            uvec2 texel = geometry_at(slot * LODE_VGI_PAGE_TEXELS + (low.y + j * stride) * row + low.x + i * stride);
            vec3 p = from_lattice(vec3(float(texel.x & 0xffffu), float(texel.x >> 16), float(texel.y & 0xffffu)));
            precise float reach = reach_of((texel.y >> 16) & 255u) + radius_of(texel.y >> 24);
            if (lode_within(reach, p.x, p.y, p.z)) return true;
        }
    }
    return false;
}

void main() {
    if (!begin_chart()) return;
    uint level = draw_constants.words[LODE_CUT_WORD_LEVEL];
    Node n;
    if (level == levels) {
        // Here the frame begins for the chart: nothing of its pages is used or wished for yet.
        uint first = LODE_CUT_FIRST_FINDING + 2u * (cuts[instance].first_page + gl_WorkGroupID.z * cuts[instance].pages);
        for (uint i = gl_LocalInvocationID.x; i < 2u * cuts[instance].pages; i += LODE_CUT_GROUP) findings[first + i] = 0u;
        if (gl_GlobalInvocationID.x == 0u && gl_WorkGroupID.yz == uvec2(0u)) findings[0] = findings[1] = 0u;
    }
    if (!own_node(level, n)) return;
    bool open = true;
    uint mask = cuts[instance].views, state = 0u;
    if (level < levels) {
        uint parent = states[state_of(up(n, level + 1u))];
        open = (parent & LODE_NODE_OPEN) != 0u;
        mask = (parent >> LODE_NODE_LOOKED_SHIFT) & 255u;
    }
    if (open && level > 0u && int(level) > cuts[instance].forced_level) {
        mask = seen(n, mask);
        uint number = page_of(n, level - 1u), below = bounds[number].codes >> 16;
        bool forced = cuts[instance].forced_level >= 0;
        if (mask != 0u && (forced || may_be_wanted(bounds[number], below & 255u, below >> 8))) {
            if (forced || wants_division(n, number)) state |= LODE_NODE_WANTED;
            if (page_slots[number] != LODE_CUT_ABSENT) state |= LODE_NODE_OPEN;
        }
        state |= mask << LODE_NODE_LOOKED_SHIFT;
    }
    states[state_of(n)] = state;
}
