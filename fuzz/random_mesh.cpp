#include "fuzz/random_mesh.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "mesh/generate.h"

namespace lodestone::fuzz {

namespace {

void add_attributes(TriMesh& mesh, FuzzedDataProvider& from) {
    const auto kinds = from.ConsumeIntegral<uint8_t>();
    const size_t wedges = mesh.wedge_vertex.size();
    mesh.normals.clear();
    mesh.uvs.clear();
    mesh.second_uvs.clear();
    mesh.tangents.clear();
    if (kinds & 1) compute_normals(mesh);
    if (kinds & 2) {
        for (size_t w = 0; w < wedges; ++w)
            mesh.uvs.push_back({from.ConsumeIntegral<uint8_t>() / 16.0f, from.ConsumeIntegral<uint8_t>() / 16.0f});
    }
    if ((kinds & 2) && (kinds & 16)) {
        for (size_t w = 0; w < wedges; ++w)
            mesh.second_uvs.push_back(
                {from.ConsumeIntegral<uint8_t>() / 16.0f, from.ConsumeIntegral<uint8_t>() / 8.0f});
    }
    if ((kinds & 1) && (kinds & 32)) {
        const std::array<glm::vec4, 4> some{glm::vec4(0), {1, 0, 0, 1}, {0, 1, 0, -1}, {0, 0, -1, 1}};
        for (size_t w = 0; w < wedges; ++w) mesh.tangents.push_back(some[from.ConsumeIntegral<uint8_t>() % 4]);
    }
    if (kinds & 4) {
        for (size_t w = 0; w < wedges; ++w) {
            const auto grey = from.ConsumeIntegral<uint8_t>();
            mesh.colours.push_back({grey, grey / 2, 255 - grey, 255});
        }
    }
    if (kinds & 8) {
        mesh.material_table.resize(2);
        for (size_t w = 0; w < wedges; ++w) mesh.materials.push_back(from.ConsumeBool());
    }
}

// Triangles of few points: whatever can meet in an edge or a point does.
TriMesh soup(FuzzedDataProvider& from) {
    TriMesh mesh;
    const auto points = from.ConsumeIntegralInRange<uint32_t>(3, 40);
    // From places that coincide in rounding to places far apart.
    const float scale = std::ldexp(1.0f, from.ConsumeIntegralInRange<int>(-40, 40));
    for (uint32_t v = 0; v < points; ++v) {
        const auto at = [&] { return static_cast<float>(from.ConsumeIntegralInRange<int>(-4, 4)) * scale; };
        const float x = at(), y = at(), z = at();
        mesh.positions.emplace_back(x, y, z);
    }
    const auto wedges = from.ConsumeIntegralInRange<uint32_t>(points, 2 * points);
    for (uint32_t w = 0; w < wedges; ++w)
        mesh.wedge_vertex.push_back(w < points ? w : from.ConsumeIntegralInRange<uint32_t>(0, points - 1));
    const auto triangles = from.ConsumeIntegralInRange<uint32_t>(1, 200);
    for (uint32_t t = 0; t < triangles; ++t) {
        const auto corner = [&] { return from.ConsumeIntegralInRange<uint32_t>(0, wedges - 1); };
        const uint32_t a = corner(), b = corner(), c = corner();
        mesh.triangles.push_back({a, b, c});
    }
    return mesh;
}

TriMesh dented_shape(FuzzedDataProvider& from) {
    constexpr Shape shapes[] = {Shape::rock, Shape::terrain, Shape::grid, Shape::sphere, Shape::torus, Shape::cliff};
    TriMesh mesh;
    if (from.ConsumeIntegralInRange<int>(0, 6) == 6) {
        const auto triangles = from.ConsumeIntegralInRange<uint32_t>(3, 150);
        add_fan(mesh, triangles, from.ConsumeBool(), {});
    } else {
        const Shape shape = from.PickValueInArray(shapes);
        const auto triangles = from.ConsumeIntegralInRange<uint32_t>(20, 300);
        mesh = generate(shape, triangles, from.ConsumeIntegral<uint8_t>());
    }
    const auto dents = from.ConsumeIntegralInRange<uint32_t>(0, 30);
    for (uint32_t k = 0; k < dents; ++k) {
        const auto v = from.ConsumeIntegralInRange<size_t>(0, mesh.positions.size() - 1);
        switch (from.ConsumeIntegralInRange<int>(0, 4)) {
            case 0:  // onto another
                mesh.positions[v] = mesh.positions[from.ConsumeIntegralInRange<size_t>(0, mesh.positions.size() - 1)];
                break;
            case 1:  // a spike
                mesh.positions[v] *= std::ldexp(1.0f, from.ConsumeIntegralInRange<int>(-20, 20));
                break;
            case 2: {  // a hole
                const auto t = from.ConsumeIntegralInRange<size_t>(0, mesh.triangles.size() - 1);
                if (mesh.triangles.size() > 1) mesh.triangles.erase(mesh.triangles.begin() + static_cast<long>(t));
                break;
            }
            case 3: {  // a triangle the wrong way round, or twice
                const auto t = from.ConsumeIntegralInRange<size_t>(0, mesh.triangles.size() - 1);
                const Triangle turned = {mesh.triangles[t][1], mesh.triangles[t][0], mesh.triangles[t][2]};
                if (from.ConsumeBool()) {
                    mesh.triangles[t] = turned;
                } else {
                    mesh.triangles.push_back(turned);
                }
                break;
            }
            default:  // flat
                mesh.positions[v].y = 0;
        }
    }
    return mesh;
}

}  // namespace

void add_fan(TriMesh& mesh, uint32_t triangles, bool closed, const glm::vec3& middle) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    const auto wedge = static_cast<uint32_t>(mesh.wedge_vertex.size());
    mesh.positions.push_back(middle + glm::vec3(0, 1, 0));
    if (closed) mesh.positions.push_back(middle - glm::vec3(0, 1, 0));
    const uint32_t around = wedge + (closed ? 2 : 1);
    for (uint32_t i = 0; i < triangles; ++i) {
        const float angle = 6.2831853f * static_cast<float>(i) / static_cast<float>(triangles);
        mesh.positions.push_back(middle + glm::vec3(std::cos(angle), 0, std::sin(angle)));
        const uint32_t a = around + i, b = around + (i + 1) % triangles;
        mesh.triangles.push_back({wedge, b, a});
        if (closed) mesh.triangles.push_back({wedge + 1, a, b});
    }
    for (uint32_t v = first; v < mesh.positions.size(); ++v) mesh.wedge_vertex.push_back(v);
}

TriMesh random_mesh(FuzzedDataProvider& from) {
    TriMesh mesh = from.ConsumeBool() ? soup(from) : dented_shape(from);
    add_attributes(mesh, from);
    require_good(mesh.validate(), "a random mesh is valid");
    return mesh;
}

}  // namespace lodestone::fuzz
