#include <cstdio>
#include <filesystem>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/options/bake_options.h"
#include "apps/options/common_options.h"
#include "apps/options/memory_option.h"
#include "apps/scene/bake.h"
#include "apps/terminal.h"
#include "base/text.h"
#include "base/threads.h"
#include "mesh/io/image_file.h"
#include "report/thumbnail.h"

namespace lodestone {

namespace {

struct BakeArguments {
    std::string mesh, out, report, thumbnail;
    unsigned threads = 0;
    MemoryOption memory;  // its folder holds the work folder, too
    bool resume = false;
    bool json = false;
    BakeWords words;
};

void print_summary(const Json& report) {
    const auto& input = report["input"];
    std::printf("%s: %llu triangles, %llu vertices, %llu components, %llu boundary loops\n",
                printable(report["name"].get<std::string>()).c_str(), input["triangles"].get<unsigned long long>(),
                input["vertices"].get<unsigned long long>(), input["components"].get<unsigned long long>(),
                input["boundary_loops"].get<unsigned long long>());
    for (const auto& [what, count] : report["repair"].items()) {
        if (count.get<uint64_t>() > 0)
            std::printf("  repaired: %s %llu\n", what.c_str(), count.get<unsigned long long>());
    }
    if (report.contains("lod")) {
        const auto& lod = report["lod"];
        std::printf(
            "  lod: %u levels down to %u triangles (%s); simplified in %.2f s of CPU, errors measured in %.2f s\n",
            lod["levels"].get<unsigned>(), lod["base_triangles"].get<unsigned>(),
            lod["stopped_because"].get<std::string>().c_str(), lod["simplify_cpu_seconds"].get<double>(),
            lod["error_seconds"].get<double>());
    }
    if (report.contains("vgi")) {
        const auto& vgi = report["vgi"];
        std::printf(
            "  vgi: %u clusters, %u charts of %u^2 samples; stretch %.3f (worst %.2f); error rms %.2g, largest %.2g of "
            "the "
            "diagonal; %llu bytes\n",
            vgi["clusters"].get<unsigned>(), vgi["charts"].get<unsigned>(), vgi["resolution"].get<unsigned>(),
            vgi["l2_stretch_rms"].get<double>(), vgi["l2_stretch_worst"].get<double>(), vgi["rms_error"].get<double>(),
            vgi["max_error"].get<double>(), vgi["bytes"].get<unsigned long long>());
    }
    std::printf("  %llu bytes in %.2f s\n", report["out_bytes"].get<unsigned long long>(),
                report["seconds"].get<double>());
}

// Two scans of equal content, baked at the same time, have work folders of their own.
Hash128 work_key(const Hash128& bake, const std::string& out) {
    std::error_code error;
    const std::string text = bake.hex() + std::filesystem::weakly_canonical(out, error).string();
    return hash_of(std::span(text.data(), text.size()));
}

// Reads, bakes and writes; returns the report.
Result<Json> bake_file(const BakeArguments& given, const BakeOptions& options) {
    const Progress progress = terminal_progress();
    auto input = read_bake_input(given.mesh, options, progress);
    if (!input) return tl::unexpected(input.error());
    if (!given.thumbnail.empty()) {
        if (auto done = write_png(thumbnail_of(input->mesh), given.thumbnail); !done)
            return tl::unexpected(done.error());
    }
    std::optional<CheckpointFolder> work;
    if (given.resume) {
        auto folder =
            CheckpointFolder::open(given.memory.folder(), work_key(bake_key(input->source, options), given.out));
        if (!folder) return tl::unexpected(folder.error());
        work = std::move(*folder);
        if (work->begun()) announce("going on with what " + work->path().string() + " has kept");
    }
    auto report = bake_asset(std::move(*input), options, given.out, progress, work ? &*work : nullptr);
    if (!report && report.error().fault == Fault::interrupted && work)
        announce("the same command goes on from " + work->path().string());
    if (report && work) work->remove();
    return report;
}

Result<int> bake(const BakeArguments& given) {
    const auto options = bake_options_of(given.words);
    if (!options) return tl::unexpected(options.error());
    set_thread_count(given.threads);
    if (auto done = limit_memory(given.memory, "baking takes"); !done) return tl::unexpected(done.error());
    const auto report = bake_file(given, *options);
    if (!report) return tl::unexpected(report.error());
    end_progress();
    if (!given.report.empty()) {
        if (auto done = write_json(given.report, report->dump(2)); !done) return tl::unexpected(done.error());
    }
    if (given.json) {
        print_line(report->dump(2));
    } else if (verbosity() != Verbosity::quiet) {
        print_summary(*report);
    }
    return 0;
}

// Options by what they are about. Help lists them in the order in which they are added.
void add_file_options(CLI::App& command, BakeArguments& o) {
    command
        .add_option("mesh", o.mesh,
                    "Mesh (PLY, OBJ, STL, OFF, glTF, GLB) or height map (16-bit PNG, GeoTIFF); also .gz")
        ->required();
    command.add_option("-o,--out", o.out, "Asset to write, .lode")->required();
}

void add_machine_options(CLI::App& command, BakeArguments& o) {
    command.add_option("--threads", o.threads, "Threads to use; 0 takes one per core")->capture_default_str();
    add_memory_option(command, o.memory);
    command.add_flag(
        "--resume", o.resume,
        "Keep finished stages in a work folder until the asset is written; the same command then goes on from "
        "them, even if it was killed");
    add_tmp_option(command, o.memory, "--resume and --memory, on a disk; the system's folder for temporary files");
    command.add_option("--report", o.report, "Also write the bake report to this JSON file");
    command.add_option("--thumbnail", o.thumbnail, "Also draw a small picture of the mesh, a PNG of 96 x 72");
    command.add_flag("--json", o.json, "Print the bake report as JSON");
}

}  // namespace

void add_bake(CLI::App& app, Run& run) {
    const auto o = std::make_shared<BakeArguments>();
    CLI::App* command = app.add_subcommand(
        "bake", "Make an asset from a mesh: a progressive mesh, an atlas of geometry images, or both");
    add_file_options(*command, *o);
    add_bake_options(*command, o->words);
    add_machine_options(*command, *o);
    command->footer(
        examples("lodestone bake bunny.obj -o bunny.lode\n"
                 "lodestone bake scan.ply.gz -o scan.lode --backends lod,vgi --report scan.json\n"
                 "lodestone bake large.ply -o large.lode --backends vgi --resume   # and again, should it be stopped\n"
                 "lodestone bake dem.tif -o dem.lode --backends vgi --fill-voids --clusters 300 --resolution 65"));
    command->callback([o, &run] { run = [o] { return bake(*o); }; });
}

}  // namespace lodestone
