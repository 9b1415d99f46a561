// A library over many machines, by any scheduler: a plan says which shard bakes which meshes, a shard is baked by one
// task, and what the shards wrote is merged. A plan is a folder that all machines see:
//   plan.json       the folder of the library, the bake options of all, how many shards
//   manifest.jsonl  a line a mesh: name, path, options, shard (-1 where it was current when planned), seconds,
//   memory_mib arrays          a line for each run of shards that take about the same memory: FIRST-LAST MIB results/
//   what shards wrote: one file for each try of each, so that each has one writer
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/library/library.h"

namespace lodestone {

struct PlanOptions {
    double minutes = 8;          // of one core, at which a shard closes
    uint64_t most_meshes = 500;  // at which it closes as well
    uint64_t most_shards = 1000;
};

struct LibraryPlan {
    std::filesystem::path folder;    // of the plan
    std::filesystem::path out;       // of the library
    std::vector<std::string> words;  // bake options of all
    uint64_t shards = 0;
    std::vector<Item> items;
};

// Deals what is not current out to shards, dear ones first, and writes the plan.
Result<LibraryPlan> make_plan(std::vector<Item> items, const Recipes& recipes, const Shelf& shelf,
                              const std::vector<std::string>& words, const std::filesystem::path& folder,
                              const PlanOptions& options, const Progress& progress);

// Fault::usage where there is none.
Result<LibraryPlan> read_plan(const std::filesystem::path& folder);

// Bakes what is left of one shard.
Result<Tally> bake_shard(const LibraryPlan& plan, uint64_t shard, const Recipes& recipes, const Crew& crew,
                         const Progress& progress);

struct Merged {
    Tally tally;
    std::vector<uint64_t> shards_left;  // with meshes that are neither decided nor failed
};
// Gathers what shards wrote, writes results.jsonl and index.html, and sweeps.
Result<Merged> merge_plan(const LibraryPlan& plan, const Recipes& recipes, const Progress& progress);

}  // namespace lodestone
