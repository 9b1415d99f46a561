// A voxel in a word: density in 11 bits, and red, green and blue of the radiance that a thick layer of it sends out in 7
// bits each, all as square roots of shares of the largest, so that small values keep their digits. What is rounded off is
// spread by a hash of the place: sums over many voxels are right.
#ifndef LODESTONE_VOLUME_VOXEL_GLSL
#define LODESTONE_VOLUME_VOXEL_GLSL

uint hash_of_place(uvec3 place) {
    uint h = place.x * 0x9e3779b1u ^ place.y * 0x85ebca77u ^ place.z * 0xc2b2ae3du;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ h >> 15;
}

// density: share of the largest, 0 and up; radiance: the same.
uint voxel_word(float density, vec3 radiance, uvec3 place) {
    uint h = hash_of_place(place);
    uint code = min(uint(sqrt(density) * 2047.0 + float(h >> 24) / 256.0), 2047u);
    vec3 spread = vec3(uvec3(h, h >> 8, h >> 16) & 255u) / 256.0;
    uvec3 colour = min(uvec3(sqrt(max(radiance, vec3(0.0))) * 127.0 + spread), uvec3(127u));
    return density > 0.0 ? code | colour.r << 11 | colour.g << 18 | colour.b << 25 : 0u;
}

// Codes of a voxel: density 0 .. 2047, colours 0 .. 127.
float density_code(uint word) { return float(word & 2047u); }
vec3 radiance_codes(uint word) { return vec3(uvec3(word >> 11, word >> 18, word >> 25) & 127u); }

#endif
