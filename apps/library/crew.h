// Bakes side by side, within the memory and the cores there are.
#pragma once

#include <functional>
#include <span>

#include "apps/library/item.h"
#include "apps/library/record.h"
#include "apps/library/shelf.h"
#include "base/progress.h"

namespace lodestone {

// What bakes may take, and how they are run.
struct Crew {
    std::filesystem::path program;   // that bakes
    unsigned cores = 1;              // for all together
    uint64_t memory = 0;             // bytes for all together
    bool memory_given = false;       // bakes that need more are told to keep to it; else they are let
    std::vector<std::string> words;  // for each bake besides its recipe: --tmp, --resume
};

// A mesh to bake.
struct Job {
    const Item* item = nullptr;
    const BakeRecipe* recipe = nullptr;
};

// Bakes, dear ones first. Those that the machine or a signal ends are tried three times, 137, which may be for want of
// memory, with twice of it. done: told of each when it is decided, failed, or left. Fault::interrupted where
// progress.stop is set; the rest is then left as it was.
Result<void> bake_all(const Crew& crew, const Shelf& shelf, std::span<const Job> jobs,
                      const std::function<Result<void>(Record)>& done, const Progress& progress);

}  // namespace lodestone
