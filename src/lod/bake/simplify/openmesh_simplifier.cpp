// OpenMesh's decimater with ModQuadric (Garland and Heckbert 1997, positions alone) as a producer of collapse lists.
#include <algorithm>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "base/check.h"
#include "lod/bake/simplify/simplifier.h"
#include "lod/bake/simplify/wedge_replay.h"

namespace lodestone {

namespace {

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
};
using DecimatedMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Decimater = OpenMesh::Decimater::DecimaterT<DecimatedMesh>;

// A binary module: allows what seams allow, and writes down every collapse that happens.
template <class MeshT>
class Recorder : public OpenMesh::Decimater::ModBaseT<MeshT> {
public:
    DECIMATING_MODULE(Recorder, MeshT, Recorder);
    explicit Recorder(MeshT& mesh) : Base(mesh, true) {}

    float collapse_priority(const CollapseInfo& info) override {
        return wedges->can_collapse(static_cast<uint32_t>(info.v0.idx()), static_cast<uint32_t>(info.v1.idx()))
                   ? Base::LEGAL_COLLAPSE
                   : Base::ILLEGAL_COLLAPSE;
    }
    void preprocess_collapse(const CollapseInfo& info) override {
        wedges->collapse(static_cast<uint32_t>(info.v0.idx()), static_cast<uint32_t>(info.v1.idx()), *list);
    }

    WedgeReplay* wedges = nullptr;
    CollapseList* list = nullptr;
};

class OpenMeshSimplifier final : public Simplifier {
public:
    std::string name() const override { return "openmesh"; }

    Result<CollapseList> simplify(const TriMesh& mesh, const SimplifyOptions& options,
                                  const Progress& progress) const override {
        progress.at("simplify (OpenMesh)", 0);
        DecimatedMesh decimated;
        for (const glm::vec3& p : mesh.positions) decimated.add_vertex({p.x, p.y, p.z});
        for (size_t t = 0; t < mesh.triangle_count(); ++t) {
            const auto v = [&](int k) { return decimated.vertex_handle(mesh.vertex_of(t, k)); };
            if (!decimated.add_face(v(0), v(1), v(2)).is_valid())
                return fail(Fault::format,
                            "OpenMesh refuses triangle " + std::to_string(t) + "; simplify with --simplifier quadric");
        }
        decimated.request_face_normals();
        decimated.update_face_normals();

        CollapseList list;
        WedgeReplay wedges(mesh);
        Decimater decimater(decimated);
        OpenMesh::Decimater::ModQuadricT<DecimatedMesh>::Handle quadric;
        OpenMesh::Decimater::ModNormalFlippingT<DecimatedMesh>::Handle flipping;
        Recorder<DecimatedMesh>::Handle recorder;
        decimater.add(quadric);
        decimater.add(flipping);
        decimater.add(recorder);
        decimater.module(quadric).unset_max_err();
        decimater.module(flipping).set_max_normal_deviation(78);
        decimater.module(recorder).wedges = &wedges;
        decimater.module(recorder).list = &list;
        if (!decimater.initialize()) return fail(Fault::invariant, "OpenMesh's decimater does not start");
        decimater.decimate_to_faces(0, options.target_triangles);
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        // OpenMesh does not tell which of its rules refused what was left.
        list.stop =
            wedges.triangles_left() <= options.target_triangles ? StopReason::target_reached : StopReason::topology;
        return list;
    }
};

}  // namespace

std::unique_ptr<Simplifier> make_openmesh_simplifier() { return std::make_unique<OpenMeshSimplifier>(); }

}  // namespace lodestone
