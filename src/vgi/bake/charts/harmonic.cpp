#include "vgi/bake/charts/harmonic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <Eigen/SparseCholesky>
#include <glm/geometric.hpp>

namespace lodestone::vgi {

namespace {
// Cotangents below are raised to this, in units of the weight of a right-angled isosceles triangle: weights stay
// positive, and obtuse triangles do not come loose.
constexpr double least_weight = 0.02, most_weight = 50;
}  // namespace

namespace {

// The system of one coordinate, or of both.
struct Axes {
    std::vector<uint32_t> unknown;  // per vertex: its row, none where it is given
    Eigen::SparseMatrix<double> matrix;
    std::vector<uint32_t> diagonal, entry;  // where in the matrix: per row; per half-edge, none where there is nothing
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver;
    uint32_t rows = 0;
    bool x = true, y = true;  // coordinates that it gives

    // given: per vertex.
    void prepare(const ChartMesh& patch, const std::vector<bool>& given) {
        unknown.assign(patch.positions.size(), none);
        for (uint32_t v = 0; v < unknown.size(); ++v) {
            if (!given[v]) unknown[v] = rows++;
        }
        if (rows == 0) return;
        // The lower triangle.
        std::vector<Eigen::Triplet<double>> triplets;
        for (uint32_t row = 0; row < rows; ++row) triplets.emplace_back(row, row, 1);
        for (uint32_t h = 0; h < patch.twin.size(); ++h) {
            const uint32_t i = unknown[patch.from(h)], j = unknown[patch.to(h)];
            if (i != none && j != none) triplets.emplace_back(std::max(i, j), std::min(i, j), 0);
        }
        matrix.resize(rows, rows);
        matrix.setFromTriplets(triplets.begin(), triplets.end());
        matrix.makeCompressed();
        const auto place = [&](uint32_t row, uint32_t column) {
            const int* begin = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column];
            const int* end = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column + 1];
            return static_cast<uint32_t>(std::lower_bound(begin, end, static_cast<int>(row)) - matrix.innerIndexPtr());
        };
        for (uint32_t row = 0; row < rows; ++row) diagonal.push_back(place(row, row));
        entry.assign(patch.twin.size(), none);
        for (uint32_t h = 0; h < patch.twin.size(); ++h) {
            const uint32_t i = unknown[patch.from(h)], j = unknown[patch.to(h)];
            if (i != none && j != none) entry[h] = place(std::max(i, j), std::min(i, j));
        }
        solver.analyzePattern(matrix);
    }

    // weight: per half-edge. into: takes the coordinates.
    bool solve(const ChartMesh& patch, const std::vector<double>& weight, std::vector<glm::dvec2>& into) {
        if (rows == 0) return true;
        double* values = matrix.valuePtr();
        std::fill(values, values + matrix.nonZeros(), 0.0);
        Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(rows, 2);
        for (uint32_t h = 0; h < patch.twin.size(); ++h) {
            const uint32_t a = patch.from(h), b = patch.to(h), i = unknown[a], j = unknown[b];
            if (i != none) values[diagonal[i]] += weight[h];
            if (j != none) values[diagonal[j]] += weight[h];
            if (entry[h] != none) values[entry[h]] -= weight[h];
            if (i != none && j == none)
                right.row(i) += weight[h] * Eigen::RowVector2d(patch.flat[b].x, patch.flat[b].y);
            if (j != none && i == none)
                right.row(j) += weight[h] * Eigen::RowVector2d(patch.flat[a].x, patch.flat[a].y);
        }
        solver.factorize(matrix);
        if (solver.info() != Eigen::Success) return false;
        const Eigen::MatrixX2d flat = solver.solve(right);
        if (solver.info() != Eigen::Success || !flat.allFinite()) return false;
        for (uint32_t v = 0; v < unknown.size(); ++v) {
            if (unknown[v] == none) continue;
            if (x) into[v].x = flat(unknown[v], 0);
            if (y) into[v].y = flat(unknown[v], 1);
        }
        return true;
    }
};

}  // namespace

struct HarmonicSolver::System {
    ChartMesh& patch;
    std::vector<double> cotangent;  // per half-edge: of the angle opposite to it, clamped
    std::array<Axes, 2> axes;       // both coordinates in the first, or one in each
    size_t used = 1;
};

HarmonicSolver::HarmonicSolver(ChartMesh& patch, Border border)
    : system_(new System{patch, {}, {}, border == Border::pinned ? size_t{1} : size_t{2}}) {
    System& s = *system_;
    s.cotangent.resize(patch.twin.size());
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const glm::dvec3& apex = patch.positions[patch.to(next_corner(h))];
        const glm::dvec3 a = patch.positions[patch.from(h)] - apex, b = patch.positions[patch.to(h)] - apex;
        const double sine = glm::length(glm::cross(a, b));
        const double cotangent = sine > 0 ? glm::dot(a, b) / sine : most_weight;
        s.cotangent[h] = std::clamp(cotangent, least_weight, most_weight);
    }
    const std::vector<bool> rim = patch.on_boundary();
    if (border == Border::pinned) {
        s.axes[0].prepare(patch, rim);
        return;
    }
    const auto at_end = [](double at) { return at == 0 || at == 1; };
    for (int k = 0; k < 2; ++k) {
        std::vector<bool> given(rim.size(), false);
        for (size_t v = 0; v < rim.size(); ++v) given[v] = rim[v] && at_end(patch.flat[v][k]);
        s.axes[static_cast<size_t>(k)].x = k == 0;
        s.axes[static_cast<size_t>(k)].y = k == 1;
        s.axes[static_cast<size_t>(k)].prepare(patch, given);
    }
}

HarmonicSolver::~HarmonicSolver() = default;

bool HarmonicSolver::solve(std::span<const double> density, bool uniform) {
    System& s = *system_;
    std::vector<double> weight(s.cotangent.size(), 0.5);
    for (size_t h = 0; h < weight.size() && !uniform; ++h)
        weight[h] = s.cotangent[h] * (density.empty() ? 1 : density[h / 3]);
    std::vector<glm::dvec2> flat = s.patch.flat;
    for (size_t k = 0; k < s.used; ++k) {
        if (!s.axes[k].solve(s.patch, weight, flat)) return false;
    }
    s.patch.flat = std::move(flat);
    return true;
}

}  // namespace lodestone::vgi
