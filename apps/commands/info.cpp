#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/commands/tileset_info.h"
#include "apps/options/common_options.h"
#include "apps/scene/asset.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "base/progress.h"
#include "base/text.h"
#include "lod/asset/level_steps.h"
#include "mesh/topology.h"
#include "vgi/extract/atlas_levels.h"
#include "vgi/extract/extract.h"

namespace lodestone {

namespace {

void describe_lod(const ProgressiveMesh& pm, Json& lod) {
    lod["vertices"] = pm.vertices.size();
    lod["triangles"] = pm.full_triangles();
    lod["levels_missing"] = pm.levels_missing;
    lod["stored_bytes"] = {{"connectivity", pm.parts.connectivity},
                           {"vertices", pm.parts.vertices},
                           {"orders", pm.parts.orders},
                           {"errors", pm.parts.errors}};
    lod["bytes_per_triangle"] = static_cast<double>(pm.parts.all()) / pm.full_triangles();
    for (const FaceOrder& order : pm.orders) {
        lod["orders"].push_back({{"name", order.name},
                                 {"keyframes", order.keyframes.size()},
                                 {"permutation_bytes", order.permutation_bytes()},
                                 {"moved_per_ecol", order.moved_per_ecol(pm.ecols.size())}});
    }
    const LevelSteps steps = level_steps(pm);
    lod["diagonal"] = steps.diagonal;
    lod["distinct_errors"] = steps.distinct_errors;
    lod["largest_step"] = steps.largest_step;
    lod["median_step"] = steps.median_step;
    for (const double share : {1.0, 0.5, 0.25, 0.1, 0.05, 0.02, 0.01}) {
        const uint32_t level = pm.level_for_triangles(static_cast<uint64_t>(share * pm.full_triangles()));
        lod["errors"].push_back(
            {{"level", level + pm.levels_missing}, {"triangles", pm.triangles_at(level)}, {"error", pm.errors[level]}});
    }
}

Json describe(const Asset& asset) {
    Json info = asset.about;
    info["file"] = as_utf8(asset.file.path().filename().string());
    info["bytes"] = asset.file.file_bytes();
    info["whole_bytes"] = asset.file.whole_bytes();
    info["format_version"] = chunk_file_version;
    info["source_hash"] = asset.file.provenance().source.hex();
    info["options_hash"] = asset.file.provenance().options.hex();
    for (const ChunkInfo& chunk : asset.file.chunks()) {
        info["chunks"].push_back({{"name", chunk.name}, {"bytes", chunk.bytes}, {"hash", chunk.hash.hex()}});
    }
    if (asset.lod != nullptr) describe_lod(*asset.lod, info["lod"]);
    if (asset.atlas_file != nullptr) {
        const vgi::Atlas& atlas = asset.atlas_file->about();
        const auto add = [&](uint32_t level, uint64_t triangles, float error) {
            info["vgi"]["levels"].push_back({{"level", level}, {"triangles", triangles}, {"error", error}});
        };
        const vgi::AtlasLevels levels(atlas, atlas.errors, asset.atlas_file->leaf_triangles().value_or(0));
        for (uint32_t level = 0; level < levels.levels(); ++level)
            add(levels.has_source() ? level : level + 1, levels.triangles_at(level), levels.error_at(level));
    }
    if (asset.discrete != nullptr) {
        for (const DiscreteLevel& level : asset.discrete->levels) {
            info["discrete"]["levels"].push_back(
                {{"triangles", level.indices.size() / 3}, {"error", level.max_error}, {"rms_error", level.rms_error}});
        }
    }
    return info;
}

void print_lod(const Json& info) {
    const Json& lod = info.at("lod");
    if (const auto missing = lod.at("levels_missing").get<unsigned>(); missing > 0)
        std::printf("  of the progressive mesh levels %u to %u are there, level %u is the finest\n", missing,
                    lod.at("levels").get<unsigned>() - 1, missing);
    std::printf("  lod: %llu triangles, %llu vertices, %u levels; %s\n", lod.at("triangles").get<unsigned long long>(),
                lod.at("vertices").get<unsigned long long>(), lod.at("levels").get<unsigned>(),
                printable(lod.at("stopped_because").get<std::string>()).c_str());
    const Json& stored = lod.at("stored_bytes");
    std::printf("    %.2f bytes a triangle: connectivity %llu, vertices %llu, orders %llu, errors %llu\n",
                lod.at("bytes_per_triangle").get<double>(), stored.at("connectivity").get<unsigned long long>(),
                stored.at("vertices").get<unsigned long long>(), stored.at("orders").get<unsigned long long>(),
                stored.at("errors").get<unsigned long long>());
    for (const Json& order : lod.at("orders")) {
        std::printf("    order %-10s %llu keyframes, %.2f faces moved per ecol\n",
                    printable(order.at("name").get<std::string>()).c_str(),
                    order.at("keyframes").get<unsigned long long>(), order.at("moved_per_ecol").get<double>());
    }
    for (const Json& level : lod.at("errors")) {
        std::printf("    level %-9u %10u triangles  error %g\n", level.at("level").get<unsigned>(),
                    level.at("triangles").get<unsigned>(), level.at("error").get<double>());
    }
    std::printf(
        "    %u distinct errors; 1%% more error leaves out at most %.2f%% of the triangles, %.2f%% in the middle\n",
        lod.at("distinct_errors").get<unsigned>(), 100 * lod.at("largest_step").get<double>(),
        100 * lod.at("median_step").get<double>());
}

void print(const Json& info) {
    std::printf("%s: %s, %llu bytes, format %u\n", printable(info.at("file").get<std::string>()).c_str(),
                printable(info.at("name").get<std::string>()).c_str(), info.at("bytes").get<unsigned long long>(),
                info.at("format_version").get<unsigned>());
    std::printf("  source %s\n  baked with %s\n", info.at("source_hash").get<std::string>().c_str(),
                printable(info.at("options").dump()).c_str());
    if (const uint64_t whole = info.at("whole_bytes").get<uint64_t>(); whole != info.at("bytes").get<uint64_t>())
        std::printf("  the first of %llu bytes\n", static_cast<unsigned long long>(whole));
    if (info.contains("lod")) print_lod(info);
    if (info.contains("vgi")) {
        const Json& vgi = info.at("vgi");
        std::printf(
            "  vgi: %u clusters, %u charts of %u^2 samples; stretch %.3f, worst %.2f; error rms %.3g, largest "
            "%.3g of the diagonal\n",
            vgi.at("clusters").get<unsigned>(), vgi.at("charts").get<unsigned>(), vgi.at("resolution").get<unsigned>(),
            vgi.at("l2_stretch_rms").get<double>(), vgi.at("l2_stretch_worst").get<double>(),
            vgi.at("rms_error").get<double>(), vgi.at("max_error").get<double>());
        for (const Json& level : vgi.at("levels")) {
            std::printf("    level %-9u %10llu triangles  error %g\n", level.at("level").get<unsigned>(),
                        level.at("triangles").get<unsigned long long>(), level.at("error").get<double>());
        }
    }
    if (info.contains("discrete")) {
        for (const Json& level : info.at("discrete")["levels"]) {
            std::printf("  discrete: %10llu triangles  error %g\n", level.at("triangles").get<unsigned long long>(),
                        level.at("error").get<double>());
        }
    }
    for (const Json& chunk : info.at("chunks")) {
        std::printf("  chunk %-28s %12llu bytes\n", chunk.at("name").get<std::string>().c_str(),
                    chunk.at("bytes").get<unsigned long long>());
    }
}

// Every level has the same topology; a coarse one is quick to look at. (The two coarsest may join what lies next to
// each other: their charts have too few samples to be manifold.)
Result<void> same_topology(const Asset& asset, const vgi::Atlas& atlas) {
    const Topology found = topology_of(extract_samples(atlas, atlas.levels() > 2 ? atlas.levels() - 3 : 0));
    const Json& source = asset.about.at("input");
    const auto differs = [&](const char* what, uint64_t is) -> Result<void> {
        const auto was = source.value(what, uint64_t{0});
        if (was == is) return {};
        return fail(Fault::invariant,
                    std::string(what) + " are " + std::to_string(is) + " where the source has " + std::to_string(was));
    };
    if (!found.manifold() || found.inconsistent_edges > 0) return fail(Fault::invariant, "it is no oriented manifold");
    if (auto same = differs("components", found.components); !same) return same;
    if (auto same = differs("boundary_loops", found.boundary_loops); !same) return same;
    return differs("genus", static_cast<uint64_t>(found.genus));
}

// What a file tells of itself may be anything.
template <class Tell>
Result<int> telling(const std::string& path, Tell&& tell) {
    try {
        return tell();
    } catch (const Json::exception& e) {
        return fail(Fault::format, path + ": chunk 'about': " + e.what() + "; bake the asset again");
    }
}

// Checks in order, each a name and what it found. Damage ends it at once: what is damaged need not be looked at.
Result<int> verify(const std::string& path, bool json) {
    const Progress progress = terminal_progress();
    auto asset = open_asset(path);
    if (!asset) return tl::unexpected(asset.error());
    std::vector<std::pair<std::string, Result<void>>> checks;
    progress.at("chunk hashes", 0);
    if (auto whole = asset->file.verify(); !whole) return tl::unexpected(whole.error());
    checks.emplace_back("chunk hashes", Result<void>{});
    if (asset->lod != nullptr) {
        progress.at("progressive mesh", 0);
        checks.emplace_back("progressive mesh: every order played down and up", asset->lod->validate());
    }
    if (asset->atlas_file != nullptr) {
        progress.at("atlas", 0);
        const auto atlas = asset->atlas();
        checks.emplace_back(
            "atlas: pages and leaves decode; gluing closes; glued samples equal at every level; leaves fit together",
            atlas ? Result<void>{} : Result<void>(tl::unexpected(atlas.error())));
        if (atlas)
            checks.emplace_back("atlas: an oriented manifold with the source's topology",
                                same_topology(*asset, *atlas));
    }
    if (asset->discrete != nullptr) checks.emplace_back("discrete chain", asset->discrete->validate());
    end_progress();
    bool good = true;
    Json report = {{"file", as_utf8(asset->file.path().filename().string())}, {"checks", Json::array()}};
    for (const auto& [name, result] : checks) {
        good &= result.has_value();
        report["checks"].push_back(
            {{"name", name}, {"passed", result.has_value()}, {"message", result ? "" : result.error().message}});
        if (!json)
            std::printf("%s %s%s%s\n", result ? "ok    " : "FAILED", printable(name).c_str(), result ? "" : ": ",
                        result ? "" : printable(result.error().message).c_str());
    }
    report["passed"] = good;
    if (json) print_line(report.dump(2));
    return good ? 0 : static_cast<int>(Fault::invariant);
}

struct InfoArguments {
    std::string asset;
    bool json = false, prefix = false;
    TilesetVerification tiles;
};

}  // namespace

void add_info(CLI::App& app, Run& run) {
    const auto o = std::make_shared<InfoArguments>();
    CLI::App* command =
        app.add_subcommand("info",
                           "Print what an asset holds: levels, orders, charts, errors, bytes, hashes, options; or what "
                           "a tileset does");
    command->add_option("asset", o->asset, "Asset file, .lode; or folder of 3D Tiles, or its tileset.json")->required();
    add_prefix_option(*command, o->prefix);
    command->add_flag("--json", o->json, "Print as JSON");
    command->footer(examples("lodestone info bunny.lode\nlodestone info bunny.lode --json"));
    command->callback([o, &run] {
        run = [o]() -> Result<int> {
            if (is_tileset(o->asset)) return info_of_tileset(o->asset, o->json);
            auto asset = open_asset(o->asset, o->prefix ? Extent::prefix : Extent::whole);
            if (!asset) return tl::unexpected(asset.error());
            return telling(o->asset, [&] {
                const Json info = describe(*asset);
                if (o->json) {
                    print_line(info.dump(2));
                } else {
                    print(info);
                }
                return 0;
            });
        };
    });
}

void add_verify(CLI::App& app, Run& run) {
    const auto o = std::make_shared<InfoArguments>();
    CLI::App* command = app.add_subcommand(
        "verify",
        "Check every invariant of an asset, or of a tileset; exit with 1 where one fails, 3 where the file is damaged");
    command->add_option("asset", o->asset, "Asset file, .lode; or folder of 3D Tiles, or its tileset.json")->required();
    command->add_option("--cuts", o->tiles.cuts, "3D Tiles: random sets of tiles that are checked to be closed")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command->add_flag("--measure", o->tiles.measure,
                      "3D Tiles: also measure how far every tile is from the leaves below it; takes long");
    command->add_flag("--json", o->json, "Print as JSON");
    command->footer(examples("lodestone verify bunny.lode\nlodestone verify tiles --cuts 1000 --measure"));
    command->callback([o, &run] {
        run = [o] {
            if (is_tileset(o->asset)) return verify_tileset(o->asset, o->tiles, o->json);
            return telling(o->asset, [&] { return verify(o->asset, o->json); });
        };
    });
}

}  // namespace lodestone
