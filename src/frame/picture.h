// What a frame looks like: the renderer makes it, image metrics read it.
#pragma once

#include <cstdint>
#include <vector>

namespace lodestone {

// A frame as pixels.
struct Picture {
    uint32_t width = 0, height = 0;  // pixels
    std::vector<uint8_t> colour;     // RGBA, sRGB, rows top to bottom; alpha 255 where a surface was drawn,
                                     // 0 elsewhere, and between where one is blended over nothing
    std::vector<float> depth;        // reversed: 1 near plane, 0 far plane or nothing drawn
};

}  // namespace lodestone
