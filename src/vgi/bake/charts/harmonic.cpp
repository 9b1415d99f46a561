#include "vgi/bake/charts/harmonic.h"

#include <algorithm>
#include <cmath>
#include <Eigen/SparseCholesky>
#include <glm/geometric.hpp>

namespace lodestone::vgi {

namespace {
// Cotangents below are raised to this, in units of the weight of a right-angled isosceles triangle: weights stay
// positive, and obtuse triangles do not come loose.
constexpr double least_weight = 0.02, most_weight = 50;
}  // namespace

struct HarmonicSolver::System {
    ChartMesh& patch;
    std::vector<uint32_t> unknown;  // per vertex: its row, none on the boundary
    std::vector<double> cotangent;  // per half-edge: of the angle opposite to it, clamped
    Eigen::SparseMatrix<double> matrix;
    std::vector<uint32_t> diagonal, entry;  // where in the matrix: per row; per half-edge, none where there is nothing
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
    uint32_t rows = 0;
};

HarmonicSolver::HarmonicSolver(ChartMesh& patch) : system_(new System{patch, {}, {}, {}, {}, {}, {}, 0}) {
    System& s = *system_;
    s.unknown.assign(patch.positions.size(), 0);
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        if (patch.twin[h] == none) s.unknown[patch.from(h)] = none;
    }
    for (uint32_t& u : s.unknown) {
        if (u != none) u = s.rows++;
    }
    s.cotangent.resize(patch.twin.size());
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const glm::dvec3& apex = patch.positions[patch.to(next_corner(h))];
        const glm::dvec3 a = patch.positions[patch.from(h)] - apex, b = patch.positions[patch.to(h)] - apex;
        const double sine = glm::length(glm::cross(a, b));
        const double cotangent = sine > 0 ? glm::dot(a, b) / sine : most_weight;
        s.cotangent[h] = std::clamp(cotangent, least_weight, most_weight);
    }
    if (s.rows == 0) return;
    // The lower triangle.
    std::vector<Eigen::Triplet<double>> triplets;
    for (uint32_t row = 0; row < s.rows; ++row) triplets.emplace_back(row, row, 1);
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const uint32_t i = s.unknown[patch.from(h)], j = s.unknown[patch.to(h)];
        if (i != none && j != none && i > j) triplets.emplace_back(i, j, 0);
    }
    s.matrix.resize(s.rows, s.rows);
    s.matrix.setFromTriplets(triplets.begin(), triplets.end());
    s.matrix.makeCompressed();
    const auto place = [&](uint32_t row, uint32_t column) {
        const int* begin = s.matrix.innerIndexPtr() + s.matrix.outerIndexPtr()[column];
        const int* end = s.matrix.innerIndexPtr() + s.matrix.outerIndexPtr()[column + 1];
        return static_cast<uint32_t>(std::lower_bound(begin, end, static_cast<int>(row)) - s.matrix.innerIndexPtr());
    };
    for (uint32_t row = 0; row < s.rows; ++row) s.diagonal.push_back(place(row, row));
    s.entry.assign(patch.twin.size(), none);
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const uint32_t i = s.unknown[patch.from(h)], j = s.unknown[patch.to(h)];
        if (i != none && j != none) s.entry[h] = place(std::max(i, j), std::min(i, j));
    }
    s.solver.analyzePattern(s.matrix);
}

HarmonicSolver::~HarmonicSolver() = default;

bool HarmonicSolver::solve(std::span<const double> density, bool uniform) {
    System& s = *system_;
    if (s.rows == 0) return true;
    ChartMesh& patch = s.patch;
    double* values = s.matrix.valuePtr();
    std::fill(values, values + s.matrix.nonZeros(), 0.0);
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(s.rows, 2);
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const double weight = uniform ? 0.5 : s.cotangent[h] * (density.empty() ? 1 : density[h / 3]);
        const uint32_t a = patch.from(h), b = patch.to(h), i = s.unknown[a], j = s.unknown[b];
        if (i != none) values[s.diagonal[i]] += weight;
        if (j != none) values[s.diagonal[j]] += weight;
        if (s.entry[h] != none) values[s.entry[h]] -= weight;
        if (i != none && j == none) right.row(i) += weight * Eigen::RowVector2d(patch.flat[b].x, patch.flat[b].y);
        if (j != none && i == none) right.row(j) += weight * Eigen::RowVector2d(patch.flat[a].x, patch.flat[a].y);
    }
    s.solver.factorize(s.matrix);
    if (s.solver.info() != Eigen::Success) return false;
    const Eigen::MatrixX2d flat = s.solver.solve(right);
    if (s.solver.info() != Eigen::Success || !flat.allFinite()) return false;
    for (uint32_t v = 0; v < s.unknown.size(); ++v) {
        if (s.unknown[v] != none) patch.flat[v] = {flat(s.unknown[v], 0), flat(s.unknown[v], 1)};
    }
    return true;
}

}  // namespace lodestone::vgi
