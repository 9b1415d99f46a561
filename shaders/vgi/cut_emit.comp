#version 460
#extension GL_GOOGLE_include_directive : require
// Last pass of a grid cut (cut_look.comp tells the protocol): a patch for every node that is drawn, chart after chart and in
// order of the nodes' numbers whichever invocation comes first, and the draws of all of them (GridCut::draw).
#include "shared/vgi_nodes.glsl"

layout(set = 1, binding = LODE_VGI_PATCHES, std430) writeonly buffer VgiPatchBlock { uint patch_words[]; };

shared uint counts[LODE_CUT_GROUP];

// Levels that the node across a side is coarser; 0 where nothing of it is drawn.
uint coarser_across(Node n, uint side) {
    Node other = across(n, side);
    if (other.chart == LODE_CUT_ABSENT) return 0u;
    while ((states[state_of(other)] & LODE_NODE_EXISTS) == 0u) other = up(other, other.level + 1u);
    bool drawn = ((states[state_of(other)] >> LODE_NODE_SEEN_SHIFT) & 255u) != 0u;
    return drawn ? other.level - n.level : 0u;
}

Node node_of(uint chart, uint number) {
    if (number < levels - node_top) return Node(levels - number, chart, 0u, 0u);
    uint within = number - (levels - node_top), shift = uint(findMSB(3u * within + 1u)) / 2u;
    uint place = within - ((1u << (2u * shift)) - 1u) / 3u;
    return Node(node_top - shift, chart, place & ((1u << shift) - 1u), place >> shift);
}

void write_patch(Node n, uint mask, uint to) {
    uint cells = 1u << cell_shift(n.level), shape = n.level | cell_shift(n.level) << 4 | mask << LODE_VGI_PATCH_VIEWS;
    uint triangles = 2u * cells * cells;
    for (uint side = 0u; side < 4u; ++side) {
        uint coarser = coarser_across(n, side);
        shape |= coarser << (8u + 2u * side);
        triangles -= cells - (cells >> coarser);
    }
    if ((mask & 1u) != 0u) atomicAdd(findings[0], triangles);
    patch_words[to] = shape;
    patch_words[to + 1u] = n.x << size_shift(n.level) | n.y << (size_shift(n.level) + 16u);
    uint lowest = min(n.level, base_level);
    for (uint k = 0u; k < LODE_VGI_PATCH_SLOTS; ++k) {
        uint slot = 0u;
        if (lowest + k <= base_level) {
            uint number = page_of(n, lowest + k);
            slot = slot_of(number, lowest + k);
            findings[LODE_CUT_FIRST_FINDING + 2u * number] = 1u;
        }
        patch_words[to + 2u + k] = slot;
    }
}

void main() {
    begin();
    uint chart = own_group();
    if (chart >= cuts[instance].charts) return;
    uint lane = gl_LocalInvocationID.x;
    uint before = leaves[cuts[instance].first_leaf + chart];  // nodes of the charts before
    // A run of nodes each, and where in the list they begin.
    uint nodes = nodes_per_chart(), first = cuts[instance].first_state + chart * nodes;
    uint run = (nodes + LODE_CUT_GROUP - 1u) / LODE_CUT_GROUP, begin = min(lane * run, nodes), end = min(begin + run, nodes);
    uint mine = 0u;
    for (uint i = begin; i < end; ++i) mine += (states[first + i] & LODE_NODE_LEAF) != 0u ? 1u : 0u;
    counts[lane] = mine;
    barrier();
    uint to = before;
    for (uint i = 0u; i < lane; ++i) to += counts[i];
    for (uint i = begin; i < end; ++i) {
        uint state = states[first + i];
        if ((state & LODE_NODE_LEAF) == 0u) continue;
        write_patch(node_of(chart, i), (state >> LODE_NODE_SEEN_SHIFT) & 255u, cuts[instance].first_patch + to * LODE_VGI_PATCH_WORDS);
        ++to;
    }
    if (chart + 1u < cuts[instance].charts) return;
    uint total = before;
    for (uint i = 0u; i < LODE_CUT_GROUP; ++i) total += counts[i];
    if (lane == 0u) atomicAdd(findings[1], total);
    for (uint r = lane; r < cuts[instance].records; r += LODE_CUT_GROUP) {
        uint done = r * LODE_CUT_RECORD_PATCHES, at = (cuts[instance].first_record + r) * LODE_CUT_RECORD_WORDS;
        records[at] = clamp(int(total) - int(done), 0, LODE_CUT_RECORD_PATCHES);
        records[at + 1u] = 1u;
        records[at + 2u] = done;
        records[at + 3u] = cuts[instance].first_id;
    }
}
