#version 460
#extension GL_GOOGLE_include_directive : require
// Second pass of a grid cut (cut_look.comp tells the protocol): what findings and charts told of the frame before is
// forgotten, and every chart of every instance is a node to look into. gl_WorkGroupID.y is the instance.
#include "vgi/nodes.glsl"

void main() {
    uint step = gl_NumWorkGroups.x * LODE_CUT_GROUP, rows = gl_NumWorkGroups.y;
    uint words = draw_constants.words[LODE_CUT_WORD_FINDINGS];
    for (uint i = gl_GlobalInvocationID.x + gl_WorkGroupID.y * step; i < words; i += step * rows) findings[i] = 0u;
    for (uint of = gl_WorkGroupID.y; of < draw_constants.words[LODE_CUT_WORD_INSTANCES]; of += rows) {
        begin(of);
        for (uint chart = gl_GlobalInvocationID.x; chart < cuts[of].charts; chart += step) {
            leaves[cuts[of].first_leaf + chart] = 0u;
            uint at = state_of(Node(levels, chart, 0u, 0u));
            states[at] = LODE_NODE_LISTED | LODE_NODE_EXISTS;
            append(0u, at);
        }
    }
}
