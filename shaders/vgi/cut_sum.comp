#version 460
#extension GL_GOOGLE_include_directive : require
// Seventh pass of a grid cut (cut_look.comp tells the protocol): where in the list each chart's nodes begin, a prefix sum over
// the charts of an instance by one group, and the draws of all of them. gl_WorkGroupID.x is the instance.
// Hillis and Steele, "Data parallel algorithms", CACM 1986, for sums of the lanes' runs.
#include "vgi/nodes.glsl"

shared uint sums[LODE_CUT_GROUP];

// What a draw has of `total` patches. Those before that drew something are the first of the instance's, without a gap.
void write_records(uint total) {
    for (uint r = gl_LocalInvocationID.x; r < slot_records; r += LODE_CUT_GROUP) {
        uint done = r * LODE_CUT_RECORD_PATCHES, at = (instance * slot_records + r) * LODE_CUT_RECORD_WORDS;
        uint patches = clamp(int(total) - int(done), 0, LODE_CUT_RECORD_PATCHES);
        if (patches == 0u && records[at] == 0u) return;
        records[at] = patches;
        records[at + 1u] = 1u;
        records[at + 2u] = done;
        records[at + 3u] = cuts[instance].first_id;
    }
}

void sum_up() {
    uint lane = gl_LocalInvocationID.x, first = cuts[instance].first_leaf, charts = cuts[instance].charts;
    uint run = (charts + LODE_CUT_GROUP - 1u) / LODE_CUT_GROUP;
    uint begin_chart = min(lane * run, charts), end_chart = min(begin_chart + run, charts);
    uint mine = 0u;
    for (uint c = begin_chart; c < end_chart; ++c) mine += leaves[first + c];
    barrier();  // sums of the instance before are read
    sums[lane] = mine;
    barrier();
    for (uint step = 1u; step < LODE_CUT_GROUP; step *= 2u) {
        uint lower = lane >= step ? sums[lane - step] : 0u;
        barrier();
        sums[lane] += lower;
        barrier();
    }
    uint before = sums[lane] - mine, total = sums[LODE_CUT_GROUP - 1u];
    for (uint c = begin_chart; c < end_chart; ++c) {
        uint own = leaves[first + c];
        leaves[first + c] = before;
        before += own;
    }
    if (lane == 0u) atomicAdd(findings[1], total);
    write_records(total);
}

void main() {
    for (uint of = gl_WorkGroupID.x; of < draw_constants.words[LODE_CUT_WORD_INSTANCES]; of += gl_NumWorkGroups.x) {
        instance = of;
        sum_up();
    }
}
