// A library of meshes, baked over one machine.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "apps/library/crew.h"
#include "apps/library/item.h"
#include "apps/library/record.h"
#include "apps/library/shelf.h"
#include "base/progress.h"

namespace lodestone {

// What a mesh's own bake options come to with those of the library; Fault::usage where they make no sense.
using Recipes = std::function<Result<const BakeRecipe*>(const std::vector<std::string>& own)>;

// What became of a library.
struct Tally {
    uint64_t meshes = 0, baked = 0, there = 0, refused = 0, failed = 0, left = 0;
    // 0 where all are decided, 1 where some failed, 4 where some are left.
    int exit_code() const { return left > 0 ? 4 : failed > 0 ? 1 : 0; }
};
// By outcome; baked includes what was there.
Tally tally_of(const Records& records, uint64_t meshes);

// A folder that one program at a time works in; held until it ends. Fault::machine where another does.
class FolderLock {
public:
    static Result<FolderLock> take(const std::filesystem::path& folder);
    FolderLock(FolderLock&& other) noexcept;
    FolderLock& operator=(FolderLock&&) = delete;
    ~FolderLock();

private:
    explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
    int descriptor_;
};

// Adds recipes' estimates to items; Fault::usage names the mesh whose options make no sense.
Result<void> estimate_all(std::vector<Item>& items, const Recipes& recipes);

// What of `items` is current, into `records`; the rest as jobs.
Result<std::vector<Job>> what_is_left(const std::vector<Item>& items, const Recipes& recipes, const Shelf& shelf,
                                      const Records& known, Records& records, const Progress& progress);

// Sweeps, and writes results.jsonl and index.html. as_recorded: they hold these records already, if they are there.
Result<void> finish(const Shelf& shelf, const Records& records, bool as_recorded, const Progress& progress);

// Bakes what is not there and current.
Result<Tally> bake_library(std::vector<Item> items, const Recipes& recipes, const Shelf& shelf, const Crew& crew,
                           const Progress& progress);

// Compares a library with its sources, by every hash: a line for each asset that is missing, stale, damaged or foreign.
Result<std::vector<std::string>> check_library(const std::vector<Item>& items, const Recipes& recipes,
                                               const Shelf& shelf, const Progress& progress);

}  // namespace lodestone
