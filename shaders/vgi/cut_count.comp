#version 460
#extension GL_GOOGLE_include_directive : require
// Fourth pass of a grid cut (cut_look.comp tells the protocol): how many nodes of each chart are drawn.
#include "shared/vgi_nodes.glsl"

shared uint count;

void main() {
    begin();
    uint chart = own_group();
    if (chart >= cuts[instance].charts) return;
    if (gl_LocalInvocationID.x == 0u) count = 0u;
    barrier();
    uint nodes = nodes_per_chart(), first = cuts[instance].first_state + chart * nodes, mine = 0u;
    for (uint i = gl_LocalInvocationID.x; i < nodes; i += LODE_CUT_GROUP)
        mine += (states[first + i] & LODE_NODE_LEAF) != 0u ? 1u : 0u;
    atomicAdd(count, mine);
    barrier();
    if (gl_LocalInvocationID.x == 0u) leaves[cuts[instance].first_leaf + chart] = count;
}
