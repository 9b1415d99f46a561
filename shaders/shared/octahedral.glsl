// Directions as two numbers, -1 .. 1: the octahedron, folded out onto a square.
//
//   Cigolle et al., "A survey of efficient representations for independent unit vectors", JCGT 2014.
#ifndef LODESTONE_OCTAHEDRAL_GLSL
#define LODESTONE_OCTAHEDRAL_GLSL

// Not of unit length.
vec3 unfolded(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float fold = max(-n.z, 0.0);
    return vec3(n.x + (n.x < 0.0 ? fold : -fold), n.y + (n.y < 0.0 ? fold : -fold), n.z);
}
// n: of any length but 0.
vec2 folded(vec3 n) {
    vec3 p = n / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 aside = 1.0 - abs(p.yx);
    return p.z >= 0.0 ? p.xy : vec2(p.x < 0.0 ? -aside.x : aside.x, p.y < 0.0 ? -aside.y : aside.y);
}

#endif
