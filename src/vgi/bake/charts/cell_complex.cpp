#include "vgi/bake/charts/cell_complex.h"

#include <algorithm>
#include <array>
#include <Eigen/Eigenvalues>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <string>
#include <unordered_map>

#include "base/check.h"

namespace lodestone::vgi {

void CellMoments::add(const CellMoments& other) {
    area += other.area;
    weighted += other.weighted;
    normal += other.normal;
    first += other.first;
    for (int i = 0; i < 6; ++i) second[i] += other.second[i];
}

double CellMoments::flatness() const {
    if (area <= 0) return 0;
    const glm::dvec3 c = first / area;
    Eigen::Matrix3d covariance;
    const double xx = second[0] / area - c.x * c.x, yy = second[1] / area - c.y * c.y,
                 zz = second[2] / area - c.z * c.z, xy = second[3] / area - c.x * c.y,
                 xz = second[4] / area - c.x * c.z, yz = second[5] / area - c.y * c.z;
    covariance << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(covariance, Eigen::EigenvaluesOnly);
    return std::max(0.0, solver.eigenvalues()[0]);
}

namespace {

// Positions are taken relative to `origin`: sums of squares of large coordinates would leave no digits.
CellMoments moments_of(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, const glm::dvec3& origin) {
    a -= origin;
    b -= origin;
    c -= origin;
    CellMoments m;
    m.normal = area_vector(a, b, c) * 0.5;
    m.area = glm::length(m.normal);
    const glm::dvec3 sum = a + b + c;
    m.first = sum * (m.area / 3);
    // The integral of p_i p_j over a triangle: area / 12 (sum_i sum_j + sum over corners of p_i p_j).
    const auto integral = [&](int i, int j) {
        return m.area / 12 * (sum[i] * sum[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]);
    };
    const int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    for (int k = 0; k < 6; ++k) m.second[k] = integral(pairs[k][0], pairs[k][1]);
    return m;
}

}  // namespace

CellComplex::CellComplex(const Surface& surface, std::span<const float> density, const FeatureLines& features,
                         const glm::dvec3& middle)
    : triangle_cells_(static_cast<uint32_t>(surface.triangles.size())) {
    const std::vector<uint32_t> twin = surface.twins();
    const auto count = static_cast<uint32_t>(twin.size());
    std::vector<uint32_t> half(count, none);  // half-edge of the complex
    uint32_t edges = 0;
    for (uint32_t h = 0; h < count; ++h) {
        if (half[h] != none) continue;
        half[h] = edges * 2;
        if (twin[h] != none) half[twin[h]] = edges * 2 + 1;
        ++edges;
    }
    next_.resize(size_t{edges} * 2);
    prev_.resize(next_.size());
    origin_.resize(next_.size());
    cell_.assign(next_.size(), none);
    length_.resize(edges);
    feature_.assign(edges, 0);
    out_.assign(surface.positions.size(), none);
    first_.resize(triangle_cells_);
    sides_.assign(triangle_cells_, 3);
    perimeter_.resize(triangle_cells_);
    moments_.resize(triangle_cells_);
    parent_.resize(triangle_cells_);
    for (uint32_t t = 0; t < triangle_cells_; ++t) {
        const auto& v = surface.triangles[t].vertices;
        moments_[t] = moments_of(surface.positions[v[0]], surface.positions[v[1]], surface.positions[v[2]], middle);
        moments_[t].weighted = moments_[t].area * (density.empty() ? 1.0 : static_cast<double>(density[t]));
        parent_[t] = t;
        first_[t] = half[t * 3];
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t h = half[t * 3 + k];
            next_[h] = half[t * 3 + (k + 1) % 3];
            prev_[h] = half[t * 3 + (k + 2) % 3];
            origin_[h] = v[k];
            cell_[h] = t;
            out_[v[k]] = h;
            length_[h >> 1] = glm::length(surface.positions[v[(k + 1) % 3]] - surface.positions[v[k]]);
            perimeter_[t] += length_[h >> 1];
            if (features.at(surface.triangles, twin, t * 3 + k)) feature_[h >> 1] = length_[h >> 1];
        }
    }
    close_boundary();
}

CellComplex::CellComplex(std::span<const CellPart> parts, size_t vertices, const FeatureLines& features) {
    std::vector<std::vector<uint32_t>> half = join_edges(parts, features);
    next_.resize(cell_.size());
    prev_.resize(cell_.size());
    out_.assign(vertices, none);
    parent_.resize(triangle_cells_);
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (size_t i = 0; i < parts.size(); ++i) {
        for (const CellPart::Cell& cell : parts[i].cells) {
            first_.push_back(half[i][cell.first]);
            sides_.push_back(cell.sides);
            perimeter_.push_back(cell.perimeter);
            moments_.push_back(cell.moments);
        }
        for (size_t k = 0; k < half[i].size(); ++k) {
            const uint32_t h = half[i][k];
            if (h == none) continue;
            next_[h] = half[i][parts[i].edges[k / 2].next[k % 2]];
            prev_[next_[h]] = h;
            out_[origin_[h]] = h;
        }
        half[i] = {};
    }
    close_boundary();
}

// Numbers the cells of all parts and their edges, an edge of two parts once. Returns, for every part, the half-edge of
// the complex by those of the part.
std::vector<std::vector<uint32_t>> CellComplex::join_edges(std::span<const CellPart> parts,
                                                           const FeatureLines& features) {
    struct End {
        uint32_t half_edge, source;
    };
    std::unordered_map<uint64_t, End> open;  // edges that end in none so far, by their ends
    std::vector<std::vector<uint32_t>> half(parts.size());
    triangle_cells_ = 0;
    for (size_t i = 0; i < parts.size(); ++i) {
        const CellPart& part = parts[i];
        half[i].assign(part.edges.size() * 2, none);
        for (size_t e = 0; e < part.edges.size(); ++e) {
            const CellPart::Edge& edge = part.edges[e];
            const bool ends = edge.cell[0] == none || edge.cell[1] == none;
            const size_t mine = edge.cell[0] != none ? 0 : 1;
            const uint64_t there = uint64_t{edge.origin[mine]} << 32 | edge.origin[1 - mine],
                           back = uint64_t{edge.origin[1 - mine]} << 32 | edge.origin[mine];
            auto h = static_cast<uint32_t>(cell_.size());
            if (const auto met = ends ? open.find(back) : open.end(); met != open.end()) {
                h = met->second.half_edge ^ 1;
                if (features.between(edge.source, met->second.source)) feature_[h >> 1] = edge.length;
                open.erase(met);
            } else {
                cell_.insert(cell_.end(), {none, none});
                origin_.insert(origin_.end(), {edge.origin[mine], edge.origin[1 - mine]});
                length_.push_back(edge.length);
                feature_.push_back(edge.feature);
                if (ends) open.emplace(there, End{h, edge.source});
            }
            half[i][2 * e + mine] = h;
            cell_[h] = edge.cell[mine] + triangle_cells_;
            if (ends) continue;
            half[i][2 * e + 1 - mine] = h ^ 1;
            cell_[h ^ 1] = edge.cell[1 - mine] + triangle_cells_;
        }
        triangle_cells_ += static_cast<uint32_t>(part.cells.size());
    }
    return half;
}

// Boundary loops: the half-edges that no cell has, each going on where its twin's vertex leads, become cells.
void CellComplex::close_boundary() {
    for (uint32_t h = 0; h < cell_.size(); ++h) {
        const uint32_t mine = h ^ 1;
        if (cell_[h] == none || cell_[mine] != none) continue;
        origin_[mine] = origin_[next_[h]];
        // From the end of `mine` on along the boundary: turn around that vertex through its cells.
        uint32_t g = h;
        for (;;) {
            const uint32_t in = prev_[g];  // comes into the origin of g
            if (cell_[in ^ 1] == none) {
                next_[mine] = in ^ 1;
                prev_[in ^ 1] = mine;
                break;
            }
            g = in ^ 1;
        }
    }
    for (uint32_t h = 0; h < cell_.size(); ++h) {
        if (cell_[h] != none) continue;
        const auto loop = static_cast<uint32_t>(first_.size());
        first_.push_back(h);
        sides_.push_back(0);
        perimeter_.push_back(0);
        moments_.emplace_back();
        for (uint32_t g = h; cell_[g] == none; g = next_[g]) {
            cell_[g] = loop;
            ++sides_[loop];
            perimeter_[loop] += length_[g >> 1];
        }
    }
    at_ends_.assign(first_.size(), 0);
    touching_.assign(first_.size(), 0);
}

template <class Visit>
void CellComplex::around(uint32_t vertex, Visit&& visit) const {
    const uint32_t begin = out_[vertex];
    uint32_t h = begin;
    do {
        visit(h);
        h = next_[h ^ 1];
    } while (h != begin);
}

uint32_t CellComplex::degree(uint32_t vertex) const {
    uint32_t n = 0;
    around(vertex, [&](uint32_t) { ++n; });
    return n;
}

bool CellComplex::may_merge(uint32_t edge) {
    const uint32_t h = edge * 2, g = h + 1, a = cell_[h], b = cell_[g];
    if (a == b || a >= triangle_cells_ || b >= triangle_cells_) return false;
    if (++query_ == 0) {  // once in four billion times all marks are old
        std::ranges::fill(at_ends_, 0u);
        std::ranges::fill(touching_, 0u);
        query_ = 1;
    }
    if (!ends_allow_merge(edge)) return false;
    const uint32_t lost = 2u + (degree(origin_[h]) == 3) + (degree(origin_[g]) == 3);
    if (sides_[a] + sides_[b] < lost + 3) return false;
    return touch_nowhere_else(edge);
}

// Cells at the edge's ends other than its two: some at either, none at both, none left with fewer than three sides.
// They are marked in at_ends_.
bool CellComplex::ends_allow_merge(uint32_t edge) {
    const uint32_t h = edge * 2, g = h + 1, a = cell_[h], b = cell_[g];
    bool good = true;
    for (const uint32_t end : {origin_[h], origin_[g]}) {
        uint32_t met = 0, other = none;
        around(end, [&](uint32_t out) {
            const uint32_t c = cell_[out];
            ++met;
            if (c == a || c == b) return;
            good = good && at_ends_[c] != query_;
            at_ends_[c] = query_;
            other = c;
        });
        if (!good || other == none || (met == 3 && sides_[other] <= 3)) return false;
    }
    return true;
}

// Whether the edge's two cells touch in nothing but the edge, and no third cell but those at its ends touches both.
bool CellComplex::touch_nowhere_else(uint32_t edge) {
    const uint32_t h = edge * 2, g = h + 1, a = cell_[h], b = cell_[g];
    const uint32_t p = origin_[h], q = origin_[g];
    bool good = true;
    for (uint32_t i = next_[h]; i != h && good; i = next_[i]) {
        const uint32_t v = origin_[i];
        if (v == q) continue;
        around(v, [&](uint32_t out) {
            const uint32_t c = cell_[out];
            if (c == b) good = false;
            touching_[c] = query_;
        });
    }
    for (uint32_t i = next_[g]; i != g && good; i = next_[i]) {
        const uint32_t v = origin_[i];
        if (v == p) continue;
        around(v, [&](uint32_t out) {
            const uint32_t c = cell_[out];
            if (c == b || !good) return;
            good = c != a && (touching_[c] != query_ || at_ends_[c] == query_);
        });
    }
    return good;
}

uint32_t CellComplex::merge(uint32_t edge) {
    const uint32_t h = edge * 2, g = h + 1;
    uint32_t a = cell_[h], b = cell_[g];
    const uint32_t kept = std::min(a, b), gone = std::max(a, b);
    for (uint32_t begin = cell_[h] == gone ? h : g, i = begin;;) {
        cell_[i] = kept;
        i = next_[i];
        if (i == begin) break;
    }
    const uint32_t p = origin_[h], q = origin_[g];
    next_[prev_[h]] = next_[g];
    prev_[next_[g]] = prev_[h];
    next_[prev_[g]] = next_[h];
    prev_[next_[h]] = prev_[g];
    out_[p] = next_[g];
    out_[q] = next_[h];
    first_[kept] = next_[h];
    first_[gone] = none;
    sides_[kept] = sides_[a] + sides_[b] - 2;
    perimeter_[kept] = perimeter_[a] + perimeter_[b] - 2 * length_[edge];
    moments_[kept].add(moments_[gone]);
    parent_[gone] = kept;
    length_[edge] = -1;
    for (const uint32_t v : {p, q}) {
        if (degree(v) == 2) dissolve(v);
    }
    return kept;
}

// A vertex between two cells alone: its two arcs become one.
void CellComplex::dissolve(uint32_t vertex) {
    const uint32_t x = out_[vertex], u = prev_[x];  // u comes in, x goes out, of one cell; their twins of the other
    const uint32_t end = origin_[x ^ 1];
    next_[u] = next_[x];
    prev_[next_[x]] = u;
    next_[prev_[x ^ 1]] = u ^ 1;
    prev_[u ^ 1] = prev_[x ^ 1];
    origin_[u ^ 1] = end;
    length_[u >> 1] += length_[x >> 1];
    feature_[u >> 1] += feature_[x >> 1];
    length_[x >> 1] = -1;
    if (out_[end] == (x ^ 1)) out_[end] = u ^ 1;
    for (const uint32_t side : {u, u ^ 1}) {
        const uint32_t c = cell_[side];
        --sides_[c];
        if (first_[c] == x || first_[c] == (x ^ 1)) first_[c] = side;
    }
    out_[vertex] = none;
}

std::vector<uint32_t> CellComplex::labels() const {
    std::vector<uint32_t> label(triangle_cells_);
    // A cell is only ever merged into one of lower number.
    for (uint32_t t = 0; t < triangle_cells_; ++t) label[t] = parent_[t] == t ? t : label[parent_[t]];
    return label;
}

CellPart CellComplex::part(const Surface& surface, std::span<const uint32_t> vertices,
                           std::vector<uint32_t>& cell_of) const {
    CellPart part;
    std::vector<uint32_t> number(first_.size(), none), half(next_.size(), none);
    for (uint32_t c = 0; c < triangle_cells_; ++c) {
        if (!alive(c)) continue;
        number[c] = static_cast<uint32_t>(part.cells.size());
        part.cells.push_back({moments_[c], perimeter_[c], first_[c], sides_[c]});
    }
    uint32_t edges = 0;
    for (uint32_t e = 0; e < length_.size(); ++e) {
        if (!edge_alive(e)) continue;
        half[2 * e] = 2 * edges;
        half[2 * e + 1] = 2 * edges + 1;
        ++edges;
    }
    part.edges.reserve(edges);
    for (uint32_t e = 0; e < length_.size(); ++e) {
        if (!edge_alive(e)) continue;
        CellPart::Edge edge;
        for (uint32_t side = 0; side < 2; ++side) {
            const uint32_t h = 2 * e + side;
            edge.origin[side] = vertices[origin_[h]];
            edge.next[side] = half[next_[h]];
            edge.cell[side] = number[cell_[h]];
            if (cell_[h ^ 1] < triangle_cells_) continue;
            LODE_CHECK(sides_[cell_[h]] == 3, cell_[h]);
            edge.source = surface.triangles[cell_[h]].source;
        }
        edge.length = length_[e];
        edge.feature = feature_[e];
        part.edges.push_back(edge);
    }
    for (CellPart::Cell& cell : part.cells) cell.first = half[cell.first];
    cell_of = labels();
    for (uint32_t& cell : cell_of) cell = number[cell];
    return part;
}

Result<void> CellComplex::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "cell complex: " + what); };
    for (uint32_t h = 0; h < next_.size(); ++h) {
        if (!edge_alive(h >> 1)) continue;
        if (prev_[next_[h]] != h || origin_[next_[h]] != origin_[h ^ 1] || cell_[next_[h]] != cell_[h])
            return wrong("half-edge " + std::to_string(h) + " leads astray");
        if (out_[origin_[h]] == none) return wrong("a vertex in use has no half-edge");
    }
    // Contacts: per pair of cells the vertices both have, and the edges between them; those on one arc are one more
    // than its edges, so vertices - edges is the number of contacts (1), or the arc is a closed loop (0).
    std::map<std::pair<uint32_t, uint32_t>, int> contacts;
    std::vector<uint32_t> cells;
    for (uint32_t v = 0; v < out_.size(); ++v) {
        if (out_[v] == none) continue;
        cells.clear();
        around(v, [&](uint32_t out) { cells.push_back(cell_[out]); });
        if (cells.size() < 3) return wrong("vertex " + std::to_string(v) + " joins fewer than three cells");
        std::sort(cells.begin(), cells.end());
        if (std::adjacent_find(cells.begin(), cells.end()) != cells.end())
            return wrong("a cell meets itself at vertex " + std::to_string(v));
        for (size_t i = 0; i < cells.size(); ++i) {
            for (size_t j = i + 1; j < cells.size(); ++j) ++contacts[{cells[i], cells[j]}];
        }
    }
    for (uint32_t e = 0; e < length_.size(); ++e) {
        if (!edge_alive(e)) continue;
        --contacts[std::minmax(cell_[e * 2], cell_[e * 2 + 1])];
    }
    for (const auto& [pair, number] : contacts) {
        if (number != 1)
            return wrong("cells " + std::to_string(pair.first) + " and " + std::to_string(pair.second) + " touch in " +
                         std::to_string(number) + " places");
    }
    for (uint32_t c = 0; c < first_.size(); ++c) {
        if (!alive(c)) continue;
        uint32_t n = 0, h = first_[c];
        do {
            if (cell_[h] != c) return wrong("cell " + std::to_string(c) + " has a half-edge of another");
            ++n;
            h = next_[h];
        } while (h != first_[c] && n <= sides_[c]);
        if (n != sides_[c] || n < 3) return wrong("cell " + std::to_string(c) + " has the wrong number of sides");
    }
    return {};
}

}  // namespace lodestone::vgi
