#include "vgi/unwrap/unwrapped_mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/threads.h"

namespace lodestone::vgi {

namespace {

// What a wedge has besides its vertex and its texture coordinates.
struct Attributes {
    glm::vec3 normal{0};
    glm::u8vec4 colour{255};
    uint16_t material = 0;
    bool operator==(const Attributes&) const = default;
};

// Of a place on a triangle of the source, by the weights of its corners 1 and 2.
Attributes attributes_at(const TriMesh& source, uint32_t triangle, const glm::vec2& place) {
    const Triangle& t = source.triangles[triangle];
    const float weights[3] = {1 - place.x - place.y, place.x, place.y};
    Attributes at;
    if (!source.materials.empty()) at.material = source.materials[t[0]];
    // Corners are as they were, bit for bit.
    for (int k = 0; k < 3; ++k) {
        if (weights[k] != 1) continue;
        if (!source.normals.empty()) at.normal = source.normals[t[static_cast<size_t>(k)]];
        if (!source.colours.empty()) at.colour = source.colours[t[static_cast<size_t>(k)]];
        return at;
    }
    glm::vec3 normal(0);
    glm::vec4 colour(0);
    for (size_t k = 0; k < 3; ++k) {
        if (!source.normals.empty()) normal += weights[k] * source.normals[t[k]];
        if (!source.colours.empty()) colour += weights[k] * glm::vec4(source.colours[t[k]]);
    }
    const float length = glm::length(normal);
    if (!source.normals.empty()) at.normal = length > 0 ? normal / length : source.normals[t[0]];
    if (!source.colours.empty()) at.colour = glm::u8vec4(glm::clamp(colour + 0.5f, glm::vec4(0), glm::vec4(255)));
    return at;
}

// A chart's share of the mesh, with numbers of its own.
struct Part {
    std::vector<uint32_t> vertex;  // per wedge: of the patch
    std::vector<Attributes> attributes;
    std::vector<Triangle> triangles;
};

Part part_of(const TriMesh& source, const ChartMesh& patch, uint32_t square, size_t materials) {
    Part part;
    std::vector<uint32_t> first(patch.positions.size(), none), next;  // wedges of a vertex, as a list
    const auto wedge_of = [&](uint32_t v, const Attributes& attributes) {
        for (uint32_t w = first[v]; w != none; w = next[w]) {
            if (part.attributes[w] == attributes) return w;
        }
        const auto made = static_cast<uint32_t>(part.vertex.size());
        part.vertex.push_back(v);
        part.attributes.push_back(attributes);
        next.push_back(first[v]);
        return first[v] = made;
    };
    for (const SurfaceTriangle& t : patch.triangles) {
        const CutPlaces::Corners& corners = patch.places.of(t);
        Triangle made;
        for (size_t k = 0; k < 3; ++k) {
            Attributes at = attributes_at(source, t.source, corners[k]);
            at.material = static_cast<uint16_t>(at.material + square * materials);
            made[k] = wedge_of(t.vertices[k], at);
        }
        part.triangles.push_back(made);
    }
    return part;
}

class Assembly {
public:
    Assembly(const TriMesh& source, const std::vector<FlatChart>& charts, std::span<const PackedRectangle> places,
             const std::vector<std::vector<LatticePoint>>& points, uint32_t squares)
        : source_(source), charts_(charts), places_(places), points_(points), squares_(squares) {}

    Unwrapped run() {
        materials_ = std::max<size_t>(1, source_.material_table.size());
        with_materials_ = !source_.materials.empty() || squares_ > 1;
        add_materials();
        parts_.resize(charts_.size());
        parallel_for(charts_.size(), 1, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c)
                parts_[c] = part_of(source_, charts_[c].patch, places_[c].square, materials_);
        });
        made_.mesh.positions = source_.positions;
        for (size_t c = 0; c < charts_.size(); ++c) add_wedges(c);
        add_triangles();
        drop_unused_vertices();
        return std::move(made_);
    }

private:
    void add_materials() {
        if (!with_materials_) return;
        for (uint32_t s = 0; s < squares_; ++s) {
            for (size_t m = 0; m < materials_; ++m) {
                Material material = source_.material_table.empty() ? Material{} : source_.material_table[m];
                for (Texture* texture : material.textures()) {
                    if (texture->there()) leave_out(material, *texture);
                }
                if (squares_ > 1) material.name += (material.name.empty() ? "texture" : "-") + std::to_string(s);
                made_.mesh.material_table.push_back(material);
            }
        }
        LODE_CHECK(made_.mesh.material_table.size() <= 65536, made_.mesh.material_table.size());
    }

    void add_wedges(size_t c) {
        const ChartMesh& patch = charts_[c].patch;
        const Part& part = parts_[c];
        TriMesh& mesh = made_.mesh;
        first_wedge_.push_back(static_cast<uint32_t>(mesh.wedge_vertex.size()));
        std::vector<uint32_t> number(patch.positions.size());
        for (uint32_t v = 0; v < number.size(); ++v) number[v] = vertex_of(patch, v);
        for (size_t w = 0; w < part.vertex.size(); ++w) {
            const uint32_t v = part.vertex[w];
            const LatticePoint& at = points_[c][v];
            mesh.wedge_vertex.push_back(number[v]);
            mesh.uvs.emplace_back(static_cast<float>(at.x) / static_cast<float>(lattice_side),
                                  static_cast<float>(lattice_side - at.y) / static_cast<float>(lattice_side));
            if (!source_.normals.empty()) mesh.normals.push_back(part.attributes[w].normal);
            if (!source_.colours.empty()) mesh.colours.push_back(part.attributes[w].colour);
            if (with_materials_) mesh.materials.push_back(part.attributes[w].material);
        }
    }

    // Vertices of the source keep their numbers, those of the edge of the surface have one in all charts, those inside
    // a chart are its own.
    uint32_t vertex_of(const ChartMesh& patch, uint32_t v) {
        TriMesh& mesh = made_.mesh;
        const uint32_t origin = patch.origin[v];
        if (origin < source_.positions.size()) return origin;
        if (origin != none) {
            const size_t beyond = origin - source_.positions.size();
            if (beyond >= shared_.size()) shared_.resize(beyond + 1, none);
            if (shared_[beyond] != none) return shared_[beyond];
        }
        const auto made = static_cast<uint32_t>(mesh.positions.size());
        mesh.positions.emplace_back(patch.positions[v]);
        if (origin != none) shared_[origin - source_.positions.size()] = made;
        return made;
    }

    // In the order of the source's, parts of one in the order of charts.
    void add_triangles() {
        std::vector<uint32_t> first(source_.triangle_count() + 1, 0);
        for (const FlatChart& chart : charts_) {
            for (const SurfaceTriangle& t : chart.patch.triangles) ++first[t.source + 1];
        }
        for (size_t t = 0; t < source_.triangle_count(); ++t) first[t + 1] += first[t];
        made_.mesh.triangles.resize(first.back());
        made_.square.resize(first.back());
        made_.parts.resize(first.back());
        for (size_t c = 0; c < charts_.size(); ++c) {
            const ChartMesh& patch = charts_[c].patch;
            for (size_t i = 0; i < patch.triangles.size(); ++i) {
                const uint32_t to = first[patch.triangles[i].source]++;
                Triangle t = parts_[c].triangles[i];
                for (uint32_t& w : t) w += first_wedge_[c];
                made_.mesh.triangles[to] = t;
                made_.square[to] = places_[c].square;
                made_.parts[to] = made_.places.adopt(patch.triangles[i], patch.places);
            }
        }
    }

    // Positions of the source that no triangle uses stay out, as repair() leaves none.
    void drop_unused_vertices() { drop_unreferenced(made_.mesh); }

    const TriMesh& source_;
    const std::vector<FlatChart>& charts_;
    const std::span<const PackedRectangle> places_;
    const std::vector<std::vector<LatticePoint>>& points_;
    const uint32_t squares_;
    size_t materials_ = 1;  // of a square
    bool with_materials_ = false;
    std::vector<Part> parts_;
    std::vector<uint32_t> first_wedge_, shared_;  // per chart; per vertex of the surface beyond the source's
    Unwrapped made_;
};

}  // namespace

Unwrapped unwrapped_mesh(const TriMesh& source, const std::vector<FlatChart>& charts,
                         std::span<const PackedRectangle> places, const std::vector<std::vector<LatticePoint>>& points,
                         uint32_t squares) {
    return Assembly(source, charts, places, points, squares).run();
}

}  // namespace lodestone::vgi
