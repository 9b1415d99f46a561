#include "lod/asset/split_mesh.h"

#include <algorithm>

#include "base/check.h"

namespace lodestone {

void SplitMesh::reserve(size_t vertices, size_t faces) {
    across_.reserve(faces);
    corners_.reserve(faces);
    witnesses_.reserve(faces);
    home_.reserve(vertices);
    first_wedge_.reserve(vertices + 1);
}

uint32_t SplitMesh::add_vertex(uint32_t wedges) {
    home_.push_back(none);
    first_wedge_.push_back(first_wedge_.back() + wedges);
    if (wedges > 1 && locals_.empty()) locals_.assign(std::max<size_t>(1, corners_.size() * 3), 0);
    return vertices() - 1;
}

uint32_t SplitMesh::add_face(const std::array<uint32_t, 3>& corners, uint32_t witness) {
    across_.push_back({none, none, none});
    corners_.push_back(corners);
    witnesses_.push_back(witness);
    if (!locals_.empty()) locals_.resize(corners_.size() * 3, 0);
    return face_count() - 1;
}

void SplitMesh::add_base_face(const std::array<uint32_t, 3>& corners, const std::array<uint16_t, 3>& locals) {
    const uint32_t face = add_face(corners, none);
    for (uint32_t k = 0; k < 3; ++k) {
        set_local({face, k}, locals[k]);
        home_[corners[k]] = Corner{face, k}.code();
    }
}

bool SplitMesh::join_base() {
    struct Edge {
        uint32_t from, to;
        Corner at;
    };
    std::vector<Edge> edges;
    edges.reserve(corners_.size() * 3);
    for (uint32_t f = 0; f < face_count(); ++f) {
        const auto& v = corners_[f];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return false;
        for (uint32_t k = 0; k < 3; ++k) edges.push_back({v[k], v[(k + 1) % 3], {f, k}});
    }
    const auto key = [](const Edge& e) { return uint64_t{e.from} << 32 | e.to; };
    std::ranges::sort(edges, {}, key);
    const auto same = [&](const Edge& a, const Edge& b) { return key(a) == key(b); };
    if (std::ranges::adjacent_find(edges, same) != edges.end()) return false;
    for (const Edge& e : edges) {
        const auto back = std::ranges::lower_bound(edges, uint64_t{e.to} << 32 | e.from, {}, key);
        if (back != edges.end() && back->from == e.to && back->to == e.from)
            across_[e.at.face][e.at.k] = back->at.code();
    }
    return true;
}

void SplitMesh::fan_of(uint32_t vertex, Fan& fan) const {
    fan.size = 0;
    fan.closed = fan.large = false;
    if (home_[vertex] == none) return;
    const Corner first = home(vertex);
    Corner c = first;
    do {
        if (fan.size == Fan::most) {
            fan.large = true;
            return;
        }
        fan.corners[fan.size++] = c;
        c = counter_clockwise(c);
    } while (c.face != none && c.face != first.face);
    fan.closed = c.face == first.face;
    if (fan.closed) return;
    const uint32_t ahead = fan.size;
    for (c = clockwise(first); c.face != none; c = clockwise(c)) {
        if (fan.size == Fan::most) {
            fan.large = true;
            return;
        }
        fan.corners[fan.size++] = c;
    }
    // Those found clockwise come first, the last found the very first.
    std::reverse(fan.corners.begin() + ahead, fan.corners.begin() + fan.size);
    std::rotate(fan.corners.begin(), fan.corners.begin() + ahead, fan.corners.begin() + fan.size);
}

void SplitMesh::join(Corner edge, Corner other) {
    across_[edge.face][edge.k] = other.code();
    across_[other.face][other.k] = edge.code();
}

void SplitMesh::apply(const Split& split) {
    const uint32_t u = split.parent, v = vertices() - 1;
    LODE_CHECK(u < v, u, v);
    const Corner before = split.before, after = split.after;
    const bool empty = split.arc.empty();
    const Corner first = empty ? Corner{} : split.arc.front(), last = empty ? Corner{} : split.arc.back();
    const uint32_t x = !empty                ? corners_[first.face][next(first.k)]
                       : before.face != none ? corners_[before.face][previous(before.k)]
                                             : split.opposite;
    const uint32_t y = !empty               ? corners_[last.face][previous(last.k)]
                       : after.face != none ? corners_[after.face][next(after.k)]
                                            : split.opposite;
    bool home_goes = home_[u] == none;
    for (const Corner c : split.arc) {
        corners_[c.face][c.k] = v;
        home_goes |= c.code() == home_[u];
    }
    uint32_t right = none, left = none;
    const auto older = [](uint32_t a, uint32_t b) { return std::min(a, b); };  // none is the largest
    if (split.right) {
        right = add_face({v, u, x}, older(before.face, first.face));
        if (before.face != none) join({right, 1}, {before.face, previous(before.k)});
        if (!empty) join({right, 2}, first);
        if (home_[x] == none) home_[x] = Corner{right, 2}.code();
    }
    if (split.left) {
        left = add_face({v, y, u}, older(after.face, last.face));
        if (after.face != none) join({left, 1}, after);
        if (!empty) join({left, 0}, {last.face, previous(last.k)});
        if (home_[y] == none) home_[y] = Corner{left, 1}.code();
    }
    if (right != none && left != none) join({right, 0}, {left, 2});
    const uint32_t born = right != none ? Corner{right, 0}.code() : left != none ? Corner{left, 0}.code() : none;
    home_[v] = empty ? born : first.code();
    if (home_goes && right != none) home_[u] = Corner{right, 1}.code();
    if (home_goes && right == none) home_[u] = left != none ? Corner{left, 2}.code() : none;
}

std::vector<uint32_t> SplitMesh::wedge_indices() const {
    std::vector<uint32_t> all(corners_.size() * 3);
    for (uint32_t f = 0; f < face_count(); ++f) {
        for (uint32_t k = 0; k < 3; ++k) all[size_t{f} * 3 + k] = wedge({f, k});
    }
    return all;
}

}  // namespace lodestone
