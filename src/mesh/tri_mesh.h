// The indexed triangle mesh every room works on.
//
// A *vertex* is a point of the surface. A *wedge* (Hoppe, "Efficient implementation of progressive meshes", 1998) is a
// vertex together with one set of attributes: where normals, texture coordinates, colours or materials jump, a vertex
// has several wedges and the edge between is a *seam*. Triangles refer to wedges, wedges to vertices, so topology is
// read through vertices, what is drawn through wedges, and positions are never torn apart to store an attribute.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/looks/material.h"
#include "base/result.h"

namespace lodestone {

using Triangle = std::array<uint32_t, 3>;  // wedge indices, counter-clockwise seen from outside

// Vertices, wedges, triangles, and what they look like. A value; copies are deep.
struct TriMesh {
    std::vector<glm::vec3> positions;    // per vertex, object units, finite
    std::vector<uint32_t> wedge_vertex;  // per wedge: its vertex, 0 .. positions.size()-1
    std::vector<Triangle> triangles;     // per triangle: its wedges, 0 .. wedge_vertex.size()-1

    // Attributes: each empty or one per wedge.
    std::vector<glm::vec3> normals;     // unit length
    std::vector<glm::vec2> uvs;         // texture coordinates, origin at the top left (glTF's convention), any range
    std::vector<glm::vec2> second_uvs;  // the second set of them; only where there is a first
    std::vector<glm::vec4> tangents;    // glTF's: see below; only where there are normals
    std::vector<glm::u8vec4> colours;   // sRGB and alpha
    std::vector<uint16_t> materials;    // into material_table; empty means material 0 everywhere

    // A tangent is of unit length, and its w is +1 or -1: maps of normals are in the frame of it, of
    // cross(normal, tangent) * w, and of the normal. A wedge without one has (0, 0, 0, 0), and the frame of its texture
    // coordinates.

    std::vector<Material> material_table;  // empty only where `materials` is
    std::vector<Image> images;             // what materials refer to

    size_t vertex_count() const { return positions.size(); }                    // points of the surface
    size_t wedge_count() const { return wedge_vertex.size(); }                  // vertices as they are drawn
    size_t triangle_count() const { return triangles.size(); }                  // degenerate ones included
    bool has_seams() const { return wedge_vertex.size() != positions.size(); }  // whether a vertex has several wedges

    // The vertex at a corner, 0 .. 2, of a triangle.
    uint32_t vertex_of(size_t triangle, int corner) const { return wedge_vertex[triangles[triangle][corner]]; }
    // Where that vertex is.
    const glm::vec3& position_of(size_t triangle, int corner) const { return positions[vertex_of(triangle, corner)]; }

    // What a texture of the mesh is looked up by; may be empty.
    const std::vector<glm::vec2>& uvs_of(const Texture& texture) const { return texture.second ? second_uvs : uvs; }

    // One wedge per vertex, in vertex order: wedge_vertex becomes 0, 1, 2, ... For meshes without seams.
    void set_identity_wedges();

    // Every index in range, every array of the right length, coordinates finite, tangents as above. Fault::invariant
    // names the first fault found.
    Result<void> validate() const;
};

// Calls visit with every array of attributes: of one mesh, or with the same array of several side by side. Batches of
// a MeshStream have the same ones.
template <class Visit, class... Meshes>
void for_attributes(Visit&& visit, Meshes&... meshes) {
    visit(meshes.normals...);
    visit(meshes.uvs...);
    visit(meshes.second_uvs...);
    visit(meshes.tangents...);
    visit(meshes.colours...);
    visit(meshes.materials...);
}

// A box along the axes.
struct Box {
    glm::vec3 low{0}, high{0};                                // opposite corners
    glm::vec3 centre() const { return (low + high) * 0.5f; }  // half way between the corners
    float diagonal() const;                                   // its length
    int longest_axis() const;                                 // 0 x, 1 y, 2 z; the first of several
};
Box bounding_box(std::span<const glm::vec3> points);  // of no points: a point at the origin

// Area-weighted vertex normals (Gouraud), written to mesh.normals for every wedge; all wedges of a vertex get the same
// one. A vertex without area around it gets (0, 0, 1).
void compute_normals(TriMesh& mesh);
// The same, per wedge, without writing them to the mesh.
std::vector<glm::vec3> vertex_normals(const TriMesh& mesh);

// Drops vertices and wedges no triangle refers to, keeping the order of the rest. Returns how many vertices went.
size_t drop_unreferenced(TriMesh& mesh);

}  // namespace lodestone
