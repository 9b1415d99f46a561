#version 460
#extension GL_GOOGLE_include_directive : require
// Third of the nine passes that make a grid cut on the device (src/vgi/study/device_cut.cpp records them, in Stage::update;
// the renderer puts a barrier between any two that share a buffer). They do what GridCut of src/vgi/study/grid_cut.cpp does.
//
//   pass    dispatches, D = greatest depth   one per            reads                    writes
//   clear   1, indirect                      entry, last frame  lists                    states: 0
//   roots   1                                chart              instances                roots to list 0; leaves, findings: 0
//   look    depth 0 .. D-1, indirect         entry of a list    parent's state           state (WANTED, views), parts to lists
//   close   depth D-1 .. 1, indirect         entry of a list    state                    WANTED of coarser nodes, those to lists
//   divide  depth 0 .. D, indirect           entry of a list    coarser states           state (DIVIDED), parts to lists, wishes
//   count   1, indirect                      node drawn         -                        counts of nodes, leaves[chart]
//   sum     1                                instance           leaves                   leaves[chart]: of charts before; records
//   emit    1, indirect                      node drawn         states, leaves           patches, findings
//
// Lists: one per depth, which is the levels between a node's atlas' coarsest and its own, and one of nodes that are drawn.
// Entries are numbers of states; a state's number tells the instance, for each has as many. Instances that no view sees are
// none of the device's business: the processor leaves them out. A node comes to the list of its depth when it first is more
// than nothing: as a root, as part of one that look goes on below, when close wants it and nobody had looked, as part of one
// that divide divides. LODE_NODE_LISTED says that it has, so it is there once, and the room for a list is as many nodes as
// there are at its depth. The list of what is drawn has room for the finest cut. So no list can overflow. Which order entries
// have depends on scheduling, and nothing else does: states are by node, and sum and emit number what is drawn.
// Who dispatches: whoever appends the first entry of a workgroup adds the group to its list's dispatch (append of
// nodes.glsl). Past LODE_CUT_MOST_GROUPS no more are added, and each takes further entries. A pass appends to lists of
// later dispatches alone.
// Who clears: clear, the states of nodes that the cut before had listed (before the first cut, all of them); the processor then
// uploads empty lists. So a frame that was cut short leaves nothing behind. roots zeroes findings, and leaves of charts it lists.
// Records are by instance, and those that draw something are the first ones: sum writes as many as did so or do now.
// Who counts: count adds each node that is drawn to leaves of its chart and to all nodes of at most node_top that it is part
// of. sum makes leaves the place where a chart's patches begin. emit adds, from a node upwards, what stands before it among the
// four parts of one: the order of patches is that of GridCut::draw. emit adds triangles of views[0] to findings[0]; sum adds
// patches of an instance to findings[1]. divide raises the wish of a page that is missing (findings, atomicMax on the bits of a
// positive float); emit marks the pages that are used.
// Sizes, of each instance (DeviceCutSizes), where atlases differ those of the largest: a state per node, as many entries for
// lists by depth; charts << 2 * node_top patches, and as many entries; a record per LODE_CUT_RECORD_PATCHES of them.
// When it ends: after 3 D + 5 dispatches. There is no queue, and no loop but over what a dispatch has no workgroups for. The
// processor reads findings back in a later frame: the pages used and missed, and two counts for statistics.
//
// This pass: nodes of a depth that some view sees and that have a wanted sample of the next finer level (GridCut::look_into).
#include "vgi/nodes.glsl"

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
            uvec2 texel = geometry_at(slot * LODE_VGI_PAGE_TEXELS(1u << page_shift) + (low.y + j * stride) * row + low.x + i * stride);
            vec3 p = mapped(lattice, vec3(float(texel.x & 0xffffu), float(texel.x >> 16), float(texel.y & 0xffffu)));
            precise float reach = reach_of(reaches, (texel.y >> 16) & 255u) + radius_of(reaches, texel.y >> 24);
            if (within(reach, p)) return true;
        }
    }
    return false;
}

void look_into(uint at) {
    Node n = node_of(at);
    if (int(n.level) <= cuts[instance].forced_level) return;
    uint state = states[at] | LODE_NODE_LOOKED, mask = cuts[instance].views;
    if (n.level < levels) mask = (states[state_of(up(n, n.level + 1u))] >> LODE_NODE_VIEWS_SHIFT) & 255u;
    mask = seen(n, mask);
    uint number = page_of(n, n.level - 1u), below = bounds[number].codes >> 16;
    bool forced = cuts[instance].forced_level >= 0, open = false;
    if (mask != 0u && (forced || may_be_wanted(bounds[number], below & 255u, below >> 8))) {
        if (forced || wants_division(n, number)) state |= LODE_NODE_WANTED;
        open = n.level > 1u && slot_of(number, n.level - 1u) != LODE_CUT_ABSENT;
    }
    states[at] = state | mask << LODE_NODE_VIEWS_SHIFT;
    for (uint k = 0u; open && k < parts_of(n); ++k) {
        uint part = state_of(part_of(n, k));
        states[part] = LODE_NODE_LISTED;
        append(depth_of(n) + 1u, part);
    }
}

void main() {
    LODE_EACH_ENTRY(at) look_into(at);
}
