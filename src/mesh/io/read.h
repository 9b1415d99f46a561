// Reads every mesh format the program takes. One room per format (ply.cpp, obj.cpp, ...); this header is all callers
// need.
//
// Whatever the file holds, the caller gets either a mesh that passes TriMesh::validate() or one clear line
// (Fault::format: "file: line or place: what is wrong; what to do"). Positions are not welded yet, except where the
// format itself shares them across attributes (OBJ); `repair` does that. Things that do not stop the reading are
// warnings. A file that is cut or written to while it is read is refused.
//
// A mesh may name other files, its materials, textures or buffers. They are looked for in its folder and below. What
// lies elsewhere, be it by a symbolic link, is not read unless ReadOptions::allow_outside: a mesh that cannot be read
// without is refused, others go without, and a warning says so.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/hash.h"
#include "base/progress.h"
#include "base/result.h"
#include "mesh/limits.h"
#include "mesh/mesh_stream.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// A format that is read.
enum class MeshFormat {
    ply,          // ASCII and binary of either byte order
    obj,          // with its .mtl
    stl,          // ASCII and binary
    off,          // OFF in ASCII
    gltf,         // glTF 2.0, .gltf and .glb
    png_heights,  // a grey PNG of 16 bits as a height map
    geotiff,      // a TIFF of heights
};

// What is made of a file.
struct ReadOptions {
    bool load_images = true;  // decode textures
    float height_scale = 1;   // height maps: object units per height unit
    float pixel_size = 0;     // height maps: object units between samples, 0 takes the file's own (1 where it has none)
    std::optional<float> void_height;  // height maps: samples of this height hold no data, as those the file marks
    bool fill_voids = false;     // height maps: samples without data are filled from around instead of being holes
    bool allow_outside = false;  // files that the mesh names may lie outside the folder it lies in
    bool hash_source = false;    // ReadReport::source is computed
    Limits limits;               // what is larger is refused
    int gltf_mesh = -1;  // glTF: this mesh alone, before nodes place it; -1: all that stands in the scene, as one
};

// What was found in a file.
struct ReadReport {
    MeshFormat format = MeshFormat::ply;  // the format it was read as
    uint64_t polygons = 0;                // faces with more than three corners, cut into triangles
    std::vector<std::string> warnings;    // one line each, UTF-8
    // Files that were looked for, material libraries, textures and buffers, as the mesh file calls them: what each
    // holds, as stored; nothing where it could not be read.
    std::map<std::string, std::optional<Hash128>> side_files;
    // Why one of them could not be read, where that is the machine's fault: the mesh is not read then.
    std::optional<Error> machine_fault;
    Hash128 source;  // as hash_of_source, where it was asked for
};

// The format is told by content first, then by the file's extension (".gz" is looked through).
Result<TriMesh> read_mesh(const std::filesystem::path& path, const ReadOptions& options = {},
                          ReadReport* report = nullptr);

// The same as batches. PLY and STL are read piece by piece; the others are read whole and
// handed out in batches. `report`, if given, must outlive the stream.
Result<std::unique_ptr<MeshStream>> open_mesh_stream(const std::filesystem::path& path, const ReadOptions& options = {},
                                                     ReadReport* report = nullptr);

// What a mesh is made from, told by content: the hash of its file as stored; where it refers to other files, of them,
// too, be they there or not. Reads no more than it must, and is the same as ReadReport::source of the same options.
// report: takes the files it refers to, even where it cannot be read; null for none.
Result<Hash128> hash_of_source(const std::filesystem::path& path, const ReadOptions& options = {},
                               ReadReport* report = nullptr);

// For messages, such as "GeoTIFF height map".
const char* name_of(MeshFormat format);

// A mesh that a node of a glTF scene places.
struct PlacedMesh {
    uint32_t mesh = 0;      // its number in the file, as ReadOptions::gltf_mesh takes it
    glm::mat4 to_scene{1};  // from the mesh to the scene
};
// What stands in a glTF file's scene, in the order of its nodes: meshes with triangles, by number, and where they are.
// Fault::format as for read_mesh().
Result<std::vector<PlacedMesh>> read_gltf_nodes(const std::filesystem::path& path, const ReadOptions& options = {});

}  // namespace lodestone
