#include "mesh/scanned_texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>

#include "base/looks/srgb.h"
#include "base/random.h"
#include "base/threads.h"
#include "mesh/noise.h"

namespace lodestone {

namespace {

constexpr uint32_t most_side = 4096, wanted_cell = 56;  // texels
constexpr double gutter = 2;                            // texels

// A piece of the surface, laid onto the plane that touches the unit sphere at its middle.
struct Fragment {
    glm::dvec3 middle, across, down;  // unit vectors, upright to each other
    glm::dvec2 low{1e9}, high{-1e9};  // of its corners in the plane
    glm::dvec2 in_plane(const glm::dvec3& d) const {
        const glm::dvec3 q = d / glm::dot(d, middle);
        return {glm::dot(q, across), glm::dot(q, down)};
    }
};

// Middles spread over the sphere along a spiral, from +z to -z, and pushed about a little.
std::vector<Fragment> spread_fragments(uint64_t count, uint64_t seed) {
    std::vector<Fragment> fragments(count);
    Random random(seed + 51);
    const double apart = std::sqrt(4 * std::numbers::pi / static_cast<double>(count));
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    const auto any = [&] { return static_cast<double>(random.below(1 << 20)) / (1 << 20); };
    for (uint64_t i = 0; i < count; ++i) {
        const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count), r = std::sqrt(1 - z * z);
        const double turn = golden * static_cast<double>(i % (uint64_t{1} << 40));
        const glm::dvec3 push(any() - 0.5, any() - 0.5, any() - 0.5);
        Fragment& f = fragments[i];
        f.middle = glm::normalize(glm::dvec3(r * std::cos(turn), r * std::sin(turn), z) + 0.6 * apart * push);
        const glm::dvec3 other = std::abs(f.middle.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 first = glm::normalize(glm::cross(f.middle, other)), second = glm::cross(f.middle, first);
        const double angle = 2 * std::numbers::pi * any();
        f.across = std::cos(angle) * first + std::sin(angle) * second;
        f.down = glm::cross(f.middle, f.across);
    }
    return fragments;
}

// Of each triangle the fragment whose middle is nearest to its own.
std::vector<uint32_t> nearest_fragments(const TriMesh& mesh, const std::vector<Fragment>& fragments) {
    std::vector<uint32_t> nearest(mesh.triangle_count());
    const auto count = static_cast<double>(fragments.size());
    // None of the nearest is farther along the axis of the spiral.
    const auto reach = static_cast<int64_t>(std::ceil(1.6 * std::sqrt(4 * std::numbers::pi / count) * count / 2)) + 2;
    parallel_for(nearest.size(), 256, [&](size_t begin, size_t end) {
        for (size_t t = begin; t < end; ++t) {
            const glm::dvec3 d =
                glm::normalize(glm::dvec3(mesh.position_of(t, 0)) + glm::dvec3(mesh.position_of(t, 1)) +
                               glm::dvec3(mesh.position_of(t, 2)));
            const auto beside = static_cast<int64_t>((1 - d.z) / 2 * count);
            const auto first = std::max<int64_t>(0, beside - reach),
                       last = std::min<int64_t>(static_cast<int64_t>(fragments.size()) - 1, beside + reach);
            double most = -2;
            for (int64_t f = first; f <= last; ++f) {
                const double near = glm::dot(d, fragments[static_cast<size_t>(f)].middle);
                if (near <= most) continue;
                most = near;
                nearest[t] = static_cast<uint32_t>(f);
            }
        }
    });
    return nearest;
}

// Squares of one size, row by row.
struct Cells {
    uint32_t columns, side;  // side: of the image, texels
    double size() const { return static_cast<double>(side) / columns; }
    glm::dvec2 middle(uint32_t fragment) const {
        return (glm::dvec2(fragment % columns, fragment / columns) + 0.5) * size();
    }
    // Texels for each unit of the fragment's plane.
    double scale(const Fragment& f) const {
        const glm::dvec2 span = f.high - f.low;
        return (size() - 2 * gutter) / std::max({span.x, span.y, 1e-9});
    }
};

Cells cells_for(size_t fragments) {
    const auto columns = static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(fragments))));
    return {columns, std::min(most_side, std::bit_ceil(columns * wanted_cell))};
}

// Layers of two stones with grain, and lichen on them. d: of unit length.
glm::u8vec4 paint(const glm::dvec3& d, uint64_t seed) {
    const double cloud = fractal_noise(d * 3.0, seed + 61, 0.6, 0.16);
    const double layer = 0.5 + 0.5 * std::sin(14 * d.y + 5 * cloud);
    glm::dvec3 colour = glm::mix(glm::dvec3(0.42, 0.36, 0.30), glm::dvec3(0.66, 0.60, 0.52), layer);
    colour *= 1 + 0.25 * gradient_noise(d * 90.0, seed + 62);
    double lichen = gradient_noise(d * 7.0, seed + 63);
    if (lichen > 0) lichen += 0.4 * gradient_noise(d * 40.0, seed + 64);
    if (lichen > 0.42) colour = glm::mix(colour, glm::dvec3(0.72, 0.66, 0.20), std::min(1.0, 8 * (lichen - 0.42)));
    const glm::vec3 share(colour);
    return {byte_of_share(share.x), byte_of_share(share.y), byte_of_share(share.z), 255};
}

Image painted(const std::vector<Fragment>& fragments, const Cells& cells, uint64_t seed) {
    Image image{cells.side, cells.side, std::vector<glm::u8vec4>(size_t{cells.side} * cells.side)};
    parallel_for(cells.side, 8, [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) {
            for (uint32_t x = 0; x < cells.side; ++x) {
                const glm::dvec2 texel = glm::dvec2(x, y) + 0.5;
                const glm::uvec2 cell(texel / cells.size());
                const size_t fragment = std::min<size_t>(size_t{cell.y} * cells.columns + cell.x, fragments.size() - 1);
                const Fragment& f = fragments[fragment];
                const glm::dvec2 at =
                    (texel - cells.middle(static_cast<uint32_t>(fragment))) / cells.scale(f) + 0.5 * (f.low + f.high);
                image.texels[y * cells.side + x] =
                    paint(glm::normalize(f.middle + at.x * f.across + at.y * f.down), seed);
            }
        }
    });
    return image;
}

// Wedges of their own for the corners that each fragment has.
void divide_wedges(TriMesh& mesh, const std::vector<uint32_t>& fragment_of) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> wedges;  // by fragment and vertex
    std::vector<uint32_t> vertices;
    std::vector<glm::vec3> normals;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (uint32_t& wedge : mesh.triangles[t]) {
            const uint32_t vertex = mesh.wedge_vertex[wedge];
            const auto [at, is_new] =
                wedges.try_emplace({fragment_of[t], vertex}, static_cast<uint32_t>(vertices.size()));
            if (is_new) {
                vertices.push_back(vertex);
                normals.push_back(mesh.normals[wedge]);
            }
            wedge = at->second;
        }
    }
    mesh.wedge_vertex.assign(vertices.begin(), vertices.end());
    mesh.normals.assign(normals.begin(), normals.end());
}

}  // namespace

void lay_out_as_scanned(TriMesh& mesh, uint64_t seed) {
    std::vector<Fragment> fragments =
        spread_fragments(std::max<uint64_t>(1, mesh.triangle_count() / triangles_per_fragment), seed);
    // Fewer would reach round the sphere.
    if (fragments.size() < 12) fragments = spread_fragments(12, seed);
    const std::vector<uint32_t> fragment_of = nearest_fragments(mesh, fragments);
    divide_wedges(mesh, fragment_of);
    const auto direction = [&](uint32_t wedge) {
        return glm::normalize(glm::dvec3(mesh.positions[mesh.wedge_vertex[wedge]]));
    };
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        Fragment& f = fragments[fragment_of[t]];
        for (const uint32_t wedge : mesh.triangles[t]) {
            const glm::dvec2 at = f.in_plane(direction(wedge));
            f.low = glm::min(f.low, at);
            f.high = glm::max(f.high, at);
        }
    }
    const Cells cells = cells_for(fragments.size());
    mesh.uvs.assign(mesh.wedge_count(), glm::vec2(0));
    mesh.second_uvs.clear();
    mesh.tangents.clear();
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const Fragment& f = fragments[fragment_of[t]];
        for (const uint32_t wedge : mesh.triangles[t]) {
            const glm::dvec2 at = f.in_plane(direction(wedge)) - 0.5 * (f.low + f.high);
            mesh.uvs[wedge] = (cells.middle(fragment_of[t]) + cells.scale(f) * at) / static_cast<double>(cells.side);
        }
    }
    mesh.images.assign(1, painted(fragments, cells, seed));
    Material material;
    material.name = "scanned stone";
    material.base_colour_texture.image = 0;
    mesh.material_table.assign(1, material);
    mesh.materials.assign(mesh.wedge_count(), 0);
}

}  // namespace lodestone
