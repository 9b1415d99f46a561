// Gueziec, Taubin, Lazarus, Horn, "Cutting and stitching: converting sets of polygons to manifold surfaces", IEEE TVCG
// 2001.
#include "mesh/repair.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <span>
#include <unordered_map>

#include "base/random.h"
#include "base/structures/disjoint_sets.h"
#include "mesh/position_index.h"
#include "mesh/topology.h"

namespace lodestone {

namespace {

// Joins vertices closer than `distance`, through chains too, on a grid of cells of that size.
void weld_near(const std::vector<glm::vec3>& positions, float distance, std::vector<uint32_t>& to) {
    struct Cell {
        int64_t x, y, z;
        bool operator==(const Cell&) const = default;
    };
    struct CellHash {
        size_t operator()(const Cell& c) const {
            return static_cast<size_t>(static_cast<uint64_t>(c.x) * 0x9e3779b97f4a7c15ull ^
                                       static_cast<uint64_t>(c.y) * 0xbf58476d1ce4e5b9ull ^
                                       static_cast<uint64_t>(c.z) * 0x94d049bb133111ebull);
        }
    };
    const auto cell_of = [&](const glm::vec3& p) {
        const auto i = [&](float x) {
            return static_cast<int64_t>(std::floor(static_cast<double>(x) / static_cast<double>(distance)));
        };
        return Cell{i(p.x), i(p.y), i(p.z)};
    };
    std::unordered_map<Cell, std::vector<uint32_t>, CellHash> cells;
    DisjointSets sets(positions.size());
    for (uint32_t v = 0; v < positions.size(); ++v) {
        if (to[v] != v) {
            sets.join(v, to[v]);
            continue;
        }
        const Cell home = cell_of(positions[v]);
        for (int n = 0; n < 27; ++n) {
            const auto found = cells.find({home.x + n % 3 - 1, home.y + n / 3 % 3 - 1, home.z + n / 9 - 1});
            if (found == cells.end()) continue;
            for (const uint32_t other : found->second) {
                if (glm::distance(positions[v], positions[other]) < distance) sets.join(v, other);
            }
        }
        cells[home].push_back(v);
    }
    for (uint32_t v = 0; v < positions.size(); ++v) to[v] = sets.find(v);
}

bool same_attributes(const TriMesh& mesh, uint32_t a, uint32_t b) {
    bool same = true;
    for_attributes([&](const auto& values) { same = same && (values.empty() || values[a] == values[b]); }, mesh);
    return same;
}

// Equal where same_attributes holds.
uint64_t attribute_hash(const TriMesh& mesh, uint32_t w) {
    uint64_t hash = 0;
    const auto add = [&](float x) { hash = mix64(hash ^ std::bit_cast<uint32_t>(x + 0.0f)); };
    for (int k = 0; k < 3 && !mesh.normals.empty(); ++k) add(mesh.normals[w][k]);
    for (int k = 0; k < 2 && !mesh.uvs.empty(); ++k) add(mesh.uvs[w][k]);
    for (int k = 0; k < 2 && !mesh.second_uvs.empty(); ++k) add(mesh.second_uvs[w][k]);
    for (int k = 0; k < 4 && !mesh.tangents.empty(); ++k) add(mesh.tangents[w][k]);
    if (!mesh.colours.empty()) hash = mix64(hash ^ std::bit_cast<uint32_t>(mesh.colours[w]));
    if (!mesh.materials.empty()) hash = mix64(hash ^ mesh.materials[w]);
    return hash;
}

// Items 0 .. keys.size()-1 grouped by key: items of key k are item[first[k]] .. item[first[k + 1] - 1], in rising
// order.
struct Grouped {
    std::vector<uint32_t> first, item;
};
Grouped group(const std::vector<uint32_t>& keys, size_t key_count) {
    Grouped g;
    g.first.assign(key_count + 1, 0);
    for (const uint32_t k : keys) ++g.first[k + 1];
    std::partial_sum(g.first.begin(), g.first.end(), g.first.begin());
    g.item.resize(keys.size());
    std::vector<uint32_t> next(g.first.begin(), g.first.end() - 1);
    for (uint32_t i = 0; i < keys.size(); ++i) g.item[next[keys[i]]++] = i;
    return g;
}

// wedges: all of one vertex, rising. Per wedge: the wedge it becomes, the first that says the same.
void join_equal_wedges(const TriMesh& mesh, std::span<const uint32_t> wedges, std::vector<uint32_t>& wedge_to) {
    constexpr size_t few = 16;
    // A fan may have thousands of wedges, and nearly all distinct: those of one hash are compared.
    std::unordered_multimap<uint64_t, uint32_t> kinds;
    for (size_t i = 0; i < wedges.size(); ++i) {
        const uint32_t w = wedges[i];
        wedge_to[w] = w;
        if (wedges.size() <= few) {
            for (size_t k = 0; k < i && wedge_to[w] == w; ++k) {
                if (wedge_to[wedges[k]] == wedges[k] && same_attributes(mesh, wedges[k], w)) wedge_to[w] = wedges[k];
            }
            continue;
        }
        const uint64_t hash = attribute_hash(mesh, w);
        const auto [begin, end] = kinds.equal_range(hash);
        const auto same = std::find_if(begin, end, [&](const auto& k) { return same_attributes(mesh, k.second, w); });
        if (same != end) {
            wedge_to[w] = same->second;
        } else {
            kinds.emplace(hash, w);
        }
    }
}

void weld(TriMesh& mesh, const RepairOptions& options, RepairReport& report) {
    std::vector<uint32_t> to = PositionIndex(mesh.positions).first_at();
    if (options.weld_distance > 0) weld_near(mesh.positions, options.weld_distance, to);
    for (uint32_t v = 0; v < to.size(); ++v) report.welded_vertices += to[v] != v ? 1 : 0;
    if (report.welded_vertices == 0 && !mesh.has_seams()) return;
    for (uint32_t& v : mesh.wedge_vertex) v = to[v];
    // Wedges of one vertex that say the same are one wedge.
    const Grouped wedges = group(mesh.wedge_vertex, mesh.positions.size());
    std::vector<uint32_t> wedge_to(mesh.wedge_count());
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const auto own = std::span(wedges.item).subspan(wedges.first[v], wedges.first[v + 1] - wedges.first[v]);
        join_equal_wedges(mesh, own, wedge_to);
    }
    for (Triangle& t : mesh.triangles) {
        for (uint32_t& w : t) w = wedge_to[w];
    }
}

void drop_degenerate(TriMesh& mesh, RepairReport& report) {
    const auto degenerate = [&](const Triangle& t) {
        const uint32_t a = mesh.wedge_vertex[t[0]], b = mesh.wedge_vertex[t[1]], c = mesh.wedge_vertex[t[2]];
        return a == b || b == c || c == a;
    };
    const size_t before = mesh.triangles.size();
    std::erase_if(mesh.triangles, degenerate);
    report.degenerate_triangles = before - mesh.triangles.size();
}

void drop_duplicates(TriMesh& mesh, RepairReport& report) {
    // Triangles grouped by their lowest vertex; those of one group are compared.
    std::vector<Triangle> sorted(mesh.triangles.size());
    std::vector<uint32_t> lowest(mesh.triangles.size());
    for (size_t t = 0; t < sorted.size(); ++t) {
        sorted[t] = {mesh.vertex_of(t, 0), mesh.vertex_of(t, 1), mesh.vertex_of(t, 2)};
        std::sort(sorted[t].begin(), sorted[t].end());
        lowest[t] = sorted[t][0];
    }
    Grouped groups = group(lowest, mesh.positions.size());
    std::vector<bool> drop(sorted.size(), false);
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const auto begin = groups.item.begin() + groups.first[v], end = groups.item.begin() + groups.first[v + 1];
        std::sort(begin, end,
                  [&](uint32_t a, uint32_t b) { return sorted[a] != sorted[b] ? sorted[a] < sorted[b] : a < b; });
        for (auto i = begin; i != end; ++i) {
            if (i != begin && sorted[*i] == sorted[*std::prev(i)]) drop[*i] = true;
        }
    }
    size_t kept = 0;
    for (size_t t = 0; t < drop.size(); ++t) {
        if (!drop[t]) mesh.triangles[kept++] = mesh.triangles[t];
    }
    report.duplicate_triangles = drop.size() - kept;
    mesh.triangles.resize(kept);
}

// Half-edge 3 * t + k runs from corner k to corner k + 1 of triangle t.
class Surface {
public:
    explicit Surface(const TriMesh& mesh)
        : mesh_(mesh), twin_(3 * mesh.triangle_count(), no_neighbour), flipped_(mesh.triangle_count(), false) {}

    // Pairs half-edges across each edge; more than two are paired where they enclose a piece of the inside, or not at
    // all. Returns how many edges had more than two.
    uint64_t pair(bool pair_crowded) {
        uint64_t crowded = 0;
        std::vector<uint32_t> low(twin_.size());
        for (uint32_t h = 0; h < low.size(); ++h) low[h] = std::min(from(h), to(h));
        Grouped edges = group(low, mesh_.positions.size());
        const auto high = [&](uint32_t h) { return std::max(from(h), to(h)); };
        for (size_t v = 0; v < mesh_.positions.size(); ++v) {
            const auto begin = edges.item.begin() + edges.first[v], end = edges.item.begin() + edges.first[v + 1];
            std::sort(begin, end,
                      [&](uint32_t a, uint32_t b) { return high(a) != high(b) ? high(a) < high(b) : a < b; });
            for (auto i = begin; i != end;) {
                auto j = i;
                while (j != end && high(*j) == high(*i)) ++j;
                if (j - i == 2) {
                    twin_[*i] = *std::next(i);
                    twin_[*std::next(i)] = *i;
                } else if (j - i > 2) {
                    ++crowded;
                    if (pair_crowded) pair_around(std::span<const uint32_t>(&*i, static_cast<size_t>(j - i)));
                }
                i = j;
            }
        }
        return crowded;
    }

    // Chooses which triangles to turn round. Without `may_flip`, cuts every edge whose triangles disagree.
    void orient(bool may_flip, RepairReport& report) {
        std::vector<bool> seen(flipped_.size(), false);
        std::vector<uint32_t> piece;
        for (uint32_t seed = 0; seed < flipped_.size(); ++seed) {
            if (seen[seed]) continue;
            piece.assign(1, seed);
            seen[seed] = true;
            bool closed = true;
            for (size_t i = 0; i < piece.size(); ++i) {
                for (uint32_t k = 0; k < 3; ++k) {
                    const uint32_t h = 3 * piece[i] + k;
                    if (twin_[h] == no_neighbour) {
                        closed = false;
                        continue;
                    }
                    const uint32_t other = twin_[h] / 3;
                    const bool same_way = from(h) == from(twin_[h]);  // as the triangles are stored
                    const bool wanted = flipped_[piece[i]] != same_way;
                    if (!seen[other] && (may_flip || !same_way)) {
                        seen[other] = true;
                        flipped_[other] = wanted;
                        piece.push_back(other);
                    } else if ((!seen[other] && same_way) || flipped_[other] != wanted) {
                        twin_[twin_[h]] = no_neighbour;
                        twin_[h] = no_neighbour;
                        ++report.non_orientable_edges;
                        closed = false;
                    }
                }
            }
            if (may_flip) choose_side(piece, closed, report);
        }
    }

    // Gives every fan of triangles around a vertex a vertex of its own, and turns triangles round.
    void split_fans(TriMesh& mesh, RepairReport& report) const {
        DisjointSets fans(twin_.size());  // corners
        for (uint32_t h = 0; h < twin_.size(); ++h) {
            const uint32_t t = twin_[h];
            if (t == no_neighbour || t < h) continue;
            const bool same_way = from(h) == from(t);
            fans.join(h, same_way ? t : next_corner(t));
            fans.join(next_corner(h), same_way ? next_corner(t) : t);
        }
        std::vector<uint32_t> vertex(twin_.size());
        for (uint32_t c = 0; c < vertex.size(); ++c) vertex[c] = from(c);
        const Grouped corners = group(vertex, mesh.positions.size());
        const size_t vertices = mesh.positions.size();
        std::vector<std::pair<uint32_t, uint32_t>> fan_vertex;  // of this vertex: fan to its vertex
        std::vector<std::array<uint32_t, 3>> copies;            // of this vertex: wedge, new vertex, new wedge
        for (size_t v = 0; v < vertices; ++v) {
            fan_vertex.clear();
            copies.clear();
            for (uint32_t i = corners.first[v]; i < corners.first[v + 1]; ++i) {
                const uint32_t corner = corners.item[i], fan = fans.find(corner);
                auto found =
                    std::find_if(fan_vertex.begin(), fan_vertex.end(), [&](const auto& f) { return f.first == fan; });
                if (found == fan_vertex.end()) {
                    uint32_t own = static_cast<uint32_t>(v);
                    if (!fan_vertex.empty()) {
                        own = static_cast<uint32_t>(mesh.positions.size());
                        const glm::vec3 position = mesh.positions[v];
                        mesh.positions.push_back(position);
                        if (fan_vertex.size() == 1) ++report.non_manifold_vertices;
                    }
                    fan_vertex.emplace_back(fan, own);
                    found = std::prev(fan_vertex.end());
                }
                if (found->second == v) continue;
                uint32_t& wedge = mesh.triangles[corner / 3][corner % 3];
                auto copy = std::find_if(copies.begin(), copies.end(),
                                         [&](const auto& c) { return c[0] == wedge && c[1] == found->second; });
                if (copy == copies.end()) {
                    copies.push_back({wedge, found->second, copy_wedge(mesh, wedge, found->second)});
                    copy = std::prev(copies.end());
                }
                wedge = (*copy)[2];
            }
        }
        for (size_t t = 0; t < flipped_.size(); ++t) {
            if (flipped_[t]) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
        }
    }

private:
    uint32_t from(uint32_t h) const { return mesh_.vertex_of(h / 3, static_cast<int>(h % 3)); }
    uint32_t to(uint32_t h) const { return from(next_corner(h)); }

    static uint32_t copy_wedge(TriMesh& mesh, uint32_t wedge, uint32_t vertex) {
        mesh.wedge_vertex.push_back(vertex);
        for_attributes(
            [&](auto& values) {
                if (values.empty()) return;
                const auto value = values[wedge];
                values.push_back(value);
            },
            mesh);
        return static_cast<uint32_t>(mesh.wedge_vertex.size() - 1);
    }

    // Around the edge from its lower to its higher vertex, by angle: a triangle that runs downwards has the inside
    // ahead of it, one that runs upwards has it behind. The two that enclose a piece of the inside belong together.
    void pair_around(std::span<const uint32_t> edges) {
        const uint32_t low = std::min(from(edges[0]), to(edges[0])), high = std::max(from(edges[0]), to(edges[0]));
        const glm::dvec3 a(mesh_.positions[low]), axis = glm::dvec3(mesh_.positions[high]) - a;
        const double length = glm::length(axis);
        if (!(length > 0)) return;
        const glm::dvec3 unit = axis / length;
        const glm::dvec3 side = glm::normalize(std::abs(unit.x) < 0.6 ? glm::cross(unit, glm::dvec3(1, 0, 0))
                                                                      : glm::cross(unit, glm::dvec3(0, 1, 0)));
        const glm::dvec3 up = glm::cross(unit, side);
        std::vector<std::pair<double, uint32_t>> around;
        for (const uint32_t h : edges) {
            const glm::dvec3 r = glm::dvec3(mesh_.positions[from(next_corner(next_corner(h)))]) - a;
            around.emplace_back(std::atan2(glm::dot(r, up), glm::dot(r, side)), h);
        }
        std::sort(around.begin(), around.end());
        for (size_t i = 0; i < around.size(); ++i) {
            const uint32_t down = around[i].second, upward = around[(i + 1) % around.size()].second;
            if (from(down) == high && from(upward) == low && twin_[upward] == no_neighbour &&
                twin_[down] == no_neighbour) {
                twin_[down] = upward;
                twin_[upward] = down;
            }
        }
    }

    void choose_side(const std::vector<uint32_t>& piece, bool closed, RepairReport& report) {
        uint64_t turned = 0;
        for (const uint32_t t : piece) turned += flipped_[t] ? 1 : 0;
        bool turn_all = turned * 2 > piece.size();
        if (closed) {
            const glm::dvec3 origin(mesh_.position_of(piece[0], 0));
            double volume = 0;
            for (const uint32_t t : piece) {
                const glm::dvec3 a = glm::dvec3(mesh_.position_of(t, 0)) - origin,
                                 b = glm::dvec3(mesh_.position_of(t, 1)) - origin,
                                 c = glm::dvec3(mesh_.position_of(t, 2)) - origin;
                volume += (flipped_[t] ? -1 : 1) * glm::dot(a, glm::cross(b, c));
            }
            if (volume != 0) turn_all = volume < 0;
        }
        if (turn_all) {
            for (const uint32_t t : piece) flipped_[t] = !flipped_[t];
            turned = piece.size() - turned;
        }
        report.flipped_triangles += turned;
    }

    const TriMesh& mesh_;
    std::vector<uint32_t> twin_;
    std::vector<bool> flipped_;
};

}  // namespace

bool RepairReport::changed() const {
    return welded_vertices + degenerate_triangles + duplicate_triangles + flipped_triangles + non_manifold_edges +
               non_orientable_edges + non_manifold_vertices + unreferenced_vertices >
           0;
}

Result<RepairReport> repair(TriMesh& mesh, const RepairOptions& options, const Progress& progress) {
    const Error interrupted{Fault::interrupted, "interrupted"};
    RepairReport report;
    if (options.weld) weld(mesh, options, report);
    if (progress.stopped()) return tl::unexpected(interrupted);
    drop_degenerate(mesh, report);
    drop_duplicates(mesh, report);
    if (progress.stopped()) return tl::unexpected(interrupted);
    if (mesh.triangles.empty())
        return fail(Fault::format, "no triangle is left after repair; every face was degenerate");
    if (mesh.triangles.size() > options.limits.triangles)
        return fail(Fault::format, over_limit("triangles", mesh.triangles.size(), options.limits.triangles));
    {
        Surface surface(mesh);
        report.non_manifold_edges = surface.pair(true);
        if (progress.stopped()) return tl::unexpected(interrupted);
        surface.orient(options.orient, report);
        surface.split_fans(mesh, report);
    }
    // One fan may pass the same edge twice, around a handle. Such edges are cut wholly.
    for (;;) {
        if (progress.stopped()) return tl::unexpected(interrupted);
        Surface surface(mesh);
        if (surface.pair(false) == 0) break;
        surface.split_fans(mesh, report);
    }
    // Welding leaves the vertices it merged behind; they were counted already.
    const size_t dropped = drop_unreferenced(mesh);
    report.unreferenced_vertices = dropped > report.welded_vertices ? dropped - report.welded_vertices : 0;
    return report;
}

}  // namespace lodestone
