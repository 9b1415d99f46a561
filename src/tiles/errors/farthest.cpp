#include "tiles/errors/farthest.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "mesh/distance/closest_point.h"
#include "tiles/errors/polygon.h"

namespace lodestone::tiles {

TargetSurface::TargetSurface(std::vector<glm::vec3> positions, std::vector<uint32_t> indices)
    : positions_(std::move(positions)), indices_(std::move(indices)), search_(positions_, indices_) {}

std::array<glm::dvec3, 3> TargetSurface::corners(uint32_t triangle) const {
    const uint32_t* first = &indices_[size_t{triangle} * 3];
    return {positions_[first[0]], positions_[first[1]], positions_[first[2]]};
}

double TargetSurface::distance(const glm::dvec3& point, uint32_t triangle) const {
    const auto [a, b, c] = corners(triangle);
    return glm::distance(point, closest_on_triangle(point, a, b, c));
}

namespace {

bool less_bound(const SurfacePiece& a, const SurfacePiece& b) { return a.bound < b.bound; }

class FarthestSearch {
public:
    FarthestSearch(std::vector<SurfacePiece> pieces, const TargetSurface& target, double at_least, double resolution)
        : open_(std::move(pieces)), target_(target), least_(at_least), resolution_(resolution) {}

    double run() {
        std::erase_if(open_, [&](const SurfacePiece& piece) {
            if (!settled(piece.bound)) return false;
            closed_ = std::max(closed_, piece.bound);
            return true;
        });
        std::make_heap(open_.begin(), open_.end(), less_bound);
        while (!open_.empty() && !settled(open_.front().bound)) {
            std::pop_heap(open_.begin(), open_.end(), less_bound);
            const SurfacePiece piece = open_.back();
            open_.pop_back();
            look_at(piece);
        }
        return std::max({least_, closed_, open_.empty() ? 0.0 : open_.front().bound});
    }

private:
    bool settled(double bound) const { return bound <= least_ * (1 + farthest_tolerance) + resolution_; }

    void put(const SurfacePiece& piece) {
        if (settled(piece.bound)) {
            closed_ = std::max(closed_, piece.bound);
            return;
        }
        open_.push_back(piece);
        std::push_heap(open_.begin(), open_.end(), less_bound);
    }

    // The largest distance to one triangle.
    double bound_by(const SurfacePiece& piece, uint32_t triangle) const {
        double bound = 0;
        for (const glm::dvec3& corner : piece.corners) bound = std::max(bound, target_.distance(corner, triangle));
        return bound;
    }

    void look_at(SurfacePiece piece) {
        if (piece.near != ClosestSurface::no_hint) {
            const double bound = bound_by(piece, piece.near);
            if (bound < piece.bound) {
                piece.bound = bound;
                if (settled(bound)) return put(piece);
            }
        }
        const glm::dvec3 centre = (piece.corners[0] + piece.corners[1] + piece.corners[2]) / 3.0;
        const ClosestSurface::Hit middle = target_.closest(centre, piece.near);
        least_ = std::max(least_, middle.distance);
        double reach = 0;
        for (const glm::dvec3& corner : piece.corners) {
            const ClosestSurface::Hit hit = target_.closest(corner, middle.triangle);
            least_ = std::max(least_, hit.distance);
            piece.bound = std::min(piece.bound, bound_by(piece, hit.triangle));
            reach = std::max(reach, glm::distance(corner, centre));
        }
        piece.bound = std::min({piece.bound, bound_by(piece, middle.triangle), middle.distance + reach});
        piece.near = middle.triangle;
        if (settled(piece.bound)) return put(piece);
        if (!cut_along(piece, centre)) quarter(piece);
    }

    // Cuts a piece along the edges of the triangle that it is near to; false where its middle does not lie over that,
    // or no part of it reaches beyond by more than what need not be told apart.
    bool cut_along(const SurfacePiece& piece, const glm::dvec3& middle) {
        const std::array<glm::dvec3, 3> triangle = target_.corners(piece.near);
        const glm::dvec3 normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
        std::vector<glm::dvec3> over(piece.corners.begin(), piece.corners.end());
        std::vector<std::vector<glm::dvec3>> beside;
        const double least = resolution_ / 8;
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3 outwards = glm::cross(triangle[(k + 1) % 3] - triangle[k], normal);
            const double length = glm::length(outwards);
            if (!(length > 0)) return false;
            const auto off = [&](const glm::dvec3& p) { return glm::dot(outwards, p - triangle[k]) / length; };
            if (std::ranges::none_of(over, [&](const glm::dvec3& p) { return off(p) < -least; })) return false;
            if (off(middle) > least) return false;
            if (std::ranges::all_of(over, [&](const glm::dvec3& p) { return off(p) <= least; })) continue;
            auto parts = divided(
                over, off, [](const glm::dvec3& a, const glm::dvec3& b, double share) { return a + (b - a) * share; });
            over = std::move(parts[0]);
            beside.push_back(std::move(parts[1]));
        }
        for (const auto& part : beside) put_polygon(part, piece);
        if (!beside.empty()) put_polygon(over, piece);
        return !beside.empty();
    }
    void put_polygon(const std::vector<glm::dvec3>& corners, const SurfacePiece& of) {
        for (size_t k = 1; k + 1 < corners.size(); ++k)
            put({{corners[0], corners[k], corners[k + 1]}, of.bound, of.near});
    }

    void quarter(const SurfacePiece& piece) {
        const auto& [a, b, c] = piece.corners;
        const glm::dvec3 ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
        for (const auto& corners :
             {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}})
            put({corners, piece.bound, piece.near});
    }

    std::vector<SurfacePiece> open_;  // a heap, the largest bound first
    const TargetSurface& target_;
    double least_, closed_ = 0;  // found at a point; the largest bound of what need not be looked at
    const double resolution_;
};

}  // namespace

double farthest_of(std::vector<SurfacePiece> pieces, const TargetSurface& target, double at_least, double resolution) {
    return FarthestSearch(std::move(pieces), target, at_least, resolution).run();
}

}  // namespace lodestone::tiles
