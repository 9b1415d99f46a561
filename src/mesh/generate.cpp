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
#include "mesh/scanned_texture.h"

namespace lodestone {

namespace {

constexpr double pi = std::numbers::pi;
constexpr size_t grain = 4096;

// The six sides of a cube, each n x n quads. Sides are charts of the texture: every one has wedges of its own, and
// vertices are shared along the cube's edges.
class CubeSides {
public:
    explicit CubeSides(uint32_t n) : n_(n), row_(n + 1), vertex_(size_t{6} * row_ * row_) {
        // Vertices of the cube's surface lattice are numbered by first appearance over the sides; a lattice point of a
        // side's rim is found again through its integer coordinates.
        for (uint32_t side = 0; side < 6; ++side) {
            for (uint32_t i = 0; i < row_; ++i) {
                for (uint32_t j = 0; j < row_; ++j) {
                    const Point p = lattice(static_cast<int>(side), i, j);
                    const auto o = owner(p);
                    if (o[0] == side) {
                        vertex_[at(side, i, j)] = static_cast<uint32_t>(points_.size());
                        points_.push_back(p);
                    } else {
                        vertex_[at(side, i, j)] = vertex_[at(o[0], o[1], o[2])];
                    }
                }
            }
        }
    }

    size_t vertices() const { return points_.size(); }
    const std::vector<uint32_t>& wedge_vertex() const { return vertex_; }
    // From the cube's middle to a vertex, of length 1.
    glm::dvec3 direction(size_t vertex) const {
        const Point& p = points_[vertex];
        glm::dvec3 d;
        for (size_t k = 0; k < 3; ++k) {
            // Equal angles rather than equal lengths keep the quads of nearly one size.
            const double t = 2.0 * p[k] / n_ - 1;
            d[static_cast<int>(k)] = p[k] == 0 ? -1 : p[k] == n_ ? 1 : std::tan(t * pi / 4);
        }
        return glm::normalize(d);
    }
    void set_uvs(uint32_t side, TriMesh& mesh) const {
        // Sides lie in a 3 x 2 block of texture space, a margin apart.
        const uint32_t column = side % 3, row = side / 3;
        const double left = column / 3.0, top = row / 2.0, margin = 0.01;
        for (uint32_t i = 0; i < row_; ++i) {
            for (uint32_t j = 0; j < row_; ++j) {
                mesh.uvs[at(side, i, j)] = {left + margin + (1 / 3.0 - 2 * margin) * i / n_,
                                            top + margin + (0.5 - 2 * margin) * j / n_};
            }
        }
    }
    void add_triangles(uint32_t side, TriMesh& mesh) const {
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            mesh.triangles.push_back(side % 2 ? std::array{a, b, c} : std::array{a, c, b});
        };
        for (uint32_t i = 0; i < n_; ++i) {
            for (uint32_t j = 0; j < n_; ++j) {
                const auto a = static_cast<uint32_t>(at(side, i, j)), b = static_cast<uint32_t>(at(side, i + 1, j));
                const auto c = static_cast<uint32_t>(at(side, i + 1, j + 1)),
                           d = static_cast<uint32_t>(at(side, i, j + 1));
                // Diagonals run towards the middle of the side, so that no corner vertex has a single narrow fan.
                if ((i < n_ / 2) == (j < n_ / 2)) {
                    add(a, b, c);
                    add(a, c, d);
                } else {
                    add(a, b, d);
                    add(b, c, d);
                }
            }
        }
    }

private:
    using Point = std::array<uint32_t, 3>;  // of the lattice: 0 .. n each

    size_t at(uint32_t side, uint32_t i, uint32_t j) const { return (size_t{side} * row_ + i) * row_ + j; }
    Point lattice(int side, uint32_t i, uint32_t j) const {
        const int axis = side / 2;
        Point p{};
        p[static_cast<size_t>(axis)] = side % 2 ? n_ : 0;
        p[static_cast<size_t>((axis + 1) % 3)] = i;
        p[static_cast<size_t>((axis + 2) % 3)] = j;
        return p;
    }
    // Rim points are on two or three sides: the first of them, and the place there.
    std::array<uint32_t, 3> owner(const Point& p) const {
        for (int side = 0; side < 6; ++side) {
            const auto axis = static_cast<size_t>(side / 2);
            if (p[axis] != (side % 2 ? n_ : 0)) continue;
            return {static_cast<uint32_t>(side), p[(axis + 1) % 3], p[(axis + 2) % 3]};
        }
        return {0, 0, 0};
    }

    uint32_t n_, row_;              // quads and points along a side
    std::vector<uint32_t> vertex_;  // by wedge
    std::vector<Point> points_;     // by vertex
};

// A closed surface made of the sides of a cube pushed onto the sphere by `place`. place(unit direction) gives the
// point.
template <class Surface>
TriMesh cube_sphere(uint32_t n, const Surface& place) {
    TriMesh mesh;
    const CubeSides sides(n);
    mesh.positions.resize(sides.vertices());
    parallel_for(sides.vertices(), grain, [&](size_t begin, size_t end) {
        for (size_t v = begin; v < end; ++v) mesh.positions[v] = place(sides.direction(v));
    });
    mesh.wedge_vertex.assign(sides.wedge_vertex().begin(), sides.wedge_vertex().end());
    mesh.uvs.resize(sides.wedge_vertex().size());
    mesh.triangles.reserve(size_t{12} * n * n);
    for (uint32_t side = 0; side < 6; ++side) {
        sides.set_uvs(side, mesh);
        sides.add_triangles(side, mesh);
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

TriMesh make_scan(uint64_t triangles, uint64_t seed) {
    TriMesh mesh = make_rock(triangles, seed);
    lay_out_as_scanned(mesh, seed);
    return mesh;
}

// A field of n x n quads over [-1, 1]^2; place(x, z) gives the point.
template <class Surface>
TriMesh field(uint32_t n, const Surface& place) {
    TriMesh mesh;
    const uint32_t row = n + 1;
    mesh.positions.resize(size_t{row} * row);
    mesh.uvs.resize(mesh.positions.size());
    parallel_for(row, 8, [&](size_t begin, size_t end) {
        for (size_t z = begin; z < end; ++z) {
            for (size_t x = 0; x < row; ++x) {
                const double u = static_cast<double>(x) / n, v = static_cast<double>(z) / n;
                mesh.positions[z * row + x] = place(2 * u - 1, 2 * v - 1);
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

template <class Height>
TriMesh height_field(uint32_t n, const Height& height) {
    return field(n, [&](double x, double z) { return glm::vec3(x, height(x, z), z); });
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

// Ledges with steep walls between, which bulge and hang over: the walls are where heights change fast, and noise in all
// three directions pushes them about.
TriMesh make_cliff(uint64_t triangles, uint64_t seed) {
    const uint32_t n = side_quads(triangles, 2);
    const double spacing = 2.0 / n;
    return field(n, [&](double x, double z) {
        const glm::dvec3 p(x, 0.5, z);
        const double rise = 0.5 + 0.5 * fractal_noise(p * 1.3, seed + 31, 0.45, 0.3);
        const double cracks = 0.10 * ridged_noise(p * 3.0, seed + 32, 0.5, spacing * 6);
        constexpr double ledges = 4;
        const double t = ledges * std::clamp(rise + cracks, 0.0, 1.2), ledge = std::floor(t);
        const double wall = std::clamp((t - ledge - 0.35) / 0.3, 0.0, 1.0);
        const double height = (ledge + wall * wall * (3 - 2 * wall)) / ledges;
        const glm::dvec3 q(x * 5, height * 9, z * 5);
        const double bulge = 0.05, grit = 0.008;
        const auto push = [&](uint64_t k) {
            return bulge * gradient_noise(q, seed + k) + grit * fractal_noise(q * 8.0, seed + k, 0.6, spacing * 40);
        };
        return glm::vec3(x + push(33), 0.7 * height + push(34), z + push(35));
    });
}

// A closed profile turned about the y axis; profile(v), 0 .. 1, gives radius and height, first up the outside. Texture
// coordinates wrap both ways, where wedges are doubled. slim: length of the profile over that of the way around.
template <class Profile>
TriMesh revolved(uint64_t triangles, double slim, const Profile& profile) {
    const auto along =
        std::max(3u, static_cast<uint32_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 2 * slim))));
    const auto around = std::max(3u, static_cast<uint32_t>(std::lround(static_cast<double>(triangles) / 2 / along)));
    TriMesh mesh;
    for (uint32_t i = 0; i <= around; ++i) {
        for (uint32_t j = 0; j <= along; ++j) {
            const double u = static_cast<double>(i) / around, v = static_cast<double>(j) / along;
            mesh.wedge_vertex.push_back((i % around) * along + j % along);
            mesh.uvs.emplace_back(u, v);
            if (i == around || j == along) continue;
            const glm::dvec2 at = profile(v);
            const double a = 2 * pi * u;
            mesh.positions.emplace_back(at.x * std::cos(a), at.y, at.x * std::sin(a));
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

TriMesh make_torus(uint64_t triangles) {
    constexpr double large = 1, small = 0.4;
    return revolved(triangles, small / large, [](double v) {
        return glm::dvec2(large + small * std::cos(2 * pi * v), small * std::sin(2 * pi * v));
    });
}

// Glaze in bands, with a meander and speckles: something whose every blur and seam shows.
Image glaze(uint64_t seed) {
    constexpr uint32_t size = 1024;
    Image image{size, size, std::vector<glm::u8vec4>(size_t{size} * size)};
    parallel_for(size, 8, [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) {
            for (size_t x = 0; x < size; ++x) {
                const double u = (static_cast<double>(x) + 0.5) / size, v = (static_cast<double>(y) + 0.5) / size;
                // Noise around a cylinder has no edge where u wraps.
                const glm::dvec3 p(std::cos(2 * pi * u) * 3, v * 12, std::sin(2 * pi * u) * 3);
                const double cloud = 0.5 + 0.5 * fractal_noise(p, seed + 41, 0.55, 0.05);
                glm::dvec3 colour = glm::mix(glm::dvec3(0.16, 0.30, 0.42), glm::dvec3(0.55, 0.70, 0.72), cloud);
                const double band = std::fmod(v * 24, 1.0);
                if (band < 0.12) colour = {0.12, 0.10, 0.09};
                const double turn = std::fmod(u * 48, 1.0), row = std::fmod(v * 24, 4.0);
                if (row > 1.2 && row < 1.9) {
                    const bool line = turn < 0.14 || (row < 1.3) || (row > 1.55 && row < 1.65 && turn > 0.4) ||
                                      (turn > 0.4 && turn < 0.54 && row > 1.5);
                    colour = line ? glm::dvec3(0.80, 0.32, 0.12) : glm::dvec3(0.90, 0.85, 0.74);
                }
                if (gradient_noise(p * 26.0, seed + 42) > 0.62) colour = {0.07, 0.06, 0.06};
                const auto byte = [](double c) {
                    return static_cast<uint8_t>(std::lround(255 * std::clamp(c, 0.0, 1.0)));
                };
                image.texels[y * size + x] = {byte(colour.x), byte(colour.y), byte(colour.z), 255};
            }
        }
    });
    return image;
}

TriMesh make_vase(uint64_t triangles, uint64_t seed) {
    // From the hole in the foot's bottom up the outside over the lip and down the inside, joined by straight lines and
    // half circles; corners stay sharp.
    constexpr double thick = 0.07;
    const auto outside = [](double h) { return 0.42 + 0.30 * std::sin(pi * (0.12 + 0.86 * h)) - 0.10 * h * h * h; };
    TriMesh mesh = revolved(triangles, 0.9, [&](double v) -> glm::dvec2 {
        if (v < 0.08) return {0.12 + (outside(0) - 0.12) * v / 0.08, -1};
        if (v < 0.50) {
            const double h = (v - 0.08) / 0.42;
            return {outside(h) + 0.006 * std::sin(40 * pi * h), -1 + 2 * h};
        }
        if (v < 0.54) {
            const double a = pi * (v - 0.50) / 0.04;
            return {outside(1) - thick / 2 + thick / 2 * std::cos(a), 1 + thick / 2 * std::sin(a)};
        }
        if (v < 0.94) {
            const double h = 1 - (v - 0.54) / 0.40, y = -1 + thick + (2 - thick) * h;
            return {outside((y + 1) / 2) - thick, y};
        }
        const double foot = outside(thick / 2) - thick;
        return {foot + (0.12 - foot) * (v - 0.94) / 0.06, -1 + thick};
    });
    mesh.images.push_back(glaze(seed));
    Material material;
    material.name = "glaze";
    material.base_colour_texture.image = 0;
    mesh.material_table.push_back(material);
    mesh.materials.assign(mesh.wedge_count(), 0);
    return mesh;
}

}  // namespace

Result<Shape> shape_named(std::string_view name) {
    static constexpr std::pair<std::string_view, Shape> names[] = {
        {"rock", Shape::rock},   {"terrain", Shape::terrain}, {"grid", Shape::grid}, {"sphere", Shape::sphere},
        {"torus", Shape::torus}, {"cliff", Shape::cliff},     {"vase", Shape::vase}, {"scan", Shape::scan}};
    for (const auto& [known, shape] : names) {
        if (name == known) return shape;
    }
    return fail(Fault::usage,
                "shape '" + std::string(name) +
                    "': no such shape; choose from rock, terrain, grid, sphere, torus, cliff, vase, scan");
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
        case Shape::cliff:
            return make_cliff(triangles, seed);
        case Shape::vase:
            return make_vase(triangles, seed);
        case Shape::scan:
            return make_scan(triangles, seed);
    }
    LODE_CHECK(false, static_cast<int>(shape));
    return {};
}

}  // namespace lodestone
