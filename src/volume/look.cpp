#include "volume/look.h"

namespace lodestone::volume {

Look smoke_look() {
    Look look;
    look.colour_by = ColourBy::displacement;
    look.colour_from = {0.92f, 0.9f, 0.88f};
    look.colour_to = {0.6f, 0.58f, 0.57f};
    look.density_from = 6;
    look.density_to = 0;
    return look;
}

Look fire_look() {
    Look look;
    look.colour_by = ColourBy::heat;
    look.colour_from = {1, 0.62f, 0.12f};
    look.colour_to = {0, 0, 0};
    look.density_from = 9;
    look.density_to = 1;
    look.scatter = 0.1f;
    look.emission = 5;
    return look;
}

}  // namespace lodestone::volume
