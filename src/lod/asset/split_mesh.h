// A mesh that grows by vertex splits, with the adjacency that coding a split, or an order of its faces, goes by. Faces
// and vertices are numbered by birth: those of every level are a prefix.
//
// A split of vertex u brings a new vertex v. The faces around u form a fan; some that follow one another in it, the
// arc, take v in place of u. Where the arc meets a face of u that is left, a new face closes the gap between them, and
// at a border of the surface one may. The face at the beginning of the arc is (v, u, x): `right`; that at its end is
// (v, y, u): `left`; both where both are born, in this order.
//
//        y                          y
//      / | \                      / | \        .
//     /  u  \      split(u)      / left \      .
//    /  / \  \    --------->    v ------ u     arc: the faces left of u on the way from x to y, counter-clockwise
//     \/ arc\/                   \ right /
//        x                          x
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/none.h"

namespace lodestone {

class SplitMesh {
public:
    // Corner k of a face, and its edge from vertex k to the next; face none for none.
    struct Corner {
        uint32_t face = none;
        uint32_t k = 0;
        bool operator==(const Corner&) const = default;
        // In one word; below none (Limits::triangles).
        uint32_t code() const { return face * 3 + k; }
        static Corner of(uint32_t code) { return code == none ? Corner{} : Corner{code / 3, code % 3}; }
    };
    // Of 0, 1 or 2, in two bits each: a third of them would be guessed wrong.
    static constexpr uint32_t next(uint32_t k) { return 0b00'10'01u >> (2 * k) & 3; }
    static constexpr uint32_t previous(uint32_t k) { return 0b01'00'10u >> (2 * k) & 3; }
    // The faces around a vertex, counter-clockwise; where the fan is open, from border to border.
    struct Fan {
        static constexpr uint32_t most = 32;
        std::array<Corner, most> corners;
        uint32_t size = 0;
        bool closed = false;
        bool large = false;  // there are more than `most`, and they are not listed
    };
    // A split, as it is carried out.
    struct Split {
        uint32_t parent = 0;               // u
        std::vector<Corner> arc;           // of u, counter-clockwise; may be empty
        Corner before;                     // of u, which the arc begins behind; none at a border
        Corner after;                      // of u, which follows the arc
        bool right = false, left = false;  // faces that are born
        uint32_t opposite = none;          // x or y where no face tells it: no arc, and neither `before` nor `after`
    };

    // Room for so many, so that what is added is not copied again and again.
    void reserve(size_t vertices, size_t faces);
    // Adds a vertex of so many wedges, 1 .. 65536, without faces.
    uint32_t add_vertex(uint32_t wedges);
    // Adds a face of the base. Its neighbours are unknown until join_base().
    void add_base_face(const std::array<uint32_t, 3>& vertices, const std::array<uint16_t, 3>& locals);
    // Finds the neighbours of all faces. False where an edge has more than two faces, or two that disagree on its
    // direction, or a face has a vertex twice.
    bool join_base();
    // The faces at a vertex, found from its home.
    void fan_of(uint32_t vertex, Fan& fan) const;
    // The vertex must have been added, the split must fit.
    void apply(const Split& split);

    uint32_t vertices() const { return static_cast<uint32_t>(home_.size()); }
    uint32_t face_count() const { return static_cast<uint32_t>(corners_.size()); }
    uint32_t wedge_count() const { return first_wedge_.back(); }
    // The vertex of a corner.
    uint32_t vertex(Corner c) const { return corners_[c.face][c.k]; }
    // Per code of an edge, the code of the same edge in the face behind it, none at a border.
    const uint32_t* across() const { return across_.empty() ? nullptr : across_.data()->data(); }
    // A corner of the vertex.
    Corner home(uint32_t vertex) const { return Corner::of(home_[vertex]); }
    // Wedges of a vertex are numbered first_wedge(v) .. first_wedge(v + 1) - 1.
    uint32_t first_wedge(uint32_t vertex) const { return first_wedge_[vertex]; }
    uint32_t wedges_of(uint32_t vertex) const { return first_wedge_[vertex + 1] - first_wedge_[vertex]; }
    bool has_seams() const { return !locals_.empty(); }
    // Which of its vertex' wedges a corner has.
    uint32_t local(Corner c) const { return locals_.empty() ? 0 : locals_[size_t{c.face} * 3 + c.k]; }
    void set_local(Corner c, uint32_t local) {
        if (!locals_.empty()) locals_[size_t{c.face} * 3 + c.k] = static_cast<uint16_t>(local);
    }
    uint32_t wedge(Corner c) const {
        const uint32_t of = vertex(c);
        return locals_.empty() ? of : first_wedge_[of] + locals_[size_t{c.face} * 3 + c.k];
    }
    // Hints that these are looked at soon.
    void fetch_home(uint32_t vertex) const { __builtin_prefetch(&home_[vertex]); }
    void fetch_face(uint32_t face) const {
        __builtin_prefetch(&across_[face]);
        __builtin_prefetch(&corners_[face]);
    }
    // A face that has all the vertices that this one has once it is collapsed again, and is older; none where there is
    // none. Of a face of the base: none.
    uint32_t witness(uint32_t face) const { return witnesses_[face]; }
    std::vector<uint32_t> take_witnesses() { return std::move(witnesses_); }
    // Wedges of all faces, three each.
    std::vector<uint32_t> wedge_indices() const;

    // The next corner around the vertex of a corner, counter-clockwise or clockwise; none at a border.
    Corner counter_clockwise(Corner c) const { return Corner::of(across_[c.face][previous(c.k)]); }
    Corner clockwise(Corner c) const {
        const uint32_t code = across_[c.face][c.k];
        return code == none ? Corner{} : Corner{code / 3, next(code % 3)};
    }

private:
    uint32_t add_face(const std::array<uint32_t, 3>& vertices, uint32_t witness);
    void join(Corner edge, Corner other);

    // Walks from face to face read nothing but what is across: it lies by itself.
    std::vector<std::array<uint32_t, 3>> across_;   // per face
    std::vector<std::array<uint32_t, 3>> corners_;  // per face: its vertices, counter-clockwise
    std::vector<uint32_t> witnesses_;               // per face
    std::vector<uint32_t> home_;                    // per vertex: the code of a corner; none without faces
    std::vector<uint32_t> first_wedge_ = {0};       // per vertex; one more at the end
    std::vector<uint16_t> locals_;                  // per corner; empty while every vertex has one wedge
};

}  // namespace lodestone
