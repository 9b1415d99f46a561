#version 460
#extension GL_GOOGLE_include_directive : require
// Fourth pass of a grid cut (cut_look.comp tells the protocol): whatever the wanted nodes of a depth need is wanted, too
// (GridCut::close_wanted). Depths from the deepest upwards, a dispatch each: what is needed is coarser. Where nobody looked,
// nodes come to their list here.
#include "vgi/nodes.glsl"

void close(uint at) {
    if ((states[at] & LODE_NODE_WANTED) == 0u) return;
    Node n = node_of(at), needed;
    for (uint k = 0u; k < 5u; ++k) {
        if (!needed_for(n, k, needed)) continue;
        uint other = state_of(needed);
        if (atomicOr(states[other], LODE_NODE_LISTED | LODE_NODE_WANTED) == 0u) append(depth_of(needed), other);
    }
}

void main() {
    LODE_EACH_ENTRY(at) close(at);
}
