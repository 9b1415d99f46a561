// What a bake will take, told before it begins: from the first bytes of its mesh.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "apps/scene/bake.h"

namespace lodestone {

struct BakeCost {
    double seconds = 0;   // of one core, about
    uint64_t memory = 0;  // bytes, about
};

// Triangles of a mesh as far as its first bytes tell, or else guessed from its size.
uint64_t triangles_about(const std::filesystem::path& path, uint64_t bytes);
// parts: backends, and face orders where a progressive mesh is among them. error_samples: as BakeOptions has them.
BakeCost cost_of_bake(uint64_t triangles, uint64_t file_bytes, std::span<const std::string> parts,
                      uint64_t error_samples);

// Fault::machine where a bake would take more memory than the machine has free, whatever the mesh is like. Meshes whose
// first bytes do not tell how many triangles they have are let through. For bakes that keep all of it in memory
// (base/spill.h).
Result<void> check_room_for_bake(const std::filesystem::path& mesh, const BakeOptions& options);

}  // namespace lodestone
