#include "vgi/bake/images/corners/collapse_corners.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <queue>
#include <span>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "mesh/distance/closest_point.h"
#include "vgi/asset/corners.h"
#include "vgi/bake/charts/surface.h"
#include "vgi/bake/images/corners/corner_motion.h"
#include "vgi/bake/images/corners/corner_saturation.h"
#include "vgi/bake/images/corners/measured_charts.h"

namespace lodestone::vgi {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
// Collapses that turn a triangle over or pinch the surface come after all others.
constexpr double turned_over = 1;  // extents

// A corner with more faces than this is a hub, as the tip of a fan of needles is. It may move onto its nearest
// neighbours alone, points around it are measured to the face that moves with them, and where something moves onto it
// only faces beside that are looked at: else a hub of n faces took the cube of n steps.
constexpr size_t most_faces = 32, nearest_of_hub = 8;
// Points of a face that what to do next is chosen by.
constexpr size_t most_few = 32;

using Face = std::array<uint32_t, 3>;
struct Points {
    std::vector<glm::dvec3> few, many;  // to choose by, and to measure at
};

// What all components have in common. Each touches its own corners and faces alone.
struct CornerMesh {
    explicit CornerMesh(const Atlas& atlas) : charts(atlas), extent(atlas.extent()) {}

    MeasuredCharts charts;
    std::vector<uint32_t> of;                   // per corner of a chart: the number of the glued one
    std::vector<glm::dvec3> positions;          // per corner
    std::vector<Face> faces;                    // two to a chart; those without area are of equal corners
    std::vector<Points> points;                 // per face
    std::vector<std::vector<uint32_t>> around;  // per corner: faces
    std::vector<double> least_errors;           // per corner: of its charts, object units; it goes by no less
    std::vector<CornerFate> fates;              // per corner
    double extent;
};

bool has(const Face& face, uint32_t corner) { return face[0] == corner || face[1] == corner || face[2] == corner; }
bool is_flat(const Face& face) { return face[0] == face[1] || face[1] == face[2] || face[2] == face[0]; }

// One component made coarser until nothing is left of it.
class Collapse {
public:
    Collapse(CornerMesh& mesh, std::vector<uint32_t> corners, const Progress& progress)
        : mesh_(mesh), corners_(std::move(corners)), progress_(progress), states_(corners_.size()) {}

    // Corners in the order in which they went; not all of them where it is told to stop.
    std::vector<uint32_t> run() {
        for (const uint32_t corner : corners_) {
            if (progress_.stopped()) break;
            consider(corner);
        }
        while (!queue_.empty() && !progress_.stopped()) {
            Candidate next = queue_.top();
            queue_.pop();
            State& state = state_of(next.corner);
            state.waits = false;
            if (std::exchange(state.changed, false)) {
                // What lies around it has changed since it was considered, and it costs more now than it did, mostly.
                consider(next.corner);
            } else if (next.measured || next.cost >= dearest()) {
                take(next.corner, next.onto);
            } else {
                // One that went too early would raise the errors of all that go after it: they only rise.
                const double measured = measured_off(next.corner, next.onto);
                if (measured <= next.cost) {
                    take(next.corner, next.onto);
                } else {
                    put({measured, next.own, next.corner, next.onto, true});
                }
            }
        }
        return std::move(gone_);
    }

private:
    struct Candidate {
        double cost;  // squared error, as far as it is known: at least so much
        double own;   // of that, what few points tell, whatever the charts are off
        uint32_t corner, onto;
        bool measured;                                  // cost is of all points
        bool operator<(const Candidate& other) const {  // the dearest first: a queue's top is the last
            return std::tie(other.cost, other.own, other.corner) < std::tie(cost, own, corner);
        }
    };
    struct State {
        uint32_t height = 0;   // of what moved onto it
        bool waits = false;    // is in the queue, once
        bool changed = false;  // what is around it, since it was put there
    };
    State& state_of(uint32_t corner) {
        return states_[static_cast<size_t>(std::ranges::lower_bound(corners_, corner) - corners_.begin())];
    }
    void put(const Candidate& candidate) {
        queue_.push(candidate);
        state_of(candidate.corner).waits = true;
    }
    double dearest() const { return turned_over * mesh_.extent * mesh_.extent; }
    const glm::dvec3& at(uint32_t corner) const { return mesh_.positions[corner]; }

    std::vector<uint32_t> neighbours(uint32_t corner) const {
        std::vector<uint32_t> all;
        for (const uint32_t f : mesh_.around[corner]) {
            for (const uint32_t other : mesh_.faces[f]) {
                if (other != corner) all.push_back(other);
            }
        }
        std::ranges::sort(all);
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }

    // Faces near a corner once it lies on another: those that moved, in the order of those around it, then those that
    // were around the other; around a hub those alone that a neighbour of the corner has, too.
    void place_faces(uint32_t corner, uint32_t onto) {
        after_.clear();
        for (const uint32_t f : mesh_.around[corner]) {
            Face moved = mesh_.faces[f];
            std::ranges::replace(moved, corner, onto);
            if (!is_flat(moved)) after_.push_back({f, moved});
        }
        std::vector<uint32_t> near;
        if (is_hub(onto)) {
            near = neighbours(corner);
            std::erase(near, onto);
        }
        const auto is_near = [&](uint32_t v) { return std::ranges::binary_search(near, v); };
        const auto add_others = [&](bool all) {
            for (const uint32_t f : mesh_.around[onto]) {
                const Face& face = mesh_.faces[f];
                if (!has(face, corner) && (all || std::ranges::any_of(face, is_near))) after_.push_back({f, face});
            }
        };
        add_others(!is_hub(onto));
        // What hangs on a hub by itself: something has to take its points.
        if (after_.empty()) add_others(true);
    }
    double squared_off(const glm::dvec3& point, const Face& face) const {
        const glm::dvec3 off = closest_on_triangle(point, at(face[0]), at(face[1]), at(face[2])) - point;
        return glm::dot(off, off);
    }
    // The squared distance of a point to these, and the nearest; to the corner where there are none.
    std::pair<double, size_t> nearest(const glm::dvec3& point, uint32_t onto) const {
        std::pair<double, size_t> best{infinite, 0};
        for (size_t i = 0; i < after_.size(); ++i) {
            if (const double squared = squared_off(point, after_[i].second); squared < best.first) best = {squared, i};
        }
        if (after_.empty()) best.first = glm::dot(point - at(onto), point - at(onto));
        return best;
    }
    bool meet(uint32_t a, uint32_t b) const {
        if (mesh_.around[b].size() < mesh_.around[a].size()) std::swap(a, b);
        return a != b && std::ranges::any_of(mesh_.around[a], [&](uint32_t f) { return has(mesh_.faces[f], b); });
    }
    bool spoils(uint32_t corner, uint32_t onto) const {
        for (const uint32_t f : mesh_.around[corner]) {
            Face moved = mesh_.faces[f];
            const glm::dvec3 before = area_vector(at(moved[0]), at(moved[1]), at(moved[2]));
            std::ranges::replace(moved, corner, onto);
            if (!is_flat(moved) && glm::dot(before, area_vector(at(moved[0]), at(moved[1]), at(moved[2]))) <= 0)
                return true;
        }
        const bool less = mesh_.around[corner].size() < mesh_.around[onto].size();
        const uint32_t few = less ? corner : onto, many = less ? onto : corner;
        return std::ranges::count_if(neighbours(few), [&](uint32_t other) { return meet(other, many); }) > 2;
    }

    bool is_hub(uint32_t corner) const { return mesh_.around[corner].size() > most_faces; }

    // Neighbours that a corner may be moved onto, in rising order.
    std::vector<uint32_t> goals(uint32_t corner) {
        std::vector<uint32_t> all = neighbours(corner);
        const uint32_t height = state_of(corner).height + 1;
        std::erase_if(all, [&](uint32_t onto) { return std::max(state_of(onto).height, height) > most_corner_depth; });
        if (!is_hub(corner) || all.size() <= nearest_of_hub) return all;
        const auto off = [&](uint32_t onto) { return std::pair(glm::distance(at(corner), at(onto)), onto); };
        std::ranges::nth_element(all, all.begin() + nearest_of_hub, {}, off);
        all.resize(nearest_of_hub);
        std::ranges::sort(all);
        return all;
    }

    // Calls visit(point, its squared distance to the surface once a corner lies on another, where its face is in
    // after_) for the points around the corner while it returns true. Points around a hub are measured to the face that
    // moves with them alone.
    template <class Visit>
    void for_points(uint32_t corner, uint32_t onto, std::vector<glm::dvec3> Points::*kind, Visit&& visit) {
        const bool alone = is_hub(corner);
        size_t own = 0;
        for (const uint32_t f : mesh_.around[corner]) {
            Face moved = mesh_.faces[f];
            std::ranges::replace(moved, corner, onto);
            const bool flat = is_flat(moved);
            for (const glm::dvec3& point : mesh_.points[f].*kind) {
                const auto [squared, face] =
                    alone && !flat ? std::pair(squared_off(point, moved), own) : nearest(point, onto);
                if (!visit(point, squared, face)) return;
            }
            own += flat ? 0 : 1;
        }
    }

    // The largest squared distance of the few points around a corner to the surface once it lies on another; where that
    // is `enough` or more, at least so much.
    double worst_off(uint32_t corner, uint32_t onto, double enough) {
        double worst = spoils(corner, onto) ? dearest() : 0;
        if (worst >= enough) return worst;
        place_faces(corner, onto);
        for_points(corner, onto, &Points::few, [&](const glm::dvec3&, double squared, size_t) {
            worst = std::max(worst, squared);
            return worst < enough;
        });
        return worst;
    }

    // The same of all points, and of the faces that move.
    double measured_off(uint32_t corner, uint32_t onto) {
        place_faces(corner, onto);
        double worst = 0;
        for_points(corner, onto, &Points::many, [&](const glm::dvec3&, double squared, size_t) {
            worst = std::max(worst, squared);
            return true;
        });
        return faces_off(worst);
    }

    // The largest squared distance of faces that move (place_faces) to the charts, or `worst` where that is more. A
    // face across a hollow is far from everything though all points are near to some face.
    double faces_off(double worst) const {
        uint32_t hint = ClosestSurface::no_hint;
        for (const auto& [f, face] : after_) {
            if (mesh_.faces[f] == face) break;  // those that stay come last
            worst = mesh_.charts.squared_off({at(face[0]), at(face[1]), at(face[2])}, worst, hint);
        }
        return worst;
    }

    // Looks for the neighbour that a corner is best moved onto.
    void consider(uint32_t corner) {
        double least = infinite;
        uint32_t best = corner;
        for (const uint32_t onto : goals(corner)) {
            if (const double worst = worst_off(corner, onto, least); worst < least) {
                least = worst;
                best = onto;
            }
        }
        const double by_charts = mesh_.least_errors[corner];
        if (best != corner) put({std::max(least, by_charts * by_charts), least, corner, best, false});
    }

    void take(uint32_t corner, uint32_t onto) {
        const std::vector<uint32_t> changed = neighbours(corner);
        CornerFate& fate = mesh_.fates[corner];
        fate.parent = onto;
        for (const uint32_t other : changed) fate.radius = std::max(fate.radius, glm::distance(at(corner), at(other)));
        place_faces(corner, onto);
        std::vector<Points> given(after_.size());
        double worst = 0;
        for (const auto kind : {&Points::few, &Points::many}) {
            for_points(corner, onto, kind, [&](const glm::dvec3& point, double squared, size_t face) {
                if (kind == &Points::many) worst = std::max(worst, squared);
                if (!given.empty()) (given[face].*kind).push_back(point);
                return true;
            });
        }
        for (const uint32_t f : mesh_.around[corner]) mesh_.points[f] = {};
        fate.error = std::sqrt(faces_off(worst));
        put_faces(corner, onto, given);
        state_of(onto).height = std::max(state_of(onto).height, state_of(corner).height + 1);
        gone_.push_back(corner);
        for (const uint32_t other : changed) {
            State& state = state_of(other);
            state.changed = state.waits;
            if (!state.waits) consider(other);
        }
    }

    // Every other goes, until there are few.
    static void thin_out(std::vector<glm::dvec3>& points) {
        while (points.size() > most_few) {
            for (size_t i = 0; 2 * i < points.size(); ++i) points[i] = points[2 * i];
            points.resize((points.size() + 1) / 2);
        }
    }

    void put_faces(uint32_t corner, uint32_t onto, std::vector<Points>& given) {
        for (const uint32_t f : mesh_.around[corner]) {
            const Face face = mesh_.faces[f];
            if (!has(face, onto)) continue;
            for (const uint32_t other : face) {
                if (other != corner) std::erase(mesh_.around[other], f);
            }
        }
        for (size_t i = 0; i < after_.size(); ++i) {
            const auto& [f, face] = after_[i];
            if (mesh_.faces[f] != face) mesh_.around[onto].push_back(f);
            mesh_.faces[f] = face;
            Points& points = mesh_.points[f];
            points.few.insert(points.few.end(), given[i].few.begin(), given[i].few.end());
            thin_out(points.few);
            points.many.insert(points.many.end(), given[i].many.begin(), given[i].many.end());
        }
        mesh_.around[corner].clear();
    }

    CornerMesh& mesh_;
    const std::vector<uint32_t> corners_;  // rising
    const Progress& progress_;
    std::vector<State> states_;  // per corner of corners_
    std::priority_queue<Candidate> queue_;
    std::vector<std::pair<uint32_t, Face>> after_;
    std::vector<uint32_t> gone_;
};

void add_points(const Atlas& atlas, uint32_t chart, uint32_t cells, Points& lower, Points& upper, bool few) {
    const uint32_t n = atlas.cells_of(chart), step = n / cells;
    for (uint32_t y = 0; y <= n; y += step) {
        for (uint32_t x = 0; x <= n; x += step) {
            Points& to = x >= y ? lower : upper;
            (few ? to.few : to.many).push_back(atlas.point(atlas.texel(chart, x, y)));
        }
    }
}

CornerMesh corner_mesh(const Atlas& atlas) {
    CornerMesh mesh(atlas);
    mesh.of = glued_corners(atlas.sides);
    const size_t count = mesh.of.empty() ? 0 : *std::ranges::max_element(mesh.of) + size_t{1};
    mesh.positions.resize(count);
    mesh.around.resize(count);
    mesh.points.resize(size_t{2} * atlas.charts());
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const auto corner = [&](uint32_t k) { return mesh.of[4 * c + k]; };
        for (uint32_t k = 0; k < 4; ++k) mesh.positions[corner(k)] = atlas.point(corner_texel(atlas, c, k));
        for (const Face& face : {Face{corner(0), corner(1), corner(2)}, Face{corner(0), corner(2), corner(3)}}) {
            if (!is_flat(face)) {
                for (const uint32_t v : face) mesh.around[v].push_back(static_cast<uint32_t>(mesh.faces.size()));
            }
            mesh.faces.push_back(face);
        }
        add_points(atlas, c, 2, mesh.points[2 * c], mesh.points[2 * c + 1], true);
        add_points(atlas, c, measured_cells(atlas, c), mesh.points[2 * c], mesh.points[2 * c + 1], false);
    }
    for (uint32_t v = 0; v < count; ++v) mesh.fates.push_back({v});
    return mesh;
}

// Corners of each component, rising.
std::vector<std::vector<uint32_t>> components_of(const CornerMesh& mesh) {
    DisjointSets joined(mesh.positions.size());
    for (const Face& face : mesh.faces) {
        joined.join(face[0], face[1]);
        joined.join(face[0], face[2]);
    }
    std::vector<uint32_t> number(mesh.positions.size(), ~0u);
    std::vector<std::vector<uint32_t>> all;
    for (uint32_t v = 0; v < number.size(); ++v) {
        uint32_t& its = number[joined.find(v)];
        if (its == ~0u) {
            its = static_cast<uint32_t>(all.size());
            all.emplace_back();
        }
        all[its].push_back(v);
    }
    return all;
}

}  // namespace

void collapse_corners(Atlas& atlas, const Progress& progress) {
    CornerMesh mesh = corner_mesh(atlas);
    CornerSaturation saturation(atlas, mesh.of, mesh.positions);
    mesh.least_errors = saturation.least_errors();
    const CornerMotion motion(atlas, mesh.charts, mesh.of, mesh.positions);
    const std::vector<std::vector<uint32_t>> components = components_of(mesh);
    std::vector<std::vector<uint32_t>> orders(components.size());
    parallel_for(orders.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) orders[i] = Collapse(mesh, components[i], progress).run();
    });
    if (progress.stopped()) return;
    std::vector<Corner> corners(mesh.positions.size());
    std::vector<uint32_t> order(corners.size()), went(corners.size(), ~0u);  // of roots: last
    for (size_t i = 0; i < components.size(); ++i) {
        std::vector<uint8_t> codes = saturation.codes(orders[i], mesh.fates);
        motion.hold(components[i], orders[i], mesh.fates, codes);
        saturation.run(orders[i], codes, mesh.fates, corners);
        for (uint32_t k = 0; k < orders[i].size(); ++k) went[orders[i][k]] = k;
    }
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, [&](uint32_t a, uint32_t b) {
        return std::tuple(corners[b].error, went[b], a) < std::tuple(corners[a].error, went[a], b);
    });
    std::vector<uint32_t> number(order.size());
    for (uint32_t i = 0; i < order.size(); ++i) number[order[i]] = i;
    atlas.corners.clear();
    for (const uint32_t v : order) {
        corners[v].parent = number[mesh.fates[v].parent];
        atlas.corners.push_back(corners[v]);
    }
    atlas.chart_corners.resize(atlas.charts());
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t own = atlas.chart_corners[c][k] = number[mesh.of[4 * c + k]];
            atlas.corners[own].position = atlas.positions[corner_texel(atlas, c, k)];
        }
    }
}

}  // namespace lodestone::vgi
