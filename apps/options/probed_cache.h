// What `lodestone probe` found out about this machine, kept in the user's cache folder for `bake --cache auto`.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

struct ProbedCache {
    std::string device, driver;
    CacheModel model;
};
Result<void> remember_probe(const ProbedCache& probed);
// Nothing where no probe was made or what it left cannot be read.
std::optional<ProbedCache> remembered_probe();

// The model of the device that was probed last; else the one whose order serves batches of 32 faces and a FIFO of 16
// entries at once.
Result<CacheModel> auto_cache_model();

}  // namespace lodestone
