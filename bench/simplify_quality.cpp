// Prints how far simplified scans are from their source: ours, OpenMesh's ModQuadric, meshoptimizer, at 50%, 10% and 2%
// of the triangles; and the CPU each took to go to 2%.
//   simplify_quality [--json] [--weights NORMAL UV COLOUR] [part of a subject's name]
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "base/clock.h"
#include "bench/rivals.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/distance/distance.h"

using namespace lodestone;

namespace {

struct Arguments {
    SimplifyOptions options;
    std::string wanted;  // part of a subject's name
    bool json = false;   // one object a line in place of a table
};

Arguments read_arguments(int argc, char** argv) {
    Arguments read;
    for (int next = 1; next < argc; ++next) {
        if (std::strcmp(argv[next], "--json") == 0) {
            read.json = true;
        } else if (std::strcmp(argv[next], "--weights") == 0 && next + 3 < argc) {
            read.options.normal_weight = std::atof(argv[++next]);
            read.options.uv_weight = std::atof(argv[++next]);
            read.options.colour_weight = std::atof(argv[++next]);
        } else {
            read.wanted = argv[next];
        }
    }
    return read;
}

// Two-sided distances to the source of what three simplifiers leave at one share of its triangles.
struct Compared {
    double share = 0;
    TwoSidedDistance ours, openmesh, meshoptimizer;
    double openmesh_cpu = 0;  // seconds
};

Compared compare(const TriMesh& mesh, const CollapseList& list, const MeasuredSurface& source, double share) {
    const auto target = static_cast<size_t>(share * static_cast<double>(mesh.triangle_count()));
    const auto measured = [&](const TriMesh& simplified) {
        const MeasuredSurface level(simplified, DistanceOptions{});
        return TwoSidedDistance{source.to(level), level.to(source)};
    };
    Compared found;
    found.share = share;
    const TriMesh rival = openmesh_decimated(mesh, target, &found.openmesh_cpu);
    found.ours = measured(shape_after(mesh, list, target));
    found.openmesh = measured(rival);
    found.meshoptimizer = measured(meshoptimizer_simplified(mesh, target));
    return found;
}

void print(const Subject& subject, const Compared& row, double ours_cpu, bool json) {
    const double rms = row.ours.rms() / row.openmesh.rms(), max = row.ours.max() / row.meshoptimizer.max();
    if (json) {
        std::printf(
            "{\"mesh\":\"%s\",\"triangles\":%zu,\"share\":%g,\"rms\":%.6g,\"rms_ratio\":%.6g,\"max\":%.6g,\"max_"
            "ratio\":%.6g}\n",
            subject.name.c_str(), subject.mesh.triangle_count(), row.share, row.ours.rms(), rms, row.ours.max(), max);
    } else {
        std::printf("%-26s %8zu %4.0f%% | %10.4g %10.4g %6.3f | %10.4g %10.4g %6.3f |", subject.name.c_str(),
                    subject.mesh.triangle_count(), row.share * 100, row.ours.rms(), row.openmesh.rms(), rms,
                    row.ours.max(), row.meshoptimizer.max(), max);
        if (row.share < 0.05) std::printf(" %6.2f %6.2f", ours_cpu, row.openmesh_cpu / ours_cpu);
        std::printf("\n");
    }
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    const Arguments arguments = read_arguments(argc, argv);
    if (!arguments.json) {
        std::printf("%-26s %8s %5s | %10s %10s %6s | %10s %10s %6s | %6s %6s\n", "mesh", "faces", "share", "rms ours",
                    "OpenMesh", "ratio", "max ours", "meshopt", "ratio", "CPU s", "x OM");
    }
    const auto simplifier = make_quadric_simplifier();
    for (const Subject& subject : simplification_subjects()) {
        if (subject.name.find(arguments.wanted) == std::string::npos) continue;
        const Stopwatch watch;
        const auto list = simplifier->simplify(subject.mesh, arguments.options);
        const double ours_cpu = watch.cpu();
        if (!list) {
            std::fprintf(stderr, "%s: %s\n", subject.name.c_str(), list.error().message.c_str());
            return 1;
        }
        const MeasuredSurface source(subject.mesh, DistanceOptions{});
        for (const double share : {0.5, 0.1, 0.02})
            print(subject, compare(subject.mesh, *list, source, share), ours_cpu, arguments.json);
    }
}
