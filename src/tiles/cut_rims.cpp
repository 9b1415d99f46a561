#include "tiles/cut_rims.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "mesh/topology.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaves.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;
constexpr double no_end = std::numeric_limits<double>::infinity();
// A sample of a rim is as far from it as rounding takes it, and where corners are kept open some steps more.
constexpr double most_steps_off = 6;
constexpr uint32_t most_probes = 16;

// Where the surface of the piece ends: a closed chain of edges, the surface on their left.
struct Loop {
    std::vector<glm::dvec3> points;
    std::vector<double> along;  // length up to each point, and that of all
    std::vector<bool> cut;      // per edge: on a plane
    glm::dvec3 low{no_end}, high{-no_end};

    size_t size() const { return points.size(); }
    double length() const { return along.back(); }
    const glm::dvec3& to(size_t edge) const { return points[(edge + 1) % size()]; }
    bool has_cut() const { return std::ranges::find(cut, true) != cut.end(); }
    // Of a place along it, 0 .. length().
    size_t edge_at(double place) const {
        const auto behind = std::upper_bound(along.begin(), along.end() - 1, place);
        return static_cast<size_t>(behind - along.begin()) - 1;
    }
    glm::dvec3 at(double place) const {
        const size_t edge = edge_at(place);
        const double edge_length = along[edge + 1] - along[edge];
        const double share = edge_length > 0 ? std::clamp((place - along[edge]) / edge_length, 0.0, 1.0) : 0;
        return points[edge] + (to(edge) - points[edge]) * share;
    }
    // The nearest place on an edge, and how far it is.
    std::pair<double, double> nearest(size_t edge, const glm::dvec3& p) const {
        const glm::dvec3 way = to(edge) - points[edge];
        const double squared = glm::dot(way, way);
        const double share = squared > 0 ? std::clamp(glm::dot(p - points[edge], way) / squared, 0.0, 1.0) : 0;
        const double place = along[edge] + (along[edge + 1] - along[edge]) * share;
        return {place, glm::distance(p, points[edge] + way * share)};
    }
    // No more than `most` is told apart.
    double distance(const glm::dvec3& p, double most) const {
        if (glm::distance(p, glm::clamp(p, low, high)) >= most) return most;
        for (size_t edge = 0; edge < size(); ++edge) most = std::min(most, nearest(edge, p).second);
        return most;
    }
};

std::vector<Loop> loops_of(const PieceOfSource& piece) {
    const TriMesh& mesh = piece.mesh;
    std::vector<uint32_t> corner_vertex;
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t wedge : t) corner_vertex.push_back(mesh.wedge_vertex[wedge]);
    }
    const std::vector<uint32_t> twins = half_edge_twins(corner_vertex, mesh.vertex_count());
    const glm::vec3 farthest = glm::max(glm::abs(piece.whole.low), glm::abs(piece.whole.high));
    const double largest = std::max({farthest.x, farthest.y, farthest.z});
    std::vector<char> seen(twins.size(), 0);
    std::vector<Loop> loops;
    for (uint32_t first = 0; first < twins.size(); ++first) {
        if (twins[first] != no_neighbour || seen[first]) continue;
        Loop loop;
        loop.along.push_back(0);
        for (uint32_t h = first; !seen[h];) {
            seen[h] = 1;
            const glm::vec3 &a = mesh.positions[corner_vertex[h]], &b = mesh.positions[corner_vertex[next_corner(h)]];
            loop.points.emplace_back(a);
            loop.low = glm::min(loop.low, glm::dvec3(a));
            loop.high = glm::max(loop.high, glm::dvec3(a));
            loop.along.push_back(loop.along.back() + glm::distance(glm::dvec3(a), glm::dvec3(b)));
            loop.cut.push_back(
                std::ranges::any_of(piece.planes, [&](const ClipPlane& p) { return lies_on(p, a, b, largest); }));
            for (h = next_corner(h); twins[h] != no_neighbour;) h = next_corner(twins[h]);
        }
        if (loop.has_cut()) loops.push_back(std::move(loop));
    }
    return loops;
}

// Rims of the atlas: sides (4 chart + side), each behind the one before, as far as they go round.
std::vector<std::vector<uint32_t>> rims_of(const Atlas& atlas) {
    const auto ends = [&](uint32_t side) { return atlas.sides[side].chart == ~0u; };
    const auto next = [](uint32_t side) { return side % 4 == 3 ? side - 3 : side + 1; };
    std::vector<bool> seen(atlas.sides.size());
    std::vector<std::vector<uint32_t>> rims;
    for (uint32_t first = 0; first < seen.size(); ++first) {
        if (!ends(first) || seen[first]) continue;
        rims.emplace_back();
        for (uint32_t side = first; !seen[side];) {
            seen[side] = true;
            rims.back().push_back(side);
            for (side = next(side); !ends(side);) {
                const vgi::GluedSide& across = atlas.sides[side];
                side = next(4 * across.chart + across.side);
            }
        }
    }
    return rims;
}

// One rim of the atlas laid along one loop of the piece.
class LaidRim {
public:
    // far: as loop_under().
    LaidRim(const Atlas& atlas, const std::vector<uint32_t>& sides, const Loop& loop, double far)
        : atlas_(atlas), sides_(sides), loop_(loop), far_(far) {}

    // Where the sides lie along the loop, each from the end of the one before.
    struct Corners {
        size_t first = 0;  // side, into those of the rim
        std::vector<double>
            places;  // of its begin and of the ends of all in turn; rising, the last a whole turn behind
    };
    // Corners are sought near to where they are; which of several places it is, the samples between them tell.
    std::optional<Corners> corners() const {
        std::vector<std::vector<double>> near;
        for (const uint32_t side : sides_) near.push_back(places_near(sample(side, 0)));
        const auto fewest = std::ranges::min_element(near, {}, &std::vector<double>::size);
        std::optional<Corners> best;
        double least = no_end;
        for (const double begin : *fewest)
            lay_from(begin, static_cast<size_t>(fewest - near.begin()), near, best, least);
        return best;
    }

private:
    glm::dvec3 sample(uint32_t side, uint32_t step) const {
        const uint32_t chart = side / 4;
        const auto [x, y] = vgi::on_side(side % 4, step, atlas_.cells_of(chart));
        return atlas_.point(atlas_.texel(chart, x, y));
    }

    std::vector<double> places_near(const glm::dvec3& p) const {
        const size_t n = loop_.size();
        std::vector<std::pair<double, double>> nearest;
        for (size_t edge = 0; edge < n; ++edge) nearest.push_back(loop_.nearest(edge, p));
        const double least = std::ranges::min_element(nearest, {}, &std::pair<double, double>::second)->second;
        const double most = std::max(least, far_);
        std::vector<double> places;
        for (size_t edge = 0; edge < n; ++edge) {
            const double off = nearest[edge].second;
            if (off <= most && off <= nearest[(edge + n - 1) % n].second && off < nearest[(edge + 1) % n].second)
                places.push_back(nearest[edge].first);
        }
        if (places.empty()) places.push_back(nearest.front().first);
        return places;
    }

    double wrapped(double place) const {
        const double turned = std::fmod(place, loop_.length());
        return turned < 0 ? turned + loop_.length() : turned;
    }
    // How far samples of a side are from where they would be, squared.
    double cost(uint32_t side, double begin, double end) const {
        const uint32_t cells = atlas_.cells_of(side / 4), stride = std::max(1u, cells / 8);
        double sum = 0;
        for (uint32_t step = 0; step < cells; step += stride) {
            const glm::dvec3 off =
                sample(side, step) - loop_.at(wrapped(begin + (end - begin) * step / static_cast<double>(cells)));
            sum += glm::dot(off, off);
        }
        return sum;
    }

    // The cheapest way round from a place, the begin of side `first`, and back to it.
    void lay_from(double begin, size_t first, const std::vector<std::vector<double>>& near,
                  std::optional<Corners>& best, double& least) const {
        struct Step {
            double place = 0, cost = no_end;
            size_t before = 0;
        };
        const size_t n = sides_.size();
        std::vector<std::vector<Step>> steps{{{begin, 0, 0}}};
        for (size_t k = 1; k <= n; ++k) {
            std::vector<double> ends;
            for (const double place : near[(first + k) % n]) ends.push_back(begin + wrapped(place - begin));
            if (k == n) ends = {begin + loop_.length()};
            std::vector<Step>& reached = steps.emplace_back();
            for (const double end : ends) {
                Step step{end};
                for (size_t b = 0; b < steps[k - 1].size(); ++b) {
                    const Step& before = steps[k - 1][b];
                    if (before.place > end) continue;
                    const double sum = before.cost + cost(sides_[(first + k - 1) % n], before.place, end);
                    if (sum < step.cost) step = {end, sum, b};
                }
                if (step.cost < no_end) reached.push_back(step);
            }
            if (reached.empty()) return;
        }
        if (steps[n].front().cost >= least) return;
        least = steps[n].front().cost;
        best = Corners{first, std::vector<double>(n + 1)};
        for (size_t k = n, at = 0;; at = steps[k][at].before, --k) {
            best->places[k] = steps[k][at].place;
            if (k == 0) break;
        }
    }

    const Atlas& atlas_;
    const std::vector<uint32_t>& sides_;
    const Loop& loop_;
    const double far_;
};

// Which vertices of a loop stand behind each finest edge of a rim.
class RimEdges {
public:
    // far: as loop_under().
    RimEdges(const Atlas& atlas, const FinestSurface& finest, const std::vector<uint32_t>& sides, const Loop& loop,
             double far)
        : loop_(loop) {
        const auto laid = LaidRim(atlas, sides, loop, far).corners();
        if (!laid) return;
        for (size_t k = 0; k < sides.size(); ++k) {
            sides_.push_back(sides[(laid->first + k) % sides.size()]);
            const uint32_t chart = sides_.back() / 4, cells = atlas.cells_of(chart);
            lines_.push_back(finest.side(atlas, {chart, 0, 0, cells}, sides_.back() % 4));
            const double begin = laid->places[k], end = laid->places[k + 1];
            for (const SideVertex& v : std::span(lines_.back()).first(lines_.back().size() - 1))
                add_mark(begin + (end - begin) * v.along / static_cast<double>(cells));
        }
        if (marks_.empty()) return;
        marks_.push_back({marks_[0].edge + loop_.size(), marks_[0].vertex + loop_.size(), marks_[0].on});
    }
    bool known() const { return !marks_.empty(); }

    // visit(side, line, edge, vertices): for every edge of the line of a side that has any, numbers into the loop's
    // points.
    template <class Visit>
    void for_edges(Visit&& visit) const {
        size_t i = 0;
        for (size_t k = 0; k < sides_.size(); ++k) {
            for (size_t edge = 0; edge + 1 < lines_[k].size(); ++edge, ++i) {
                const std::vector<size_t> vertices = vertices_between(marks_[i], marks_[i + 1]);
                if (!vertices.empty()) visit(sides_[k], lines_[k], edge, vertices);
            }
        }
    }

private:
    // Where a vertex of a line lies. Edges and vertices are counted on beyond a whole turn.
    struct Mark {
        size_t edge = 0, vertex = 0;  // vertex: the nearer end of the edge
        bool on = false;              // the edge is cut
    };
    void add_mark(double place) {
        const double length = loop_.length(), turns = place >= length ? 1 : 0;
        const double at = place - turns * length;
        const size_t edge = loop_.edge_at(at);
        const bool nearer_end = at - loop_.along[edge] > loop_.along[edge + 1] - at;
        Mark mark{edge, edge + (nearer_end ? 1 : 0), loop_.cut[edge]};
        if (turns > 0) mark.edge += loop_.size(), mark.vertex += loop_.size();
        // They rise; where rounding has it otherwise, they stay.
        if (!marks_.empty() && mark.edge < marks_.back().edge) mark = marks_.back();
        if (!marks_.empty() && mark.edge > marks_[0].edge + loop_.size())
            mark = {marks_[0].edge + loop_.size(), marks_[0].vertex + loop_.size(), marks_[0].on};
        if (!marks_.empty() && mark.edge == marks_.back().edge)
            mark.vertex = std::max(mark.vertex, marks_.back().vertex);
        if (!marks_.empty() && mark.edge == marks_[0].edge + loop_.size())
            mark.vertex = std::min(mark.vertex, marks_[0].vertex + loop_.size());
        marks_.push_back(mark);
    }
    // From the first to the last that is at a cut. Between two cuts lies a rim of the source; leaving that out would
    // close from the one to the other.
    std::vector<size_t> vertices_between(const Mark& a, const Mark& b) const {
        const size_t n = loop_.size(), begin = a.on ? a.vertex : a.edge + 1, end = b.on ? b.vertex : b.edge;
        const auto at_cut = [&](size_t v) { return loop_.cut[(v + n - 1) % n] || loop_.cut[v % n]; };
        size_t first = begin, last = end;
        while (first <= end && !at_cut(first)) ++first;
        while (last > first && !at_cut(last)) --last;
        std::vector<size_t> vertices;
        for (size_t v = first; v <= end && v <= last; ++v) vertices.push_back(v % n);
        return vertices;
    }

    const Loop& loop_;
    std::vector<uint32_t> sides_;                 // in turn
    std::vector<std::vector<SideVertex>> lines_;  // of these
    std::vector<Mark> marks_;                     // per edge of lines its begin, and the first again
};

// The loop that the samples of a rim lie on; nothing where that is none of these, or one that is taken. far: how far
// they may be from it.
std::optional<size_t> loop_under(const Atlas& atlas, const std::vector<uint32_t>& sides, const std::vector<Loop>& loops,
                                 const std::vector<char>& taken, double far) {
    std::vector<glm::dvec3> probes;
    const size_t stride = (sides.size() + most_probes - 1) / most_probes;
    for (size_t k = 0; k < sides.size(); k += stride) {
        const uint32_t chart = sides[k] / 4, cells = atlas.cells_of(chart);
        for (const uint32_t step : {0u, cells / 2}) {
            const auto [x, y] = vgi::on_side(sides[k] % 4, step, cells);
            probes.push_back(atlas.point(atlas.texel(chart, x, y)));
        }
    }
    std::optional<size_t> found;
    double least = far * static_cast<double>(probes.size());
    for (size_t i = 0; i < loops.size(); ++i) {
        if (taken[i] != 0) continue;
        double sum = 0;
        for (const glm::dvec3& probe : probes) {
            sum += loops[i].distance(probe, least);
            if (sum >= least) break;
        }
        if (sum < least) {
            least = sum;
            found = i;
        }
    }
    return found;
}

// A lattice whose points those of another are: of a step that is a power of two of them.
struct FittingLattice {
    glm::dvec3 origin{0};
    double step = 1;

    // The nearest point of a lattice with 1 << shift points for one of this.
    LatticePoint at(const glm::dvec3& p, uint32_t shift) const {
        const double fine = 1u << shift, last = 65536 * fine - 1;
        const glm::dvec3 rounded = glm::clamp(glm::round((p - origin) / (step / fine)), 0.0, last);
        return {static_cast<uint32_t>(rounded.x), static_cast<uint32_t>(rounded.y), static_cast<uint32_t>(rounded.z)};
    }
};

// Of the whole source: 16 bits count from one of its ends to the other.
FittingLattice lattice_of(const Box& whole) {
    const glm::dvec3 low(whole.low), extent = glm::dvec3(whole.high) - low;
    const double longest = std::max({extent.x, extent.y, extent.z, 1e-30});
    FittingLattice lattice;
    // Samples may stand out of the box by a few steps of their own lattice, which has 4,095 of them at least.
    constexpr double margin = 64;
    lattice.step = std::exp2(std::ceil(std::log2(longest / (65535 - 2 * margin - 2))));
    lattice.origin = (glm::floor(low / lattice.step) - margin) * lattice.step;
    return lattice;
}

// Finer than that of the whole where the atlas's own is, as far as 16 bits count from one end of the piece to the
// other.
FittingLattice lattice_of(const Atlas& atlas, const FittingLattice& whole, const glm::dvec3& low,
                          const glm::dvec3& high) {
    FittingLattice lattice = whole;
    const glm::dvec3 origin = (glm::floor(low / whole.step) - 1.0) * whole.step;
    const glm::dvec3 extent = high - origin;
    while (lattice.step > atlas.step / 2 && std::max({extent.x, extent.y, extent.z}) < 65534 * lattice.step / 2) {
        lattice.step /= 2;
        lattice.origin = origin;
    }
    return lattice;
}

// Brings samples and leaves to a lattice.
void move_to(const FittingLattice& lattice, Atlas& atlas) {
    constexpr uint32_t leaf_shift = vgi::leaf_bits - 16;
    std::vector<std::vector<std::byte>> moved_parts(atlas.leaf_parts.size());
    parallel_for(moved_parts.size(), 64, [&](size_t begin, size_t end) {
        for (size_t p = begin; p < end; ++p) {
            vgi::LeafPart part = decoded_leaf(atlas, static_cast<uint32_t>(p));
            for (vgi::LeafVertex& v : part.vertices) v.position = lattice.at(atlas.leaf_point(v.position), leaf_shift);
            moved_parts[p] = encode_leaf(part, atlas.attributes);
        }
    });
    atlas.leaf_parts = {};
    for (const auto& part : moved_parts) atlas.leaf_parts.add(part);
    for (auto& p : atlas.positions) {
        const LatticePoint moved = lattice.at(atlas.lattice_point(p), 0);
        for (size_t k = 0; k < 3; ++k) p[k] = static_cast<uint16_t>(moved[k]);
    }
    atlas.leaf_shift = leaf_shift;
    atlas.origin = lattice.origin;
    atlas.step = lattice.step;
}

// The points of loops, rounded to the lattice of the whole, or, with leaves, to that of theirs.
std::vector<std::vector<glm::dvec3>> lines_of(const std::vector<Loop>& loops, double step) {
    std::vector<std::vector<glm::dvec3>> lines;
    for (const Loop& loop : loops) {
        lines.emplace_back();
        for (const glm::dvec3& p : loop.points) lines.back().push_back(glm::round(p / step) * step);
    }
    return lines;
}

}  // namespace

Result<CutRims> CutRims::fit(Atlas& atlas, const PieceOfSource& piece) {
    const auto other = [] {
        return fail(Fault::invariant, "the atlas does not end where --clip cut its mesh; bake it anew");
    };
    const std::vector<Loop> loops = loops_of(piece);
    const FittingLattice whole = lattice_of(piece.whole);
    const uint32_t shift = atlas.leaves.empty() ? 0 : vgi::leaf_bits - 16;
    const auto lines = lines_of(loops, whole.step / (1u << shift));
    glm::dvec3 low(no_end), high(-no_end);
    const auto reach = [&](const glm::dvec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    };
    for (size_t texel = 0; texel < atlas.texels(); ++texel) reach(atlas.point(texel));
    for (const auto& line : lines) std::ranges::for_each(line, reach);
    const FittingLattice lattice = lattice_of(atlas, whole, low, high);
    const double far = most_steps_off * atlas.step;
    CutRims rims;
    rims.coarseness_ = std::max(1.0, atlas.step / lattice.step);
    move_to(lattice, atlas);
    const FinestSurface finest(atlas);
    std::vector<char> taken(loops.size(), 0);
    for (const std::vector<uint32_t>& sides : rims_of(atlas)) {
        const auto under = loop_under(atlas, sides, loops, taken, far);
        if (!under) continue;
        const RimEdges edges(atlas, finest, sides, loops[*under], far);
        if (!edges.known()) return other();
        taken[*under] = 1;
        edges.for_edges(
            [&](uint32_t side, const std::vector<SideVertex>& of, size_t edge, const std::vector<size_t>& vertices) {
                Line& line = rims.sides_[side];
                line.finest = of;
                line.first.resize(of.size(), 0);
                for (const size_t v : vertices) line.vertices.push_back(lattice.at(lines[*under][v], shift));
                std::fill(line.first.begin() + static_cast<ptrdiff_t>(edge) + 1, line.first.end(),
                          static_cast<uint32_t>(line.vertices.size()));
            });
    }
    if (std::ranges::find(taken, 0) != taken.end()) return other();
    return rims;
}

const CutRims::Line* CutRims::line_at(const Atlas& atlas, const ChartSquare& square, uint32_t side) const {
    const auto at = sides_.find(4 * square.chart + side);
    const uint32_t end = atlas.cells_of(square.chart) - square.cells;
    const std::array on_side = {square.y == 0, square.x == end, square.y == end, square.x == 0};
    return at != sides_.end() && on_side[side] ? &at->second : nullptr;
}

std::vector<std::span<const LatticePoint>> CutRims::beyond(const Atlas& atlas, const ChartSquare& square, uint32_t side,
                                                           const std::vector<SideVertex>& line) const {
    const Line* of = line_at(atlas, square, side);
    if (of == nullptr) return {};
    // Of the line of the chart, the square has a part; several of its vertices may be equally far along.
    auto at = std::ranges::lower_bound(of->finest, first_step(atlas, square, side), {}, &SideVertex::along);
    while (at != of->finest.end() && at->vertex.position != line.front().vertex.position) ++at;
    const auto begin = static_cast<size_t>(at - of->finest.begin());
    LODE_CHECK(begin + line.size() <= of->finest.size(), begin, line.size());
    std::vector<std::span<const LatticePoint>> beyond;
    for (size_t edge = begin; edge + 1 < begin + line.size(); ++edge)
        beyond.push_back(std::span(of->vertices).subspan(of->first[edge], of->first[edge + 1] - of->first[edge]));
    return beyond;
}

}  // namespace lodestone::tiles
