#include <cstdio>
#include <filesystem>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/commands/probed_cache.h"
#include "apps/scene/bake.h"
#include "apps/terminal.h"
#include "base/spill.h"
#include "base/text.h"
#include "base/threads.h"
#include "lod/bake/orders/face_order.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {

namespace {

constexpr uint64_t least_bake_memory_mib = 192;  // the program itself, and what small blocks take

struct Options {
    std::string mesh, out, backends = "lod", orders = "keyframe,static,classic", cache = "fifo16", report;
    unsigned threads = 0;
    uint64_t memory_mib = 0;  // 0: whatever it takes
    std::string tmp;          // for the work folder; empty: the system's
    bool resume = false;
    uint32_t resolution = 129, attribute_resolution = 0;  // of attributes: 0 for the same
    bool json = false;
    BakeOptions bake;
};

Result<void> check_backends(const std::vector<std::string>& backends) {
    for (const std::string& b : backends) {
        if (b != "lod" && b != "vgi" && b != "discrete" && b != "full")
            return fail(Fault::usage,
                        "--backends " + b + ": there is no such backend; choose from lod, vgi, discrete, full");
    }
    return {};
}

void print_summary(const nlohmann::json& report) {
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

Result<std::vector<std::string>> parse_orders(const std::string& text) {
    auto orders = parse_list("--order", text);
    if (!orders) return orders;
    for (auto order = orders->begin(); order != orders->end(); ++order) {
        if (auto orderer = face_orderer_named(*order); !orderer) return fail_at("--order", orderer.error());
        if (std::find(orders->begin(), order, *order) != order)
            return fail(Fault::usage, "--order " + text + ": names " + *order + " twice");
    }
    return orders;
}

// What the given words and numbers ask of a bake.
Result<BakeOptions> bake_options_of(const Options& given) {
    BakeOptions options = given.bake;
    auto backends = parse_list("--backends", given.backends);
    if (!backends) return tl::unexpected(backends.error());
    if (auto good = check_backends(*backends); !good) return tl::unexpected(good.error());
    auto orders = parse_orders(given.orders);
    if (!orders) return tl::unexpected(orders.error());
    options.atlas.cells = given.resolution - 1;
    if (given.attribute_resolution > 0) {
        if (given.attribute_resolution < given.resolution) {
            return fail(Fault::usage, "--attribute-resolution " + std::to_string(given.attribute_resolution) +
                                          ": must not be below --resolution, " + std::to_string(given.resolution));
        }
        options.atlas.attribute_ratio = (given.attribute_resolution - 1) / options.atlas.cells;
    }
    const auto model = given.cache == "auto" ? auto_cache_model() : cache_model_named(given.cache);
    if (!model) return fail_at("--cache", model.error());
    options.order.cache = *model;
    options.backends = *backends;
    options.orders = *orders;
    return options;
}

Result<void> limit_memory(uint64_t mib, const std::filesystem::path& tmp) {
    if (mib < least_bake_memory_mib) {
        return fail(Fault::usage, "--memory " + std::to_string(mib) + ": baking takes at least " +
                                      std::to_string(least_bake_memory_mib) + " MiB");
    }
    return begin_spilling({tmp, mib << 20});
}

// Reads, bakes and writes; returns the report. tmp: for the work folder, if stages are to be kept.
Result<nlohmann::json> bake_file(const Options& given, const BakeOptions& options, const std::filesystem::path& tmp) {
    const Progress progress = terminal_progress();
    auto input = read_bake_input(given.mesh, options, progress);
    if (!input) return tl::unexpected(input.error());
    std::optional<CheckpointFolder> work;
    if (given.resume) {
        auto folder = CheckpointFolder::open(tmp, bake_key(input->source, options));
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

Result<int> bake(const Options& given) {
    const auto options = bake_options_of(given);
    if (!options) return tl::unexpected(options.error());
    set_thread_count(given.threads);
    std::error_code no_folder;
    const std::filesystem::path tmp =
        given.tmp.empty() ? std::filesystem::temp_directory_path(no_folder) : std::filesystem::path(given.tmp);
    if (given.memory_mib > 0) {
        if (auto done = limit_memory(given.memory_mib, tmp); !done) return tl::unexpected(done.error());
    }
    const auto report = bake_file(given, *options, tmp);
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
void add_input_options(CLI::App& command, Options& o) {
    command
        .add_option("mesh", o.mesh,
                    "Mesh (PLY, OBJ, STL, OFF, glTF, GLB) or height map (16-bit PNG, GeoTIFF); also .gz")
        ->required();
    command.add_option("-o,--out", o.out, "Asset to write, .lode")->required();
    command
        .add_option("--backends", o.backends,
                    "What to bake, separated by commas: lod (a progressive mesh), vgi (an atlas of geometry images), "
                    "discrete (a chain of simplified meshes), full (the mesh itself)")
        ->capture_default_str();
    add_outside_option(command, o.bake.read.allow_outside);
}

void add_order_options(CLI::App& command, Options& o) {
    command
        .add_option(
            "--order", o.orders,
            "lod: face orders to bake, separated by commas: keyframe, greedy, static, classic; the first is drawn "
            "unless another is asked for")
        ->capture_default_str();
    command
        .add_option("--cache", o.cache,
                    "lod: vertex cache that face orders are optimised for: fifoN, lruN, nvidia, amd, intel or auto; "
                    "auto is the model that probe found last, or nvidia before any probe")
        ->capture_default_str();
    command
        .add_option(
            "--order-seconds", o.bake.order.seconds,
            "lod: longest search for a face order, in seconds, about; it is estimated from the size of the mesh, so "
            "that every machine makes the same asset")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
    command
        .add_option("--moves-per-ecol", o.bake.order.moves_per_ecol,
                    "lod: slots that keyframe and greedy write per edge collapse, about, at most; more give fewer "
                    "vertex transforms")
        ->check(CLI::Range(0.1, 100.0))
        ->capture_default_str();
}

void add_greedy_options(CLI::App& command, GreedyOptions& greedy) {
    const auto add = [&](const char* name, auto& value, auto least, auto most, const char* text) {
        command.add_option(name, value, text)->check(CLI::Range(least, most))->capture_default_str();
    };
    add("--greedy-group", greedy.group, 1, 100000,
        "lod: edge collapses to a group of the order greedy; tswaps come at its end");
    add("--greedy-window", greedy.window, 32, 100000,
        "lod: slots that a group of the order greedy rearranges; more give fewer vertex transforms");
    add("--greedy-step", greedy.step, 2, 100000,
        "lod: slots that the order greedy writes between two levels at most; the rest of a group's tswaps follow at "
        "the next levels");
    add("--greedy-in-place", greedy.in_place, 0.0, 1000.0,
        "lod: vertex transforms that the order greedy must save for each slot that it writes");
    add("--greedy-line", greedy.line, 0.0, 1000.0,
        "lod: vertex transforms that the order greedy must save for each line of the CPU's cache that it writes and "
        "the collapses of the group do not");
    add("--greedy-line-bytes", greedy.line_bytes, 16, 4096, "lod: bytes of a line of the CPU's cache, for the same");
    add("--greedy-waiting", greedy.waiting, 1.05, 100.0,
        "lod: drawn slots to a living face that the order greedy allows; dead slots wait until there are more");
    add("--look-ahead", greedy.look_ahead, 0, 1000,
        "lod: faces that the order greedy looks ahead for each choice; 0 for none");
}

void add_form_options(CLI::App& command, Options& o) {
    command
        .add_option("--quantise", o.bake.quantise,
                    "lod: round positions to this many bits along the longest side of the mesh, for a smaller file; "
                    "errors of levels are then those to the rounded mesh. Unless given they are kept as they are")
        ->check(CLI::Range(6, 24));
}

void add_chart_options(CLI::App& command, Options& o) {
    command
        .add_option("--clusters", o.bake.atlas.clusters.clusters,
                    "vgi: clusters wanted; each becomes one quad chart for each of its sides")
        ->check(CLI::Range(1, 1 << 20))
        ->capture_default_str();
    command
        .add_option("--target-error", o.bake.target_error,
                    "vgi: double --clusters until the error of the finest level is at most this, in object units")
        ->check(CLI::PositiveNumber);
    command.add_option("--resolution", o.resolution, "vgi: samples along each side of a chart, 2^n + 1")
        ->check(CLI::IsMember({3, 5, 9, 17, 33, 65, 129, 257, 513, 1025}))
        ->capture_default_str();
    command
        .add_option(
            "--attribute-resolution", o.attribute_resolution,
            "vgi: samples of normals, colours and texture coordinates along each side; at least --resolution, which "
            "it is unless given")
        ->check(CLI::IsMember({3, 5, 9, 17, 33, 65, 129, 257, 513, 1025, 2049, 4097}));
}

void add_cluster_weights(CLI::App& command, Options& o) {
    const auto cluster_weight = [&](const char* name, double& value, const char* what) {
        command.add_option(name, value, std::string("vgi: weight, in the cost of a cluster, of ") + what)
            ->check(CLI::Range(0.0, 1e6))
            ->capture_default_str();
    };
    vgi::ClusterWeights& weights = o.bake.atlas.clusters.weights;
    cluster_weight("--planarity-weight", weights.planarity, "its distance from a plane");
    cluster_weight("--compactness-weight", weights.compactness, "the length of its border");
    cluster_weight("--irregularity-weight", weights.irregularity, "how much less round a merge makes it");
    cluster_weight("--size-weight", weights.size, "its area");
    cluster_weight("--curvature-weight", weights.curvature, "how far its normals differ");
    cluster_weight("--feature-weight", weights.feature, "creases and edges of colour or material inside it");
    cluster_weight("--bulge-weight", weights.bulge, "how far it bulges beyond its border");
}

void add_sampling_options(CLI::App& command, Options& o) {
    command
        .add_option("--worst-stretch", o.bake.atlas.worst_stretch,
                    "vgi: largest stretch of a chart; where a chart has more, clusters are made finer")
        ->check(CLI::Range(1.1, 1e6))
        ->capture_default_str();
    command
        .add_option(
            "--curvature-importance", o.bake.atlas.parameterise.curvature_importance,
            "vgi: samples are denser where the surface bends, by its curvature to this power; 0 spreads them evenly")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    command
        .add_option(
            "--rounding-share", o.bake.atlas.rounding_share,
            "vgi: error that the rounding of positions may add, as a share of the error of sampling; a smaller share "
            "takes more bytes")
        ->check(CLI::Range(0.0, 10.0))
        ->capture_default_str();
}

void add_machine_options(CLI::App& command, Options& o) {
    command.add_option("--threads", o.threads, "Threads to use; 0 takes one per core")->capture_default_str();
    command
        .add_option("--memory", o.memory_mib,
                    "Memory to keep to, in MiB, about, at least 192; the rest waits in unnamed files in --tmp")
        ->check(CLI::Range(1, 1 << 30));
    command.add_flag(
        "--resume", o.resume,
        "Keep finished stages in a work folder until the asset is written; the same command then goes on from "
        "them, even if it was killed");
    command
        .add_option(
            "--tmp", o.tmp,
            "Folder for the files of --resume and --memory, on a disk; the system's folder for temporary files unless "
            "given")
        ->check(CLI::ExistingDirectory);
    command.add_option("--report", o.report, "Also write the bake report to this JSON file");
    command.add_flag("--json", o.json, "Print the bake report as JSON");
}

void add_simplifier_options(CLI::App& command, Options& o) {
    command
        .add_option("--simplifier", o.bake.simplifier,
                    "lod: simplifier: quadric (our own) or openmesh (OpenMesh's decimater)")
        ->check(CLI::IsMember({"quadric", "openmesh"}))
        ->capture_default_str();
    const auto attribute_weight = [&](const char* name, double& value, const char* what, double otherwise) {
        command
            .add_option(name, value, std::string("lod: weight of ") + what + " in the error that the simplifier counts")
            ->check(CLI::Range(0.0, 1e6))
            ->default_str(CLI::detail::to_string(otherwise));
    };
    const SimplifyOptions simplify;
    attribute_weight("--normal-weight", o.bake.normal_weight, "normals", simplify.normal_weight);
    attribute_weight("--uv-weight", o.bake.uv_weight, "texture coordinates", simplify.uv_weight);
    attribute_weight("--colour-weight", o.bake.colour_weight, "colours", simplify.colour_weight);
    command
        .add_option("--error-samples", o.bake.error_samples,
                    "lod: points on each surface from which the error of a level is measured")
        ->check(CLI::Range(1000, 100000000))
        ->capture_default_str();
}

void add_height_options(CLI::App& command, Options& o) {
    command.add_option("--height-scale", o.bake.read.height_scale, "Height maps: object units per height unit")
        ->capture_default_str();
    command
        .add_option("--pixel-size", o.bake.read.pixel_size,
                    "Height maps: object units between samples; 0 takes the file's")
        ->capture_default_str();
    command.add_option("--void-height", o.bake.read.void_height,
                       "Height maps: samples of this height (before scaling) hold no data");
    command.add_flag("--fill-voids", o.bake.read.fill_voids,
                     "Height maps: fill samples that hold no data from around them, instead of leaving holes");
}

}  // namespace

void add_bake(CLI::App& app, Run& run) {
    const auto o = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "bake", "Make an asset from a mesh: a progressive mesh, an atlas of geometry images, or both");
    add_input_options(*command, *o);
    add_order_options(*command, *o);
    add_greedy_options(*command, o->bake.order.greedy);
    add_form_options(*command, *o);
    add_chart_options(*command, *o);
    add_cluster_weights(*command, *o);
    add_sampling_options(*command, *o);
    add_machine_options(*command, *o);
    add_simplifier_options(*command, *o);
    add_height_options(*command, *o);
    command->footer(
        examples("lodestone bake bunny.obj -o bunny.lode\n"
                 "lodestone bake scan.ply.gz -o scan.lode --backends lod,vgi --report scan.json\n"
                 "lodestone bake large.ply -o large.lode --backends vgi --resume   # and again, should it be stopped\n"
                 "lodestone bake dem.tif -o dem.lode --backends vgi --fill-voids --clusters 300 --resolution 65"));
    command->callback([o, &run] { run = [o] { return bake(*o); }; });
}

}  // namespace lodestone
