// From a mesh to an asset file: reading, repair, simplification, orders, measured errors, one file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/files/checkpoint_folder.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/progress.h"
#include "base/result.h"
#include "lod/bake/orders/face_order.h"
#include "mesh/clip.h"
#include "mesh/io/read.h"
#include "mesh/tri_mesh.h"
#include "vgi/bake/bake.h"

namespace lodestone {

// Raised whenever equal input and options give other bytes than before, so that caches are baked anew.
inline constexpr int bake_revision = 28;

inline constexpr uint32_t usual_texture_quality = 58;

// With leaves, samples that make no more triangles than leaves do, about, and what textures hold.
inline vgi::AtlasOptions as_fine_as_the_source() {
    vgi::AtlasOptions options;
    options.leaves = true;
    options.samples_per_triangle = 1;
    options.bake_textures = true;
    options.texture_quality = usual_texture_quality;
    return options;
}

struct TrianglesPerCluster {
    double fewest = 1000, most = 50000;
};

struct BakeOptions {
    std::vector<std::string> backends = {"lod"};  // lod, vgi, discrete, full
    std::vector<std::string> orders = {"keyframe", "static",
                                       "classic"};                  // the first is what is drawn unless asked otherwise
    OrderOptions order;                                             // what optimised orders aim at
    std::string simplifier = "quadric";                             // quadric, openmesh
    double normal_weight = -1, uv_weight = -1, colour_weight = -1;  // < 0: the simplifier's default
    uint64_t error_samples = 100000;                                // points on each surface when errors are measured
    uint32_t quantise = 0;  // lod: bits of positions along the longest side of the mesh; 0 keeps them as they are
    vgi::AtlasOptions atlas = as_fine_as_the_source();
    // vgi: clusters are fewer, 8 at least, or more than `atlas` says where they would have fewer or more; nothing for
    // as many as it says
    std::optional<TrianglesPerCluster> triangles_per_cluster = TrianglesPerCluster{};
    double target_error = 0;  // vgi: object units; > 0: more clusters until the finest level comes under it
    bool retexture = false;   // textures are laid out anew, with few cuts, before anything is baked
    ReadOptions read;
    std::vector<ClipPlane> clip;  // what all of them keep of the mesh is baked; none for all of it

    // Everything the asset's bytes depend on besides the source.
    Json to_json() const;
};

// The mesh a bake starts from, and where it came from.
struct BakeInput {
    TriMesh mesh;
    Hash128 source;    // of the file's content or of the recipe
    std::string name;  // for people: file name without folders, or the recipe in words
    ReadReport read;
};
Result<BakeInput> read_bake_input(const std::filesystem::path& path, const BakeOptions& options,
                                  const Progress& progress);

// The same from batches. source: a hash of what the stream was made from.
Result<BakeInput> collect_bake_input(MeshStream& stream, std::string name, const Hash128& source,
                                     const Progress& progress);

// Writes the asset and returns the bake report of docs/cli.md. Outputs appear whole or not at all. work: stages found
// there are not made again, others are kept there; null for none. The same asset either way.
Result<Json> bake_asset(BakeInput input, const BakeOptions& options, const std::filesystem::path& out,
                        const Progress& progress, const CheckpointFolder* work = nullptr);

// A hash of everything that an asset's bytes depend on besides its source and its source's name: the options, the
// version of the program and bake_revision. The header of an asset holds it (Provenance::options).
Hash128 recipe_hash(const BakeOptions& options);
// The same with the source: as BakeInput::source.
Hash128 bake_key(const Hash128& source, const BakeOptions& options);

}  // namespace lodestone
