// Where a tileset stands on the Earth.
#pragma once

#include <array>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "tiles/tile_glb.h"

namespace lodestone::tiles {

// Matrices as 3D Tiles has them, column by column.
using Transform = std::array<double, 16>;
Transform transform_of(const glm::dmat4& matrix);

// From metres east, north and up of a place to earth-centred, earth-fixed metres (EPSG 4978).
// longitude, latitude: degrees east and north, WGS 84, -180 .. 180 and -90 .. 90; height: metres above the ellipsoid.
// Source: OGC 22-025r4, 3D Tiles 1.1, and EPSG method 9602 for the position.
glm::dmat4 east_north_up(double longitude, double latitude, double height);

// From a mesh's axes to those of tiles, x to the east, y to the north, z up.
glm::dmat4 to_tile_axes(UpAxis up);

}  // namespace lodestone::tiles
