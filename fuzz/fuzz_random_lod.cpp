// Random meshes through repair, simplification, every order, errors and the cursor: each step leaves what the next may
// rely on, and a walk ends where extraction of the level does.
#include <algorithm>
#include <vector>

#include "fuzz/random_mesh.h"
#include "fuzz/watch.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/repair.h"
#include "tests/fixtures/faces.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

// OpenMesh's decimater takes time by the cube of the triangles around a vertex: 0.1 s where there are 125, 42 s where
// there are 1000. Meshes with more than these are left to our own simplifier.
constexpr uint32_t most_around = 64;

uint32_t most_triangles_around_a_vertex(const TriMesh& mesh) {
    std::vector<uint32_t> around(mesh.vertex_count());
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) ++around[mesh.vertex_of(t, k)];
    }
    return *std::ranges::max_element(around);
}

void walk(const ProgressiveMesh& pm, uint32_t order, FuzzedDataProvider& from) {
    PmCursor cursor(pm, order);
    if (from.ConsumeBool()) cursor.use(std::make_shared<const PmSnapshots>(pm, order));
    for (int step = from.ConsumeIntegralInRange<int>(1, 12); step > 0; --step) {
        switch (from.ConsumeIntegralInRange<int>(0, 3)) {
            case 0:
                cursor.ecol();
                break;
            case 1:
                cursor.vsplit();
                break;
            default:
                cursor.goto_level(from.ConsumeIntegralInRange<uint32_t>(0, pm.levels() - 1));
        }
        require_good(cursor.validate(), "a cursor is valid wherever it goes");
    }
    PmCursor straight(pm, 0);
    straight.goto_level(cursor.level());
    require(fixtures::faces_of(cursor.drawn_indices()) == fixtures::faces_of(straight.drawn_indices()),
            "every order and every way has the faces of its level");
}

void check_steps(TriMesh mesh, FuzzedDataProvider& from) {
    if (!repair(mesh)) return;  // nothing is left
    require_good(mesh.validate(), "a repaired mesh is valid");
    const bool by_openmesh =
        from.ConsumeIntegralInRange<int>(0, 7) == 0 && most_triangles_around_a_vertex(mesh) <= most_around;
    const auto simplifier = by_openmesh ? make_openmesh_simplifier() : make_quadric_simplifier();
    const auto list = simplifier->simplify(mesh, {});
    require_good(list, "a repaired mesh can be simplified");
    require_good(list->validate(mesh), "a collapse list is valid");
    OrderOptions options;
    options.moves_per_ecol = from.ConsumeIntegralInRange<int>(1, 40) / 4.0;
    auto pm = bake_progressive_mesh(mesh, *list, {"keyframe", "greedy", "static", "classic"}, options);
    require_good(pm, "orders are made of every list");
    const auto errors = measure_errors(*pm, {200, 1});
    require_good(errors, "levels are measured");
    pm->set_errors(*errors);
    require_good(pm->validate(), "a progressive mesh is valid");
    walk(*pm, from.ConsumeIntegralInRange<uint32_t>(0, 3), from);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    FuzzedDataProvider from(data, size);
    TriMesh mesh = random_mesh(from);
    // A few hundred triangles take less than the least that counts is given, by far: nothing is added for them.
    const size_t bytes = size + bytes_of(mesh);
    const Watch watch;
    check_steps(std::move(mesh), from);
    watch.check(bytes);
    return 0;
}
