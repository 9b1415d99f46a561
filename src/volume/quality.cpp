#include "volume/quality.h"

#include "base/check.h"

namespace lodestone::volume {

Quality at_level(Quality quality, uint32_t level) {
    struct Level {
        float steps;
        uint32_t divisor, refresh;
    };
    // What shows least is given up first.
    static constexpr Level levels[] = {{0.25f, 4, 8}, {0.35f, 3, 8}, {0.5f, 3, 4}, {0.5f, 2, 4},
                                       {0.7f, 2, 3},  {1, 2, 2},     {1, 1, 2},    {1, 1, 1}};
    LODE_CHECK(level >= lowest_level && level <= highest_level, level);
    const Level& chosen = levels[level - lowest_level];
    quality.steps = chosen.steps;
    quality.divisor = chosen.divisor;
    quality.refresh = chosen.refresh;
    return quality;
}

}  // namespace lodestone::volume
