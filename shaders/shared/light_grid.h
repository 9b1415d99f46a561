// Words before the places of a light grid (light_grid.glsl).
#ifndef LODESTONE_LIGHT_GRID_H
#define LODESTONE_LIGHT_GRID_H
#define LODE_LIGHT_GRID_HEAD 16
#endif
