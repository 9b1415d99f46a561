#include "apps/scene/unwrap.h"

#include <algorithm>
#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/options/unwrap_options.h"
#include "apps/terminal.h"
#include "base/clock.h"
#include "base/text.h"
#include "base/threads.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

struct UnwrapArguments {
    std::string mesh, out, report, encoding = "plain";
    TextureFormat format;
    UnwrapChoices choices;
    unsigned threads = 0;
    bool json = false;
    ReadOptions read;
};

Result<WriteOptions> write_options(const UnwrapArguments& o) {
    auto write = write_options_of(o.encoding, o.out);
    if (!write) return write;
    if (auto good = o.format.put(*write, o.choices.bake ? o.choices.resolution : 0); !good)
        return tl::unexpected(good.error());
    write->exact_uvs = true;  // rounded further, small triangles would be turned over
    return write;
}

struct Seconds {
    double read = 0, write = 0, all = 0;
};

void print_summary(const vgi::UnwrapReport& r, const Seconds& seconds) {
    std::printf("%u charts, %llu triangles (%llu before); stretch %.3f (worst %.2f); %.1f%% covered; %.2f s\n",
                r.charts, static_cast<unsigned long long>(r.triangles),
                static_cast<unsigned long long>(r.source_triangles), r.l2_stretch_rms, r.l2_stretch_worst,
                100 * r.coverage, seconds.all);
}

Result<void> tell(const UnwrapArguments& o, const UnwrapDone& done, const Seconds& seconds) {
    const vgi::UnwrapReport& report = done.report;
    Json json = unwrap_report(report, o.choices);
    json["seconds"] = {{"read", seconds.read},
                       {"cluster", report.cluster_seconds},
                       {"lay_out", report.lay_out_seconds},
                       {"pack", report.pack_seconds},
                       {"check", report.check_seconds},
                       {"bake", done.bake_seconds},
                       {"write", seconds.write},
                       {"all", seconds.all}};
    json["peak_rss_bytes"] = peak_rss_bytes();
    if (!o.report.empty()) {
        if (auto written = write_json(o.report, json.dump(2)); !written) return written;
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
    const auto write = write_options(o);
    if (!write) return tl::unexpected(write.error());
    progress.at("read", 0);
    ReadReport told;
    ReadOptions read = o.read;
    read.load_images = true;
    auto mesh = read_mesh(o.mesh, read, &told);
    if (!mesh) return tl::unexpected(mesh.error());
    for (const std::string& line : told.warnings) progress.warning(line);
    if (const std::string line = o.format.lost(mesh->images); o.choices.bake && !line.empty()) progress.warning(line);
    auto repaired = repair(*mesh, {}, progress);
    if (!repaired) return fail_at(o.mesh, repaired.error());
    seconds.read = all.wall();
    auto made = unwrap_mesh(*mesh, o.choices, progress);
    if (!made) return fail_at(o.mesh, made.error());
    const Stopwatch write_watch;
    progress.at("write", 0);
    for (const std::string& line : lost_in_writing(made->unwrapped.mesh, o.out)) progress.warning(line);
    if (auto done = write_mesh(made->unwrapped.mesh, o.out, *write); !done) return tl::unexpected(done.error());
    seconds.write = write_watch.wall();
    seconds.all = all.wall();
    end_progress();
    if (auto done = tell(o, *made, seconds); !done) return tl::unexpected(done.error());
    return 0;
}

}  // namespace

void add_unwrap(CLI::App& app, Run& run) {
    const auto o = std::make_shared<UnwrapArguments>();
    CLI::App* command = app.add_subcommand(
        "unwrap", "Give a mesh new texture coordinates without overlaps, and bake its textures into them");
    command->add_option("mesh", o->mesh, "Mesh (PLY, OBJ, STL, OFF, glTF, GLB) or height map; also .gz")->required();
    command->add_option("-o,--out", o->out, "Mesh to write: .glb, .obj or .ply")->required();
    add_unwrap_options(*command, o->choices);
    add_texture_options(*command, o->format);
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
