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

// A box along the axes of tiles: x east, y north, z up; metres.
struct TileBox {
    glm::dvec3 centre{0}, half{0};
};
// The box along the axes around a box that was moved.
TileBox moved(const TileBox& box, const glm::dmat4& by);
// The box around two.
TileBox around(const TileBox& a, const TileBox& b);

// Earth-centred, earth-fixed metres (EPSG 4978) of a place; arguments as east_north_up() has them.
// Source: EPSG method 9602.
glm::dvec3 earth_centred(double longitude, double latitude, double height);

// From metres east, north and up of a place to earth-centred, earth-fixed metres (EPSG 4978).
// longitude, latitude: degrees east and north, WGS 84, -180 .. 180 and -90 .. 90; height: metres above the ellipsoid.
// Source: OGC 22-025r4, 3D Tiles 1.1.
glm::dmat4 east_north_up(double longitude, double latitude, double height);

// From a mesh's axes to those of tiles, x to the east, y to the north, z up.
glm::dmat4 to_tile_axes(UpAxis up);

}  // namespace lodestone::tiles
