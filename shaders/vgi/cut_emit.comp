#version 460
#extension GL_GOOGLE_include_directive : require
// Last pass of a grid cut (cut_look.comp tells the protocol): a patch for every node that is drawn, in the order in which
// GridCut::draw comes to them whichever invocation comes first.
#include "vgi/nodes.glsl"

layout(set = 1, binding = LODE_VGI_PATCHES, std430) writeonly buffer VgiPatchBlock { uint patch_words[]; };

// Levels that the node across a side is coarser; 0 where nothing of it is drawn.
uint coarser_across(Node n, uint side) {
    Node other = across(n, side);
    if (other.chart == LODE_CUT_ABSENT) return 0u;
    while ((states[state_of(other)] & LODE_NODE_EXISTS) == 0u) other = up(other, other.level + 1u);
    bool drawn = ((states[state_of(other)] >> LODE_NODE_VIEWS_SHIFT) & 255u) != 0u;
    return drawn ? other.level - n.level : 0u;
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

// Where among the patches of its instance a node stands: after those of charts before, and, upwards from the node, after
// those of parts before it.
uint place_of(Node n) {
    uint place = leaves[cuts[instance].first_leaf + n.chart];
    for (; n.level < node_top; n = up(n, n.level + 1u)) {
        uint own = (n.x & 1u) + 2u * (n.y & 1u);
        for (uint k = 0u; k < own; ++k) {
            Node before = Node(n.level, n.chart, (n.x & ~1u) + (k & 1u), (n.y & ~1u) + (k >> 1));
            place += states[state_of(before)] >> LODE_NODE_COUNT_SHIFT;
        }
    }
    return place;
}

void main() {
    LODE_EACH_ENTRY(at) {
        Node n = node_of(at);
        uint to = cuts[instance].first_patch + place_of(n) * LODE_VGI_PATCH_WORDS;
        write_patch(n, (states[at] >> LODE_NODE_VIEWS_SHIFT) & 255u, to);
    }
}
