#include "apps/scene/asset.h"

#include <algorithm>
#include <cmath>

#include "base/json.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone {

namespace {

constexpr int most_nested = 32;  // brackets of `about` in one another: JSON is copied and written by recursion

// A chunk that tells something in words.
Result<Json> read_words(const ChunkFile& file, const std::string& chunk) {
    auto text = file.text(chunk);
    if (!text) return tl::unexpected(text.error());
    bool too_deep = false;
    const auto shallow = [&](int depth, Json::parse_event_t, Json&) {
        too_deep |= depth > most_nested;
        return !too_deep;
    };
    Json words = Json::parse(*text, shallow, false);
    const auto wrong = [&](const char* what) {
        return fail(Fault::format,
                    file.path().string() + ": chunk '" + chunk + "': " + what + "; bake the asset again");
    };
    if (words.is_discarded() || !words.is_object()) return wrong("is not JSON, or no object");
    if (too_deep) return wrong("is nested too deeply");
    return words;
}

// What the file tells of itself, its backends included.
Result<Json> read_about(const ChunkFile& file) {
    auto words = read_words(file, "about");
    if (!words) return words;
    Json about = std::move(*words);
    for (const char* backend : {"lod", "vgi"}) {
        if (!file.contains(std::string(backend) + "/about")) continue;
        auto more = read_words(file, std::string(backend) + "/about");
        if (!more) return more;
        about[backend] = std::move(*more);
    }
    const auto wrong = [&](const char* what) {
        return fail(Fault::format, file.path().string() + ": chunk 'about': " + what + "; bake the asset again");
    };
    const auto is = [&](const char* name, auto&& good) {
        const auto at = about.find(name);
        return at != about.end() && good(*at);
    };
    if (!is("name", [](const Json& v) { return v.is_string(); })) return wrong("has no name");
    if (!is("input", [](const Json& v) { return v.is_object(); })) return wrong("tells nothing of the input");
    // Flights go some radii away, which must be numbers, too.
    const auto number = [](const Json& v) { return v.is_number() && std::isfinite(1e6f * v.get<float>()); };
    const auto sphere = [&](const Json& v) {
        return v.is_array() && v.size() == 4 && std::ranges::all_of(v, number) && v[3].get<float>() > 0;
    };
    if (!is("bounds", sphere)) return wrong("has no bounds");
    return about;
}

}  // namespace

Result<Asset> open_asset(const std::filesystem::path& path, Extent extent) {
    auto file = ChunkFile::open(path, extent);
    if (!file) return tl::unexpected(file.error());
    return open_asset(std::move(*file));
}

Result<Asset> open_asset(ChunkFile file) {
    auto about = read_about(file);
    if (!about) return tl::unexpected(about.error());
    Asset asset{std::move(file), std::move(*about), nullptr, nullptr, nullptr, nullptr, {}};
    if (asset.file.is_prefix() && asset.file.bytes_there("lod/blocks") == 0) {
        return fail(Fault::format,
                    asset.file.path().string() + ": end of file: the " + std::to_string(asset.file.file_bytes()) +
                        " bytes that are there have no level of a progressive mesh; give more of the file");
    }
    if (asset.file.contains("lod/mesh")) {
        auto lod = ProgressiveMesh::open(asset.file);
        if (!lod) return tl::unexpected(lod.error());
        asset.lod = std::make_shared<const ProgressiveMesh>(std::move(*lod));
    }
    // The last chunk of an atlas that is read when it is opened, or asked for later.
    if (asset.file.contains("vgi/atlas") && (!asset.file.is_prefix() || asset.file.contains("vgi/attribute_pages"))) {
        auto atlas = vgi::AtlasFile::open(asset.file);
        if (!atlas) return tl::unexpected(atlas.error());
        asset.atlas_file = std::make_shared<const vgi::AtlasFile>(std::move(*atlas));
    }
    if (asset.lod == nullptr && asset.atlas_file == nullptr && asset.file.contains("mesh/materials")) {
        auto materials = read_materials(asset.file);
        if (!materials) return tl::unexpected(materials.error());
        asset.materials = std::move(*materials);
    }
    for (const auto& [room, chain] : {std::pair("discrete", &asset.discrete), std::pair("full", &asset.full)}) {
        if (!asset.file.contains(std::string(room) + "/levels")) continue;
        auto opened = DiscreteChain::open(asset.file, std::max<size_t>(1, asset.material_table().size()), room);
        if (!opened) return tl::unexpected(opened.error());
        *chain = std::make_shared<const DiscreteChain>(std::move(*opened));
    }
    return asset;
}

Result<vgi::Atlas> Asset::atlas() const {
    if (atlas_file == nullptr)
        return fail(Fault::format, file.path().string() + ": holds no atlas; bake it with --backends vgi");
    return vgi::open_atlas(file);
}

std::string baked_textures_warning(const std::string& path) {
    return path +
           ": textures are baked into the atlas; colours of samples stand in their place here. Bake with "
           "--keep-uv to keep textures and their coordinates, if these are one set";
}

const std::vector<Material>& Asset::material_table() const {
    return lod != nullptr          ? lod->material_table
           : atlas_file != nullptr ? atlas_file->about().material_table
                                   : materials.table;
}
Sphere Asset::bounds() const {
    const auto& b = about["bounds"];
    return {{b[0].get<float>(), b[1].get<float>(), b[2].get<float>()}, b[3].get<float>()};
}
const std::vector<Image>& Asset::images() const {
    return lod != nullptr ? lod->images : atlas_file != nullptr ? atlas_file->about().images : materials.images;
}

}  // namespace lodestone
