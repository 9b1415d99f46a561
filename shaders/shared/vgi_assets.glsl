// Assets of virtual geometry images, as all shaders read them.
#ifndef LODESTONE_VGI_ASSETS_GLSL
#define LODESTONE_VGI_ASSETS_GLSL

#include "shared/texels.glsl"
#include "shared/vgi_texels.h"

LODE_TEXELS(LODE_VGI_ASSETS, asset_words, uvec4)

// What is not asked of it is not read.
VgiAsset asset_at(uint number) {
    uvec4 t[6];
    for (uint k = 0u; k < 6u; ++k) t[k] = asset_words_at(6u * number + k);
    vec4 place = uintBitsToFloat(t[0]), uv = uintBitsToFloat(t[1]);
    return VgiAsset(place.x, place.y, place.z, place.w, uv.x, uv.y, uv.z, uv.w, t[2].x, t[2].y, t[2].z, t[2].w, t[3].x,
                    t[3].y, t[3].z, t[3].w, t[4].x, t[4].y, t[4].z, t[4].w, t[5].x, t[5].y, uintBitsToFloat(t[5].z), t[5].w);
}

#endif
