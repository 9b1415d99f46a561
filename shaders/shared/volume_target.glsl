// Which pixel of the picture a pixel of the target (a tap) is.
#ifndef LODESTONE_VOLUME_TARGET_GLSL
#define LODESTONE_VOLUME_TARGET_GLSL

ivec2 pixel_of_tap(ivec2 tap) {
    int divisor = int(volume.divisor);
    return min(tap * divisor + divisor / 2, ivec2(volume.picture.xy) - 1);
}

#endif
