// Prints what the errors of levels are worth: the CPU they take, how evenly levels can be asked for, and stated over
// measured error at levels spread over the logarithm of the triangles and on both sides of the largest rises.
//   level_errors [--levels N] [--points N] [--simplifier openmesh] [--curve FILE] [--zoom SHARE]... [--verbose]
//                MESH|SHAPE:TRIANGLES ...
// --zoom: 600 frames of going away by 0.4% a frame, with that share of the wedges on their way (0: without geomorphs).
// --curve: writes level, triangles, stated and measured error of every level.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include "base/clock.h"
#include "lod/asset/cursor.h"
#include "lod/asset/level_steps.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/level_distance.h"
#include "lod/bake/simplify/simplifier.h"
#include "lod/draw/zoom.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"

using namespace lodestone;

namespace {

struct Options {
    uint32_t levels = 200;
    uint64_t points = 2000000;
    bool openmesh = false, verbose = false;
    std::string curve;
    std::vector<double> zoom;  // shares that morph
};

Result<TriMesh> mesh_named(const std::string& name) {
    const size_t colon = name.find(':');
    Result<TriMesh> mesh = TriMesh{};
    if (colon != std::string::npos) {
        const auto shape = shape_named(name.substr(0, colon));
        if (!shape) return fail(Fault::usage, "no shape " + name);
        mesh = generate(*shape, std::strtoull(name.c_str() + colon + 1, nullptr, 10), 1);
    } else {
        mesh = read_mesh(name, {});
    }
    if (mesh) repair(*mesh);
    return mesh;
}

std::vector<uint32_t> levels_to_check(const ProgressiveMesh& pm, uint32_t count) {
    std::set<uint32_t> levels;
    const uint32_t last = pm.levels() - 1;
    const double full = pm.full_triangles(), base = std::max(1u, pm.triangles_at(last));
    for (uint32_t i = 1; i <= count * 3 / 4; ++i)
        levels.insert(std::max(
            1u, pm.level_for_triangles(static_cast<uint64_t>(full * std::pow(base / full, i / (count * 0.75))))));
    // The largest rises from one level to the next. Not of the first hundredth of the triangles: what few collapses do
    // is on so little of the surface that points spread over all of it see too little of it.
    std::vector<uint32_t> rises;
    for (uint32_t level = 2; level <= last; ++level) {
        if (pm.triangles_at(level) < 0.99 * full) rises.push_back(level);
    }
    std::ranges::stable_sort(rises, std::greater<>{}, [&](uint32_t l) { return pm.errors[l] / pm.errors[l - 1]; });
    for (size_t i = 0; i < rises.size() && levels.size() + 1 < count; ++i) levels.insert({rises[i] - 1, rises[i]});
    return {levels.begin(), levels.end()};
}

void check(const std::string& name, const Options& options) {
    auto mesh = mesh_named(name);
    if (!mesh) {
        std::printf("%s: %s\n", name.c_str(), mesh.error().message.c_str());
        return;
    }
    const auto simplifier = options.openmesh ? make_openmesh_simplifier() : make_quadric_simplifier();
    const auto list = simplifier->simplify(*mesh, {});
    auto pm = bake_progressive_mesh(*mesh, *list, {"classic"});
    const Stopwatch watch;
    auto errors = measure_errors(*pm);
    const double cpu = watch.cpu();
    pm->set_errors(std::move(*errors));
    const LevelSteps steps = level_steps(*pm);
    std::printf("%-28s %8u faces %7u levels | CPU %6.2f s, %5.2f a 100k | distinct %7u, step %5.2f%%, median %5.2f%%",
                name.substr(name.find_last_of('/') + 1).c_str(), pm->full_triangles(), pm->levels(), cpu,
                cpu * 1e5 / pm->full_triangles(), steps.distinct_errors, 100 * steps.largest_step,
                100 * steps.median_step);
    if (!options.curve.empty()) {
        FILE* out = std::fopen(options.curve.c_str(), "w");
        LevelDistance distance(*pm, {});
        for (uint32_t l = 0; out && l < pm->levels(); ++l)
            std::fprintf(out, "%u %u %.9g %.9g\n", l, pm->triangles_at(l), static_cast<double>(pm->errors[l]),
                         l == 0 ? 0 : distance.ecol());
        if (out) std::fclose(out);
    }
    for (size_t i = 0; i < options.zoom.size(); ++i) {
        const double share = options.zoom[i];
        const auto mesh_of_zoom = std::make_shared<const ProgressiveMesh>(*pm);
        const ZoomFigures f = zoom_on(mesh_of_zoom, {.geomorph = share > 0, .morphing_share = share});
        std::printf(
            "\n    zoom, %4.2f morphing: %u of %u frames change, at most %.2f%%; a wedge goes at most %.2f px (frame "
            "%u); %u to %u triangles, %.0f in the mean",
            share, f.changed, f.frames, 100 * f.most_changed, f.farthest, f.farthest_frame, f.first_triangles,
            f.last_triangles, f.mean_triangles);
        std::fflush(stdout);
    }
    if (options.levels > 0) {
        DistanceOptions distance;
        distance.samples = options.points;
        distance.seed = 77;
        const MeasuredSurface source(*extract_level(*pm, 0), distance);
        std::vector<double> ratios;
        PmCursor cursor(*pm);
        for (const uint32_t level : levels_to_check(*pm, options.levels)) {
            cursor.goto_level(level);
            distance.seed = 1000 + level;
            const MeasuredSurface there(mesh_of(cursor), distance);
            const double stated = pm->errors[level];
            const double measured = there.farthest_from(source, source.farthest_from(there, stated / 3));
            if (measured > resolution_of(*mesh)) ratios.push_back(stated / measured);
            if (options.verbose)
                std::printf("  level %u, %u triangles: stated %g, over measured %.3f\n", level, pm->triangles_at(level),
                            stated, stated / measured);
        }
        std::ranges::sort(ratios);
        const auto within = [&](double low, double high) {
            return 100.0 *
                   static_cast<double>(std::ranges::count_if(ratios, [&](double r) { return r >= low && r <= high; })) /
                   static_cast<double>(ratios.size());
        };
        const auto at = [&](double share) {
            return ratios[static_cast<size_t>(share * static_cast<double>(ratios.size() - 1))];
        };
        if (!ratios.empty())
            std::printf(" | of %zu levels .95-1.35 %5.1f%%, 1-1.25 %5.1f%%; %.3f %.3f %.3f %.3f %.3f", ratios.size(),
                        within(0.95, 1.35), within(1, 1.25), at(0), at(0.05), at(0.5), at(0.95), at(1));
    }
    std::printf("\n");
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const char* value = i + 1 < argc ? argv[i + 1] : "";
        if (word == "--verbose") {
            options.verbose = true;
            continue;
        }
        if (word == "--levels") {
            options.levels = static_cast<uint32_t>(std::atoi(value));
        } else if (word == "--points") {
            options.points = std::strtoull(value, nullptr, 10);
        } else if (word == "--simplifier") {
            options.openmesh = std::string(value) == "openmesh";
        } else if (word == "--zoom") {
            options.zoom.push_back(std::atof(value));
        } else if (word == "--curve") {
            options.curve = value;
        } else {
            check(word, options);
            continue;
        }
        ++i;
    }
}
