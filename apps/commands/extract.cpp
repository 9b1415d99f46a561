#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/scene/asset.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "lod/asset/cursor.h"
#include "mesh/io/write.h"
#include "vgi/extract/atlas_levels.h"

namespace lodestone {

namespace {

struct ExtractArguments {
    std::string asset, backend = "lod", order, out, encoding = "plain";
    WriteOptions write;
    TextureFormat textures;
    uint32_t resolution = 8192;
    std::optional<uint64_t> triangles;
    std::optional<double> error;
    bool json = false, prefix = false;
    std::optional<uint32_t> level;
};

float error_of(const ProgressiveMesh& pm, uint32_t level) { return pm.errors[level]; }
float error_of(const vgi::AtlasLevels& levels, uint32_t level) { return levels.error_at(level); }

// The level that is asked for, of anything with numbered levels.
// missing: levels finer than those there; the option counts them, what is returned does not.
template <class Levels>
Result<uint32_t> chosen_level(const ExtractArguments& o, const Levels& levels, uint32_t missing = 0) {
    const uint32_t count = levels.levels();
    if (o.triangles) {
        const uint32_t level = levels.level_for_triangles(*o.triangles);
        if (levels.triangles_at(level) > *o.triangles)
            terminal_progress().warning("the coarsest level has " + std::to_string(levels.triangles_at(level)) +
                                        " triangles");
        return level;
    }
    if (o.error) {
        const uint32_t level = levels.level_for_error(*o.error);
        if (const float least = error_of(levels, level); static_cast<double>(least) > *o.error)
            terminal_progress().warning("the finest level has an error of " + std::to_string(least));
        return level;
    }
    if (*o.level < missing || *o.level - missing >= count)
        return fail(Fault::usage, "--level " + std::to_string(*o.level) + ": the asset has levels " +
                                      std::to_string(missing) + " (finest) to " + std::to_string(missing + count - 1));
    return *o.level - missing;
}

Result<int> write_level(const ExtractArguments& o, const WriteOptions& write, const TriMesh& mesh, uint32_t level,
                        uint32_t levels, float error) {
    for (const std::string& line : lost_in_writing(mesh, o.out)) terminal_progress().warning(line);
    if (auto done = write_mesh(mesh, o.out, write); !done) return tl::unexpected(done.error());
    if (o.json) {
        const Json json = {{"triangles", mesh.triangle_count()}, {"level", level}, {"error", error}};
        print_line(json.dump(2));
    } else if (verbosity() != Verbosity::quiet) {
        std::printf("level %u of %u: %zu triangles, error %g\n", level, levels, mesh.triangle_count(),
                    static_cast<double>(error));
    }
    return 0;
}

// With what is baked into the atlas as textures, where the file can hold them.
Result<TriMesh> mesh_of(const ExtractArguments& o, const vgi::Atlas& atlas, const vgi::AtlasLevels& levels,
                        uint32_t level) {
    if (!atlas.attributes.baked) return vgi::extract_level(atlas, levels, level);
    if (std::filesystem::path(o.out).extension() == ".ply") {
        terminal_progress().warning(o.out +
                                    ": PLY holds no textures, so colours of samples stand in their place; "
                                    "write .glb or .obj");
        return vgi::extract_level(atlas, levels, level);
    }
    auto mesh = vgi::extract_with_textures(atlas, levels, level, o.resolution);
    if (!mesh) return fail(mesh.error().fault, "--resolution " + mesh.error().message);
    if (const std::string line = o.textures.lost(mesh->images); !line.empty()) terminal_progress().warning(line);
    return mesh;
}

Result<int> extract_atlas(const ExtractArguments& o, const Asset& asset) {
    if (!o.order.empty()) return fail(Fault::usage, "--order " + o.order + ": is for the lod backend");
    const auto atlas = asset.atlas();
    if (!atlas) return tl::unexpected(atlas.error());
    const vgi::AtlasLevels levels = vgi::levels_of(*atlas);
    const uint32_t missing = levels.has_source() ? 0 : 1;  // the source is level 0, there or not
    const auto level = chosen_level(o, levels, missing);
    if (!level) return tl::unexpected(level.error());
    const auto mesh = mesh_of(o, *atlas, levels, *level);
    if (!mesh) return tl::unexpected(mesh.error());
    WriteOptions write = o.write;
    write.exact_uvs = atlas->attributes.baked;  // borders of charts lie in the middles of texels
    return write_level(o, write, *mesh, *level + missing, levels.levels() + missing, levels.error_at(*level));
}

Result<int> extract(const ExtractArguments& o) {
    if (o.backend != "lod" && o.backend != "vgi")
        return fail(Fault::usage,
                    "--backend " + o.backend + ": there is nothing to extract from it; choose lod or vgi");
    const int given = o.triangles.has_value() + o.error.has_value() + o.level.has_value();
    if (given != 1) return fail(Fault::usage, "extract: give exactly one of --triangles, --error, --level");
    auto asset = open_asset(o.asset, o.prefix ? Extent::prefix : Extent::whole);
    if (!asset) return tl::unexpected(asset.error());
    if (o.backend == "vgi") return extract_atlas(o, *asset);
    if (asset->lod == nullptr)
        return fail(Fault::format, o.asset + ": holds no progressive mesh; bake it with --backends lod");
    const ProgressiveMesh& pm = *asset->lod;
    const FaceOrder* order = o.order.empty() ? pm.orders.data() : pm.order_named(o.order);
    if (order == nullptr)
        return fail(Fault::usage,
                    "--order " + o.order + ": the asset does not hold it; bake it with --order " + o.order);
    const auto level = chosen_level(o, pm, pm.levels_missing);
    if (!level) return tl::unexpected(level.error());
    const auto mesh = extract_level(pm, *level, static_cast<uint32_t>(order - pm.orders.data()));
    if (!mesh) return fail_at(o.asset, mesh.error());
    return write_level(o, o.write, *mesh, *level + pm.levels_missing, pm.levels() + pm.levels_missing,
                       pm.errors[*level]);
}

}  // namespace

void add_extract(CLI::App& app, Run& run) {
    const auto o = std::make_shared<ExtractArguments>();
    CLI::App* command = app.add_subcommand("extract", "Write one level of an asset as a mesh, faces in drawing order");
    command->add_option("asset", o->asset, "Asset file, .lode")->required();
    command->add_option("--backend", o->backend, "lod (progressive mesh) or vgi (geometry images)")
        ->capture_default_str();
    command->add_option("--order", o->order, "lod: face order to write; the asset's first unless given");
    command->add_option("--triangles", o->triangles, "Write the finest level with at most this many triangles");
    command->add_option("--error", o->error, "Write the coarsest level whose error is at most this, in object units")
        ->check(CLI::NonNegativeNumber);
    command
        ->add_option("--level", o->level,
                     "Write this level; 0, or source, is the source itself (vgi: its leaves, 1 the finest samples). "
                     "Give exactly one of --triangles, --error and --level")
        ->transform([](const std::string& level) { return level == "source" ? std::string("0") : level; });
    command->add_option("-o,--out", o->out, "Mesh to write: .ply, .obj or .glb")->required();
    command
        ->add_option("--resolution", o->resolution,
                     "vgi, of baked textures: texels along a side of what is written, at most")
        ->check(CLI::Range(16, 16384))
        ->capture_default_str();
    add_texture_options(*command, o->textures);
    add_encoding_option(*command, o->encoding);
    add_prefix_option(*command, o->prefix);
    command->add_flag("--json", o->json, "Print triangles, level and error (object units) as JSON");
    command->footer(
        examples("lodestone extract bunny.lode --backend lod --triangles 5000 -o bunny-5k.glb\n"
                 "lodestone extract atlas.lode --backend vgi --level source -o atlas.ply"));
    command->callback([o, &run] {
        run = [o]() -> Result<int> {
            const auto write = write_options_of(o->encoding, o->out);
            if (!write) return tl::unexpected(write.error());
            o->write = *write;
            if (auto good = o->textures.put(o->write, o->resolution); !good) return tl::unexpected(good.error());
            return extract(*o);
        };
    });
}

}  // namespace lodestone
