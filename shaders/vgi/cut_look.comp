#version 460
#extension GL_GOOGLE_include_directive : require
// First of the six passes that make a grid cut on the device (src/vgi/study/device_cut.cpp records them, in Stage::update;
// the renderer puts a barrier between any two that share a buffer). They do what GridCut of src/vgi/study/grid_cut.cpp does.
//
//   pass    dispatches, L = coarsest level   one per      reads              writes
//   look    L, L-1, .. 1                     node         parent's state     state (WANTED, OPEN); clears findings
//   close   1, 2, .. L                       node         state              WANTED of coarser nodes (atomicOr)
//   divide  L, L-1, .. 0                     node         coarser states     state (DIVIDED, EXISTS, LEAF), wishes
//   count   1                                chart        states             leaves[chart]: nodes drawn
//   sum     1                                instance     leaves             leaves[chart]: those of the charts before
//   emit    1                                chart        states, leaves     patches, records, findings
//
// Who clears: nothing is cleared between frames. look overwrites the states of levels L .. 1, divide writes those of level 0
// without reading them. look zeroes findings[0], findings[1] and the two words of every page, each by the one node that covers
// the page; count overwrites every entry of leaves, emit every record.
// Who counts: count, the nodes with LODE_NODE_LEAF of a chart; sum makes that the place where the chart's patches begin, so
// the order does not depend on scheduling. emit adds triangles of views[0] to findings[0]; the workgroup of an
// instance's last chart adds its patches to findings[1] and writes its records. divide raises the wish of a page that is
// missing (findings, atomicMax on the bits of a positive float); emit marks the pages that are used.
// Sizes, of each instance (DeviceCutSizes): a state per node; charts << 2 * node_top patches, as many as the finest cut has, so
// no list can overflow; a record per LODE_CUT_RECORD_PATCHES of them. Records past the end draw 0 patches.
// When it ends: after 3 L + 4 dispatches. There is no loop and no queue. gl_WorkGroupID.y is the instance; where atlases differ
// in size, L is that of the largest, and invocations without a node or chart return. The processor reads findings back in a
// later frame: the pages used and missed, and two counts for statistics.
//
// This pass: nodes of a level that some view sees and that have a wanted sample of the next finer level (GridCut::look_into).
#include "shared/vgi_nodes.glsl"

bool within(float reach, vec3 p) {
    return lode_metric_within(reach, p.x, p.y, p.z, cuts[instance].ahead, cuts[instance].cosine, cuts[instance].sine_squared);
}

// As RefinementTest::may_be.
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
