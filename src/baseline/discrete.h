// The baseline `discrete`: what a user would pick instead of a continuous mesh. A chain of meshes, each half of the one
// before it, simplified and cache-ordered by meshoptimizer over one vertex buffer. meshoptimizer 0.18 knows no
// attribute metric: only positions count, and attributes follow their vertices.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/files/chunk_file.h"
#include "base/progress.h"
#include "baseline/fixed_levels.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// A mesh of the chain.
struct DiscreteLevel {
    std::span<const uint32_t> indices;  // three per triangle, into DiscreteChain::vertices
    double max_error = 0;  // object units, two-sided against the source, raised by sampling_margin; never decreases
    double rms_error = 0;  // object units, two-sided
};

// Meshes of falling size over one vertex buffer. Copies share what the spans refer to.
struct DiscreteChain {
    std::span<const MeshVertex> vertices;        // of all levels
    std::span<const FurtherAttributes> further;  // none, or as many as vertices
    std::vector<DiscreteLevel> levels;           // finest first: the source mesh itself, error 0
    std::shared_ptr<const void> owner;           // keeps what the spans refer to

    // Adds chunks ROOM/vertices, ROOM/indices and ROOM/levels, and ROOM/further where there are some. Fault::machine
    // where they cannot be written.
    Result<void> write_chunks(ChunkWriter& writer, const std::string& room = "discrete") const;
    // The chain that write_chunks() wrote. materials: of the asset, at least 1; a vertex with another is Fault::format,
    // as are chunks that are missing, damaged or no valid chain.
    static Result<DiscreteChain> open(const ChunkFile& file, size_t materials, const std::string& room = "discrete");
    // At least one level, indices in range, errors that never decrease, sizes that do. Fault::invariant names the
    // level.
    Result<void> validate() const;
};

// Halves until 64 triangles are reached or meshoptimizer gets less than 10% further. Errors are measured as those of
// progressive meshes are (mesh/distance/distance.h). Fault::interrupted when progress says stop.
Result<DiscreteChain> make_discrete_chain(const TriMesh& mesh, const Progress& progress = {});

// The first level of that chain alone.
DiscreteChain source_chain(const TriMesh& mesh);

// The chain to be drawn: its levels with max_error as their errors. The chain lives as long as they do.
FixedLevels fixed_levels_of(std::shared_ptr<const DiscreteChain> chain);

}  // namespace lodestone
