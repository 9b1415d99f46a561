// The calls that scripts/python-cost.py makes from Python, made from C++: CPU seconds of each, as JSON.
//   bench_embed_calls TRIANGLES REPEATS
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "apps/embed/arrays.h"
#include "apps/embed/levels.h"
#include "apps/embed/simplify.h"
#include "base/clock.h"
#include "base/threads.h"
#include "mesh/generate.h"

namespace {

using namespace lodestone;

// The least of so many tries.
template <class Call>
void measure(const char* name, int repeats, Call&& call, bool last = false) {
    double least = 1e30;
    for (int i = 0; i < repeats; ++i) {
        const Stopwatch watch;
        call();
        least = std::min(least, watch.cpu());
    }
    std::printf("\"%s\": %.6f%s", name, least, last ? "" : ", ");
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    set_thread_count(1);
    const int repeats = std::atoi(argv[2]);
    const TriMesh rock = generate(Shape::rock, std::strtoull(argv[1], nullptr, 10), 1);
    MeshArrays arrays;
    std::vector<glm::vec3> room;
    arrays.positions = wedge_positions(rock, room);
    arrays.triangles = rock.triangles;
    const TriMesh mesh = mesh_of(arrays).value();
    std::printf("{");
    measure("Mesh", 5 * repeats, [&] { (void)mesh_of(arrays); });
    measure("simplify", repeats, [&] { (void)simplify(mesh, {mesh.triangle_count() / 10, 0, "quadric"}); });
    measure(
        "cache_cost", 5 * repeats,
        [&] {
            (void)simulated_cost({mesh.triangles.front().data(), mesh.triangle_count() * 3}, "fifo16");
        },
        true);
    std::printf("}\n");
    return 0;
}
