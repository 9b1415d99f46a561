// A mesh as bounded batches, for meshes that should not be held in memory twice.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "base/progress.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// One batch: either vertices or triangles may be empty. Vertices (one wedge each) are numbered on through the stream;
// a triangle may refer to vertices of its own batch and of earlier ones. Attributes are present in all batches or in
// none.
struct MeshBatch {
    std::vector<glm::vec3> positions;   // object units
    std::vector<glm::vec3> normals;     // unit length
    std::vector<glm::vec2> uvs;         // origin at the top left
    std::vector<glm::vec2> second_uvs;  // likewise; only where there are uvs
    std::vector<glm::vec4> tangents;    // as TriMesh has them; only where there are normals
    std::vector<glm::u8vec4> colours;   // sRGB and alpha
    std::vector<uint16_t> materials;    // into material_table()
    std::vector<Triangle> triangles;    // stream-wide vertex numbers
};

// A mesh that is handed out piece by piece, once.
class MeshStream {
public:
    virtual ~MeshStream() = default;
    // Known before the first batch; estimates where the format does not tell (`exact` false).
    struct Size {
        uint64_t vertices = 0, triangles = 0;  // of the whole stream
        bool exact = false;                    // whether these are counts, not estimates
    };
    virtual Size size() const = 0;  // may be asked at any time
    // Fills `batch` with at most about max_items vertices and triangles together; false at the end of the stream.
    // Errors as of read_mesh().
    virtual Result<bool> next(MeshBatch& batch, size_t max_items) = 0;
    // What materials of vertices refer to. Complete once next() returned false.
    virtual const std::vector<Material>& material_table() const = 0;
    // What materials refer to. Complete once next() returned false.
    virtual const std::vector<Image>& images() const = 0;
};

// The whole stream as one mesh, one wedge per streamed vertex: positions not yet welded (repair does that).
Result<TriMesh> collect(MeshStream& stream, const Progress& progress = {});

// A mesh in memory as a stream of its wedges; `mesh` must outlive it.
std::unique_ptr<MeshStream> stream_of(const TriMesh& mesh);

}  // namespace lodestone
