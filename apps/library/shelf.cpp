#include "apps/library/shelf.h"

#include <algorithm>

#include "base/files/chunk_file.h"
#include "base/files/file.h"
#include "base/json.h"
#include "base/text.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

Json parsed(const ChunkFile& file, const char* chunk) {
    if (!file.contains(chunk)) return Json::object();
    const auto text = file.text(chunk);
    Json json = text ? Json::parse(*text, nullptr, false) : Json();
    return json.is_object() ? json : Json::object();
}

void take(Json& figures, const Json& from, std::initializer_list<const char*> names) {
    for (const char* name : names) {
        if (from.contains(name)) figures[name] = from[name];
    }
}

Json figures_of(const ChunkFile& file, const Json& about) {
    Json figures = Json::object();
    take(figures, about.value("input", Json::object()),
         {"triangles", "vertices", "components", "boundary_loops", "genus"});
    take(figures, parsed(file, "lod/about"), {"levels", "base_triangles"});
    take(figures, parsed(file, "vgi/about"), {"charts", "rms_error", "max_error"});
    const Json repaired = about.value("repair", Json::object());
    for (const auto& [what, count] : repaired.items()) {
        if (count.is_number_unsigned() && count.get<uint64_t>() > 0) figures["repaired"][what] = count;
    }
    return figures;
}

// What the mesh was read from, now. False where it cannot be read.
bool read_sources(Record& record, const Item& item, const BakeRecipe& recipe) {
    ReadReport report;
    record.source = stamp_of(item.path);
    const auto hash = hash_of_source(item.path, recipe.read, &report);
    record.source_hash = hash ? hash->hex() : "";
    record.side_files.clear();
    for (const auto& side_file : report.side_files)
        record.side_files.emplace_back(side_file.first, stamp_of(item.path.parent_path() / side_file.first));
    return hash.has_value();
}

}  // namespace

bool same_sources(const Record& record, const Item& item, const BakeRecipe& recipe) {
    if (record.recipe != recipe.hash.hex() || record.source != stamp_of(item.path)) return false;
    return std::ranges::all_of(record.side_files, [&](const auto& file) {
        return file.second == stamp_of(item.path.parent_path() / file.first);
    });
}

std::optional<Record> Shelf::from_asset(const Item& item, const BakeRecipe& recipe) const {
    const fs::path path = asset_of(item.name);
    Record record;
    record.asset = stamp_of(path);
    if (record.asset.bytes < 0) return std::nullopt;
    const auto file = ChunkFile::open(path);
    if (!file || file->provenance().options != recipe.hash) return std::nullopt;
    const Json about = parsed(*file, "about");
    if (about.value("name", "") != as_utf8(item.path.filename().string())) return std::nullopt;
    if (!read_sources(record, item, recipe) || record.source_hash != file->provenance().source.hex())
        return std::nullopt;
    record.name = item.name;
    record.path = item.path;
    record.outcome = Outcome::baked;
    record.recipe = recipe.hash.hex();
    record.bytes = file->file_bytes();
    record.figures = figures_of(*file, about);
    return record;
}

std::optional<Record> Shelf::current(const Item& item, const BakeRecipe& recipe, const Record* known) const {
    // What could not be opened is tried again: it is quick.
    if (known != nullptr && known->decided() && known->source.bytes >= 0 && same_sources(*known, item, recipe)) {
        if (known->outcome == Outcome::refused || known->asset == stamp_of(asset_of(item.name))) return *known;
    }
    auto found = from_asset(item, recipe);
    if (found && known != nullptr && known->outcome == Outcome::baked) {
        found->tries = known->tries;
        found->seconds = known->seconds;
        found->cpu_seconds = known->cpu_seconds;
        found->peak_rss_bytes = known->peak_rss_bytes;
        found->warnings = known->warnings;
    }
    return found;
}

void Shelf::add_sources(Record& record, const BakeRecipe& recipe) const {
    Item item;
    item.path = record.path;
    const Stamp before = record.source;
    read_sources(record, item, recipe);
    if (record.source != before) record.source = {};  // changed meanwhile: to be looked at again
}

std::vector<fs::path> Shelf::sweep() const {
    std::vector<fs::path> swept;
    std::error_code error;
    for (const auto& entry : fs::recursive_directory_iterator(folder_, error)) {
        if (abandoned_part(entry.path())) swept.push_back(entry.path());
    }
    std::erase_if(swept, [](const fs::path& path) {
        std::error_code ignored;
        return !fs::remove(path, ignored);
    });
    std::ranges::sort(swept);
    return swept;
}

std::string fault_of_asset(const Shelf& shelf, const Item& item, const BakeRecipe& recipe) {
    const auto file = ChunkFile::open(shelf.asset_of(item.name));
    if (!file) return file.error().message;
    if (auto whole = file->verify(); !whole) return whole.error().message;
    if (file->provenance().options != recipe.hash) return "was baked with other options or by another version";
    const auto hash = hash_of_source(item.path, recipe.read);
    if (!hash) return hash.error().message;
    return *hash == file->provenance().source ? "" : "its source has changed since it was baked";
}

}  // namespace lodestone
