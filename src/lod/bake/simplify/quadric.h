// Quadrics: sums of squared distances to planes, and of squared differences to linear fields of attributes.
//   Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
//   Hoppe, "New quadric metric for simplifying meshes with appearance attributes", IEEE Visualization 1999.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace lodestone {

// Q(p) = p' A p + 2 b' p + c, with A symmetric.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    double bx = 0, by = 0, bz = 0;
    double c = 0;

    // weight * (normal . p + offset)^2; normal of any length.
    void add_plane(const glm::dvec3& normal, double offset, double weight) {
        const glm::dvec3 n = normal * weight;
        xx += n.x * normal.x;
        xy += n.x * normal.y;
        xz += n.x * normal.z;
        yy += n.y * normal.y;
        yz += n.y * normal.z;
        zz += n.z * normal.z;
        bx += n.x * offset;
        by += n.y * offset;
        bz += n.z * offset;
        c += weight * offset * offset;
    }
    Quadric& operator+=(const Quadric& o) {
        xx += o.xx;
        xy += o.xy;
        xz += o.xz;
        yy += o.yy;
        yz += o.yz;
        zz += o.zz;
        bx += o.bx;
        by += o.by;
        bz += o.bz;
        c += o.c;
        return *this;
    }
    // Of unit-normal planes alone: the sum of their weights.
    double weight() const { return xx + yy + zz; }
    double at(const glm::dvec3& p) const {
        const double x = xx * p.x + 2 * (xy * p.y + xz * p.z + bx);
        const double y = yy * p.y + 2 * (yz * p.z + by);
        const double z = zz * p.z + 2 * bz;
        return x * p.x + y * p.y + z * p.z + c;
    }
};

// For each of a number of attributes: the sum over faces of weight * (gradient . p + offset - s)^2. The part that does
// not depend on s is one Quadric for all of them; the rest is four numbers an attribute.
struct AttributeField {
    glm::dvec3 gradient{0};  // sum of weight * gradient
    double offset = 0;       // sum of weight * offset
};

}  // namespace lodestone
