#version 460
#extension GL_GOOGLE_include_directive : require
// Fifth pass of a grid cut (cut_look.comp tells the protocol): nodes of a level are divided where that is wanted and pages
// are there, and what is left and seen is drawn (GridCut::divide and see). Depths from the coarsest on, a dispatch each.
#include "vgi/nodes.glsl"

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

// Whether it is divided: what it needs is, and the page is there. Wishes for the page where it is not.
bool is_divided(Node n) {
    Node needed;
    for (uint k = 0u; k < 5u; ++k) {
        if (needed_for(n, k, needed) && (states[state_of(needed)] & LODE_NODE_DIVIDED) == 0u) return false;
    }
    uint number = page_of(n, n.level - 1u);
    if (slot_of(number, n.level - 1u) != LODE_CUT_ABSENT) return true;
    // Bits of numbers that are not negative are in the numbers' order.
    atomicMax(findings[LODE_CUT_FIRST_FINDING + 2u * number + 1u], floatBitsToUint(wish(n, number)));
    return false;
}

uint views_of(Node n, uint state) {
    if ((state & LODE_NODE_LOOKED) != 0u) return (state >> LODE_NODE_VIEWS_SHIFT) & 255u;
    uint of_parent = cuts[instance].views;
    if (n.level < levels) of_parent = (states[state_of(up(n, n.level + 1u))] >> LODE_NODE_VIEWS_SHIFT) & 255u;
    return seen(n, of_parent);
}

void divide(uint at) {
    uint state = states[at];
    bool exists = (state & LODE_NODE_EXISTS) != 0u, wanted = (state & LODE_NODE_WANTED) != 0u;
    // What is wanted needs what it is part of, so it exists or cannot be divided.
    if (!exists) return;
    Node n = node_of(at);
    uint mask = views_of(n, state);
    state |= LODE_NODE_LOOKED | mask << LODE_NODE_VIEWS_SHIFT;
    if (wanted && is_divided(n)) {
        state |= LODE_NODE_DIVIDED;
        for (uint k = 0u; k < parts_of(n); ++k) {
            uint part = state_of(part_of(n, k)), before = states[part];
            states[part] = before | LODE_NODE_LISTED | LODE_NODE_EXISTS;
            if (before == 0u) append(depth_of(n) + 1u, part);
        }
    } else if (mask != 0u) {
        append(LODE_CUT_DRAWN, at);
    }
    states[at] = state;
}

void main() {
    LODE_EACH_ENTRY(at) divide(at);
}
