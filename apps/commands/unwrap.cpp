#include "vgi/unwrap/unwrap.h"
#include "base/json.h"

#include <algorithm>
#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/clock.h"
#include "base/text.h"
#include "base/threads.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"
#include "mesh/repair.h"
#include "vgi/unwrap/texture_bake.h"

namespace lodestone {

namespace {

struct UnwrapArguments {
    std::string mesh, out, report, format = "png", encoding = "plain";
    vgi::UnwrapOptions unwrap;
    uint32_t resolution = 4096;
    double gutter = 4;
    unsigned threads = 0;
    int quality = 92;
    bool bake = false, json = false;
    ReadOptions read;
};

nlohmann::json to_json(const vgi::UnwrapReport& r) {
    const double more = r.source_triangles > 0 ? static_cast<double>(r.triangles - r.source_triangles) /
                                                     static_cast<double>(r.source_triangles)
                                               : 0;
    return {{"charts", r.charts},
            {"rounds", r.rounds},
            {"source_triangles", r.source_triangles},
            {"source_vertices", r.source_vertices},
            {"triangles", r.triangles},
            {"vertices", r.vertices},
            {"cut_share", more},
            {"seam_edges", r.seam_edges},
            {"seam_length", r.seam_length},
            {"l2_stretch_rms", r.l2_stretch_rms},
            {"l2_stretch_worst", r.l2_stretch_worst},
            {"coverage", r.coverage},
            {"flipped_triangles", r.flipped},
            {"overlapping_pairs", r.overlapping}};
}

// What becomes of textures is said where it may surprise.
void tell_of_textures(const UnwrapArguments& o, const TriMesh& mesh) {
    const Progress progress = terminal_progress();
    if (!o.bake && !mesh.images.empty())
        progress.warning(
            "the textures of the mesh do not fit its new texture coordinates and are left out; --bake "
            "brings them over");
    if (o.bake && o.format == "jpeg") {
        const auto clear = [](const Image& image) {
            return std::ranges::any_of(image.texels, [](const glm::u8vec4& t) { return t.w < 255; });
        };
        if (std::ranges::any_of(mesh.images, clear)) progress.warning("JPEG holds no alpha; --texture-format png does");
    }
}

struct Seconds {
    double read = 0, bake = 0, write = 0, all = 0;
};

Result<vgi::Unwrapped> unwrap_mesh(const UnwrapArguments& o, const TriMesh& mesh, vgi::UnwrapReport& report,
                                   Seconds& seconds) {
    vgi::UnwrapOptions options = o.unwrap;
    options.gutter = o.gutter / o.resolution;
    auto made = vgi::unwrap(mesh, options, report, terminal_progress());
    if (!made) return fail_at(o.mesh, made.error());
    if (!o.bake) return made;
    terminal_progress().at("textures", 0);
    const Stopwatch watch;
    const auto images = vgi::bake_textures(mesh, *made, options.textures, o.resolution);
    vgi::use_textures(made->mesh, images, std::max<size_t>(1, mesh.material_table.size()));
    seconds.bake = watch.wall();
    return made;
}

void print_summary(const vgi::UnwrapReport& r, const Seconds& seconds) {
    std::printf("%u charts, %llu triangles (%llu before); stretch %.3f (worst %.2f); %.1f%% covered; %.2f s\n",
                r.charts, static_cast<unsigned long long>(r.triangles),
                static_cast<unsigned long long>(r.source_triangles), r.l2_stretch_rms, r.l2_stretch_worst,
                100 * r.coverage, seconds.all);
}

Result<void> tell(const UnwrapArguments& o, const vgi::UnwrapReport& report, const Seconds& seconds) {
    nlohmann::json json = to_json(report);
    json["textures"] = o.unwrap.textures;
    json["resolution"] = o.resolution;
    json["gutter"] = o.gutter;
    json["baked"] = o.bake;
    json["seconds"] = {{"read", seconds.read},
                       {"cluster", report.cluster_seconds},
                       {"lay_out", report.lay_out_seconds},
                       {"pack", report.pack_seconds},
                       {"check", report.check_seconds},
                       {"bake", seconds.bake},
                       {"write", seconds.write},
                       {"all", seconds.all}};
    json["peak_rss_bytes"] = peak_rss_bytes();
    if (!o.report.empty()) {
        if (auto done = write_json(o.report, json.dump(2)); !done) return done;
    }
    if (o.json)
        print_line(json.dump(2));
    else if (verbosity() != Verbosity::quiet)
        print_summary(report, seconds);
    return {};
}

Result<int> unwrap_file(const UnwrapArguments& o) {
    set_thread_count(o.threads);
    const Progress progress = terminal_progress();
    const Stopwatch all;
    Seconds seconds;
    auto write = write_options_of(o.encoding, o.out, o.format == "jpeg" ? o.quality : 0);
    if (!write) return tl::unexpected(write.error());
    write->exact_uvs = true;  // rounded further, small triangles would be turned over
    progress.at("read", 0);
    ReadReport told;
    ReadOptions read = o.read;
    read.load_images = true;
    auto mesh = read_mesh(o.mesh, read, &told);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const std::string& line : told.warnings) progress.warning(line);
    tell_of_textures(o, *mesh);
    auto repaired = repair(*mesh);
    if (!repaired) return fail_at(o.mesh, repaired.error());
    seconds.read = all.wall();
    vgi::UnwrapReport report;
    auto made = unwrap_mesh(o, *mesh, report, seconds);
    if (!made) return tl::unexpected(made.error());
    const Stopwatch write_watch;
    progress.at("write", 0);
    for (const std::string& line : lost_in_writing(made->mesh, o.out)) progress.warning(line);
    if (auto done = write_mesh(made->mesh, o.out, *write); !done) return tl::unexpected(done.error());
    seconds.write = write_watch.wall();
    seconds.all = all.wall();
    end_progress();
    if (auto done = tell(o, report, seconds); !done) return tl::unexpected(done.error());
    return 0;
}

void add_square_options(CLI::App& command, UnwrapArguments& o) {
    command.add_option("--charts", o.unwrap.charts, "Charts wanted; 0 for as many as suit the mesh")
        ->check(CLI::Range(0, 1 << 20))
        ->capture_default_str();
    command
        .add_option("--worst-stretch", o.unwrap.worst_stretch,
                    "Charts that are stretched more than this are cut finer, L2; 1 is even")
        ->check(CLI::Range(1.1, 1e6))
        ->capture_default_str();
    command.add_option("--textures", o.unwrap.textures, "Squares that charts are spread over, a material for each")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command.add_option("--resolution", o.resolution, "Texels along a side of a square")
        ->check(CLI::Range(16, 16384))
        ->capture_default_str();
    command.add_option("--gutter", o.gutter, "Texels between charts, at least")
        ->check(CLI::Range(0.0, 256.0))
        ->capture_default_str();
}

void add_bake_options_of_unwrap(CLI::App& command, UnwrapArguments& o) {
    command.add_flag("--bake", o.bake, "Bring colours and textures of the materials over into the new squares");
    command.add_option("--texture-format", o.format, "Of baked textures: png or jpeg")
        ->check(CLI::IsMember({"png", "jpeg"}))
        ->capture_default_str();
    command.add_option("--jpeg-quality", o.quality, "Of JPEG textures")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
}

}  // namespace

void add_unwrap(CLI::App& app, Run& run) {
    const auto o = std::make_shared<UnwrapArguments>();
    CLI::App* command = app.add_subcommand(
        "unwrap", "Give a mesh new texture coordinates without overlaps, and bake its textures into them");
    command->add_option("mesh", o->mesh, "Mesh (PLY, OBJ, STL, OFF, glTF, GLB) or height map; also .gz")->required();
    command->add_option("-o,--out", o->out, "Mesh to write: .glb, .obj or .ply")->required();
    add_square_options(*command, *o);
    add_bake_options_of_unwrap(*command, *o);
    add_encoding_option(*command, o->encoding);
    command->add_option("--threads", o->threads, "Threads to use; 0 takes one per core")->capture_default_str();
    command->add_option("--report", o->report, "Also write stretch, coverage, seams and times to this JSON file");
    command->add_flag("--json", o->json, "Print the report as JSON");
    add_outside_option(*command, o->read.allow_outside);
    command->footer(
        examples("lodestone unwrap scan.obj -o scan.glb --bake --resolution 8192\n"
                 "lodestone unwrap rock.ply -o rock.obj --report rock.json"));
    command->callback([o, &run] { run = [o] { return unwrap_file(*o); }; });
}

}  // namespace lodestone
