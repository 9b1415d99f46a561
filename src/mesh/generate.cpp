#include "mesh/generate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "base/check.h"
#include "base/threads.h"
#include "mesh/noise.h"

namespace lodestone {

namespace {

constexpr double pi = std::numbers::pi;
constexpr size_t grain = 4096;

// A closed surface made of the six sides of a cube, each n x n quads, pushed onto the sphere by `place`. Sides are
// charts of the texture: their common edges are seams, positions are shared. place(unit direction) gives the point.
template <class Place>
TriMesh cube_sphere(uint32_t n, const Place& place) {
    TriMesh mesh;
    const uint32_t row = n + 1;
    // Vertices of the cube's surface lattice are numbered by first appearance over the sides; a lattice point of a
    // side's rim is found again through its integer coordinates.
    const auto lattice = [&](int side, uint32_t i, uint32_t j) -> std::array<uint32_t, 3> {
        const int axis = side / 2;
        std::array<uint32_t, 3> p{};
        p[static_cast<size_t>(axis)] = side % 2 ? n : 0;
        p[static_cast<size_t>((axis + 1) % 3)] = i;
        p[static_cast<size_t>((axis + 2) % 3)] = j;
        return p;
    };
    // Rim points: on at least two of the planes. Their number follows from the smallest side that holds them.
    const auto owner = [&](const std::array<uint32_t, 3>& p) {
        for (int side = 0; side < 6; ++side) {
            const auto axis = static_cast<size_t>(side / 2);
            if (p[axis] != (side % 2 ? n : 0)) continue;
            return std::array<uint32_t, 3>{static_cast<uint32_t>(side), p[(axis + 1) % 3], p[(axis + 2) % 3]};
        }
        return std::array<uint32_t, 3>{0, 0, 0};
    };
    std::vector<uint32_t> vertex(size_t{6} * row * row);
    std::vector<std::array<uint32_t, 3>> points;
    const auto at = [&](uint32_t side, uint32_t i, uint32_t j) { return (size_t{side} * row + i) * row + j; };
    for (uint32_t side = 0; side < 6; ++side) {
        for (uint32_t i = 0; i < row; ++i) {
            for (uint32_t j = 0; j < row; ++j) {
                const auto p = lattice(static_cast<int>(side), i, j);
                const auto o = owner(p);
                if (o[0] == side) {
                    vertex[at(side, i, j)] = static_cast<uint32_t>(points.size());
                    points.push_back(p);
                } else {
                    vertex[at(side, i, j)] = vertex[at(o[0], o[1], o[2])];
                }
            }
        }
    }
    mesh.positions.resize(points.size());
    parallel_for(points.size(), grain, [&](size_t begin, size_t end) {
        for (size_t v = begin; v < end; ++v) {
            glm::dvec3 d;
            for (size_t k = 0; k < 3; ++k) {
                // Equal angles rather than equal lengths keep the quads of nearly one size.
                const double t = 2.0 * points[v][k] / n - 1;
                d[static_cast<int>(k)] = points[v][k] == 0 ? -1 : points[v][k] == n ? 1 : std::tan(t * pi / 4);
            }
            mesh.positions[v] = place(glm::normalize(d));
        }
    });
    mesh.wedge_vertex.assign(vertex.begin(), vertex.end());
    mesh.uvs.resize(vertex.size());
    mesh.triangles.reserve(size_t{12} * n * n);
    for (uint32_t side = 0; side < 6; ++side) {
        // Sides lie in a 3 x 2 block of texture space, a margin apart.
        const double left = (side % 3) / 3.0, top = (side / 3) / 2.0, margin = 0.01;
        for (uint32_t i = 0; i < row; ++i) {
            for (uint32_t j = 0; j < row; ++j) {
                mesh.uvs[at(side, i, j)] = {left + margin + (1 / 3.0 - 2 * margin) * i / n,
                                            top + margin + (0.5 - 2 * margin) * j / n};
            }
        }
        for (uint32_t i = 0; i < n; ++i) {
            for (uint32_t j = 0; j < n; ++j) {
                const auto a = static_cast<uint32_t>(at(side, i, j)), b = static_cast<uint32_t>(at(side, i + 1, j));
                const auto c = static_cast<uint32_t>(at(side, i + 1, j + 1)),
                           d = static_cast<uint32_t>(at(side, i, j + 1));
                // Diagonals run towards the middle of the side, so that no corner vertex has a single narrow fan.
                const bool turn = (i < n / 2) == (j < n / 2);
                if (side % 2) {
                    if (turn) {
                        mesh.triangles.push_back({a, b, c});
                        mesh.triangles.push_back({a, c, d});
                    } else {
                        mesh.triangles.push_back({a, b, d});
                        mesh.triangles.push_back({b, c, d});
                    }
                } else {
                    if (turn) {
                        mesh.triangles.push_back({a, c, b});
                        mesh.triangles.push_back({a, d, c});
                    } else {
                        mesh.triangles.push_back({a, d, b});
                        mesh.triangles.push_back({b, d, c});
                    }
                }
            }
        }
    }
    compute_normals(mesh);
    return mesh;
}

uint32_t side_quads(uint64_t triangles, double triangles_per_square) {
    return std::max(
        1u, static_cast<uint32_t>(std::lround(std::sqrt(static_cast<double>(triangles) / triangles_per_square))));
}

TriMesh make_rock(uint64_t triangles, uint64_t seed) {
    const uint32_t n = side_quads(triangles, 12);
    const double spacing = pi / 2 / n;
    return cube_sphere(n, [&](const glm::dvec3& d) {
        // A few planes cut facets off the ball, as broken stone has; noise roughens what is left, down to the
        // triangles.
        const glm::dvec3 bend(gradient_noise(d * 1.3, seed + 11), gradient_noise(d * 1.3, seed + 12),
                              gradient_noise(d * 1.3, seed + 13));
        const glm::dvec3 p = d + 0.25 * bend;
        const double body = 0.16 * fractal_noise(p * 1.1, seed + 1, 0.5, 0.3);
        const double crags = 0.20 * (ridged_noise(p * 1.7, seed + 2, 0.55, spacing * 3.4) - 0.5);
        const double grit = 0.015 * fractal_noise(p * 12.0, seed + 3, 0.62, spacing * 24);
        return glm::vec3(d * (1 + body + crags + grit) * glm::dvec3(1.08, 0.86, 0.97));
    });
}

// A height field over [-1, 1]^2: columns x rows quads.
template <class Height>
TriMesh height_field(uint32_t n, const Height& height) {
    TriMesh mesh;
    const uint32_t row = n + 1;
    mesh.positions.resize(size_t{row} * row);
    mesh.uvs.resize(mesh.positions.size());
    parallel_for(row, 8, [&](size_t begin, size_t end) {
        for (size_t z = begin; z < end; ++z) {
            for (size_t x = 0; x < row; ++x) {
                const double u = static_cast<double>(x) / n, v = static_cast<double>(z) / n;
                mesh.positions[z * row + x] = {2 * u - 1, height(2 * u - 1, 2 * v - 1), 2 * v - 1};
                mesh.uvs[z * row + x] = {u, v};
            }
        }
    });
    mesh.triangles.reserve(size_t{2} * n * n);
    for (uint32_t z = 0; z < n; ++z) {
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = z * row + x, b = a + 1, c = a + row, d = c + 1;
            mesh.triangles.push_back({a, c, d});
            mesh.triangles.push_back({a, d, b});
        }
    }
    mesh.set_identity_wedges();
    compute_normals(mesh);
    return mesh;
}

TriMesh make_terrain(uint64_t triangles, uint64_t seed) {
    const uint32_t n = side_quads(triangles, 2);
    const double spacing = 2.0 / n;
    return height_field(n, [&](double x, double z) {
        const glm::dvec3 p(x, 0.5, z);
        const glm::dvec3 bend(gradient_noise(p * 2.0, seed + 21), 0, gradient_noise(p * 2.0, seed + 22));
        const glm::dvec3 q = p * 1.4 + 0.2 * bend;
        const double mountains = ridged_noise(q, seed + 1, 0.5, spacing * 2.8);
        const double plains = 0.5 + 0.5 * fractal_noise(q * 0.6, seed + 2, 0.45, spacing * 1.2);
        return 0.42 * mountains * std::clamp(plains, 0.0, 1.0) + 0.05 * plains;
    });
}

TriMesh make_torus(uint64_t triangles) {
    constexpr double large = 1, small = 0.4;
    const auto along =
        std::max(3u, static_cast<uint32_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 2 * small / large))));
    const auto around = std::max(3u, static_cast<uint32_t>(std::lround(static_cast<double>(triangles) / 2 / along)));
    TriMesh mesh;
    // One more row and column of wedges than of vertices: the texture wraps there.
    for (uint32_t i = 0; i <= around; ++i) {
        for (uint32_t j = 0; j <= along; ++j) {
            const double u = static_cast<double>(i) / around, v = static_cast<double>(j) / along;
            mesh.wedge_vertex.push_back((i % around) * along + j % along);
            mesh.uvs.emplace_back(u, v);
            if (i == around || j == along) continue;
            const double a = 2 * pi * u, b = 2 * pi * v, r = large + small * std::cos(b);
            mesh.positions.emplace_back(r * std::cos(a), small * std::sin(b), r * std::sin(a));
        }
    }
    const uint32_t row = along + 1;
    for (uint32_t i = 0; i < around; ++i) {
        for (uint32_t j = 0; j < along; ++j) {
            const uint32_t a = i * row + j, b = a + 1, c = a + row, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    }
    compute_normals(mesh);
    return mesh;
}

}  // namespace

Result<Shape> shape_named(std::string_view name) {
    static constexpr std::pair<std::string_view, Shape> names[] = {{"rock", Shape::rock},
                                                                   {"terrain", Shape::terrain},
                                                                   {"grid", Shape::grid},
                                                                   {"sphere", Shape::sphere},
                                                                   {"torus", Shape::torus}};
    for (const auto& [known, shape] : names) {
        if (name == known) return shape;
    }
    return fail(Fault::usage,
                "shape '" + std::string(name) + "': no such shape; choose from rock, terrain, grid, sphere, torus");
}

TriMesh generate(Shape shape, uint64_t triangles, uint64_t seed) {
    LODE_CHECK(triangles >= 1 && triangles <= uint64_t{1} << 31, triangles);
    switch (shape) {
        case Shape::rock:
            return make_rock(triangles, seed);
        case Shape::terrain:
            return make_terrain(triangles, seed);
        case Shape::grid:
            return height_field(side_quads(triangles, 2), [](double, double) { return 0.0; });
        case Shape::sphere:
            return cube_sphere(side_quads(triangles, 12), [](const glm::dvec3& d) { return glm::vec3(d); });
        case Shape::torus:
            return make_torus(triangles);
    }
    LODE_CHECK(false, static_cast<int>(shape));
    return {};
}

}  // namespace lodestone
