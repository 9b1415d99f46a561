#version 460
#extension GL_GOOGLE_include_directive : require
// Sixth pass of a grid cut (cut_look.comp tells the protocol): how many of the nodes that are drawn each chart has, and each
// node that has others beside it.
#include "vgi/nodes.glsl"

void count(uint at) {
    Node n = node_of(at);
    atomicAdd(leaves[cuts[instance].first_leaf + n.chart], 1u);
    for (; n.level < node_top; n = up(n, n.level + 1u)) atomicAdd(states[state_of(n)], 1u << LODE_NODE_COUNT_SHIFT);
}

void main() {
    LODE_EACH_ENTRY(at) count(at);
}
