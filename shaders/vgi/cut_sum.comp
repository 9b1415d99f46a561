#version 460
#extension GL_GOOGLE_include_directive : require
// Fifth pass of a grid cut (cut_look.comp tells the protocol): where in the list each chart's nodes begin, a prefix sum over
// the charts of an instance by one group. Hillis and Steele, "Data parallel algorithms", CACM 1986, for sums of the lanes' runs.
#include "shared/vgi_nodes.glsl"

shared uint sums[LODE_CUT_GROUP];

void main() {
    begin();
    if (own_group() > 0u) return;
    uint lane = gl_LocalInvocationID.x, first = cuts[instance].first_leaf, charts = cuts[instance].charts;
    uint run = (charts + LODE_CUT_GROUP - 1u) / LODE_CUT_GROUP;
    uint begin_chart = min(lane * run, charts), end_chart = min(begin_chart + run, charts);
    uint mine = 0u;
    for (uint c = begin_chart; c < end_chart; ++c) mine += leaves[first + c];
    sums[lane] = mine;
    barrier();
    for (uint step = 1u; step < LODE_CUT_GROUP; step *= 2u) {
        uint lower = lane >= step ? sums[lane - step] : 0u;
        barrier();
        sums[lane] += lower;
        barrier();
    }
    uint before = sums[lane] - mine;
    for (uint c = begin_chart; c < end_chart; ++c) {
        uint own = leaves[first + c];
        leaves[first + c] = before;
        before += own;
    }
}
