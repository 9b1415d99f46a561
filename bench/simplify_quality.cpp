// Prints how far simplified scans are from their source: ours, OpenMesh's ModQuadric, meshoptimizer, at 50%, 10% and 2%
// of the triangles; and the CPU each took to go to 2%.
//   simplify_quality [--weights NORMAL UV COLOUR] [part of a subject's name]
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "base/clock.h"
#include "bench/rivals.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/distance/distance.h"

using namespace lodestone;

int main(int argc, char** argv) {
    SimplifyOptions options;
    int next = 1;
    if (argc >= 5 && std::strcmp(argv[1], "--weights") == 0) {
        options.normal_weight = std::atof(argv[2]);
        options.uv_weight = std::atof(argv[3]);
        options.colour_weight = std::atof(argv[4]);
        next = 5;
    }
    const std::string wanted = argc > next ? argv[next] : "";
    std::printf("%-26s %8s %5s | %10s %10s %6s | %10s %10s %6s | %6s %6s\n", "mesh", "faces", "share", "rms ours",
                "OpenMesh", "ratio", "max ours", "meshopt", "ratio", "CPU s", "x OM");
    const auto simplifier = make_quadric_simplifier();
    for (const Subject& subject : simplification_subjects()) {
        if (subject.name.find(wanted) == std::string::npos) continue;
        const Stopwatch watch;
        auto list = simplifier->simplify(subject.mesh, options);
        const double ours_cpu = watch.cpu();
        if (!list) {
            std::printf("%s: %s\n", subject.name.c_str(), list.error().message.c_str());
            continue;
        }
        DistanceOptions distance;
        const MeasuredSurface source(subject.mesh, distance);
        const auto measured = [&](const TriMesh& mesh) {
            const MeasuredSurface level(mesh, distance);
            return TwoSidedDistance{source.to(level), level.to(source)};
        };
        for (const double share : {0.5, 0.1, 0.02}) {
            const auto target = static_cast<size_t>(share * static_cast<double>(subject.mesh.triangle_count()));
            double openmesh_cpu = 0;
            const TriMesh rival = openmesh_decimated(subject.mesh, target, &openmesh_cpu);
            const TwoSidedDistance ours = measured(shape_after(subject.mesh, *list, target)),
                                   openmesh = measured(rival);
            const TwoSidedDistance meshopt = measured(meshoptimizer_simplified(subject.mesh, target));
            std::printf("%-26s %8zu %4.0f%% | %10.4g %10.4g %6.3f | %10.4g %10.4g %6.3f |", subject.name.c_str(),
                        subject.mesh.triangle_count(), share * 100, ours.rms(), openmesh.rms(),
                        ours.rms() / openmesh.rms(), ours.max(), meshopt.max(), ours.max() / meshopt.max());
            if (share < 0.05) std::printf(" %6.2f %6.2f", ours_cpu, openmesh_cpu / ours_cpu);
            std::printf("\n");
            std::fflush(stdout);
        }
    }
}
