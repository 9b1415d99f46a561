#include "apps/library/item.h"

#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <map>

#include "apps/scene/bake_cost.h"
#include "base/json.h"
#include "base/text.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

std::string extension_of(const fs::path& path) {
    const auto lower = [](std::string s) {
        std::ranges::transform(s, s.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        return s;
    };
    const std::string last = lower(path.extension().string());
    return last == ".gz" ? lower(path.stem().extension().string()) : last;
}

// Textures lie beside meshes; height maps are grey, of 16 bits.
bool is_height_png(const fs::path& path) {
    std::array<char, 26> begin{};
    std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
    return begin[24] == 16 && begin[25] == 0;
}

bool looks_like_a_mesh(const fs::path& path) {
    static constexpr std::array<const char*, 8> known = {".ply",  ".obj", ".stl", ".off",
                                                         ".gltf", ".glb", ".tif", ".tiff"};
    const std::string extension = extension_of(path);
    if (extension == ".png") return is_height_png(path);
    return std::ranges::any_of(known, [&](const char* one) { return extension == one; });
}

void add(std::vector<Item>& items, const fs::path& path, const std::string& name) {
    Item item;
    item.path = path;
    item.name = as_utf8(name);
    items.push_back(std::move(item));
}

Result<void> add_folder(std::vector<Item>& items, const fs::path& folder, const fs::path& out) {
    std::error_code error;
    const fs::path own = fs::weakly_canonical(out, error);
    fs::recursive_directory_iterator walk(folder, error);
    if (error) return fail(Fault::machine, folder.string() + ": cannot be read: " + error.message());
    for (; walk != fs::recursive_directory_iterator(); walk.increment(error)) {
        std::error_code ignored;
        if (walk->is_directory(ignored)) {
            if (fs::weakly_canonical(walk->path(), ignored) == own) walk.disable_recursion_pending();
        } else if (looks_like_a_mesh(walk->path())) {
            add(items, walk->path(), walk->path().lexically_relative(folder).string());
        }
    }
    if (error) return fail(Fault::machine, folder.string() + ": cannot be read: " + error.message());
    return {};
}

bool stays_inside(const std::string& name) {
    const fs::path path = fs::path(name).lexically_normal();
    return !name.empty() && name.find('\0') == std::string::npos && path.is_relative() && *path.begin() != ".." &&
           path != "." && path.has_filename();
}

Result<void> add_line(std::vector<Item>& items, const fs::path& manifest, const std::string& line, uint64_t number) {
    const auto wrong = [&](const std::string& what) {
        return fail(Fault::usage, manifest.string() + ": line " + std::to_string(number) + ": " + what);
    };
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("path")) return wrong("must be an object with a path");
    fs::path path = path_of_json(json["path"]);
    if (path.empty()) return wrong("'path' must be a text");
    std::string name = path.is_absolute() ? path.filename().string() : path.lexically_normal().string();
    if (json.contains("name")) name = json["name"].is_string() ? json["name"].get<std::string>() : "";
    if (!stays_inside(name)) return wrong("'name' must be a path below the library; give one");
    if (path.is_relative()) path = manifest.parent_path() / path;
    add(items, path, fs::path(name).lexically_normal().string());
    for (const Json& word : json.value("options", Json::array())) {
        if (!word.is_string()) return wrong("'options' must be a list of texts");
        items.back().words.push_back(word.get<std::string>());
    }
    return {};
}

Result<void> add_manifest(std::vector<Item>& items, const fs::path& manifest) {
    std::ifstream in(manifest);
    uint64_t number = 0;
    for (std::string line; std::getline(in, line);) {
        ++number;
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        if (auto done = add_line(items, manifest, line, number); !done) return done;
    }
    return {};
}

Result<void> add_source(std::vector<Item>& items, const std::string& source, const fs::path& out) {
    std::error_code error;
    const fs::path path = source;
    if (fs::is_directory(path, error)) return add_folder(items, path, out);
    if (fs::exists(path, error)) {
        if (path.extension() == ".jsonl") return add_manifest(items, path);
        add(items, path, path.filename().string());
        return {};
    }
    glob_t found{};
    const bool some = ::glob(source.c_str(), GLOB_BRACE | GLOB_TILDE, nullptr, &found) == 0;
    for (size_t i = 0; some && i < found.gl_pathc; ++i) {
        const fs::path one = found.gl_pathv[i];
        if (fs::is_regular_file(one, error)) add(items, one, one.filename().string());
    }
    ::globfree(&found);
    if (!some) return fail(Fault::usage, source + ": is no file, no folder, and no glob of files that are there");
    return {};
}

}  // namespace

Json json_of_path(const fs::path& path) {
    const std::string text = path.string();
    if (as_utf8(text) == text) return text;
    return {{"bytes", std::vector<uint8_t>(text.begin(), text.end())}};
}

fs::path path_of_json(const Json& json) {
    if (json.is_string()) return json.get<std::string>();
    std::string text;
    if (json.is_object() && json.contains("bytes") && json["bytes"].is_array()) {
        for (const Json& byte : json["bytes"]) {
            if (!byte.is_number_unsigned() || byte.get<uint64_t>() > 255) return {};
            text += static_cast<char>(byte.get<uint8_t>());
        }
    }
    return text;
}

Result<std::vector<Item>> find_items(std::span<const std::string> sources, const fs::path& out) {
    std::vector<Item> items;
    for (const std::string& source : sources) {
        if (auto done = add_source(items, source, out); !done) return tl::unexpected(done.error());
    }
    std::ranges::sort(items, {}, &Item::name);
    for (size_t i = 1; i < items.size(); ++i) {
        if (items[i].name != items[i - 1].name) continue;
        return fail(Fault::usage, items[i - 1].path.string() + " and " + items[i].path.string() + ": have one name, " +
                                      items[i].name + "; give them names in a manifest (.jsonl)");
    }
    std::error_code error;
    for (Item& item : items) {
        const uintmax_t bytes = fs::file_size(item.path, error);
        item.bytes = error ? 0 : bytes;
    }
    return items;
}

void estimate(Item& item, const BakeRecipe& recipe) {
    const BakeCost cost =
        cost_of_bake(triangles_about(item.path, item.bytes), item.bytes, recipe.parts, recipe.error_samples);
    item.cost = cost.seconds;
    item.memory = cost.memory;
}

}  // namespace lodestone
