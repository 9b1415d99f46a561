#include "tiles/check/tileset_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/files/file.h"
#include "base/json.h"

namespace lodestone::tiles {

namespace {

namespace fs = std::filesystem;

constexpr size_t most_tiles = size_t{1} << 24;
constexpr int most_depth = 256;

class Reader {
public:
    // Json::exception where something lacks.
    Result<ReadTileset> run(const fs::path& path) {
        if (auto done = read_file_at(path, ~0u, true); !done) return tl::unexpected(done.error());
        find_parts();
        return std::move(set_);
    }

    // The file that is being read.
    const fs::path& current() const { return open_.back(); }

private:
    tl::unexpected<Error> wrong(const std::string& what) const {
        return fail(Fault::format, open_.back().string() + ": " + what);
    }

    Result<void> read_file_at(const fs::path& path, uint32_t parent, bool whole) {
        std::error_code error;
        const fs::path real = fs::weakly_canonical(path, error);
        if (std::ranges::find(open_, real) != open_.end()) return wrong("refers to itself, by way of " + path.string());
        open_.push_back(real);
        const auto bytes = read_file(path);
        if (!bytes) return tl::unexpected(bytes.error());
        const auto* text = reinterpret_cast<const char*>(bytes->bytes.data());
        const Json json = Json::parse(text, text + bytes->bytes.size());
        const Json& asset = json.at("asset");
        if (asset.at("version") != "1.1" && asset.at("version") != "1.0")
            return wrong("asset.version is not 1.1 or 1.0");
        const double error_of_all = json.at("geometricError").get<double>();
        if (!std::isfinite(error_of_all) || error_of_all < 0) return wrong("geometricError is no number of at least 0");
        set_.json_bytes += bytes->bytes.size();
        ++set_.files;
        if (whole) {
            set_.geometric_error = error_of_all;
            set_.generator = asset.value("generator", "");
        }
        if (!json.at("root").contains("refine")) return wrong("root says no refine");
        if (json["root"]["refine"] != "REPLACE")
            return wrong("root.refine is not REPLACE: its tiles do not stand for each other");
        const size_t root = set_.tiles.size();
        if (auto done = read_tile(json["root"], parent, 0); !done) return done;
        const Json extras = asset.value("extras", Json::object());
        if (extras.contains("open")) set_.tiles[root].open = extras["open"].get<bool>();
        open_.pop_back();
        return {};
    }

    Result<void> read_tile(const Json& json, uint32_t parent, int depth) {
        if (depth > most_depth || set_.tiles.size() > most_tiles) return wrong("has more tiles than can be read");
        const auto id = static_cast<uint32_t>(set_.tiles.size());
        ReadTile tile;
        tile.parent = parent;
        tile.place = open_.back().filename().string();
        tile.geometric_error = json.at("geometricError").get<double>();
        if (!std::isfinite(tile.geometric_error) || tile.geometric_error < 0)
            return wrong("a tile's geometricError is no number of at least 0");
        if (auto done = read_box(json.at("boundingVolume"), tile); !done) return done;
        if (json.contains("transform")) {
            const auto numbers = json["transform"].get<std::array<double, 16>>();
            for (size_t i = 0; i < 16; ++i) {
                if (!std::isfinite(numbers[i])) return wrong("a tile's transform is not made of numbers");
                tile.transform[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = numbers[i];
            }
        }
        tile.scale = parent == ~0u ? 1 : set_.tiles[parent].scale;
        double largest = 0;
        for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, glm::length(glm::dvec3(tile.transform[axis])));
        tile.scale *= largest;
        if (json.contains("extras")) {
            // Other programs have extras of their own.
            const Json& extras = json["extras"];
            const auto read = [&](const char* name, auto& value) {
                if (extras.contains(name) && extras[name].is_number_unsigned()) extras[name].get_to(value);
            };
            read("level", tile.level);
            read("closingTriangles", tile.closing_triangles);
            if (extras.contains("sourceError") && extras["sourceError"].is_number())
                extras["sourceError"].get_to(tile.source_error);
        }
        set_.tiles.push_back(tile);
        if (parent != ~0u) set_.tiles[parent].children.push_back(id);
        if (json.contains("content")) {
            if (auto done = read_content(json["content"].at("uri"), id); !done) return done;
        }
        for (const Json& child : json.value("children", Json::array())) {
            if (auto done = read_tile(child, id, depth + 1); !done) return done;
        }
        return {};
    }

    Result<void> read_box(const Json& volume, ReadTile& tile) const {
        if (!volume.contains("box")) {
            if (!volume.contains("sphere") && !volume.contains("region")) return wrong("a tile has no bounding volume");
            return {};
        }
        const auto numbers = volume["box"].get<std::array<double, 12>>();
        for (const double number : numbers) {
            if (!std::isfinite(number)) return wrong("a tile's box is not made of numbers");
        }
        tile.has_box = true;
        tile.box[3] = glm::dvec4(numbers[0], numbers[1], numbers[2], 1);
        for (int axis = 0; axis < 3; ++axis) {
            const auto at = static_cast<size_t>(3 + 3 * axis);
            tile.box[axis] = glm::dvec4(numbers[at], numbers[at + 1], numbers[at + 2], 0);
        }
        return {};
    }

    Result<void> read_content(const std::string& uri, uint32_t id) {
        const fs::path base = open_.back().parent_path();
        const fs::path path = (base / uri).lexically_normal();
        std::error_code error;
        const fs::path inside = fs::weakly_canonical(path, error).lexically_relative(open_.front().parent_path());
        if (inside.empty() || *inside.begin() == "..") return wrong(uri + " lies outside the tileset's folder");
        if (!fs::is_regular_file(path, error)) return wrong(uri + " is not there");
        set_.tiles[id].place += ": " + uri;
        if (path.extension() != ".json") {
            set_.tiles[id].content = path;
            return {};
        }
        set_.tiles[id].refers = true;
        return read_file_at(path, id, false);
    }

    // A surface begins at a tile with content that no tile of the same frame stands above.
    void find_parts() {
        std::vector<char> covered(set_.tiles.size(), 0);
        for (uint32_t i = 0; i < set_.tiles.size(); ++i) {
            const ReadTile& tile = set_.tiles[i];
            covered[i] = tile.parent != ~0u && covered[tile.parent] != 0;
            if (tile.content.empty() || covered[i] != 0) continue;
            covered[i] = 1;
            set_.parts.push_back(i);
        }
    }

    ReadTileset set_;
    std::vector<fs::path> open_;  // tilesets that are being read, outermost first
};

}  // namespace

Result<ReadTileset> read_tileset(const fs::path& path) {
    std::error_code error;
    const fs::path file = fs::is_directory(path, error) ? path / "tileset.json" : path;
    Reader reader;
    try {
        return reader.run(file);
    } catch (const Json::exception& e) {
        return fail(Fault::format, reader.current().string() + ": " + e.what() + "; make the tiles again");
    }
}

}  // namespace lodestone::tiles
