#version 460
#extension GL_GOOGLE_include_directive : require
// Second pass of a grid cut (cut_look.comp tells the protocol): whatever the wanted nodes of a level need is wanted, too
// (GridCut::close_wanted). Levels from the finest to the coarsest, a dispatch each: what is needed is coarser.
#include "shared/vgi_nodes.glsl"

void main() {
    begin();
    Node n, needed;
    if (!own_node(n) || (states[state_of(n)] & LODE_NODE_WANTED) == 0u) return;
    for (uint k = 0u; k < 5u; ++k) {
        if (needed_for(n, k, needed)) atomicOr(states[state_of(needed)], LODE_NODE_WANTED);
    }
}
