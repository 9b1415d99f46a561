// Closest point of a triangle. Ericson, "Real-Time Collision Detection", 2005, 5.1.5 (Voronoi regions).
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace lodestone {

// The point of segment ab nearest to p; a where the segment is a point.
inline glm::dvec3 closest_on_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 ab = b - a;
    const double length2 = glm::dot(ab, ab);
    if (length2 <= 0) return a;
    const double t = glm::dot(p - a, ab) / length2;
    return t <= 0 ? a : t >= 1 ? b : a + ab * t;
}

// The point of triangle abc nearest to p. A triangle without area counts as the segment or point it is.
inline glm::dvec3 closest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                                      const glm::dvec3& c) {
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const glm::dvec3 bp = p - b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const glm::dvec3 cp = p - c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    const double sum = va + vb + vc;
    // Without area the regions of the edges are not told apart reliably: take the nearest of the three edges.
    if (!(sum > 1e-14 * glm::dot(ab, ab) * glm::dot(ac, ac))) {
        const glm::dvec3 candidates[3] = {closest_on_segment(p, a, b), closest_on_segment(p, b, c),
                                          closest_on_segment(p, c, a)};
        glm::dvec3 best = candidates[0];
        for (const glm::dvec3& q : candidates) {
            if (glm::dot(p - q, p - q) < glm::dot(p - best, p - best)) best = q;
        }
        return best;
    }
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    return a + ab * (vb / sum) + ac * (vc / sum);
}

}  // namespace lodestone
