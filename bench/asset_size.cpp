// Prints how large progressive meshes are on disk and how fast they open: positions alone, one order `keyframe` made
// for FIFO-16, errors measured. Bytes a triangle by what they tell; triangles opened a second on one core; and the
// share of the file that the n coarsest of N triangles need, as a multiple of n / N: the largest at the ends of blocks
// from 1% on (`prefix_at_ends`), and of any n from 1% on (`prefix`).
//   asset_size [--json] [--keep FILE] [--rock TRIANGLES | part of a subject's name]
//   asset_size --open FILE [--times N]
// --keep leaves the last asset in FILE; --open opens FILE once and does nothing else, for callgrind. With --times it
// opens FILE N times and prints the median and the least, to compare two builds side by side.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "base/check.h"
#include "base/clock.h"
#include "base/threads.h"
#include "bench/rivals.h"
#include "lod/asset/stored_mesh.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

using namespace lodestone;

namespace {

struct Size {
    double triangles = 0, bytes = 0;  // of the file
    StoredParts parts;
    double seconds = 1e9;                   // to open it, the least of several times
    double prefix = 0, prefix_at_ends = 0;  // in units of n / N
};

TriMesh positions_alone(const TriMesh& source) {
    TriMesh mesh;
    mesh.positions = source.positions;
    for (uint32_t v = 0; v < mesh.vertex_count(); ++v) mesh.wedge_vertex.push_back(v);
    for (size_t t = 0; t < source.triangle_count(); ++t)
        mesh.triangles.push_back({source.vertex_of(t, 0), source.vertex_of(t, 1), source.vertex_of(t, 2)});
    return mesh;
}

void write_asset(const TriMesh& mesh, const std::filesystem::path& path) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    LODE_CHECK(list.has_value());
    OrderOptions options;
    options.seconds = 10;
    auto pm = bake_progressive_mesh(mesh, *list, {"keyframe"}, options);
    LODE_CHECK(pm.has_value());
    auto errors = measure_errors(*pm, {20000, 1});
    LODE_CHECK(errors.has_value());
    pm->set_errors(std::move(*errors));
    auto writer = ChunkWriter::create(path, {});
    LODE_CHECK(writer && pm->write_chunks(*writer) && writer->commit());
}

void measure_prefixes(const ChunkFile& file, Size& size) {
    uint64_t end = 0;
    for (const ChunkInfo& chunk : file.chunks()) {
        if (chunk.name == "lod/blocks") end = chunk.offset;
    }
    double before = 0;  // triangles
    const auto table = *file.array<StoredBlock>("lod/table");
    for (const StoredBlock& block : table) {
        end += uint64_t{block.bytes} + block.error_bytes;
        const double share = static_cast<double>(end) / size.bytes;
        // One more triangle than the block before has takes this block.
        const double least = std::max(before + 1, 0.01 * size.triangles);
        if (block.faces >= 0.01 * size.triangles) {
            size.prefix = std::max(size.prefix, share / (least / size.triangles));
            size.prefix_at_ends = std::max(size.prefix_at_ends, share / (block.faces / size.triangles));
        }
        before = block.faces;
    }
}

// Seconds of one core to open a file, each of so many times.
std::vector<double> opening_times(const std::filesystem::path& path, uint64_t times, Size& size) {
    std::vector<double> seconds;
    for (uint64_t n = 0; n < times; ++n) {
        const auto file = ChunkFile::open(path);
        LODE_CHECK(file.has_value());
        const Stopwatch watch;
        const auto pm = ProgressiveMesh::open(*file);
        seconds.push_back(watch.cpu());
        LODE_CHECK(pm.has_value());
        size.triangles = pm->full_triangles();
        size.parts = pm->parts;
        size.bytes = static_cast<double>(file->file_bytes());
    }
    std::ranges::sort(seconds);
    return seconds;
}

Size measure(const std::filesystem::path& path) {
    Size size;
    size.seconds = opening_times(path, 7, size).front();
    measure_prefixes(*ChunkFile::open(path), size);
    return size;
}

void print(const std::string& name, const Size& size, bool json) {
    const auto each = [&](uint64_t bytes) { return static_cast<double>(bytes) / size.triangles; };
    if (json) {
        std::printf(
            "{\"mesh\": \"%s\", \"triangles\": %.0f, \"bytes_per_triangle\": %.3f, \"connectivity\": %.3f, "
            "\"vertices\": "
            "%.3f, \"orders\": %.3f, \"errors\": %.3f, \"open_mtri_per_s\": %.3f, \"prefix\": %.3f, "
            "\"prefix_at_ends\": "
            "%.3f}\n",
            name.c_str(), size.triangles, size.bytes / size.triangles, each(size.parts.connectivity),
            each(size.parts.vertices), each(size.parts.orders), each(size.parts.errors),
            size.triangles / size.seconds / 1e6, size.prefix, size.prefix_at_ends);
    } else {
        std::printf(
            "%-20s %9.0f triangles  %6.2f B each: connectivity %.2f, vertices %.2f, orders %.2f, errors %.2f; "
            "opens %.2f M a second; prefix %.2f, at ends %.2f\n",
            name.c_str(), size.triangles, size.bytes / size.triangles, each(size.parts.connectivity),
            each(size.parts.vertices), each(size.parts.orders), each(size.parts.errors),
            size.triangles / size.seconds / 1e6, size.prefix, size.prefix_at_ends);
    }
    std::fflush(stdout);
}

int open_only(const std::string& path, uint64_t times) {
    if (times == 0) {
        const auto file = ChunkFile::open(path);
        return file && ProgressiveMesh::open(*file) ? 0 : 1;
    }
    set_thread_count(1);
    Size size;
    const std::vector<double> seconds = opening_times(path, times, size);
    std::printf("opens %.2f M triangles a second, at most %.2f\n", size.triangles / seconds[seconds.size() / 2] / 1e6,
                size.triangles / seconds.front() / 1e6);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    bool json = false;
    std::string wanted, opened, kept;
    uint64_t rock = 0, times = 0;
    for (int next = 1; next < argc; ++next) {
        if (std::strcmp(argv[next], "--json") == 0) {
            json = true;
        } else if (std::strcmp(argv[next], "--open") == 0 && next + 1 < argc) {
            opened = argv[++next];
        } else if (std::strcmp(argv[next], "--times") == 0 && next + 1 < argc) {
            times = std::strtoull(argv[++next], nullptr, 10);
        } else if (std::strcmp(argv[next], "--rock") == 0 && next + 1 < argc) {
            rock = std::strtoull(argv[++next], nullptr, 10);
        } else if (std::strcmp(argv[next], "--keep") == 0 && next + 1 < argc) {
            kept = argv[++next];
        } else {
            wanted = argv[next];
        }
    }
    if (!opened.empty()) return open_only(opened, times);
    const std::filesystem::path path =
        !kept.empty() ? std::filesystem::path(kept)
                      : std::filesystem::temp_directory_path() / ("asset-size-" + std::to_string(getpid()) + ".lode");
    std::vector<Subject> subjects;
    if (rock > 0) {
        subjects.push_back({"rock " + std::to_string(rock), generate(Shape::rock, rock, 1)});
        LODE_CHECK(repair(subjects[0].mesh).has_value());
    } else {
        subjects = simplification_subjects();
    }
    for (const Subject& subject : subjects) {
        if (rock == 0 && subject.name.find(wanted) == std::string::npos) continue;
        write_asset(positions_alone(subject.mesh), path);
        set_thread_count(1);
        print(subject.name, measure(path), json);
        set_thread_count(0);
    }
    if (kept.empty()) std::filesystem::remove(path);
    return 0;
}
