// What volumes may cost from frame to frame.
#pragma once

#include <cstdint>

namespace lodestone::volume {

// How voxels take light away.
enum class Absorption : uint8_t {
    exponential,  // e^-(density * length), whatever the steps are
    rational,     // 1 / (1 + density * length) a step, as in the source: depends on how many steps there are
};

// What can change from frame to frame.
struct Quality {
    float steps = 1;       // samples a voxel, in the middle of the picture; 0.125 .. 4
    uint32_t divisor = 1;  // pixels of the picture, a side, that one of the target stands for; 1 .. 4
    // Voxels are filled anew in rounds of so many frames, a share of them in each; what is seen changes at the end of a
    // round, to what then is. 1: all of them in every frame; 0: once.
    uint32_t refresh = 1;
    float density = 1;  // factor of all densities, 0 .. 100
    Absorption absorption = Absorption::exponential;
    bool skips_empty = true;  // false: samples are taken of empty places, too; for measurements
    // The source's own way: metavoxels are filled and marched by turns, every frame, and each is laid over or under
    // what is there. The pool need not hold all of them. Neither divisor nor refresh nor skips_empty counts.
    bool by_metavoxel = false;
    uint32_t cache = 0;  // metavoxels that are filled before they are marched, by_metavoxel; 0: what the pool holds
    bool operator==(const Quality&) const = default;
};

// Levels of quality, from the cheapest to all rays and all voxels in every frame.
inline constexpr uint32_t lowest_level = 1, highest_level = 8;
// The same with steps, divisor and refresh as a level has them. level: lowest_level .. highest_level.
Quality at_level(Quality quality, uint32_t level);

}  // namespace lodestone::volume
