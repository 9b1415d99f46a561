#include "tiles/check/check.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <set>

#include "base/random.h"
#include "base/threads.h"
#include "mesh/distance/distance.h"
#include "tiles/check/closed_cuts.h"
#include "tiles/check/tile_content.h"
#include "tiles/check/tileset_reader.h"

namespace lodestone::tiles {

bool TilesetCheck::passed() const {
    return std::ranges::all_of(points, [](const CheckedPoint& point) { return point.passed; });
}

namespace {

// Collects the first fault of each point.
class Points {
public:
    explicit Points(std::vector<CheckedPoint>& points) : points_(points) {}
    void begin(const char* name) { points_.push_back({name, true, ""}); }
    void wrong(const std::string& message) {
        if (points_.back().passed) points_.back().message = message;
        points_.back().passed = false;
    }

private:
    std::vector<CheckedPoint>& points_;
};

// Places of a box's corners, or of a point, in half axes of another box: none is farther than 1 if it lies inside.
double reach(const glm::dmat4& box, const glm::dvec3& point) {
    double farthest = 0;
    const glm::dvec3 from = point - glm::dvec3(box[3]);
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 half(box[axis]);
        const double length2 = glm::dot(half, half);
        if (length2 > 0) farthest = std::max(farthest, std::abs(glm::dot(from, half)) / length2);
    }
    return farthest;
}
double reach(const glm::dmat4& box, const glm::dmat4& other) {
    double farthest = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 at = other * glm::dvec4(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1, 1);
        farthest = std::max(farthest, reach(box, glm::dvec3(at)));
    }
    return farthest;
}
constexpr double farthest_inside = 1 + 1e-6;

// A tile's triangles by the numbers of their places.
struct PlacedTile {
    std::vector<uint32_t> corners;  // three per triangle
    std::vector<BorderEdge> border;
};

class Checker {
public:
    Checker(const ReadTileset& set, const CheckOptions& options, const Progress& progress)
        : set_(set), options_(options), progress_(progress), points_(check_.points) {}

    Result<TilesetCheck> run() {
        check_errors();
        check_boxes();
        if (auto done = check_contents(); !done) return tl::unexpected(done.error());
        if (auto done = check_closed(); !done) return tl::unexpected(done.error());
        if (options_.measure) {
            if (auto done = check_measured(); !done) return tl::unexpected(done.error());
        }
        return std::move(check_);
    }

private:
    void check_errors() {
        points_.begin("geometric errors fall from parent to child, and are 0 of leaves");
        const auto error_of = [](const ReadTile& tile) { return tile.scale * tile.geometric_error; };
        if (!set_.tiles.empty() && set_.geometric_error < set_.tiles[0].geometric_error)
            points_.wrong("the tileset's is less than its root's");
        for (const ReadTile& tile : set_.tiles) {
            if (tile.children.empty() && tile.geometric_error != 0)
                points_.wrong(tile.place + ": a leaf's is " + std::to_string(tile.geometric_error));
            if (tile.parent == ~0u) continue;
            const ReadTile& parent = set_.tiles[tile.parent];
            // A tile that refers to a tileset is no tile of its own: the root there takes its place.
            const double error = error_of(tile), above = error_of(parent);
            const bool good = parent.refers || tile.children.empty() ? error <= above : error < above;
            if (!good || (above <= 0 && !parent.refers))
                points_.wrong(tile.place + ": " + std::to_string(error) + " below " + std::to_string(above));
        }
    }

    void check_boxes() {
        points_.begin("boxes hold those of children");
        for (const ReadTile& tile : set_.tiles) {
            if (!tile.has_box) points_.wrong(tile.place + ": has no box, and other volumes are not checked");
            if (tile.parent == ~0u || !tile.has_box || !set_.tiles[tile.parent].has_box) continue;
            const double r = reach(set_.tiles[tile.parent].box, tile.transform * tile.box);
            if (r > farthest_inside)
                points_.wrong(tile.place + ": stands out of its parent's, " + std::to_string(r) + " times");
        }
    }

    Result<void> check_contents() {
        points_.begin("contents are whole, lie in their boxes and on one lattice");
        contents_.resize(set_.tiles.size());
        std::vector<std::string> faults(set_.tiles.size());
        constexpr size_t batch = 64;
        for (size_t begin = 0; begin < faults.size(); begin += batch) {
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
            progress_.at("contents", static_cast<double>(begin) / static_cast<double>(faults.size()));
            parallel_for(std::min(batch, faults.size() - begin), 1, [&](size_t first, size_t end) {
                for (size_t i = begin + first; i < begin + end; ++i) faults[i] = read(i);
            });
            for (size_t i = begin; i < std::min(begin + batch, faults.size()); ++i) {
                if (!faults[i].empty()) points_.wrong(faults[i]);
            }
        }
        for (const uint32_t part : set_.parts) {
            for (uint32_t i = part; i < end_of(part); ++i) {
                if (contents_[i] && contents_[part] && contents_[i]->matrix != contents_[part]->matrix)
                    points_.wrong(set_.tiles[i].place + ": its node's matrix is not that of " + set_.tiles[part].place +
                                  ": places of samples are rounded in another way");
            }
        }
        return {};
    }
    // The fault, if there is one.
    std::string read(size_t i) {
        const ReadTile& tile = set_.tiles[i];
        if (tile.content.empty()) return "";
        auto content = read_tile_content(tile.content);
        if (!content) return content.error().message;
        const glm::dmat4 to_tile = content->to_tile();
        std::string fault;
        for (const auto& p : content->positions) {
            const double r = tile.has_box ? reach(tile.box, glm::dvec3(to_tile * glm::dvec4(p[0], p[1], p[2], 1))) : 0;
            if (r > farthest_inside)
                fault = tile.place + ": a vertex is outside the tile's box, " + std::to_string(r) + " times";
        }
        contents_[i] = std::move(*content);
        return fault;
    }

    // Tiles of a part stand behind one another.
    uint32_t end_of(uint32_t part) const {
        uint32_t end = part + 1;
        while (end < set_.tiles.size() && set_.tiles[end].parent != ~0u && set_.tiles[end].parent >= part) ++end;
        return end;
    }

    void place(uint32_t part, uint32_t end, std::vector<PlacedTile>& tiles) {
        Places places;
        tiles.resize(end - part);
        for (uint32_t i = part; i < end; ++i) {
            if (!contents_[i]) continue;
            std::vector<uint32_t> numbers;
            for (const auto& p : contents_[i]->positions) numbers.push_back(places.number(p));
            PlacedTile& tile = tiles[i - part];
            for (const auto& t : contents_[i]->triangles)
                tile.corners.insert(tile.corners.end(), {numbers[t[0]], numbers[t[1]], numbers[t[2]]});
            tile.border = border_of(tile.corners, &check_.repeated_edges);
        }
    }

    // Each tile is taken or gone into; one without triangles is always gone into.
    void random_cut(uint32_t tile, double share, Random& random, std::vector<uint32_t>& cut) const {
        const ReadTile& t = set_.tiles[tile];
        const bool deeper = !t.children.empty() && (t.content.empty() || random.unit() < share);
        if (!deeper) {
            cut.push_back(tile);
            return;
        }
        for (const uint32_t child : t.children) random_cut(child, share, random, cut);
    }

    Result<void> check_closed() {
        points_.begin("random cuts are closed, but for the rim of the leaves of an open surface");
        Random random(options_.seed);
        std::set<std::filesystem::path> done;
        for (const uint32_t part : set_.parts) {
            if (!done.insert(set_.tiles[part].content).second) continue;
            const uint32_t end = end_of(part);
            std::vector<PlacedTile> tiles;
            place(part, end, tiles);
            EdgeSum leaves;
            for (uint32_t i = part; i < end; ++i) {
                if (set_.tiles[i].children.empty()) leaves.add(tiles[i - part].border);
            }
            const std::vector<BorderEdge> finest = leaves.left();
            check_.rim_edges += finest.size();
            if (set_.tiles[part].open == false && !finest.empty())
                points_.wrong(set_.tiles[part].place + ": " + std::to_string(finest.size()) +
                              " edges of the leaves do not match, and the surface has no rim");
            for (uint32_t k = 0; k < options_.cuts; ++k) {
                if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
                progress_.at("random cuts", static_cast<double>(k) / options_.cuts);
                std::vector<uint32_t> cut;
                random_cut(part, k == 0 ? 0.0 : random.uniform(0.2, 0.95), random, cut);
                judge(part, cut, tiles, finest);
            }
        }
        return {};
    }
    // rim: what the leaves leave over.
    void judge(uint32_t part, const std::vector<uint32_t>& cut, const std::vector<PlacedTile>& tiles,
               const std::vector<BorderEdge>& rim) {
        EdgeSum sum;
        uint32_t finest = ~0u, coarsest = 0;
        for (const uint32_t tile : cut) {
            const PlacedTile& placed = tiles[tile - part];
            sum.add(placed.border);
            finest = std::min(finest, set_.tiles[tile].level);
            coarsest = std::max(coarsest, set_.tiles[tile].level);
        }
        ++check_.cuts;
        check_.largest_step = std::max(check_.largest_step, coarsest - finest);
        sum.take(rim);
        const uint64_t gaps = sum.left().size();
        check_.unmatched_edges += gaps;
        if (gaps > 0)
            points_.wrong(set_.tiles[part].place + ": " + std::to_string(gaps) + " edges of a cut of " +
                          std::to_string(cut.size()) + " tiles do not match");
    }

    // All triangles of some tiles, in steps of the lattice.
    TriMesh mesh_of(const std::vector<uint32_t>& tiles) const {
        TriMesh mesh;
        for (const uint32_t i : tiles) {
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (const auto& p : contents_[i]->positions) mesh.positions.emplace_back(p[0], p[1], p[2]);
            for (const auto& t : contents_[i]->triangles)
                mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
        }
        mesh.set_identity_wedges();
        return mesh;
    }
    void add_leaves(uint32_t tile, std::vector<uint32_t>& leaves) const {
        const ReadTile& t = set_.tiles[tile];
        if (t.children.empty()) leaves.push_back(tile);
        for (const uint32_t child : t.children) add_leaves(child, leaves);
    }
    Result<void> check_measured() {
        points_.begin("geometric errors are not less than the distances to the leaves, measured at samples");
        for (uint32_t i = 0; i < set_.tiles.size(); ++i) {
            const ReadTile& tile = set_.tiles[i];
            if (!contents_[i] || tile.children.empty()) continue;
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
            progress_.at("distances", static_cast<double>(i) / static_cast<double>(set_.tiles.size()));
            std::vector<uint32_t> leaves;
            add_leaves(i, leaves);
            const double step = glm::length(glm::dvec3(contents_[i]->to_tile()[0]));
            const TriMesh tile_mesh = mesh_of({i}), leaf_mesh = mesh_of(leaves);
            DistanceOptions sampling;
            sampling.samples = std::min(sampling.samples, 8 * leaf_mesh.triangle_count());
            const MeasuredSurface shown(tile_mesh, sampling), finest(leaf_mesh, sampling);
            const double measured = step * finest.farthest_from(shown, shown.farthest_from(finest, 0));
            if (measured <= 0) continue;
            const double ratio = tile.geometric_error / measured;
            check_.least_ratio = check_.least_ratio > 0 ? std::min(check_.least_ratio, ratio) : ratio;
            check_.largest_ratio = std::max(check_.largest_ratio, ratio);
            if (ratio < 1 - 1e-6)
                points_.wrong(tile.place + ": says " + std::to_string(tile.geometric_error) + ", is " +
                              std::to_string(measured));
        }
        return {};
    }

    const ReadTileset& set_;
    const CheckOptions& options_;
    const Progress& progress_;
    std::vector<std::optional<TileContent>> contents_;  // per tile
    TilesetCheck check_;
    Points points_;
};

}  // namespace

Result<TilesetFacts> tileset_facts(const std::filesystem::path& path) {
    const auto set = read_tileset(path);
    if (!set) return tl::unexpected(set.error());
    TilesetFacts facts;
    facts.generator = set->generator;
    facts.files = set->files;
    facts.json_bytes = set->json_bytes;
    facts.parts = static_cast<uint32_t>(set->parts.size());
    facts.geometric_error = set->geometric_error;
    facts.root_error = set->tiles[0].geometric_error;
    facts.placed = set->tiles[0].transform != glm::dmat4(1);
    std::vector<uint32_t> depths(set->tiles.size(), 0);
    for (size_t i = 0; i < depths.size(); ++i) {
        const ReadTile& tile = set->tiles[i];
        if (tile.parent != ~0u) depths[i] = depths[tile.parent] + (set->tiles[tile.parent].refers ? 0 : 1);
        if (tile.content.empty()) continue;
        const auto content = read_tile_content(tile.content);
        if (!content) return tl::unexpected(content.error());
        facts.depths.resize(std::max<size_t>(facts.depths.size(), depths[i] + size_t{1}));
        TilesetFacts::Depth& depth = facts.depths[depths[i]];
        ++depth.tiles;
        depth.bytes += content->bytes;
        depth.triangles += content->triangles.size();
        depth.largest_error = std::max(depth.largest_error, tile.geometric_error);
        ++facts.tiles;
        facts.tile_bytes += content->bytes;
        facts.triangles += content->triangles.size();
        facts.closing_triangles += tile.closing_triangles;
        if (!tile.children.empty()) continue;
        ++facts.leaves;
        facts.leaf_triangles += content->triangles.size();
    }
    facts.depth = static_cast<uint32_t>(facts.depths.size());
    return facts;
}

Result<TilesetCheck> check_tileset(const std::filesystem::path& path, const CheckOptions& options,
                                   const Progress& progress) {
    const auto set = read_tileset(path);
    if (!set) return tl::unexpected(set.error());
    return Checker(*set, options, progress).run();
}

}  // namespace lodestone::tiles
