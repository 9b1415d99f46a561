// What a library is made of: meshes found in folders, by globs or named by a manifest, and what each will take.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/hash.h"
#include "base/json.h"
#include "base/result.h"
#include "mesh/io/read.h"

namespace lodestone {

// A mesh of a library.
struct Item {
    std::string name;                // unique, UTF-8, a relative path: its asset is OUT/assets/NAME.lode
    std::filesystem::path path;      // of the mesh
    std::vector<std::string> words;  // bake options of its own, as on a command line
    uint64_t bytes = 0;              // of the file; 0 where it is not there
    double cost = 0;                 // seconds of one core that it takes, about
    uint64_t memory = 0;             // bytes that it takes, about
    int64_t shard = -1;              // of a plan; -1 for none
};

// What the words of a bake come to.
struct BakeRecipe {
    Hash128 hash;                    // as an asset's header holds it
    std::vector<std::string> words;  // all of them, those of the library first
    uint64_t error_samples = 0;      // as BakeOptions has them
    std::vector<std::string> parts;  // backends, and face orders where a progressive mesh is among them
    ReadOptions read;
};

// Meshes below folders, by globs, alone, or of manifests (.jsonl: an object a line with `path`, and `name` and
// `options` where wanted), by name. What lies in `out` is left out. Fault::usage where two have the same name, or a
// source is nothing.
Result<std::vector<Item>> find_items(std::span<const std::string> sources, const std::filesystem::path& out);

// Sets cost and memory.
void estimate(Item& item, const BakeRecipe& recipe);

// A path as JSON: text, or an object with its bytes where they are no UTF-8.
Json json_of_path(const std::filesystem::path& path);
// Empty where it is none.
std::filesystem::path path_of_json(const Json& json);

}  // namespace lodestone
