// Our own simplifier: quadric error metrics with attributes, half-edge collapses, one queue entry per vertex.
//   Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
//   Hoppe, "New quadric metric for simplifying meshes with appearance attributes", IEEE Visualization 1999 (wedge
//   attributes). Dey, Edelsbrunner, Guha, Nekhayev, "Topology preserving edge contraction", 1999 (link condition).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/none.h"
#include "base/random.h"
#include "base/threads.h"
#include "lod/bake/simplify/quadric.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/distance/closest_point.h"
#include "mesh/topology.h"

namespace lodestone {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr size_t grain = 4096;

// A triangle whose normal turns by more than about 78 degrees in one collapse counts as flipped.
constexpr double least_turn_cosine = 0.2;
// Twice the area over the squared longest side below which a triangle is a sliver: no collapse makes one.
constexpr double sliver = 0.02;
// Where the surface is flat every collapse is free; this share of the squared length, over the area, then decides.
constexpr double length_weight = 1e-7;

// Neighbours that a vertex may be tried on to go to, the cheapest first. A hub of thousands would be judged against all
// of them again whenever one of them goes.
constexpr size_t most_tries = 32;

// Weight of the distance a removed vertex ends up from the surface, against the quadrics'. At 1 the two-sided RMS
// distance of scans is 5 to 10% below that of quadrics alone (bench/simplify_quality); more helps coarse levels and
// harms fine ones.
constexpr double lift_weight = 1;

// A binary heap of vertices by cost, smallest first, equal costs by vertex number; it knows where each vertex is.
class VertexQueue {
public:
    explicit VertexQueue(size_t vertices) : cost_(vertices, infinite), place_(vertices, none) {}
    bool empty() const { return heap_.empty(); }
    uint32_t top() const { return heap_[0]; }
    double cost(uint32_t v) const { return cost_[v]; }
    // Sets the cost of a vertex; infinite takes it out.
    void set(uint32_t v, double cost) {
        if (cost == infinite) {
            remove(v);
            return;
        }
        const double before = cost_[v];
        cost_[v] = cost;
        if (place_[v] == none) {
            place_[v] = static_cast<uint32_t>(heap_.size());
            heap_.push_back(v);
            up(place_[v]);
        } else if (cost < before) {
            up(place_[v]);
        } else {
            down(place_[v]);
        }
    }
    void remove(uint32_t v) {
        cost_[v] = infinite;
        const uint32_t hole = place_[v];
        if (hole == none) return;
        place_[v] = none;
        const uint32_t last = heap_.back();
        heap_.pop_back();
        if (last == v) return;
        heap_[hole] = last;
        place_[last] = hole;
        up(hole);
        down(place_[last]);
    }

private:
    bool before(uint32_t a, uint32_t b) const { return cost_[a] != cost_[b] ? cost_[a] < cost_[b] : a < b; }
    void up(uint32_t i) {
        const uint32_t v = heap_[i];
        while (i > 0 && before(v, heap_[(i - 1) / 2])) {
            heap_[i] = heap_[(i - 1) / 2];
            place_[heap_[i]] = i;
            i = (i - 1) / 2;
        }
        heap_[i] = v;
        place_[v] = i;
    }
    void down(uint32_t i) {
        const uint32_t v = heap_[i];
        const auto size = static_cast<uint32_t>(heap_.size());
        for (uint32_t child = 2 * i + 1; child < size; child = 2 * i + 1) {
            if (child + 1 < size && before(heap_[child + 1], heap_[child])) ++child;
            if (!before(heap_[child], v)) break;
            heap_[i] = heap_[child];
            place_[heap_[i]] = i;
            i = child;
        }
        heap_[i] = v;
        place_[v] = i;
    }

    std::vector<double> cost_;
    std::vector<uint32_t> place_, heap_;
};

// Of a wedge: a normal, two sets of texture coordinates, a colour.
constexpr size_t most_attributes = 3 + 2 + 2 + 3;

enum class Verdict { legal, topology, flip };

// Numbers with their places in a list, found in constant time however long it grows. Open addressing.
class Places {
public:
    void clear() {
        std::fill(slots_.begin(), slots_.end(), Slot{});
        count_ = 0;
    }
    void put(uint32_t number, uint32_t place) {
        if (2 * ++count_ > slots_.size()) {
            const std::vector<Slot> before = std::exchange(slots_, std::vector<Slot>(std::max<size_t>(64, 4 * count_)));
            for (const Slot& s : before) {
                if (s.place != none) slots_[slot_of(s.number)] = s;
            }
        }
        slots_[slot_of(number)] = {number, place};
    }
    uint32_t find(uint32_t number) const { return slots_.empty() ? none : slots_[slot_of(number)].place; }

private:
    struct Slot {
        uint32_t number = none, place = none;
    };
    size_t slot_of(uint32_t number) const {
        size_t slot = static_cast<size_t>(mix64(number) % slots_.size());
        while (slots_[slot].place != none && slots_[slot].number != number) slot = (slot + 1) % slots_.size();
        return slot;
    }
    std::vector<Slot> slots_;
    size_t count_ = 0;
};

// Scratch of one evaluation, one per thread.
struct Ring {
    std::vector<uint32_t> neighbours;             // of the vertex looked at, each once
    Places places;                                // of them, where there are many
    std::vector<uint8_t> faces;                   // shared with it: 1 on the boundary, 2 inside
    std::vector<std::array<WedgePair, 2>> pairs;  // its wedges and theirs in those faces; only where attributes count
    std::vector<double> costs;
    std::vector<WedgePair> resolved;  // of the collapse judged last
    double own_error = 0;             // of the vertex's quadric at its own place
    uint32_t own_wedge = none;        // the last wedge whose attribute error at its own place was asked for,
    double own_attribute_error = 0;   // and that

    static constexpr size_t many = 24;
    void clear() {
        neighbours.clear();
        faces.clear();
        pairs.clear();
    }
    // Where v is among the neighbours, or none.
    uint32_t find(uint32_t v) const {
        if (neighbours.size() > many) return places.find(v);
        const auto at = std::find(neighbours.begin(), neighbours.end(), v);
        return at == neighbours.end() ? none : static_cast<uint32_t>(at - neighbours.begin());
    }
    bool has(uint32_t v) const { return find(v) != none; }
    void add(uint32_t v) {
        neighbours.push_back(v);
        faces.push_back(1);
        if (neighbours.size() == many + 1) {
            places.clear();
            for (uint32_t i = 0; i < many; ++i) places.put(neighbours[i], i);
        }
        if (neighbours.size() > many) places.put(v, static_cast<uint32_t>(neighbours.size() - 1));
    }
};

class QuadricSimplification {
public:
    QuadricSimplification(const TriMesh& mesh, const SimplifyOptions& options)
        : mesh_(mesh),
          options_(options),
          positions_(mesh.vertex_count()),
          wedges_(mesh.triangle_count() * 3),
          vertices_(mesh.triangle_count() * 3),
          count_(mesh.vertex_count(), 0),
          first_(mesh.vertex_count(), 0),
          boundary_(mesh.vertex_count(), 0),
          quadrics_(mesh.vertex_count()),
          seams_(mesh.has_seams()),
          target_(mesh.vertex_count(), none),
          queue_(mesh.vertex_count()) {}

    Result<CollapseList> run(const Progress& progress) {
        using Step = void (QuadricSimplification::*)();
        for (const Step step : {&QuadricSimplification::normalise, &QuadricSimplification::link_corners,
                                &QuadricSimplification::gather_attributes, &QuadricSimplification::group_wedges,
                                &QuadricSimplification::make_quadrics, &QuadricSimplification::merge_quadrics}) {
            if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
            (this->*step)();
        }
        std::vector<double> costs(mesh_.vertex_count(), infinite);
        parallel_for(mesh_.vertex_count(), grain, [&](size_t begin, size_t end) {
            Ring ring;
            for (size_t v = begin; v < end && !progress.stopped(); ++v)
                costs[v] = evaluate(static_cast<uint32_t>(v), ring);
        });
        for (uint32_t v = 0; v < costs.size(); ++v) {
            if (costs[v] != infinite) queue_.set(v, costs[v]);
        }
        const size_t all = alive_;
        for (size_t step = 0; !queue_.empty() && alive_ > options_.target_triangles; ++step) {
            if (step % 16384 == 0) {
                progress.at("simplify", 1 - static_cast<double>(alive_) / static_cast<double>(all));
                if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
            }
            const uint32_t u = queue_.top();
            // What made the collapse legal may have changed two edges away since.
            gather_ring(u, ring_);
            if (judge(u, target_[u], ring_) != Verdict::legal) {
                queue_.set(u, evaluate(u, ring_));
                continue;
            }
            collapse(u, target_[u]);
        }
        list_.stop = StopReason::target_reached;
        if (alive_ > options_.target_triangles) count_refusals();
        return std::move(list_);
    }

private:
    uint32_t vertex(uint32_t corner) const { return vertices_[corner]; }
    std::span<const uint32_t> corners(uint32_t v) const { return {pool_.data() + first_[v], count_[v]}; }

    // Coordinates centred and scaled by a power of two, so that every scale gives the same list.
    void normalise() {
        const Box box = bounding_box(mesh_.positions);
        const glm::dvec3 centre = (glm::dvec3(box.low) + glm::dvec3(box.high)) * 0.5;
        const double diagonal = glm::length(glm::dvec3(box.high) - glm::dvec3(box.low));
        const double scale = diagonal > 0 ? std::exp2(-std::ceil(std::log2(diagonal))) : 1;
        diagonal_ = diagonal * scale;
        for (size_t v = 0; v < positions_.size(); ++v)
            positions_[v] = (glm::dvec3(mesh_.positions[v]) - centre) * scale;
    }

    void link_corners() {
        alive_ = mesh_.triangle_count();
        for (size_t t = 0; t < mesh_.triangle_count(); ++t) {
            for (size_t k = 0; k < 3; ++k) {
                wedges_[t * 3 + k] = mesh_.triangles[t][k];
                vertices_[t * 3 + k] = mesh_.wedge_vertex[mesh_.triangles[t][k]];
            }
        }
        for (uint32_t c = 0; c < wedges_.size(); ++c) ++count_[vertex(c)];
        for (uint32_t v = 1; v < first_.size(); ++v) first_[v] = first_[v - 1] + count_[v - 1];
        pool_.resize(wedges_.size());
        std::vector<uint64_t> fill(first_);
        for (uint32_t c = 0; c < wedges_.size(); ++c) pool_[fill[vertex(c)]++] = c;
        parallel_for(boundary_.size(), grain, [&](size_t begin, size_t end) {
            Ring ring;
            for (size_t v = begin; v < end; ++v) {
                gather_ring(static_cast<uint32_t>(v), ring);
                boundary_[v] = std::find(ring.faces.begin(), ring.faces.end(), 1) != ring.faces.end();
            }
        });
    }

    void gather_attributes() {
        std::vector<std::vector<double>> columns;  // per attribute, per wedge
        const auto add = [&](size_t count, double weight, auto&& value) {
            if (weight <= 0) return;
            const double scale = weight * diagonal_ / 100;
            for (size_t k = 0; k < count; ++k) {
                columns.emplace_back(mesh_.wedge_count());
                for (size_t w = 0; w < mesh_.wedge_count(); ++w)
                    columns.back()[w] = scale * value(w, static_cast<int>(k));
            }
        };
        if (!mesh_.normals.empty())
            add(3, options_.normal_weight, [&](size_t w, int k) { return double{mesh_.normals[w][k]}; });
        for (const auto* uvs : {&mesh_.uvs, &mesh_.second_uvs}) {
            if (!uvs->empty()) add(2, options_.uv_weight, [&](size_t w, int k) { return double{(*uvs)[w][k]}; });
        }
        if (!mesh_.colours.empty())
            add(3, options_.colour_weight, [&](size_t w, int k) { return mesh_.colours[w][k] / 255.0; });
        attribute_count_ = columns.size();
        LODE_CHECK(attribute_count_ <= most_attributes, attribute_count_);
        attributes_.resize(attribute_count_ * mesh_.wedge_count());
        for (size_t j = 0; j < attribute_count_; ++j) {
            for (size_t w = 0; w < mesh_.wedge_count(); ++w) attributes_[w * attribute_count_ + j] = columns[j][w];
        }
        attribute_quadrics_.resize(attributes_.empty() ? 0 : mesh_.wedge_count());
        attribute_areas_.resize(attribute_quadrics_.size(), 0);
        fields_.resize(attributes_.size());
    }

    // Wedges of a vertex that agree in texture coordinates, in whether their tangents' frame is mirrored, and in
    // material form a group, named by its first wedge.
    void group_wedges() {
        if (!seams_) return;
        group_.resize(mesh_.wedge_count());
        std::vector<uint32_t> newest(mesh_.vertex_count(), none), before(mesh_.wedge_count(), none);
        for (uint32_t w = 0; w < group_.size(); ++w) {
            const uint32_t v = mesh_.wedge_vertex[w];
            group_[w] = w;
            for (uint32_t other = newest[v]; other != none; other = before[other]) {
                const bool same = (mesh_.uvs.empty() || mesh_.uvs[other] == mesh_.uvs[w]) &&
                                  (mesh_.second_uvs.empty() || mesh_.second_uvs[other] == mesh_.second_uvs[w]) &&
                                  (mesh_.tangents.empty() || mesh_.tangents[other].w == mesh_.tangents[w].w) &&
                                  (mesh_.materials.empty() || mesh_.materials[other] == mesh_.materials[w]);
                if (same) {
                    group_[w] = group_[other];
                    // Only attribute errors tell the wedges of a group apart.
                    soft_seams_ = attribute_count_ > 0;
                    break;
                }
            }
            before[w] = newest[v];
            newest[v] = w;
        }
    }

    void make_quadrics() {
        for (uint32_t c = 0; c < wedges_.size(); c += 3) {
            const std::array<uint32_t, 3> v = {vertex(c), vertex(c + 1), vertex(c + 2)};
            const glm::dvec3 p0 = positions_[v[0]], p1 = positions_[v[1]], p2 = positions_[v[2]];
            const glm::dvec3 cross = glm::cross(p1 - p0, p2 - p0);
            const double length = glm::length(cross);
            if (length <= 0) continue;
            const glm::dvec3 normal = cross / length;
            const double area = length / 2;
            Quadric plane;
            plane.add_plane(normal, -glm::dot(normal, p0), area);
            for (const uint32_t k : v) quadrics_[k] += plane;
            add_border_planes(c, v, normal);
            if (!attributes_.empty()) add_attributes(c, p0, p1, p2, cross / (length * length), area);
        }
    }

    // Without seams the one wedge of a vertex goes where the vertex goes, and one quadric holds shape and attributes
    // together.
    void merge_quadrics() {
        weights_.resize(quadrics_.size());
        for (size_t v = 0; v < weights_.size(); ++v) weights_[v] = quadrics_[v].weight();
        if (seams_ || attribute_count_ == 0) return;
        wedge_of_.resize(mesh_.vertex_count());
        for (uint32_t w = 0; w < mesh_.wedge_count(); ++w) {
            wedge_of_[mesh_.wedge_vertex[w]] = w;
            quadrics_[mesh_.wedge_vertex[w]] += attribute_quadrics_[w];
        }
        attribute_quadrics_ = {};
    }

    // Planes through boundary and seam edges, upright on the face, hold them where they are.
    void add_border_planes(uint32_t c, const std::array<uint32_t, 3>& v, const glm::dvec3& normal) {
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = v[k], b = v[(k + 1) % 3];
            const bool border = boundary_[a] && boundary_[b] && shared_faces(a, b) == 1;
            if (!border && !is_seam(c + k)) continue;
            const glm::dvec3 edge = positions_[b] - positions_[a];
            const double length = glm::length(edge);
            if (length <= 0) continue;
            const glm::dvec3 upright = glm::cross(edge / length, normal);
            // A seam has two faces, each adding its plane.
            const double weight = length * length * options_.boundary_weight * (border ? 1 : 0.05);
            Quadric plane;
            plane.add_plane(upright, -glm::dot(upright, positions_[a]), weight);
            quadrics_[a] += plane;
            quadrics_[b] += plane;
        }
    }

    uint32_t shared_faces(uint32_t a, uint32_t b) const {
        uint32_t shared = 0;
        for (const uint32_t c : corners(a)) shared += vertex(next_corner(c)) == b || vertex(previous_corner(c)) == b;
        return shared;
    }

    // The edge from this corner to the next has another face, and that uses other wedges.
    bool is_seam(uint32_t corner) const {
        const uint32_t a = wedges_[corner], b = wedges_[next_corner(corner)], va = mesh_.wedge_vertex[a],
                       vb = mesh_.wedge_vertex[b];
        for (const uint32_t c : corners(va)) {
            if (vertex(previous_corner(c)) == vb) return wedges_[c] != a || wedges_[previous_corner(c)] != b;
        }
        return false;
    }

    // dual: cross / |cross|^2, from which the gradients of linear functions on the face follow.
    void add_attributes(uint32_t c, const glm::dvec3& p0, const glm::dvec3& p1, const glm::dvec3& p2,
                        const glm::dvec3& dual, double area) {
        const glm::dvec3 along1 = glm::cross(p2 - p0, dual), along2 = glm::cross(dual, p1 - p0);
        const size_t count = attribute_count_;
        Quadric sum;
        std::array<AttributeField, most_attributes> fields;
        for (size_t j = 0; j < count; ++j) {
            const auto s = [&](uint32_t corner) { return attributes_[wedges_[corner] * count + j]; };
            const double s0 = s(c);
            const glm::dvec3 gradient = along1 * (s(c + 1) - s0) + along2 * (s(c + 2) - s0);
            const double offset = s0 - glm::dot(gradient, p0);
            sum.add_plane(gradient, offset, area);
            fields[j] = {gradient * area, offset * area};
        }
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t w = wedges_[c + k];
            attribute_quadrics_[w] += sum;
            attribute_areas_[w] += area;
            for (size_t j = 0; j < count; ++j) {
                fields_[w * count + j].gradient += fields[j].gradient;
                fields_[w * count + j].offset += fields[j].offset;
            }
        }
    }

    // The attribute error of the faces around wedge `from`, if at p they had the attributes of wedge `to`.
    double attribute_error(uint32_t from, uint32_t to, const glm::dvec3& p) const {
        return std::max(attribute_quadrics_[from].at(p) + attribute_terms(from, to, p), 0.0);
    }
    // The part of it that depends on the attributes of `to`.
    double attribute_terms(uint32_t from, uint32_t to, const glm::dvec3& p) const {
        const size_t count = attribute_count_;
        double error = 0;
        for (size_t j = 0; j < count; ++j) {
            const AttributeField& field = fields_[from * count + j];
            const double s = attributes_[to * count + j];
            error += s * (attribute_areas_[from] * s - 2 * (glm::dot(field.gradient, p) + field.offset));
        }
        return error;
    }
    double own_error(uint32_t u) const {
        const double error = quadrics_[u].at(positions_[u]);
        return wedge_of_.empty() ? error : error + attribute_terms(wedge_of_[u], wedge_of_[u], positions_[u]);
    }

    void gather_ring(uint32_t u, Ring& ring) const {
        ring.clear();
        ring.own_error = own_error(u);
        ring.own_wedge = none;
        const bool pairs = attribute_count_ > 0 && seams_;
        const auto add = [&](uint32_t corner, uint32_t other) {
            const uint32_t v = vertex(other);
            const uint32_t i = ring.find(v);
            if (i != none) {
                if (pairs && ring.faces[i] < 2) ring.pairs[i][ring.faces[i]] = {wedges_[corner], wedges_[other]};
                ++ring.faces[i];
                return;
            }
            ring.add(v);
            if (pairs) ring.pairs.push_back({WedgePair{wedges_[corner], wedges_[other]}, WedgePair{}});
        };
        for (const uint32_t c : corners(u)) {
            add(c, next_corner(c));
            add(c, previous_corner(c));
        }
    }

    // As gather_ring, of the one neighbour v.
    void gather_edge(uint32_t u, uint32_t v, Ring& ring) const {
        ring.neighbours.assign(1, v);
        ring.faces.assign(1, 0);
        ring.pairs.resize(1);
        ring.own_error = own_error(u);
        ring.own_wedge = none;
        for (const uint32_t c : corners(u)) {
            const uint32_t other = vertex(next_corner(c)) == v       ? next_corner(c)
                                   : vertex(previous_corner(c)) == v ? previous_corner(c)
                                                                     : none;
            if (other == none) continue;
            if (ring.faces[0] < 2) ring.pairs[0][ring.faces[0]] = {wedges_[c], wedges_[other]};
            ++ring.faces[0];
        }
    }

    // What the collapse adds to the sum of all errors: those of u's quadrics at v's place instead of its own. What v's
    // quadrics say of v's place was added before. ring: of u, gathered; i: which neighbour.
    double cost(uint32_t u, Ring& ring, size_t i) const {
        const uint32_t v = ring.neighbours[i];
        const glm::dvec3 &from = positions_[u], &to = positions_[v];
        double error = quadrics_[u].at(to) - ring.own_error;
        if (!wedge_of_.empty()) error += attribute_terms(wedge_of_[u], wedge_of_[v], to);
        error = std::max(error, 0.0);
        if (soft_seams_) {
            if (!pair_wedges(u, v, ring.resolved)) return infinite;
            for (const WedgePair& pair : ring.resolved) error += attribute_cost(ring, pair, from, to);
        } else if (attribute_count_ > 0 && seams_) {
            const auto& pairs = ring.pairs[i];
            error += attribute_cost(ring, pairs[0], from, to);
            if (ring.faces[i] > 1 && pairs[1].removed != pairs[0].removed)
                error += attribute_cost(ring, pairs[1], from, to);
        }
        const glm::dvec3 edge = to - from;
        const double length2 = glm::dot(edge, edge);
        return error + length_weight * length2 * length2;
    }

    double attribute_cost(Ring& ring, const WedgePair& pair, const glm::dvec3& from, const glm::dvec3& to) const {
        if (ring.own_wedge != pair.removed) {
            ring.own_wedge = pair.removed;
            ring.own_attribute_error = attribute_error(pair.removed, pair.removed, from);
        }
        return std::max(attribute_error(pair.removed, pair.kept, to) - ring.own_attribute_error, 0.0);
    }

    // The cheapest legal collapse of u goes to target_[u]; returns its cost, infinite where there is none.
    double evaluate(uint32_t u, Ring& ring) {
        target_[u] = none;
        if (count_[u] == 0) return infinite;
        gather_ring(u, ring);
        ring.costs.clear();
        for (size_t i = 0; i < ring.neighbours.size(); ++i) {
            // A boundary vertex leaves along the boundary only.
            ring.costs.push_back(boundary_[u] && ring.faces[i] != 1 ? infinite : cost(u, ring, i));
        }
        for (size_t tries = 0; tries < std::min(ring.costs.size(), most_tries); ++tries) {
            size_t best = 0;
            for (size_t i = 1; i < ring.costs.size(); ++i) {
                if (ring.costs[i] < ring.costs[best] ||
                    (ring.costs[i] == ring.costs[best] && ring.neighbours[i] < ring.neighbours[best]))
                    best = i;
            }
            if (ring.costs[best] == infinite) break;
            if (judge(u, ring.neighbours[best], ring) == Verdict::legal) {
                target_[u] = ring.neighbours[best];
                return ring.costs[best] + lift(u, target_[u]);
            }
            ring.costs[best] = infinite;
        }
        return infinite;
    }

    // The squared distance from u's place to the surface that u's collapse to v leaves, over u's area. Planes alone do
    // not see how far a surface retreats along itself: at tips, at rims, where a sheet is thin.
    double lift(uint32_t u, uint32_t v) const {
        const glm::dvec3 &from = positions_[u], &to = positions_[v];
        double nearest = infinite;
        for (const uint32_t c : corners(u)) {
            const uint32_t a = vertex(next_corner(c)), b = vertex(previous_corner(c));
            if (a == v || b == v) continue;
            const glm::dvec3 away = closest_on_triangle(from, positions_[a], positions_[b], to) - from;
            nearest = std::min(nearest, glm::dot(away, away));
        }
        return nearest == infinite ? 0 : lift_weight * weights_[u] * nearest;
    }

    // ring: of u, gathered.
    Verdict judge(uint32_t u, uint32_t v, Ring& ring) const {
        const uint32_t at = ring.find(v);
        if (at == none) return Verdict::topology;
        const uint32_t shared = ring.faces[at];
        if (shared != (boundary_[u] ? 1u : 2u)) return Verdict::topology;
        if (count_[u] + count_[v] <= 2 * shared) return Verdict::topology;  // nothing would be left
        if (!link_condition(u, v, shared, ring)) return Verdict::topology;
        if (seams_ && !pair_wedges(u, v, ring.resolved)) return Verdict::topology;
        return turns_a_face(u, v) ? Verdict::flip : Verdict::legal;
    }

    // u and v have no common neighbours but the apexes of the faces between them, and no apex is left with too few
    // faces.
    bool link_condition(uint32_t u, uint32_t v, uint32_t shared, const Ring& ring) const {
        uint32_t common = 0;
        for (const uint32_t c : corners(v)) {
            // Each neighbour once: the next vertex of every face, and the previous one where the boundary ends the fan.
            const uint32_t n = vertex(next_corner(c));
            common += n != u && ring.has(n);
        }
        if (boundary_[v]) {
            for (const uint32_t c : corners(v)) {
                const uint32_t n = vertex(previous_corner(c));
                if (n == u || !boundary_[n] || !ring.has(n)) continue;
                common += shared_faces(v, n) == 1;
            }
        }
        if (common != shared) return false;
        for (const uint32_t c : corners(u)) {
            const uint32_t a = vertex(next_corner(c)), b = vertex(previous_corner(c));
            if (a != v && b != v) continue;
            const uint32_t apex = a == v ? b : a;
            if (count_[apex] < (boundary_[apex] ? 2u : 4u)) return false;
        }
        return true;
    }

    // Pairs every wedge of u in use with one of v; false where that would tear. Across the faces of the edge the pairs
    // are given. A wedge elsewhere follows a pair of its own group (same texture coordinate and material, so the seam
    // between is one of normals or colours) to the wedge of v it differs least from: such seams may close, at the price
    // of their error.
    bool pair_wedges(uint32_t u, uint32_t v, std::vector<WedgePair>& pairs) const {
        pairs.clear();
        const auto known = [&](uint32_t wedge) {
            return std::find_if(pairs.begin(), pairs.end(), [&](const WedgePair& p) { return p.removed == wedge; });
        };
        for (const uint32_t c : corners(u)) {
            const uint32_t to = vertex(next_corner(c)) == v       ? wedges_[next_corner(c)]
                                : vertex(previous_corner(c)) == v ? wedges_[previous_corner(c)]
                                                                  : none;
            if (to == none) continue;
            const auto pair = known(wedges_[c]);
            if (pair == pairs.end()) {
                pairs.push_back({wedges_[c], to});
            } else if (pair->kept != to) {
                return false;  // one of the dying faces would keep three distinct wedges
            }
        }
        for (const uint32_t c : corners(u)) {
            const uint32_t w = wedges_[c];
            if (known(w) != pairs.end()) continue;
            const auto like = std::find_if(pairs.begin(), pairs.end(),
                                           [&](const WedgePair& p) { return group_[p.removed] == group_[w]; });
            if (like == pairs.end()) return false;
            uint32_t best = none;
            double least = infinite;
            for (const uint32_t d : corners(v)) {
                const uint32_t to = wedges_[d];
                if (group_[to] != group_[like->kept]) continue;
                const double difference = attribute_difference(w, to);
                if (difference < least || (difference == least && to < best)) {
                    least = difference;
                    best = to;
                }
            }
            pairs.push_back({w, best});
        }
        return true;
    }

    double attribute_difference(uint32_t a, uint32_t b) const {
        double sum = 0;
        for (size_t j = 0; j < attribute_count_; ++j) {
            const double d = attributes_[a * attribute_count_ + j] - attributes_[b * attribute_count_ + j];
            sum += d * d;
        }
        return sum;
    }

    bool turns_a_face(uint32_t u, uint32_t v) const {
        const glm::dvec3 &from = positions_[u], &to = positions_[v];
        for (const uint32_t c : corners(u)) {
            const uint32_t a = vertex(next_corner(c)), b = vertex(previous_corner(c));
            if (a == v || b == v) continue;
            const glm::dvec3 &pa = positions_[a], &pb = positions_[b];
            const glm::dvec3 before = glm::cross(pa - from, pb - from), after = glm::cross(pa - to, pb - to);
            const double before2 = glm::dot(before, before), after2 = glm::dot(after, after);
            const double turn = glm::dot(before, after);
            if (before2 > 0 && (turn <= 0 || turn * turn < least_turn_cosine * least_turn_cosine * before2 * after2))
                return true;
            const glm::dvec3 ab = pb - pa, ta = pa - to, tb = pb - to;
            const double longest = std::max({glm::dot(ab, ab), glm::dot(ta, ta), glm::dot(tb, tb)});
            if (after2 > sliver * sliver * longest * longest) continue;
            // A sliver may stay one, or get better, but none is made.
            const glm::dvec3 fa = pa - from, fb = pb - from;
            const double longest_before = std::max({glm::dot(ab, ab), glm::dot(fa, fa), glm::dot(fb, fb)});
            if (after2 * longest_before * longest_before <= before2 * longest * longest * 0.999 ||
                (after2 <= 0 && before2 <= 0 && longest > longest_before)) {
                return true;
            }
        }
        return false;
    }

    void collapse(uint32_t u, uint32_t v) {
        const std::span<const WedgePair> pairs = record_collapse(u, v);
        quadrics_[v] += quadrics_[u];
        weights_[v] += weights_[u];
        add_attributes(pairs);
        join_fans(u, v, pairs);
        queue_.remove(u);
        if (pool_.size() > wedges_.size() + 6 * alive_ + 65536) compact_pool();
        gather_ring(v, around_);
        for (const uint32_t w : around_.neighbours) update(w, u, v);
        queue_.set(v, evaluate(v, ring_));
    }

    // Returns its pairs of wedges, valid until the next collapse.
    std::span<const WedgePair> record_collapse(uint32_t u, uint32_t v) {
        Collapse record{u, v, static_cast<uint32_t>(list_.wedge_pairs.size()), 0};
        if (seams_) {
            LODE_CHECK(pair_wedges(u, v, ring_.resolved), u, v);
            list_.wedge_pairs.insert(list_.wedge_pairs.end(), ring_.resolved.begin(), ring_.resolved.end());
        } else {
            list_.wedge_pairs.push_back({wedges_[corners(u)[0]], wedges_[corners(v)[0]]});
        }
        record.wedge_count = static_cast<uint32_t>(list_.wedge_pairs.size()) - record.first_wedge;
        list_.collapses.push_back(record);
        return {list_.wedge_pairs.data() + record.first_wedge, record.wedge_count};
    }

    // Kept wedges take the attribute quadrics of the removed ones.
    void add_attributes(std::span<const WedgePair> pairs) {
        if (attributes_.empty()) return;
        const size_t count = attribute_count_;
        for (const WedgePair& pair : pairs) {
            if (seams_) attribute_quadrics_[pair.kept] += attribute_quadrics_[pair.removed];
            attribute_areas_[pair.kept] += attribute_areas_[pair.removed];
            for (size_t j = 0; j < count; ++j) {
                fields_[pair.kept * count + j].gradient += fields_[pair.removed * count + j].gradient;
                fields_[pair.kept * count + j].offset += fields_[pair.removed * count + j].offset;
            }
        }
    }

    // The joined fan goes to the end of the pool; the dead faces leave the lists of their apexes.
    void join_fans(uint32_t u, uint32_t v, std::span<const WedgePair> pairs) {
        const uint64_t joined = pool_.size();
        for (uint32_t i = 0; i < count_[v]; ++i) {
            const uint32_t c = pool_[first_[v] + i];
            const uint32_t a = vertex(next_corner(c)), b = vertex(previous_corner(c));
            if (a == u || b == u) {
                drop_corner(a == u ? b : a, c / 3);
                --alive_;
            } else {
                pool_.push_back(c);
            }
        }
        for (uint32_t i = 0; i < count_[u]; ++i) {
            const uint32_t c = pool_[first_[u] + i];
            if (vertex(next_corner(c)) == v || vertex(previous_corner(c)) == v) continue;
            for (const WedgePair& pair : pairs) {
                if (pair.removed == wedges_[c]) {
                    wedges_[c] = pair.kept;
                    break;
                }
            }
            vertices_[c] = v;
            pool_.push_back(c);
        }
        count_[u] = 0;
        first_[v] = joined;
        count_[v] = static_cast<uint32_t>(pool_.size() - joined);
    }

    // After u went to v: what w would add elsewhere is as it was, for only w's own quadric counts; v may be a new
    // neighbour. On seams the wedges that meet across an edge may have changed, and with them the attribute errors.
    void update(uint32_t w, uint32_t u, uint32_t v) {
        const uint32_t target = target_[w];
        if (target == none || target == u || (target == v && seams_)) {
            queue_.set(w, evaluate(w, ring_));
            return;
        }
        if (target == v) return;
        gather_edge(w, v, ring_);
        if (boundary_[w] && ring_.faces[0] != 1) return;
        const double to_v = cost(w, ring_, 0);
        if (to_v >= queue_.cost(w)) return;
        gather_ring(w, ring_);
        if (judge(w, v, ring_) != Verdict::legal) return;
        const double lifted = to_v + lift(w, v);
        if (lifted < queue_.cost(w)) {
            target_[w] = v;
            queue_.set(w, lifted);
        }
    }

    void drop_corner(uint32_t v, uint32_t face) {
        const uint64_t end = first_[v] + count_[v];
        for (uint64_t i = first_[v]; i < end; ++i) {
            if (pool_[i] / 3 != face) continue;
            // The order of the rest is kept, so that lists do not depend on how faces died.
            std::copy(pool_.data() + i + 1, pool_.data() + end, pool_.data() + i);
            --count_[v];
            return;
        }
        LODE_CHECK(false, v, face);
    }

    void compact_pool() {
        std::vector<uint32_t> fresh;
        fresh.reserve(alive_ * 9);
        for (uint32_t v = 0; v < first_.size(); ++v) {
            const uint32_t* begin = pool_.data() + first_[v];
            first_[v] = fresh.size();
            fresh.insert(fresh.end(), begin, begin + count_[v]);
        }
        pool_ = std::move(fresh);
    }

    // Why no vertex that is left can go.
    void count_refusals() {
        for (uint32_t u = 0; u < count_.size(); ++u) {
            if (count_[u] == 0) continue;
            gather_ring(u, ring_);
            bool flips = false;
            for (size_t i = 0; i < ring_.neighbours.size(); ++i) {
                if (!boundary_[u] || ring_.faces[i] == 1)
                    flips |= judge(u, ring_.neighbours[i], ring_) == Verdict::flip;
            }
            ++(flips ? list_.blocked_by_flips : list_.blocked_by_topology);
        }
        list_.stop = list_.blocked_by_flips > list_.blocked_by_topology ? StopReason::flips : StopReason::topology;
    }

    const TriMesh& mesh_;
    const SimplifyOptions& options_;
    std::vector<glm::dvec3> positions_;        // normalised
    double diagonal_ = 0;                      // of the box, normalised
    std::vector<uint32_t> wedges_, vertices_;  // per corner 3 * face + k
    // Per vertex: its corners, pool_[first_ .. first_ + count_). The pool grows to three times the corners, so places
    // in it may need more than 32 bits where corners do not.
    std::vector<uint32_t> pool_, count_;
    std::vector<uint64_t> first_;
    std::vector<uint8_t> boundary_;
    std::vector<Quadric> quadrics_;   // per vertex
    std::vector<double> weights_;     // per vertex: of its planes
    std::vector<uint32_t> wedge_of_;  // per vertex, where attributes count and there are no seams
    const bool seams_;
    bool soft_seams_ = false;      // some vertex has several wedges of one group
    std::vector<uint32_t> group_;  // per wedge, where there are seams
    size_t attribute_count_ = 0;
    std::vector<double> attributes_;           // per wedge and attribute, weighted
    std::vector<Quadric> attribute_quadrics_;  // per wedge
    std::vector<double> attribute_areas_;
    std::vector<AttributeField> fields_;  // per wedge and attribute
    std::vector<uint32_t> target_;
    VertexQueue queue_;
    Ring ring_, around_;
    size_t alive_ = 0;
    CollapseList list_;
};

class QuadricSimplifier final : public Simplifier {
public:
    std::string name() const override { return "quadric"; }
    Result<CollapseList> simplify(const TriMesh& mesh, const SimplifyOptions& options,
                                  const Progress& progress) const override {
        return QuadricSimplification(mesh, options).run(progress);
    }
};

}  // namespace

std::unique_ptr<Simplifier> make_quadric_simplifier() { return std::make_unique<QuadricSimplifier>(); }

}  // namespace lodestone
