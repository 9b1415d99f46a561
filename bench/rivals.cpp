#include "bench/rivals.h"

#include <meshoptimizer.h>

#include <cstdio>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "base/check.h"
#include "base/clock.h"
#include "fixtures/real_data.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
};
using DecimatedMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

TriMesh bare(std::vector<glm::vec3> positions, std::vector<Triangle> triangles) {
    TriMesh mesh;
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    mesh.set_identity_wedges();
    drop_unreferenced(mesh);
    return mesh;
}

}  // namespace

std::vector<Subject> simplification_subjects() {
    std::vector<Subject> subjects;
    for (const char* name : {"stanford-bunny.obj", "armadillo.obj", "horse.ply", "lucy.ply", "igea.ply",
                             "turbineblade.ply", "rockerArm.ply", "laurana.ply", "falconstatue_boundary.obj"}) {
        const std::string file = std::string("scans/") + name;
        const auto path = fixtures::real_data(file);
        if (!path) {
            std::fprintf(stderr, "%s\n", fixtures::missing_data_note(file).c_str());
            continue;
        }
        auto mesh = read_mesh(*path);
        LODE_CHECK(mesh.has_value(), mesh.error().message);
        LODE_CHECK(repair(*mesh).has_value());
        subjects.push_back({name, std::move(*mesh)});
    }
    TriMesh rock = generate(Shape::rock, 100000, 1);
    LODE_CHECK(repair(rock).has_value());
    subjects.push_back({"generated rock", std::move(rock)});
    return subjects;
}

TriMesh shape_after(const TriMesh& mesh, const CollapseList& list, size_t triangles) {
    std::vector<uint32_t> to(mesh.vertex_count());
    for (uint32_t v = 0; v < to.size(); ++v) to[v] = v;
    std::vector<std::vector<uint32_t>> faces(mesh.vertex_count());
    std::vector<Triangle> corners(mesh.triangle_count());
    for (uint32_t t = 0; t < corners.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
            corners[t][static_cast<size_t>(k)] = mesh.vertex_of(t, k);
            faces[mesh.vertex_of(t, k)].push_back(t);
        }
    }
    std::vector<bool> dead(corners.size(), false);
    size_t alive = corners.size();
    for (const Collapse& c : list.collapses) {
        if (alive <= triangles) break;
        for (const uint32_t t : faces[c.removed]) {
            if (dead[t]) continue;
            for (uint32_t& v : corners[t]) v = v == c.removed ? c.kept : v;
            if (corners[t][0] == corners[t][1] || corners[t][1] == corners[t][2] || corners[t][2] == corners[t][0]) {
                dead[t] = true;
                --alive;
            } else {
                faces[c.kept].push_back(t);
            }
        }
    }
    std::vector<Triangle> left;
    for (size_t t = 0; t < corners.size(); ++t) {
        if (!dead[t]) left.push_back(corners[t]);
    }
    return bare(mesh.positions, std::move(left));
}

TriMesh openmesh_decimated(const TriMesh& mesh, size_t triangles, double* cpu_seconds) {
    DecimatedMesh decimated;
    for (const glm::vec3& p : mesh.positions) decimated.add_vertex({p.x, p.y, p.z});
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const auto v = [&](int k) { return decimated.vertex_handle(static_cast<unsigned>(mesh.vertex_of(t, k))); };
        decimated.add_face(v(0), v(1), v(2));
    }
    const Stopwatch watch;
    OpenMesh::Decimater::DecimaterT<DecimatedMesh> decimater(decimated);
    OpenMesh::Decimater::ModQuadricT<DecimatedMesh>::Handle quadric;
    decimater.add(quadric);
    decimater.module(quadric).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, triangles);
    if (cpu_seconds != nullptr) *cpu_seconds = watch.cpu();
    decimated.garbage_collection();
    std::vector<glm::vec3> positions;
    for (const auto v : decimated.vertices()) {
        const auto p = decimated.point(v);
        positions.emplace_back(p[0], p[1], p[2]);
    }
    std::vector<Triangle> faces;
    for (const auto f : decimated.faces()) {
        Triangle t{};
        size_t k = 0;
        for (const auto v : decimated.fv_range(f)) t[k++] = static_cast<uint32_t>(v.idx());
        faces.push_back(t);
    }
    return bare(std::move(positions), std::move(faces));
}

TriMesh meshoptimizer_simplified(const TriMesh& mesh, size_t triangles, double* cpu_seconds) {
    std::vector<uint32_t> indices;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) indices.push_back(mesh.vertex_of(t, k));
    }
    std::vector<uint32_t> out(indices.size());
    const Stopwatch watch;
    out.resize(meshopt_simplify(out.data(), indices.data(), indices.size(), &mesh.positions[0].x, mesh.positions.size(),
                                sizeof(glm::vec3), triangles * 3, 1e9f, 0, nullptr));
    if (cpu_seconds != nullptr) *cpu_seconds = watch.cpu();
    std::vector<Triangle> left;
    for (size_t i = 0; i + 2 < out.size(); i += 3) left.push_back({out[i], out[i + 1], out[i + 2]});
    return bare(mesh.positions, std::move(left));
}

}  // namespace lodestone
