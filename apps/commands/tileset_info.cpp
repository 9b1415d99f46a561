#include "apps/commands/tileset_info.h"

#include <cstdio>
#include <filesystem>

#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "base/text.h"
#include "tiles/check/check.h"

namespace lodestone {

namespace {

using Number = unsigned long long;

Json json_of(const tiles::TilesetFacts& facts) {
    Json json = {{"generator", facts.generator},
                 {"tilesets", facts.files},
                 {"surfaces", facts.parts},
                 {"tiles", facts.tiles},
                 {"leaves", facts.leaves},
                 {"depth", facts.depth},
                 {"triangles", facts.triangles},
                 {"leaf_triangles", facts.leaf_triangles},
                 {"closing_triangles", facts.closing_triangles},
                 {"bytes", {{"tiles", facts.tile_bytes}, {"tilesets", facts.json_bytes}}},
                 {"geometric_error", facts.geometric_error},
                 {"root_error", facts.root_error},
                 {"placed", facts.placed},
                 {"depths", Json::array()}};
    for (const auto& depth : facts.depths) {
        json["depths"].push_back({{"tiles", depth.tiles},
                                  {"triangles", depth.triangles},
                                  {"bytes", depth.bytes},
                                  {"largest_error", depth.largest_error}});
    }
    return json;
}

void print(const tiles::TilesetFacts& facts) {
    std::printf("3D Tiles by %s: %u tiles in %u tilesets, %u surfaces%s\n", printable(facts.generator).c_str(),
                facts.tiles, facts.files, facts.parts, facts.placed ? ", placed by a transform" : "");
    std::printf("  %llu triangles in %u leaves; %llu in all tiles, %llu of them close borders\n",
                static_cast<Number>(facts.leaf_triangles), facts.leaves, static_cast<Number>(facts.triangles),
                static_cast<Number>(facts.closing_triangles));
    std::printf("  %llu bytes of tiles, %llu of tilesets; error of the root %g m\n",
                static_cast<Number>(facts.tile_bytes), static_cast<Number>(facts.json_bytes), facts.root_error);
    std::printf("  depth    tiles   triangles       bytes  largest error, m\n");
    for (size_t d = 0; d < facts.depths.size(); ++d) {
        const auto& depth = facts.depths[d];
        std::printf("  %5zu %8u %11llu %11llu  %g\n", d, depth.tiles, static_cast<Number>(depth.triangles),
                    static_cast<Number>(depth.bytes), depth.largest_error);
    }
}

}  // namespace

bool is_tileset(const std::string& path) {
    std::error_code error;
    return std::filesystem::is_directory(path, error) || std::filesystem::path(path).extension() == ".json";
}

Result<int> info_of_tileset(const std::string& path, bool json) {
    const auto facts = tiles::tileset_facts(path);
    if (!facts) return tl::unexpected(facts.error());
    if (json) {
        print_line(json_of(*facts).dump(2));
    } else {
        print(*facts);
    }
    return 0;
}

Result<int> verify_tileset(const std::string& path, const TilesetVerification& how, bool json) {
    tiles::CheckOptions options;
    options.cuts = how.cuts;
    options.measure = how.measure;
    const auto check = tiles::check_tileset(path, options, terminal_progress());
    if (!check) return tl::unexpected(check.error());
    end_progress();
    Json report = {{"checks", Json::array()},
                   {"cuts", check->cuts},
                   {"unmatched_edges", check->unmatched_edges},
                   {"repeated_edges", check->repeated_edges},
                   {"rim_edges", check->rim_edges},
                   {"largest_step", check->largest_step},
                   {"passed", check->passed()}};
    if (how.measure) report["said_over_measured"] = {{"least", check->least_ratio}, {"largest", check->largest_ratio}};
    for (const tiles::CheckedPoint& point : check->points) {
        report["checks"].push_back({{"name", point.name}, {"passed", point.passed}, {"message", point.message}});
        if (!json)
            std::printf("%s %s%s%s\n", point.passed ? "ok    " : "FAILED", point.name.c_str(), point.passed ? "" : ": ",
                        printable(point.message).c_str());
    }
    if (json) {
        print_line(report.dump(2));
    } else {
        std::printf("%llu random cuts, levels %u apart at most: %llu edges do not match; %llu edges of rims are open\n",
                    static_cast<Number>(check->cuts), check->largest_step, static_cast<Number>(check->unmatched_edges),
                    static_cast<Number>(check->rim_edges));
        if (how.measure)
            std::printf("geometric errors are %.3f to %.3f times what is measured\n", check->least_ratio,
                        check->largest_ratio);
    }
    return check->passed() ? 0 : static_cast<int>(Fault::invariant);
}

}  // namespace lodestone
