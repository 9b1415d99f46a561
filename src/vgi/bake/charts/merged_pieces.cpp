#include "vgi/bake/charts/merged_pieces.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "base/check.h"

namespace lodestone::vgi {

namespace {

// A new triangle's height over its longest edge is at least this, or no less than the worst of those that it replaces.
constexpr double good_shape = 0.05;
constexpr double least_weight_area = 1e-6;  // of a new triangle, in weights of its source's corners: of 1 in all

class PieceMerging {
public:
    explicit PieceMerging(ChartMesh& patch)
        : patch_(patch),
          rim_(patch.on_boundary()),
          out_(patch.positions.size(), none),
          gone_(patch.triangles.size(), false) {
        for (uint32_t h = 0; h < patch.twin.size(); ++h) out_[patch.from(h)] = h;
    }

    uint32_t run(uint32_t uncut) {
        std::vector<uint32_t> left, next;
        for (uint32_t v = 0; v < out_.size(); ++v) {
            if (!rim_[v] && patch_.origin[v] >= uncut) left.push_back(v);
        }
        // What is in the way of one may be taken out after it.
        uint32_t count = 0;
        for (size_t before = left.size() + 1; left.size() < before;) {
            before = left.size();
            next.clear();
            for (const uint32_t v : left) {
                if (take_out(v))
                    ++count;
                else
                    next.push_back(v);
            }
            std::swap(left, next);
        }
        if (count > 0) compact();
        return count;
    }

private:
    // Of the triangle of half-edge h, the place of the vertex that h begins at.
    glm::vec2 place(uint32_t h) const { return patch_.places.of(patch_.triangles[h / 3])[h % 3]; }
    uint32_t source(uint32_t h) const { return patch_.triangles[h / 3].source; }

    // Half-edges from an inner vertex, counter-clockwise.
    void gather_fan(uint32_t v) {
        fan_.clear();
        uint32_t h = out_[v];
        do {
            fan_.push_back(h);
            h = patch_.twin[previous_corner(h)];
        } while (h != out_[v]);
    }
    void gather_neighbours(uint32_t v) {
        neighbours_.clear();
        uint32_t h = out_[v];
        do {
            neighbours_.push_back(patch_.to(h));
            const uint32_t in = previous_corner(h);
            if (patch_.twin[in] == none) neighbours_.push_back(patch_.from(in));
            h = patch_.twin[in];
        } while (h != none && h != out_[v]);
        if (h != none) return;
        for (h = patch_.twin[out_[v]]; h != none; h = patch_.twin[h]) {
            h = next_corner(h);
            neighbours_.push_back(patch_.to(h));
        }
    }

    double shape(uint32_t a, uint32_t b, uint32_t c) const {
        const auto &p = patch_.positions[a], &q = patch_.positions[b], &r = patch_.positions[c];
        const double longest = std::max({glm::dot(q - p, q - p), glm::dot(r - q, r - q), glm::dot(p - r, p - r)});
        return longest > 0 ? glm::length(area_vector(p, q, r)) / longest : 0;
    }

    // Moves it to a neighbour along an edge, with the pieces around it; false where no neighbour will do.
    bool take_out(uint32_t v) {
        gather_fan(v);
        const size_t n = fan_.size();
        size_t borders = 0;
        double worst = good_shape;
        for (size_t i = 0; i < n; ++i) {
            borders += source(fan_[i]) != source(fan_[(i + n - 1) % n]) ? 1 : 0;
            worst = std::min(worst, shape(v, patch_.to(fan_[i]), patch_.to(fan_[(i + 1) % n])));
        }
        if (borders != 0 && borders != 2) return false;
        size_t best = n;
        double best_shape = 0;
        for (size_t i = 0; i < n; ++i) {
            // On an edge of the source it stays on it.
            if (borders == 2 && source(fan_[i]) == source(fan_[(i + n - 1) % n])) continue;
            const double shape = shape_without(i, std::max(worst, best_shape));
            if (shape > best_shape) {
                best = i;
                best_shape = shape;
            }
        }
        if (best == n) return false;
        collapse(best);
        return true;
    }

    // The place of the far end of fan_[i] on the source triangle of fan_[j], which has that edge on its border.
    glm::vec2 end_place(size_t i, size_t j) const {
        const uint32_t h = fan_[i], last = fan_[(i + fan_.size() - 1) % fan_.size()];
        return source(h) == source(fan_[j]) ? place(next_corner(h)) : place(previous_corner(last));
    }
    // The worst shape of the fan's triangles when its vertex is moved along fan_[i]; 0 where that is less than `least`,
    // where one would turn over, or where vertices would be joined that must not be.
    double shape_without(size_t i, double least) {
        const size_t n = fan_.size(), last = (i + n - 1) % n, next = (i + 1) % n;
        const uint32_t u = patch_.to(fan_[i]);
        double worst = 1;
        for (size_t j = 0; j < n; ++j) {
            if (j == i || j == last) continue;
            const uint32_t h = fan_[j];
            const glm::dvec2 at(end_place(i, j));
            const glm::dvec2 a = glm::dvec2(place(next_corner(h))) - at, b = glm::dvec2(place(previous_corner(h))) - at;
            if (cross(a, b) < least_weight_area) return 0;
            worst = std::min(worst, shape(u, patch_.to(h), patch_.from(previous_corner(h))));
        }
        if (worst < least) return 0;
        // Last, as it may have many neighbours.
        gather_neighbours(u);
        for (size_t j = 0; j < n; ++j) {
            const uint32_t w = patch_.to(fan_[j]);
            if (j == i || j == last || j == next) continue;
            if ((rim_[u] && rim_[w]) || std::ranges::find(neighbours_, w) != neighbours_.end()) return 0;
        }
        return worst;
    }

    void collapse(size_t i) {
        const size_t n = fan_.size(), last = (i + n - 1) % n;
        const uint32_t h = fan_[i], u = patch_.to(h), g = fan_[last];
        for (size_t j = 0; j < n; ++j) {
            if (j == i || j == last) continue;
            SurfaceTriangle& t = patch_.triangles[fan_[j] / 3];
            CutPlaces::Corners corners = patch_.places.of(t);
            corners[fan_[j] % 3] = end_place(i, j);
            t.vertices[fan_[j] % 3] = u;
            patch_.places.set(t, corners);
        }
        // Of either triangle that goes, the two sides that stay are one.
        const auto join = [&](uint32_t stays, uint32_t moves) {
            const uint32_t a = patch_.twin[stays], b = patch_.twin[moves];
            if (a != none) patch_.twin[a] = b;
            patch_.twin[b] = a;
        };
        const uint32_t left = patch_.twin[previous_corner(h)], right = patch_.twin[g];
        const uint32_t left_apex = patch_.from(previous_corner(h)), right_apex = patch_.to(g);
        join(next_corner(h), previous_corner(h));
        join(next_corner(g), g);
        gone_[h / 3] = gone_[g / 3] = true;
        out_[u] = left;
        out_[left_apex] = next_corner(left);
        out_[right_apex] = right;
    }

    void compact() {
        std::vector<uint32_t> kept;
        for (uint32_t t = 0; t < gone_.size(); ++t) {
            if (!gone_[t]) kept.push_back(t);
        }
        Surface all;
        all.positions = std::move(patch_.positions);
        all.triangles = std::move(patch_.triangles);
        all.places = std::move(patch_.places);
        ChartMesh taken = take_chart_mesh(all, kept);
        for (uint32_t& v : taken.origin) v = patch_.origin[v];
        patch_ = std::move(taken);
    }

    ChartMesh& patch_;
    const std::vector<bool> rim_;  // per vertex
    std::vector<uint32_t> out_;    // per vertex: a half-edge from it
    std::vector<bool> gone_;       // per triangle
    std::vector<uint32_t> fan_;    // of the vertex that is looked at
    std::vector<uint32_t> neighbours_;
};

}  // namespace

uint32_t merge_pieces(ChartMesh& patch, uint32_t uncut) {
    LODE_CHECK(patch.flat.empty());
    return PieceMerging(patch).run(uncut);
}

}  // namespace lodestone::vgi
