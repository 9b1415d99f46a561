#version 460
#extension GL_GOOGLE_include_directive : require
// First pass of a grid cut (cut_look.comp tells the protocol): what the cut before left in nodes' states is set to 0. In
// the first frame of all, where the words say so, everything is that must be 0 before there was a cut.
#include "vgi/nodes.glsl"

void clear_all(uint words, uint record_words) {
    uint step = gl_NumWorkGroups.x * LODE_CUT_GROUP;
    for (uint i = gl_GlobalInvocationID.x; i < words; i += step) states[i] = 0u;
    for (uint i = gl_GlobalInvocationID.x; i < record_words; i += step) records[i] = 0u;
}

void main() {
    if (draw_constants.words[LODE_CUT_WORD_STATES] != 0u) {
        clear_all(draw_constants.words[LODE_CUT_WORD_STATES], draw_constants.words[LODE_CUT_WORD_RECORDS]);
        return;
    }
    for (uint group = gl_WorkGroupID.x; group < lists[LODE_CUT_ALL].entries; group += gl_NumWorkGroups.x) {
        uint list = 0u, within = group;
        while (list + 1u < LODE_CUT_DEPTHS && within >= groups_for(lists[list].entries)) {
            within -= groups_for(lists[list].entries);
            ++list;
        }
        uint i = within * LODE_CUT_GROUP + gl_LocalInvocationID.x;
        if (i < lists[list].entries) states[entries[lists[list].first + i]] = 0u;
    }
}
