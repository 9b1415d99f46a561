#include "tiles/tileset.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <map>
#include <set>
#include <span>

#include "base/check.h"
#include "base/json.h"
#include "base/text.h"
#include "base/threads.h"
#include "mesh/io/gltf/material_json.h"
#include "mesh/io/image_file.h"
#include "tiles/tile_errors.h"
#include "tiles/tile_tree.h"

namespace lodestone::tiles {

namespace {

namespace fs = std::filesystem;
using vgi::Atlas;

Result<void> write_file(const fs::path& path, std::span<const std::byte> bytes) {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) return fail(Fault::machine, path.string() + ": cannot be written: " + std::strerror(errno));
    return {};
}
Result<uint64_t> write_json(const fs::path& path, const Json& json) {
    const std::string text = json.dump();
    if (auto done = write_file(path, std::as_bytes(std::span(text.data(), text.size()))); !done)
        return tl::unexpected(done.error());
    return text.size();
}
Result<void> make_folder(const fs::path& path) {
    std::error_code error;
    fs::create_directory(path, error);
    if (error) return fail(Fault::machine, path.string() + ": cannot be made: " + error.message());
    return {};
}

Json json_of(const TileBox& box) {
    const glm::dvec3 &c = box.centre, &h = box.half;
    return {{"box", {c.x, c.y, c.z, h.x, 0, 0, 0, h.y, 0, 0, 0, h.z}}};
}
double diagonal(const TileBox& box) { return 2 * glm::length(box.half); }

bool is_identity(const glm::dmat4& matrix) { return matrix == glm::dmat4(1); }

// Every second texel each way, means of four.
Image halved(const Image& image) {
    Image half;
    half.width = std::max(1u, image.width / 2);
    half.height = std::max(1u, image.height / 2);
    half.texels.reserve(size_t{half.width} * half.height);
    const auto at = [&](uint32_t x, uint32_t y) {
        return glm::uvec4(
            image.texels[size_t{std::min(y, image.height - 1)} * image.width + std::min(x, image.width - 1)]);
    };
    for (uint32_t y = 0; y < half.height; ++y) {
        for (uint32_t x = 0; x < half.width; ++x) {
            const glm::uvec4 sum =
                at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1);
            half.texels.emplace_back((sum + 2u) / 4u);
        }
    }
    return half;
}

// In axes of tiles, with half a step of the lattice around.
TileBox box_in_tile_axes(const LatticeBox& box, const Atlas& atlas, UpAxis up) {
    const glm::dvec3 low = in_steps(atlas, box.low), high = in_steps(atlas, box.high);
    const glm::dvec3 centre = atlas.origin + atlas.step * 0.5 * (low + high);
    const glm::dvec3 half = atlas.step * 0.5 * (high - low + 1.0);
    if (up == UpAxis::z) return {centre, half};
    return {{centre.x, -centre.z, centre.y}, {half.x, half.z, half.y}};
}

std::string image_name(size_t image, uint32_t level) {
    return std::to_string(image) + "-" + std::to_string(level) + ".png";
}

// What is known of a tile once it is written.
struct Written {
    uint64_t bytes = 0, triangles = 0, closing = 0;
    Result<void> done;
};

class TilesetWriter {
public:
    TilesetWriter(const Atlas& atlas, const fs::path& folder, const TilesetOptions& options, const Progress& progress)
        : atlas_(atlas), folder_(folder), options_(options), progress_(progress) {}

    Result<TilesetReport> run() {
        for (const std::string& line : unwritable_textures(atlas_.material_table)) progress_.warning(line);
        tree_ = make_tile_tree(atlas_, options_.tile_triangles);
        tree_.cut = options_.cut;
        if (auto good = tree_.validate(atlas_); !good) return tl::unexpected(good.error());
        auto measures = measure_tiles(atlas_, tree_, progress_);
        if (!measures) return tl::unexpected(measures.error());
        measures_ = std::move(*measures);
        open_ = std::ranges::any_of(atlas_.sides, [](const vgi::GluedSide& s) { return s.chart == ~0u; });
        if (auto done = make_folder(folder_ / "t"); !done) return tl::unexpected(done.error());
        if (auto done = write_images(); !done) return tl::unexpected(done.error());
        if (auto done = write_tiles(); !done) return tl::unexpected(done.error());
        if (auto done = write_tilesets(); !done) return tl::unexpected(done.error());
        return report();
    }

private:
    // Textures, halved as often as the levels that they are for.
    Result<void> write_images() {
        if (atlas_.images.empty() || atlas_.uvs.empty()) return {};
        if (auto done = make_folder(folder_ / "i"); !done) return done;
        std::set<uint32_t> levels;
        for (const TileNode& node : tree_.nodes) levels.insert(node.level);
        for (size_t i = 0; i < atlas_.images.size(); ++i) {
            Image image = atlas_.images[i];
            for (uint32_t level = 0; level <= *levels.rbegin(); ++level) {
                if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
                progress_.at("textures", static_cast<double>(i) / static_cast<double>(atlas_.images.size()));
                if (levels.contains(level)) {
                    const auto png = encode_png(image);
                    if (!png) return tl::unexpected(png.error());
                    if (auto done = write_file(folder_ / "i" / image_name(i, level), *png); !done) return done;
                    image_bytes_ += png->size();
                }
                image = halved(image);
            }
        }
        return {};
    }

    Written write_tile(uint32_t id) const {
        const TileNode& node = tree_.nodes[id];
        GlbOptions glb{options_.encoding, options_.up, {}};
        for (size_t i = 0; i < atlas_.images.size(); ++i) glb.image_uris.push_back("../i/" + image_name(i, node.level));
        TileMesh mesh = make_tile_mesh(atlas_, tree_, id);
        Written written;
        written.triangles = mesh.triangles.size();
        written.closing = mesh.triangles.size() - mesh.surface_triangles;
        const std::vector<std::byte> bytes = encode_glb(atlas_, std::move(mesh), glb);
        written.bytes = bytes.size();
        written.done = write_file(folder_ / "t" / (std::to_string(id) + ".glb"), bytes);
        return written;
    }
    Result<void> write_tiles() {
        written_.resize(tree_.nodes.size());
        constexpr size_t batch = 64;
        for (size_t begin = 0; begin < written_.size(); begin += batch) {
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
            progress_.at("tiles", static_cast<double>(begin) / static_cast<double>(written_.size()));
            parallel_for(std::min(batch, written_.size() - begin), 1, [&](size_t first, size_t end) {
                for (size_t i = begin + first; i < begin + end; ++i) written_[i] = write_tile(static_cast<uint32_t>(i));
            });
            for (size_t i = begin; i < std::min(begin + batch, written_.size()); ++i) {
                if (!written_[i].done) return written_[i].done;
            }
        }
        return {};
    }

    TileBox box_of_tile(uint32_t id) const { return box_in_tile_axes(measures_[id].box, atlas_, options_.up); }

    // to_folder: from the tileset file to the folder.
    Json tile(uint32_t id, const std::string& to_folder) const {
        const TileNode& node = tree_.nodes[id];
        const bool leaf = node.children.empty();
        Json json = {{"boundingVolume", json_of(box_of_tile(id))},
                     {"geometricError", leaf ? 0.0 : measures_[id].error}};
        json["content"] = {{"uri", to_folder + "t/" + std::to_string(id) + ".glb"}};
        json["extras"] = {
            {"level", node.level}, {"triangles", written_[id].triangles}, {"sourceError", measures_[id].source_error}};
        if (written_[id].closing > 0) json["extras"]["closingTriangles"] = written_[id].closing;
        for (const uint32_t child : node.children) {
            if (external_[child]) {
                json["children"].push_back(
                    {{"boundingVolume", json_of(box_of_tile(child))},
                     {"geometricError", tree_.nodes[child].children.empty() ? 0.0 : measures_[child].error},
                     {"content", {{"uri", to_folder + "s/" + std::to_string(child) + ".json"}}}});
            } else {
                json["children"].push_back(tile(child, to_folder));
            }
        }
        return json;
    }
    Json tileset(uint32_t root, const std::string& to_folder, double geometric_error) const {
        Json json = {{"asset", {{"version", "1.1"}, {"generator", "lodestone"}}}, {"geometricError", geometric_error}};
        json["root"] = tile(root, to_folder);
        json["root"]["refine"] = "REPLACE";
        return json;
    }

    // Subtrees of a quarter of `external` tiles at most, where there are that many in all.
    void choose_external() {
        external_.assign(tree_.nodes.size(), false);
        if (tree_.nodes.size() < options_.external) return;
        const std::vector<uint32_t> sizes = tree_.subtree_sizes();
        const uint32_t most = std::max(1u, options_.external / 4);
        for (size_t i = 1; i < sizes.size(); ++i)
            external_[i] = sizes[i] > 1 && sizes[i] <= most && sizes[tree_.nodes[i].parent] > most;
    }
    Result<void> write_tilesets() {
        choose_external();
        if (std::ranges::any_of(external_, [](bool external) { return external; })) {
            if (auto done = make_folder(folder_ / "s"); !done) return done;
        }
        for (uint32_t i = 0; i < external_.size(); ++i) {
            if (!external_[i]) continue;
            const double error = tree_.nodes[i].children.empty() ? 0.0 : measures_[i].error;
            const auto bytes = write_json(folder_ / "s" / (std::to_string(i) + ".json"), tileset(i, "../", error));
            if (!bytes) return tl::unexpected(bytes.error());
            json_bytes_ += *bytes;
            ++tilesets_;
        }
        Json json = tileset(0, "", geometric_error());
        if (!is_identity(options_.transform)) json["root"]["transform"] = transform_of(options_.transform);
        json["asset"]["extras"] = {{"source", as_utf8(options_.name)},
                                   {"tiles", tree_.nodes.size()},
                                   {"tileTriangles", options_.tile_triangles},
                                   {"open", open_}};
        const auto bytes = write_json(folder_ / "tileset.json", json);
        if (!bytes) return tl::unexpected(bytes.error());
        json_bytes_ += *bytes;
        return {};
    }
    double geometric_error() const { return std::max(diagonal(box_of_tile(0)), 1.001 * measures_[0].error); }

    TilesetReport report() const {
        TilesetReport report;
        std::vector<uint32_t> depths(tree_.nodes.size(), 1);
        for (uint32_t i = 0; i < tree_.nodes.size(); ++i) {
            if (i > 0) depths[i] = depths[tree_.nodes[i].parent] + 1;
            report.depth = std::max(report.depth, depths[i]);
            report.triangles += written_[i].triangles;
            report.closing_triangles += written_[i].closing;
            report.glb_bytes += written_[i].bytes;
            if (!tree_.nodes[i].children.empty()) continue;
            ++report.leaves;
            report.leaf_triangles += written_[i].triangles;
        }
        report.tiles = static_cast<uint32_t>(tree_.nodes.size());
        report.tilesets = tilesets_;
        report.json_bytes = json_bytes_;
        report.image_bytes = image_bytes_;
        report.root_bytes = written_[0].bytes;
        report.root_error = tree_.nodes[0].children.empty() ? 0 : measures_[0].error;
        report.geometric_error = geometric_error();
        report.box = box_of_tile(0);
        return report;
    }

    const Atlas& atlas_;
    const fs::path& folder_;
    const TilesetOptions& options_;
    const Progress& progress_;
    TileTree tree_;
    std::vector<TileMeasure> measures_;
    std::vector<Written> written_;
    std::vector<bool> external_;  // whose subtree has a file of its own
    bool open_ = false;           // the surface ends somewhere
    uint32_t tilesets_ = 1;
    uint64_t json_bytes_ = 0, image_bytes_ = 0;
};

}  // namespace

Result<TilesetReport> write_tileset(const Atlas& atlas, const fs::path& folder, const TilesetOptions& options,
                                    const Progress& progress) {
    return TilesetWriter(atlas, folder, options, progress).run();
}

TileBox box_of(const Atlas& atlas, UpAxis up) { return box_in_tile_axes(finest_box(atlas), atlas, up); }

TileBox box_of(const std::vector<PlacedTileset>& parts) {
    LODE_CHECK(!parts.empty());
    TileBox box = moved(parts[0].box, parts[0].transform);
    for (const PlacedTileset& part : parts) box = around(box, moved(part.box, part.transform));
    return box;
}

Result<uint64_t> write_joint_tileset(const std::vector<PlacedTileset>& parts, const glm::dmat4& transform,
                                     const fs::path& folder) {
    LODE_CHECK(!parts.empty());
    Json children = Json::array();
    double largest = 0;
    for (const PlacedTileset& part : parts) {
        const double scale =
            std::max({glm::length(glm::dvec3(part.transform[0])), glm::length(glm::dvec3(part.transform[1])),
                      glm::length(glm::dvec3(part.transform[2]))});
        largest = std::max(largest, scale * part.geometric_error);
        Json child = {{"boundingVolume", json_of(part.box)},
                      {"geometricError", part.geometric_error},
                      {"content", {{"uri", part.uri}}}};
        if (!is_identity(part.transform)) child["transform"] = transform_of(part.transform);
        children.push_back(std::move(child));
    }
    TileBox box = box_of(parts);
    box.half *= 1 + 1e-9;
    const double error = std::max(diagonal(box), largest) * 1.001;
    Json json = {{"asset", {{"version", "1.1"}, {"generator", "lodestone"}}}, {"geometricError", error}};
    json["root"] = {
        {"boundingVolume", json_of(box)}, {"geometricError", error}, {"refine", "REPLACE"}, {"children", children}};
    if (!is_identity(transform)) json["root"]["transform"] = transform_of(transform);
    return write_json(folder / "tileset.json", json);
}

}  // namespace lodestone::tiles
