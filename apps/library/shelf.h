// The folder that a library is baked into, and what is current in it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/library/item.h"
#include "apps/library/record.h"

namespace lodestone {

class Shelf {
public:
    explicit Shelf(std::filesystem::path folder) : folder_(std::move(folder)) {}
    const std::filesystem::path& folder() const { return folder_; }
    std::filesystem::path results() const { return folder_ / "results.jsonl"; }
    std::filesystem::path page() const { return folder_ / "index.html"; }
    std::filesystem::path assets() const { return folder_ / "assets"; }
    std::filesystem::path asset_of(const std::string& name) const { return assets() / (name + ".lode"); }
    std::filesystem::path thumbnail_of(const std::string& name) const {
        return folder_ / "thumbnails" / (name + ".png");
    }

    // The record of what is there and current, if it is: by the sizes and times that `known` has, or else by hashes.
    // known: what was recorded last; null for nothing.
    std::optional<Record> current(const Item& item, const BakeRecipe& recipe, const Record* known) const;
    // The record of an asset that is there: what it tells of itself, and what its mesh was made from.
    std::optional<Record> from_asset(const Item& item, const BakeRecipe& recipe) const;
    // Fills in a refused one what its mesh was read from.
    void add_sources(Record& record, const BakeRecipe& recipe) const;

    // What killed bakes have left on file systems that know no files without names: removed, and named.
    std::vector<std::filesystem::path> sweep() const;

private:
    std::filesystem::path folder_;
};

// Whether a record is of these sources and this recipe, by sizes and times.
bool same_sources(const Record& record, const Item& item, const BakeRecipe& recipe);

// Why an asset is not what `item` and `recipe` make of it, by every hash there is; empty where it is.
std::string fault_of_asset(const Shelf& shelf, const Item& item, const BakeRecipe& recipe);

}  // namespace lodestone
