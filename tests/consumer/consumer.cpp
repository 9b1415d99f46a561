// Simplifies a generated rock with the installed libraries.
#include <cstdio>

#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/io/write.h"
#include "mesh/repair.h"

int main() {
    using namespace lodestone;
    TriMesh mesh = generate(Shape::rock, 2000, 1);
    if (!repair(mesh)) return 1;
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    if (!list) return 1;
    const auto pm = bake_progressive_mesh(mesh, *list, {"static"});
    if (!pm) return 1;
    const TriMesh small = *extract_level(*pm, pm->level_for_triangles(200));
    std::printf("%zu triangles became %zu\n", mesh.triangle_count(), small.triangle_count());
    return small.triangle_count() <= 200 && write_mesh(small, "small.ply") ? 0 : 1;
}
