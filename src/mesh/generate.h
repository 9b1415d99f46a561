// Shapes made by code, at any triangle count, the same bytes for the same seed on every machine: with normals and
// texture coordinates. The count asked for is met within 1% (exactly where the shape allows it), always at least the
// smallest mesh of its kind.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// What can be generated; y is up.
enum class Shape {
    rock,     // a closed sphere-like boulder displaced by ridged fractal noise, radius about 1, genus 0
    terrain,  // a height field over [-1, 1]^2 in x and z with ridges and valleys; one boundary loop
    grid,     // flat [-1, 1]^2 in x and z, rows of quads cut the same way
    sphere,   // radius 1
    torus,    // radii 1 and 0.4, genus 1
    cliff,    // ledges over [-1, 1]^2 with walls that hang over, which no height field is; one boundary loop
    vase,     // a pot with a hole in its foot, genus 1, with sharp edges and a texture; about 2 high
    scan,     // the rock with a texture in fragments of about 20 triangles each, as photogrammetry leaves it
};
Result<Shape> shape_named(std::string_view name);  // Fault::usage names the choices

// A shape of about so many triangles.
// Seams: sphere, rock, torus and vase carry texture-coordinate seams (positions stay welded). triangles: 1 .. 2^31.
// seed: of the noise; grid, sphere and torus have none.
TriMesh generate(Shape shape, uint64_t triangles, uint64_t seed = 1);

}  // namespace lodestone
