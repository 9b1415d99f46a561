#version 460
#extension GL_GOOGLE_include_directive : require
// A grid cut on the device, first: the nodes of a level that some view sees and that have a wanted sample of the next
// finer level (GridCut::look_into of vgi/grid_cut.cpp). Levels from the coarsest to level 1, a dispatch each.
#include "shared/vgi_nodes.glsl"

bool within(float reach, vec3 p) {
    return lode_metric_within(reach, p.x, p.y, p.z, cuts[instance].ahead, cuts[instance].cosine, cuts[instance].sine_squared);
}

// As Wanted::may_be.
bool may_be_wanted(VgiCutPage page, uint error, uint radius) {
    Reaches reaches = own_reaches();
    vec3 p = mapped(of_object(), vec3(page.centre_x, page.centre_y, page.centre_z));
    float of_error = reach_of(reaches, error);
    precise float sphere = page.radius * reaches.scale;
    precise float reach = of_error + radius_of(reaches, radius) + sphere;
    return of_error > 0.0 && within(reach, p);
}

// As GridCut::wants_division.
bool wants_division(Node n, uint number) {
    VgiCutPage page = bounds[number];
    if (!may_be_wanted(page, page.codes & 255u, (page.codes >> 8) & 255u)) return false;
    uint slot = slot_of(number, n.level - 1u);
    if (slot == LODE_CUT_ABSENT) return true;
    uint level = n.level - 1u, page_level = min(level, base_level), stride = 1u << (level - page_level);
    uint down = page_level + page_shift, size = size_shift(n.level);
    uvec2 first = uvec2(n.x, n.y) << size;
    uvec2 low = (first - (first >> down << down)) >> page_level;
    uint row = (1u << page_shift) + 1u, count = 2u << cell_shift(n.level);
    Reaches reaches = own_reaches();
    SeenFromEye lattice = of_lattice();
    for (uint j = 0u; j <= count; ++j) {
        for (uint i = 1u - (j & 1u); i <= count; i += 2u - (j & 1u)) {
            uvec2 texel = geometry_at(slot * LODE_VGI_PAGE_TEXELS + (low.y + j * stride) * row + low.x + i * stride);
            vec3 p = mapped(lattice, vec3(float(texel.x & 0xffffu), float(texel.x >> 16), float(texel.y & 0xffffu)));
            precise float reach = reach_of(reaches, (texel.y >> 16) & 255u) + radius_of(reaches, texel.y >> 24);
            if (within(reach, p)) return true;
        }
    }
    return false;
}

void main() {
    begin();
    Node n;
    if (!own_node(n)) return;
    uint level = n.level;
    // Here the frame begins for each page, by the one node that covers as much: it is neither used nor wished for yet.
    if (level == levels || (level >= 2u && level < base_level + 2u)) {
        uint at = LODE_CUT_FIRST_FINDING + 2u * page_of(n, level == levels ? base_level : level - 2u);
        findings[at] = findings[at + 1u] = 0u;
    }
    if (level == levels && n.chart == 0u && instance == 0u) findings[0] = findings[1] = 0u;
    bool open = true;
    uint mask = cuts[instance].views, state = 0u;
    if (level < levels) {
        uint parent = states[state_of(up(n, level + 1u))];
        open = (parent & LODE_NODE_OPEN) != 0u;
        mask = (parent >> LODE_NODE_LOOKED_SHIFT) & 255u;
    }
    if (open && int(level) > cuts[instance].forced_level) {
        mask = seen(n, mask);
        uint number = page_of(n, level - 1u), below = bounds[number].codes >> 16;
        bool forced = cuts[instance].forced_level >= 0;
        if (mask != 0u && (forced || may_be_wanted(bounds[number], below & 255u, below >> 8))) {
            if (forced || wants_division(n, number)) state |= LODE_NODE_WANTED;
            if (slot_of(number, level - 1u) != LODE_CUT_ABSENT) state |= LODE_NODE_OPEN;
        }
        state |= mask << LODE_NODE_LOOKED_SHIFT;
    }
    states[state_of(n)] = state;
}
