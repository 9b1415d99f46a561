#include <cmath>
#include <cstdio>
#include <filesystem>

#include "apps/commands/commands.h"
#include "apps/commands/tile_clip.h"
#include "apps/commands/tile_place.h"
#include "apps/options/bake_options.h"
#include "apps/options/common_options.h"
#include "apps/options/memory_option.h"
#include "apps/scene/scene.h"
#include "apps/scene/workplace.h"
#include "apps/terminal.h"
#include "base/check.h"
#include "base/clock.h"
#include "base/files/file.h"
#include "base/files/output_folder.h"
#include "base/json.h"
#include "base/text.h"
#include "base/threads.h"
#include "tiles/tileset.h"
#include "tiles/view_page.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

struct TileArguments {
    std::string input, out, encoding = "meshopt", viewer;
    PlaceOptions place;
    std::vector<std::string> clip;
    uint32_t tile_triangles = 32768;
    unsigned threads = 0;
    MemoryOption memory;
    bool allow_outside = false, json = false;
    ReadOptions heights;
};

bool is_of_a_tileset(const std::string& name) {
    return name == "tileset.json" || name == "view.html" || name == "t" || name == "s" || name == "i" || name == "a";
}

// An address, or a folder as it is seen from the page.
std::string viewer_address(const TileArguments& o) {
    if (o.viewer.empty() || o.viewer.find("://") != std::string::npos) return o.viewer;
    std::error_code error;
    if (!fs::is_directory(o.viewer, error)) return o.viewer;
    return fs::relative(fs::absolute(o.viewer), fs::absolute(o.out), error).generic_string();
}

struct Made {
    tiles::TilesetReport report;  // of all parts together
    uint32_t parts = 1;
    double bake_seconds = 0;
};

// Adds the figures of one part to those of all.
void add(tiles::TilesetReport& sum, const tiles::TilesetReport& part) {
    sum.tiles += part.tiles;
    sum.leaves += part.leaves;
    sum.tilesets += part.tilesets;
    sum.depth = std::max(sum.depth, part.depth + 1);
    sum.leaf_triangles += part.leaf_triangles;
    sum.triangles += part.triangles;
    sum.closing_triangles += part.closing_triangles;
    sum.glb_bytes += part.glb_bytes;
    sum.json_bytes += part.json_bytes;
    sum.image_bytes += part.image_bytes;
    sum.root_bytes += part.root_bytes;
    sum.root_error = std::max(sum.root_error, part.root_error);
}

class SceneTiler {
public:
    SceneTiler(const ReadyScene& scene, const tiles::TilesetOptions& options, TilePlace& place, const fs::path& folder,
               const Progress& progress)
        : scene_(scene), options_(options), place_(place), folder_(folder), progress_(progress) {}

    // The scene's mesh is a piece of its source.
    Result<Made> run(const tiles::PieceOfSource& piece) {
        auto atlas = atlas_of(scene_.instances[0].asset);
        if (!atlas) return tl::unexpected(atlas.error());
        tiles::TilesetOptions options = options_;
        auto cut = tiles::CutRims::fit(*atlas, piece);
        if (!cut) return tl::unexpected(cut.error());
        options.cut = std::move(*cut);
        // All pieces stand in one frame, that of the whole.
        const tiles::TileBox whole{piece.whole.centre(), (piece.whole.high - piece.whole.low) * 0.5f};
        const auto placed = place_.transform(tiles::moved(whole, tiles::to_tile_axes(options_.up)), progress_);
        if (!placed) return tl::unexpected(placed.error());
        options.transform = *placed;
        const auto report = tiles::write_tileset(*atlas, folder_, options, progress_);
        if (!report) return tl::unexpected(report.error());
        return Made{*report};
    }
    // A scene of one instance is one tileset; of others each asset is one, and one more places them.
    Result<Made> run() {
        if (scene_.instances.size() == 1) {
            const auto report = write_alone(scene_.instances[0]);
            if (!report) return tl::unexpected(report.error());
            return Made{*report};
        }
        return joint();
    }

private:
    glm::dmat4 in_tile_axes(const glm::mat4& object_to_world) const {
        const glm::dmat4 axes = tiles::to_tile_axes(options_.up);
        return axes * glm::dmat4(object_to_world) * glm::transpose(axes);
    }
    Result<vgi::Atlas> atlas_of(uint32_t asset) const {
        progress_.at("pages of the atlas", 0);
        auto atlas = scene_.assets[asset].atlas();
        if (atlas && atlas->attributes.baked)
            progress_.warning(baked_textures_warning(scene_.assets[asset].file.path().string()));
        return atlas;
    }
    Result<tiles::TilesetReport> write_alone(const Instance& instance) {
        const auto atlas = atlas_of(instance.asset);
        if (!atlas) return tl::unexpected(atlas.error());
        const glm::dmat4 stands = in_tile_axes(instance.object_to_world);
        const auto placed = place_.transform(tiles::moved(tiles::box_of(*atlas, options_.up), stands), progress_);
        if (!placed) return tl::unexpected(placed.error());
        tiles::TilesetOptions options = options_;
        options.transform = *placed * stands;
        return tiles::write_tileset(*atlas, folder_, options, progress_);
    }
    Result<tiles::TilesetReport> write_part(uint32_t asset, const fs::path& folder) {
        const auto atlas = atlas_of(asset);
        if (!atlas) return tl::unexpected(atlas.error());
        tiles::TilesetOptions options = options_;
        options.name = scene_.scene.assets[asset].name;
        return tiles::write_tileset(*atlas, folder, options, progress_);
    }
    Result<Made> joint() {
        Made made;
        made.report.tilesets = 1;
        made.parts = static_cast<uint32_t>(scene_.assets.size());
        std::vector<tiles::PlacedTileset> of_assets;
        for (uint32_t a = 0; a < scene_.assets.size(); ++a) {
            const std::string name = "a/" + std::to_string(a);
            std::error_code error;
            fs::create_directories(folder_ / name, error);
            if (error) return fail(Fault::machine, (folder_ / name).string() + ": cannot be made: " + error.message());
            const auto report = write_part(a, folder_ / name);
            if (!report) return tl::unexpected(report.error());
            add(made.report, *report);
            of_assets.push_back({name + "/tileset.json", glm::dmat4(1), report->geometric_error, report->box});
        }
        std::vector<tiles::PlacedTileset> placed;
        for (const Instance& instance : scene_.instances) {
            placed.push_back(of_assets[instance.asset]);
            placed.back().transform = in_tile_axes(instance.object_to_world);
        }
        const auto transform = place_.transform(tiles::box_of(placed), progress_);
        if (!transform) return tl::unexpected(transform.error());
        const auto bytes = tiles::write_joint_tileset(placed, *transform, folder_);
        if (!bytes) return tl::unexpected(bytes.error());
        made.report.json_bytes += *bytes;
        return made;
    }

    const ReadyScene& scene_;
    const tiles::TilesetOptions& options_;
    TilePlace& place_;
    const fs::path& folder_;
    const Progress& progress_;
};

Json json_of(const Made& made, const TilePlace& place, double seconds) {
    const tiles::TilesetReport& r = made.report;
    Json json = {
        {"assets", made.parts},
        {"tiles", r.tiles},
        {"leaves", r.leaves},
        {"depth", r.depth},
        {"tilesets", r.tilesets},
        {"triangles", r.triangles},
        {"leaf_triangles", r.leaf_triangles},
        {"closing_triangles", r.closing_triangles},
        {"bytes",
         {{"tiles", r.glb_bytes}, {"tilesets", r.json_bytes}, {"images", r.image_bytes}, {"root", r.root_bytes}}},
        {"root_error", r.root_error},
        {"bake_seconds", made.bake_seconds},
        {"seconds", seconds}};
    if (auto stands = place.json()) json["place"] = std::move(*stands);
    return json;
}

void print_summary(const std::string& out, const Made& made, const TilePlace& place, double seconds) {
    const tiles::TilesetReport& r = made.report;
    std::printf(
        "%s: %u tiles in %u levels of tiles, %llu triangles in %u leaves; %llu triangles in all, %.1f%% of them close "
        "borders\n",
        printable(out).c_str(), r.tiles, r.depth, static_cast<unsigned long long>(r.leaf_triangles), r.leaves,
        static_cast<unsigned long long>(r.triangles),
        100.0 * static_cast<double>(r.closing_triangles) / static_cast<double>(std::max<uint64_t>(1, r.triangles)));
    std::printf("  %llu bytes of tiles, %llu of textures, %llu of tilesets, in %.2f s\n",
                static_cast<unsigned long long>(r.glb_bytes), static_cast<unsigned long long>(r.image_bytes),
                static_cast<unsigned long long>(r.json_bytes), seconds);
    if (const std::string stands = place.summary(); !stands.empty()) std::printf("  %s\n", stands.c_str());
}

// The scene as it is tiled, its mesh cut where that is asked for.
Result<Scene> read_tiled_scene(const TileArguments& o, tiles::UpAxis up) {
    const auto planes = clip_planes_of(o.clip, up);
    if (!planes) return tl::unexpected(planes.error());
    auto scene = read_scene(o.input, o.allow_outside);
    if (!scene) return scene;
    scene->heights = o.heights;
    return planes->empty() ? std::move(scene) : scene_of_piece(std::move(*scene), *planes, o.input);
}

// watch: begins anew once all is baked.
Result<Made> make_tiles(const TileArguments& o, Scene scene, TilePlace& place, const fs::path& folder,
                        Stopwatch& watch) {
    const Progress progress = terminal_progress();
    const auto encoding = tiles::encoding_named(o.encoding);
    LODE_CHECK(encoding.has_value(), o.encoding);
    tiles::TilesetOptions options;
    options.encoding = *encoding;
    options.up = place.up();
    options.tile_triangles = o.tile_triangles;
    options.name = scene.name;
    const SceneNeeds needs{Need::no, Need::no, Need::no, Need::must};
    const std::optional<Scene> of_piece = scene.clip.empty() ? std::nullopt : std::optional(scene);
    const auto ready = ready_scene(std::move(scene), needs, progress);
    if (!ready) return tl::unexpected(ready.error());
    watch = Stopwatch();
    SceneTiler tiler(*ready, options, place, folder, progress);
    const auto run = [&]() -> Result<Made> {
        if (!of_piece) return tiler.run();
        const auto piece = read_piece(*of_piece, progress);
        if (!piece) return tl::unexpected(piece.error());
        return tiler.run(*piece);
    };
    auto made = run();
    if (made) made->bake_seconds = ready->bake_seconds;
    return made;
}

Result<int> tile(const TileArguments& o) {
    auto place = TilePlace::of(o.place, o.input);
    if (!place) return tl::unexpected(place.error());
    set_thread_count(o.threads);
    if (auto done = limit_memory(o.memory, "tiles take"); !done) return tl::unexpected(done.error());
    auto folder = OutputFolder::create(o.out, is_of_a_tileset);
    if (!folder) return tl::unexpected(folder.error());
    auto scene = read_tiled_scene(o, place->up());
    if (!scene) return tl::unexpected(scene.error());
    const std::string name = scene->name;
    Stopwatch watch;
    const auto made = make_tiles(o, std::move(*scene), *place, folder->path(), watch);
    if (!made) return tl::unexpected(made.error());
    auto page = OutputFile::create(folder->path() / "view.html");
    if (!page) return tl::unexpected(page.error());
    if (auto done = page->write(tiles::view_page(name, viewer_address(o))); !done) return tl::unexpected(done.error());
    if (auto done = page->commit(); !done) return tl::unexpected(done.error());
    if (auto done = folder->commit(); !done) return tl::unexpected(done.error());
    end_progress();
    const double seconds = watch.wall();
    if (o.json) {
        print_line(json_of(*made, *place, seconds).dump(2));
    } else if (verbosity() != Verbosity::quiet) {
        print_summary(o.out, *made, *place, seconds);
    }
    return 0;
}

void add_machine_options(CLI::App& command, TileArguments& o) {
    command.add_option("--threads", o.threads, "Threads to use; 0 takes one per core")->capture_default_str();
    add_memory_option(command, o.memory);
    add_tmp_option(command, o.memory, "--memory; the system's for temporary files");
    add_outside_option(command, o.allow_outside);
    command.add_flag("--json", o.json, "Print counts, bytes and seconds as JSON");
}

}  // namespace

void add_tile(CLI::App& app, Run& run) {
    const auto o = std::make_shared<TileArguments>();
    CLI::App* command = app.add_subcommand(
        "tile",
        "Write 3D Tiles of a scene, a mesh or an asset, closed whichever of them are shown, for viewers of maps");
    command->add_option("input", o->input, "Scene (.json), mesh, height map, or asset (.lode) with an atlas")
        ->required();
    command->add_option("-o,--out", o->out, "Folder to write: tileset.json, view.html and the tiles")->required();
    command
        ->add_option("--encoding", o->encoding,
                     "meshopt (compressed), quantised (whole numbers) or plain (floats, for every reader of glTF)")
        ->check(CLI::IsMember({"meshopt", "quantised", "plain"}))
        ->capture_default_str();
    command
        ->add_option("--tile-triangles", o->tile_triangles,
                     "Triangles of a tile at most, without those that close borders")
        ->check(CLI::Range(tiles::least_tile_triangles, tiles::most_tile_triangles))
        ->capture_default_str();
    add_place_options(*command, o->place);
    add_clip_option(*command, o->clip);
    add_height_options(*command, o->heights);
    command->add_option("--viewer", o->viewer,
                        "For view.html: folder or address where viewers lie as npm lays them out (cesium, or three and "
                        "3d-tiles-renderer)");
    add_machine_options(*command, *o);
    command->footer(
        examples("lodestone tile scan.ply -o tiles\n"
                 "lodestone tile rock.lode -o rock --up z --lon 8.5 --lat 47.4 --height 500\n"
                 "lodestone tile survey.ply -o survey --epsg 2056 --epsg-origin 2600000,1200000\n"
                 "lodestone tile dem.tif -o terrain --fill-voids --viewer node_modules\n"
                 "lodestone tile dem.tif -o west --clip 'x<0' && lodestone tile dem.tif -o east --clip 'x>0'"));
    command->callback([o, &run] { run = [o] { return tile(*o); }; });
}

}  // namespace lodestone
