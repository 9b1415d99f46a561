#include "mesh/mesh_stream.h"

#include <algorithm>

namespace lodestone {

namespace {

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

class StreamOfMesh final : public MeshStream {
public:
    explicit StreamOfMesh(const TriMesh& mesh) : mesh_(mesh) {}

    Size size() const override { return {mesh_.wedge_count(), mesh_.triangle_count(), true}; }

    Result<bool> next(MeshBatch& batch, size_t max_items) override {
        batch = {};
        const size_t wedges = std::min(max_items, mesh_.wedge_count() - wedge_);
        for (size_t w = wedge_; w < wedge_ + wedges; ++w)
            batch.positions.push_back(mesh_.positions[mesh_.wedge_vertex[w]]);
        for_attributes(
            [&](auto& to, const auto& from) {
                if (!from.empty())
                    to.assign(from.begin() + static_cast<ptrdiff_t>(wedge_),
                              from.begin() + static_cast<ptrdiff_t>(wedge_ + wedges));
            },
            batch, mesh_);
        wedge_ += wedges;
        const size_t triangles = std::min(max_items - wedges, mesh_.triangle_count() - triangle_);
        batch.triangles.assign(mesh_.triangles.begin() + static_cast<ptrdiff_t>(triangle_),
                               mesh_.triangles.begin() + static_cast<ptrdiff_t>(triangle_ + triangles));
        triangle_ += triangles;
        return wedges + triangles > 0;
    }

    const std::vector<Material>& material_table() const override { return mesh_.material_table; }
    const std::vector<Image>& images() const override { return mesh_.images; }

private:
    const TriMesh& mesh_;
    size_t wedge_ = 0, triangle_ = 0;
};

}  // namespace

Result<TriMesh> collect(MeshStream& stream, const Progress& progress) {
    constexpr size_t batch_items = size_t{1} << 16;
    TriMesh mesh;
    const MeshStream::Size size = stream.size();
    // What the header promises was checked against the bytes that are there; still, an estimate is not trusted with
    // memory.
    if (size.exact) {
        mesh.positions.reserve(size.vertices);
        mesh.triangles.reserve(size.triangles);
    }
    MeshBatch batch;
    for (size_t done = 0;; done += batch_items) {
        auto more = stream.next(batch, batch_items);
        if (!more) return tl::unexpected(more.error());
        if (!*more) break;
        append(mesh.positions, batch.positions);
        for_attributes([](auto& to, const auto& from) { append(to, from); }, mesh, batch);
        append(mesh.triangles, batch.triangles);
        const uint64_t all = size.vertices + size.triangles;
        if (all > 0) progress.at("read", std::min(1.0, static_cast<double>(done) / static_cast<double>(all)));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    }
    mesh.set_identity_wedges();
    mesh.material_table = stream.material_table();
    mesh.images = stream.images();
    return mesh;
}

std::unique_ptr<MeshStream> stream_of(const TriMesh& mesh) { return std::make_unique<StreamOfMesh>(mesh); }

}  // namespace lodestone
