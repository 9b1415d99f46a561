#version 460
#extension GL_GOOGLE_include_directive : require
// Third pass of a grid cut (cut_look.comp tells the protocol): nodes of a level are divided where that is wanted and pages
// are there, and the views that see what is left are noted (GridCut::divide and see). Levels from the coarsest to the finest,
// a dispatch each.
#include "shared/vgi_nodes.glsl"

// As RefinementTest::excess and wish_for; only the order in which pages are read comes from it.
float wish(Node n, uint number) {
    VgiCutPage page = bounds[number];
    Reaches reaches = own_reaches();
    float error = reach_of(reaches, page.codes & 255u);
    float away = length(mapped(of_object(), vec3(page.centre_x, page.centre_y, page.centre_z))) -
                 page.radius * reaches.scale - radius_of(reaches, (page.codes >> 8) & 255u);
    float excess = error > 0.0 ? error / max(away, 1e-3 * error) : 0.0;
    return max(excess, 1e-6) * (seen(n, 1u) != 0u ? 1.0 : 0.25);
}

void main() {
    begin();
    Node n, needed;
    if (!own_node(n)) return;
    // Nodes of level 0 are not looked into.
    uint at = state_of(n), state = n.level > 0u ? states[at] : 0u, mask = cuts[instance].views;
    bool exists = true;
    if (n.level < levels) {
        uint parent = states[state_of(up(n, n.level + 1u))];
        exists = (parent & LODE_NODE_DIVIDED) != 0u;
        mask = exists ? (parent >> LODE_NODE_SEEN_SHIFT) & 255u : 0u;
    }
    if (mask != 0u) mask = seen(n, mask);
    if (n.level > 0u && (state & LODE_NODE_WANTED) != 0u) {
        bool may = true;
        for (uint k = 0u; k < 5u; ++k) {
            if (needed_for(n, k, needed)) may = may && (states[state_of(needed)] & LODE_NODE_DIVIDED) != 0u;
        }
        uint number = page_of(n, n.level - 1u);
        if (may && slot_of(number, n.level - 1u) == LODE_CUT_ABSENT) {
            // Bits of numbers that are not negative are in the numbers' order.
            atomicMax(findings[LODE_CUT_FIRST_FINDING + 2u * number + 1u], floatBitsToUint(wish(n, number)));
        } else if (may) {
            state |= LODE_NODE_DIVIDED;
        }
    }
    if (exists) state |= LODE_NODE_EXISTS;
    if (exists && mask != 0u && (state & LODE_NODE_DIVIDED) == 0u) state |= LODE_NODE_LEAF;
    states[at] = state | mask << LODE_NODE_SEEN_SHIFT;
}
