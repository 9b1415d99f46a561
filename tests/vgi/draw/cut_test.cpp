// Cuts through small atlases, however they are made of triangles.
#include "vgi/draw/cut/bintree_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <set>

#include "base/random.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "frame/screen_error.h"
#include "mesh/distance/closest_point.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/corners.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/saturation.h"
#include "vgi/bake/images/corners/collapse_corners.h"
#include "vgi/bake/images/sample_errors.h"
#include "vgi/draw/cut/frame_cuts.h"
#include "vgi/draw/cut/visibility.h"
#include "vgi/draw/leaves/leaf_morph.h"
#include "vgi/draw/vgi_source.h"
#include "vgi/small_atlas.h"
#include "vgi/study/grid_cut.h"
#include "vgi/study/grid_patch.h"

namespace lodestone::vgi {
namespace {

constexpr uint32_t leaf_block = LODE_VGI_LEAF_BLOCK(0u);

// alone: vertices move as their own leaves do, whatever those beside have.
void put_leaf_part(Residency& residency, const Atlas& atlas, uint32_t part, uint32_t slot, bool alone = false) {
    auto decoded = decode_leaf(atlas.leaf_parts[part], atlas.attributes);
    ASSERT_TRUE(decoded);
    const PageTopology& topology = residency.topology();
    const uint32_t page = topology.page_of_leaf(topology.leaf_of_part(part)), per_chart = topology.tree().pages();
    const GeometryPage samples =
        packed_geometry(read_page(atlas, Layer::geometry, page / per_chart, page % per_chart), topology.tree());
    DrawnLeafPart drawn = packed_leaf(topology, part, std::move(*decoded), samples, false);
    if (alone) {
        const auto own = drawn.words[0];
        drawn.words[0] = drawn.words[1] = drawn.words[2] = {own[0], own[1], own[0], own[1]};
    }
    residency.put_leaf_part(part, std::make_shared<const DrawnLeafPart>(std::move(drawn)), slot);
}

// Pages that are there with probability `share`, base pages always, whether their parents are or not; slot = number.
// So are parts of leaves with probability `leaf_share`.
// leaves: whether they are known at all.
Residency partly_resident(const Atlas& atlas, double share, uint64_t seed, double leaf_share = 0, bool alone = false,
                          bool leaves = true) {
    Residency residency(std::make_shared<const PageTopology>(atlas, leaves));
    Random random(seed);
    for (uint32_t number = 0; number < residency.pages(); ++number) {
        const uint32_t chart = number / residency.tree().pages(), page = number % residency.tree().pages();
        if (page > 0 && random.unit() >= share) continue;
        if (page >= tree_of(atlas, Layer::geometry, chart).pages()) continue;  // left out
        residency.put(number,
                      std::make_shared<const GeometryPage>(
                          packed_geometry(read_page(atlas, Layer::geometry, chart, page), residency.tree())),
                      number);
    }
    for (uint32_t part = 0; part < residency.topology().leaf_parts() && leaf_share > 0; ++part) {
        if (random.unit() < leaf_share) put_leaf_part(residency, atlas, part, part, alone);
    }
    residency.update();
    return residency;
}

// Whether a plane of a frustum has all corners of a triangle outside.
bool is_beyond(const Frustum& frustum, const std::array<glm::vec3, 3>& triangle) {
    return std::ranges::any_of(frustum.planes(), [&](const glm::vec4& plane) {
        return std::ranges::all_of(triangle,
                                   [&](const glm::vec3& p) { return glm::dot(glm::vec3(plane), p) + plane.w < 0; });
    });
}

bool is_leaf_vertex(uint32_t index) { return (index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0; }

Cut from_scratch(const Residency& residency, const CutRequest& request, PageDemand& demand) {
    IncrementalCut nothing;
    // All charts, whether they are seen or not.
    std::vector<uint32_t> charts(residency.about().charts());
    std::iota(charts.begin(), charts.end(), 0u);
    return cut_bintree(residency, request, charts, demand, nothing);
}

std::vector<std::pair<uint32_t, float>> asked(const PageDemand& demand) {
    std::vector<std::pair<uint32_t, float>> all;
    for (const uint32_t page : demand.all_asked()) all.emplace_back(page, demand.wish(page));
    return all;
}

// Where a vertex of a leaf starts, and the leaves by which it moves.
struct LeafMotion {
    uint8_t exponent = 0;
    std::array<int8_t, 3> off{};
    std::array<uint32_t, 2> low{}, high{};
    auto operator<=>(const LeafMotion&) const = default;
};

struct Glue {
    const Atlas& atlas;
    DisjointSets sets;
    std::vector<uint32_t> texel_of_corner;
    std::set<uint32_t> ends_surface;  // samples of corners at its end, and of what may stand for them
    // By what tells where they are drawn: their numbers, beyond those of samples.
    std::map<std::pair<std::array<uint32_t, 3>, LeafMotion>, uint32_t> leaf_points;
    explicit Glue(const Atlas& a) : atlas(a), sets(a.texels()), texel_of_corner(a.corners.size()) {
        glue_sides();
        for (uint32_t c = 0; c < atlas.charts(); ++c) {
            for (uint32_t k = 0; k < 4; ++k)
                texel_of_corner[atlas.chart_corners[c][k]] = static_cast<uint32_t>(corner_texel(atlas, c, k));
        }
        for (uint32_t i = 0; i < atlas.sides.size(); ++i) {
            if (atlas.sides[i].chart != ~0u) continue;
            for (const uint32_t end : {i % 4, (i + 1) % 4}) add_end(atlas.chart_corners[i / 4][end]);
        }
    }

private:
    void add_end(uint32_t corner) {
        ends_surface.insert(sets.find(texel_of_corner[corner]));
        if (atlas.corners[corner].parent != corner) add_end(atlas.corners[corner].parent);
    }
    void glue_sides() {
        const Atlas& a = atlas;
        for (uint32_t c = 0; c < a.charts(); ++c) {
            for (uint32_t s = 0; s < 4; ++s) {
                const GluedSide& other = a.sides[size_t{c} * 4 + s];
                if (other.chart == ~0u) continue;
                const uint32_t n = a.cells_of(c);
                for (uint32_t k = 0; k <= n; ++k) {
                    const auto [x, y] = on_side(s, k, n);
                    const auto [u, v] = on_side(other.side, n - k, n);
                    sets.join(static_cast<uint32_t>(a.texel(c, x, y)),
                              static_cast<uint32_t>(a.texel(other.chart, u, v)));
                }
            }
        }
    }
};

struct Sample {
    uint32_t chart, x, y;  // of the chart's own
};
Sample sample_of(const Residency& residency, uint32_t index) {
    const PageTree& tree = residency.tree();
    const uint32_t texels = LODE_VGI_PAGE_TEXELS(tree.cells_per_page()), number = index / texels,
                   texel = index % texels;
    uint32_t level = 0, px = 0, py = 0;
    tree.place(number % tree.pages(), &level, &px, &py);
    const uint32_t row = tree.samples_per_side(), n = tree.cells_per_page();
    const uint32_t chart = number / tree.pages(), own = level - residency.about().trimmed_levels[chart];
    return {chart, (px * n + texel % row) << own, (py * n + texel / row) << own};
}

// A corner of a triangle: where it is in its chart, and the number of the glued sample in whose place it is drawn.
struct Vertex {
    Sample at;
    uint32_t id;
    bool moved;                              // LODE_VGI_CORNER
    bool is_leaf = false, may_meet = false;  // of a leaf; a sample on a page's side, to which several points may go
};
// Of a vertex of a leaf. slot: the number of the part.
LeafMotion motion_of(const Residency& residency, uint32_t index) {
    index &= ~(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES);
    const uint32_t part = index / LODE_VGI_LEAF_VERTICES, v = index % LODE_VGI_LEAF_VERTICES;
    const auto& words = residency.leaf_part(part).part->words;
    const LeafMorph morph = LeafMorph::unpacked(words[LODE_VGI_LEAF_MORPHS(v, leaf_block)][v % 4]);
    const auto leaf = [&](size_t i) { return std::array{words[i / 2][i % 2 * 2], words[i / 2][i % 2 * 2 + 1]}; };
    const auto [low, high] = std::minmax({leaf(0), leaf(morph.border)});
    // Nothing moves what is where it starts.
    if (morph.off == std::array<int8_t, 3>{}) return {};
    return {morph.exponent, morph.off, low, high};
}
Vertex leaf_vertex_of(const Residency& residency, Glue& glue, uint32_t index) {
    index &= ~LODE_VGI_LEAF_MOVES;
    const uint32_t part = index / LODE_VGI_LEAF_VERTICES, leaf = residency.topology().leaf_of_part(part),
                   number = residency.topology().page_of_leaf(leaf), chart = number / residency.tree().pages();
    const LeafVertex& v = residency.leaf_part(part).part->part.vertices[index % LODE_VGI_LEAF_VERTICES];
    const uint32_t n = glue.atlas.cells_of(chart), per_side = glue.atlas.leaves_per_side(chart),
                   square = leaf - glue.atlas.first_leaf[chart];
    const auto along = [&](size_t k, uint32_t at, uint32_t low_side, uint32_t high_side) {
        if (at == 0 && v.on_side(low_side)) return 0u;
        if (at == per_side - 1 && v.on_side(high_side)) return n;
        return std::clamp(v.place[k] * n / leaf_places, 1u, n - 1);
    };
    const auto [at, fresh] =
        glue.leaf_points.try_emplace({v.position, motion_of(residency, index)},
                                     static_cast<uint32_t>(glue.atlas.texels() + glue.leaf_points.size()));
    return {{chart, along(0, square % per_side, 3, 1), along(1, square / per_side, 0, 2)}, at->second, false, true};
}
// The corner that an index of LODE_VGI_CORNER names.
uint32_t corner_of(const Atlas& atlas, uint32_t index) {
    const uint32_t of_chart = index % LODE_VGI_CORNER_STEP;
    uint32_t corner = atlas.chart_corners[of_chart / 4][of_chart % 4];
    for (uint32_t step = (index & ~LODE_VGI_CORNER) / LODE_VGI_CORNER_STEP; step > 0; --step)
        corner = atlas.corners[corner].parent;
    return corner;
}

// What is drawn is what the atlas has there, or `bad` counts it.
Vertex vertex_of(const Residency& residency, Glue& glue, uint32_t index, size_t& bad) {
    const Atlas& atlas = glue.atlas;
    if ((index & LODE_VGI_CORNER) != 0) {
        const uint32_t of_chart = index % LODE_VGI_CORNER_STEP, chart = of_chart / 4;
        const auto [x, y] = on_side(of_chart % 4, 0u, atlas.cells_of(chart));
        return {{chart, x, y}, glue.sets.find(glue.texel_of_corner[corner_of(atlas, index)]), true};
    }
    if ((index & LODE_VGI_LEAF) != 0) return leaf_vertex_of(residency, glue, index & ~LODE_VGI_LEAF);
    const Sample s = sample_of(residency, index);
    const uint32_t id = glue.sets.find(static_cast<uint32_t>(atlas.texel(s.chart, s.x, s.y)));
    const uint32_t texels = LODE_VGI_PAGE_TEXELS(residency.tree().cells_per_page());
    const GeometryTexel& texel = (*residency.entry(index / texels).texels)[index % texels];
    const auto& p = atlas.positions[id];
    bad += texel.x != p[0] || texel.y != p[1] || texel.z != p[2];
    const uint32_t page = residency.tree().cells_per_page();
    return {s, id, false, false, s.x % page == 0 || s.y % page == 0};
}

// Corners that charts share may be given as any of these charts has them.
bool on_rim(const Atlas& atlas, const Sample& a, const Sample& b) {
    if (a.chart != b.chart) return false;
    const uint32_t n = atlas.cells_of(a.chart);
    const int side = a.y == 0 && b.y == 0   ? 0
                     : a.x == n && b.x == n ? 1
                     : a.y == n && b.y == n ? 2
                     : a.x == 0 && b.x == 0 ? 3
                                            : -1;
    return side >= 0 && atlas.sides[size_t{a.chart} * 4 + static_cast<size_t>(side)].chart == ~0u;
}

// Edges that are not met as often each way, those on the end of the surface left out; and those met more than once,
// unless triangles of moved corners have them: where a surface has become flat they may lie on each other.
size_t bad_edges(const Residency& residency, Glue& glue, const std::vector<uint32_t>& indices) {
    struct Met {
        int forth = 0, back = 0;
        bool moved = false;
    };
    const bool leaves = !glue.atlas.leaves.empty();
    std::set<uint32_t> coinciding;  // several points of leaves that rounding has put in one place
    std::map<std::pair<uint32_t, uint32_t>, Met> edges;
    size_t bad = 0;
    for (size_t t = 0; t + 2 < indices.size(); t += 3) {
        Vertex v[3];
        for (size_t k = 0; k < 3; ++k) v[k] = vertex_of(residency, glue, indices[t + k], bad);
        for (size_t k = 0; k < 3; ++k) {
            const Vertex &a = v[k], &b = v[(k + 1) % 3];
            if (a.id == b.id && a.is_leaf && b.is_leaf) {
                coinciding.insert(a.id);
                continue;
            }
            bad += a.id == b.id;
            Met& met = edges[std::minmax(a.id, b.id)];
            met.moved = met.moved || a.moved || (leaves && (a.may_meet || b.may_meet));
            ++(a.id < b.id ? met.forth : met.back);
            // Beyond it there is as much as is needed.
            if (on_rim(glue.atlas, a.at, b.at)) ++(a.id < b.id ? met.back : met.forth);
        }
    }
    for (const auto& [ends, met] : edges) {
        // What is left out of an open surface may move its end inwards, to other corners that stand for the end's.
        const bool ends_surface = glue.ends_surface.contains(ends.first) && glue.ends_surface.contains(ends.second);
        const bool several = met.moved || coinciding.contains(ends.first) || coinciding.contains(ends.second);
        bad += (met.forth != met.back && !ends_surface) || (met.forth > 1 && !several);
    }
    return bad;
}

// Where it lies: middle and longest extent.
struct Extent {
    glm::vec3 centre;
    float size;
};
Extent extent_of(const Atlas& atlas) {
    glm::dvec3 low(1e300), high(-1e300);
    for (size_t t = 0; t < atlas.positions.size(); ++t) {
        low = glm::min(low, atlas.point(t));
        high = glm::max(high, atlas.point(t));
    }
    const glm::dvec3 extent = high - low;
    return {glm::vec3((low + high) * 0.5), static_cast<float>(std::max({extent.x, extent.y, extent.z}))};
}

// A camera somewhere around the atlas, near or far, and a shadow view that sees all of it.
std::vector<View> random_views(const Atlas& atlas, Random& random) {
    const auto [centre, size] = extent_of(atlas);
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    Camera camera;
    camera.eye = centre + glm::vec3(unit(), unit(), unit()) * size * std::exp2(unit() * 4 + 1);
    camera.target = centre + glm::vec3(unit(), unit(), unit()) * size * 0.3f;
    camera.near_plane = size * 1e-3f;
    camera.far_plane = size * 100;
    return {view_of(camera, 1280, 720), shadow_view({0.3f, -1, 0.2f}, centre, size * 4, 64)};
}

std::vector<uint32_t> all_triangles(const Cut& cut) {
    std::vector<uint32_t> all;
    for (const auto& [mask, indices] : cut.parts) {
        EXPECT_NE(mask & 2, 0u);
        all.insert(all.end(), indices.begin(), indices.end());
    }
    return all;
}

Cut cut_as(Raster raster, const Residency& residency, const CutRequest& request, PageDemand& demand) {
    if (raster == Raster::bintree) return from_scratch(residency, request, demand);
    return cut_grid(residency, request, demand, GridOutput::indices,
                    raster == Raster::grid_area ? GridRule::by_area : GridRule::by_error);
}

class Cuts : public testing::TestWithParam<Raster> {
protected:
    static Cut cut(const Residency& residency, const CutRequest& request, PageDemand& demand) {
        return cut_as(GetParam(), residency, request, demand);
    }
};
const char* name_of(Raster raster) {
    return raster == Raster::bintree ? "Bintree" : raster == Raster::grid ? "Grid" : "GridByArea";
}
INSTANTIATE_TEST_SUITE_P(By, Cuts, testing::Values(Raster::bintree, Raster::grid, Raster::grid_area),
                         [](const auto& one) { return name_of(one.param); });
using ErrorCuts = Cuts;
INSTANTIATE_TEST_SUITE_P(By, ErrorCuts, testing::Values(Raster::bintree, Raster::grid),
                         [](const auto& one) { return name_of(one.param); });

// What cuts were made of, all together.
struct Met {
    size_t triangles = 0, of_leaves = 0, mixed = 0;  // of them: with corners of leaves alone; with others besides
    size_t arrived = 0, on_their_way = 0;            // vertices of leaves that are in their places, as cuts say; others
};

// Of vertices that a cut says are in their places, those that are not, seen from some eye within its margin.
size_t count_not_there(const Residency& residency, const CutRequest& request, const std::vector<uint32_t>& indices,
                       Random& random, Met& met) {
    const Atlas& about = residency.about();
    const ErrorCodes codes(about.extent());
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    View view = request.views[0];
    view.eye += glm::normalize(glm::vec3(unit(), unit(), unit()) + 1e-3f) * request.margin.distance;
    const double magnification = magnification_of(view, request.pixel_error);
    size_t bad = 0;
    for (const uint32_t index : indices) {
        if ((index & LODE_VGI_CORNER) != 0 || (index & LODE_VGI_LEAF) == 0) continue;
        if ((index & LODE_VGI_LEAF_MOVES) != 0) {
            ++met.on_their_way;
            continue;
        }
        ++met.arrived;
        const LeafMotion motion = motion_of(residency, index);
        for (const auto& words : {motion.low, motion.high}) {
            const auto leaf = std::bit_cast<GeometryTexel>(words);
            const double reach = static_cast<double>(codes.error(leaf.error)) * magnification / error_ratio +
                                 static_cast<double>(codes.radius(leaf.radius));
            const float away = distance_metric(view, glm::vec3(about.lattice_point({leaf.x, leaf.y, leaf.z})));
            bad += leaf.error > 0 && static_cast<double>(away) > reach;
        }
    }
    return bad;
}
size_t count_bad(Raster raster, const Atlas& atlas, const Atlas& gluing, uint32_t cameras, uint64_t seed,
                 Met* met = nullptr, bool leaves = false, bool alone = false) {
    Glue glue(atlas);
    Random random(seed);
    size_t bad = 0;
    for (uint32_t i = 0; i < cameras; ++i) {
        Atlas about = gluing;
        const double share = i % 4 == 0 ? 1 : leaves ? 0.7 + 0.3 * random.unit() : random.unit();
        const Residency residency = partly_resident(about, share, mix64(seed + i),
                                                    !leaves      ? 0
                                                    : i % 3 == 0 ? 1
                                                                 : 0.5 + random.unit() / 2,
                                                    alone);
        PageDemand demand(residency.units());
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        request.pixel_error = std::exp2(random.unit() * 5 - 2);
        if (i % 3 == 0) request.margin = {extent_of(atlas).size * static_cast<float>(random.unit()) * 0.3f, 0.1f};
        const Cut cut = cut_as(raster, residency, request, demand);
        const auto all = all_triangles(cut);
        if (met != nullptr) {
            met->triangles += all.size() / 3;
            for (size_t t = 0; t < all.size(); t += 3) {
                uint32_t of_leaves = 0;
                for (size_t k = t; k < t + 3; ++k) of_leaves += is_leaf_vertex(all[k]);
                met->of_leaves += of_leaves == 3;
                met->mixed += of_leaves == 1 || of_leaves == 2;
            }
            Random eyes(mix64(seed + i));
            bad += count_not_there(residency, request, all, eyes, *met);
        }
        bad += bad_edges(residency, glue, all);
    }
    return bad;
}

// cameras: for each mesh; a third as many where charts are large.
void expect_to_fit(Raster raster, int cameras) {
    Met met;
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        for (const uint32_t cells : {8u, 64u, 128u}) {
            const Atlas atlas = small_atlas(f.mesh, cells);
            EXPECT_EQ(count_bad(raster, atlas, atlas, cells == 128 ? cameras / 3 : cameras, cells, &met), 0u) << cells;
        }
    }
    EXPECT_GT(met.triangles, 100000u);
}

TEST_P(Cuts, FitTogetherForAnyCameraAndAnyPages) { expect_to_fit(GetParam(), GetParam() == Raster::bintree ? 24 : 6); }

using CutsLong = Cuts;
INSTANTIATE_TEST_SUITE_P(By, CutsLong, testing::Values(Raster::bintree, Raster::grid, Raster::grid_area),
                         [](const auto& one) { return name_of(one.param); });
TEST_P(CutsLong, FitTogetherForAnyCameraAndAnyPages) { expect_to_fit(GetParam(), 96); }

// Leaves beside leaves, beside any level of samples, and where some or some of their parts are missing. cameras: for
// each mesh.
void expect_leaves_to_fit(int cameras) {
    Met met;
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        for (const uint32_t cells : {4u, 8u, 64u}) {
            const Atlas atlas = small_atlas(f.mesh, cells, 8, true);
            EXPECT_EQ(count_bad(Raster::bintree, atlas, atlas, cameras, cells, &met, true), 0u) << cells;
        }
    }
    EXPECT_GT(met.triangles, 100000u);
    EXPECT_GT(met.of_leaves, 10000u);
    EXPECT_GT(met.mixed, 1000u);
    EXPECT_GT(met.arrived, 10000u);
    EXPECT_GT(met.on_their_way, 10000u);
}

TEST(Cuts, FitTogetherWithAnyLeaves) { expect_leaves_to_fit(16); }

// Charts of different depths beside each other.
void expect_depths_to_fit(uint32_t cameras) {
    Met met;
    for (const uint32_t clusters : {60u, 4u}) {
        const Atlas atlas = uneven_atlas(clusters);
        EXPECT_EQ(count_bad(Raster::bintree, atlas, atlas, cameras, clusters, &met, true), 0u) << clusters;
        EXPECT_EQ(count_bad(Raster::bintree, atlas, atlas, cameras, clusters, &met), 0u) << clusters;
        // Samples on sides that charts have on one side alone.
        Atlas broken = atlas;
        for (uint32_t c = 0; c < broken.charts(); ++c) {
            for (size_t t = broken.first_texel[c]; t < broken.first_texel[c + 1]; ++t) {
                if (broken.sample_radii[t] != ErrorCodes::absent || c % 2 == 0) continue;
                broken.sample_errors[t] = 200;
                broken.sample_radii[t] = ErrorCodes::everywhere;
            }
        }
        EXPECT_GT(count_bad(Raster::bintree, broken, broken, 8, clusters), 0u) << clusters;
        // Leaves that take more samples of sides not to be there than are not.
        Atlas shallow = atlas;
        for (uint8_t& levels : shallow.unsampled_levels) ++levels;
        EXPECT_GT(count_bad(Raster::bintree, atlas, shallow, 16, clusters, nullptr, true), 0u) << clusters;
    }
    EXPECT_GT(met.of_leaves, 10000u);
    EXPECT_GT(met.mixed, 1000u);
}
TEST(Cuts, FitTogetherForAnyDepths) { expect_depths_to_fit(48); }
TEST(LeafCutsLong, FitTogetherForAnyDepths) { expect_depths_to_fit(1000); }

TEST(LeafCutsLong, FitTogetherForAnyCameraAndAnyPages) { expect_leaves_to_fit(48); }

TEST(Cuts, FallApartWhereRulesOfLeavesAreBroken) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64, 8, true);
    EXPECT_EQ(count_bad(Raster::bintree, atlas, atlas, 16, 5, nullptr, true), 0u);
    // Leaves that are wanted where corners of charts beside them are not.
    Atlas broken = atlas;
    for (Leaf& leaf : broken.leaves) leaf.error = static_cast<uint8_t>(std::min(255, leaf.error + 40));
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 48, 5, nullptr, true), 0u);
    // A point that two leaves do not share.
    broken = atlas;
    move_points(broken, [](size_t p) { return p % 7 == 0; });
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 16, 5, nullptr, true), 0u);
    // Leaves that move without those across along sides that they share.
    EXPECT_GT(count_bad(Raster::bintree, atlas, atlas, 16, 5, nullptr, true, true), 0u);
    // Leaves that do not know what is next to them.
    broken = atlas;
    broken.sides.assign(broken.sides.size(), GluedSide{});
    EXPECT_GT(count_bad(Raster::bintree, atlas, broken, 16, 5, nullptr, true), 0u);
}

// The whole atlas in view from so many of its sizes away.
Cut cut_from_afar(const Atlas& atlas, const Residency& residency, float away, float* focal_px = nullptr) {
    const auto [centre, size] = extent_of(atlas);
    Camera camera;
    camera.eye = centre + glm::vec3(0.6f, 0.48f, 0.64f) * size * away;
    camera.target = centre;
    camera.far_plane = size * 1e5f;
    const std::array views{view_of(camera, 1280, 720)};
    if (focal_px != nullptr) *focal_px = views[0].focal_px;
    CutRequest request;
    request.views = views;
    request.cull_back_faces = false;
    PageDemand demand(residency.units());
    return from_scratch(residency, request, demand);
}

// The same samples without leaves, and corners as they are then.
Atlas without_leaves_of(Atlas atlas) {
    atlas.leaves.clear();
    atlas.leaf_parts = {};
    collapse_corners(atlas);
    return atlas;
}

// Where no leaf is wanted nothing is drawn for the sake of one.
TEST(Cuts, TakeNothingForLeavesThatAreFarAway) {
    const TriMesh rock = fixtures::repaired(Shape::rock, 60000);
    for (const uint32_t cells : {16u, 64u}) {
        const Atlas with = small_atlas(rock, cells, 24, true), without = without_leaves_of(with);
        const Residency all = partly_resident(with, 1, 1, 1), samples = partly_resident(without, 1, 1),
                        unknown = partly_resident(with, 1, 1, 0, false, false);
        uint32_t without_leaves = 0;
        for (float away = 1; away < 100; away *= 1.3f) {
            const Cut cut = cut_from_afar(with, all, away);
            bool leaves = false;
            for (const auto& part : cut.parts) leaves = leaves || std::ranges::any_of(part.second, is_leaf_vertex);
            if (leaves) continue;
            ++without_leaves;
            EXPECT_EQ(cut.parts, cut_from_afar(with, unknown, away).parts) << cells << ", " << away;
            const uint64_t alone = cut_from_afar(without, samples, away).triangles;
            EXPECT_EQ(cut.triangles, alone) << cells << ", " << away;
        }
        EXPECT_GT(without_leaves, 5u) << cells;
    }
}

// From afar there is less and less of an atlas, and in the end nothing.
TEST(Cuts, DrawFewerTrianglesThanChartsHaveFromAfar) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 64, 24);
        const Residency residency = partly_resident(atlas, 1, 1);
        uint64_t before = ~uint64_t{0};
        for (float away = 4; away < 1e4f; away *= 1.5f) {
            const uint64_t triangles = cut_from_afar(atlas, residency, away).triangles;
            EXPECT_LE(triangles, before + before / 50) << away;
            before = triangles;
        }
        EXPECT_EQ(before, 0u);
    }
}

// What stands above the charts is as many triangles as the distance asks for: there is no gap between charts and dots.
TEST(Cuts, LoseTrianglesStepByStepFromAfar) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 60000), 16, 130);
    const Residency residency = partly_resident(atlas, 1, 1);
    uint64_t before = 0, steps = 0;
    for (float away = 2; away < 1000 && (before == 0 || before > 80); away *= 1.1f) {
        const uint64_t triangles = cut_from_afar(atlas, residency, away).triangles;
        ASSERT_GT(triangles, 0u) << away;
        ASSERT_LE(before, 2 * triangles) << away;
        before = triangles;
        steps += triangles < 2 * atlas.charts();
    }
    EXPECT_GT(steps, 5u);
    EXPECT_LE(before, 80u);
}

// Where it is drawn, on its way from its parent (shaders/shared/vgi_sample.glsl); the atlas stands in the world as it
// is.
glm::dvec3 drawn_corner(const Atlas& atlas, const View& view, double pixel_error, uint32_t corner) {
    const Corner& c = atlas.corners[corner];
    const ErrorCodes codes(atlas.extent());
    const glm::dvec3 own = atlas.lattice_point(c.position);
    const double error = static_cast<double>(codes.error(c.error)) * magnification_of(view, pixel_error);
    if (c.parent == corner || error == 0) return own;
    const double left = error + static_cast<double>(codes.radius(c.radius)) -
                        static_cast<double>(distance_metric(view, glm::vec3(own)));
    const double share = std::clamp(left / ((1 - 1 / error_ratio) * error), 0.0, 1.0);
    return share >= 1 ? own : glm::mix(drawn_corner(atlas, view, pixel_error, c.parent), own, share);
}

using CornerTriangles = std::set<std::array<uint32_t, 3>>;
CornerTriangles corner_triangles(const Cut& cut) {
    CornerTriangles all;
    for (const auto& [mask, list] : cut.parts) {
        for (size_t i = 0; i < list.size(); i += 3) {
            if ((list[i] & LODE_VGI_CORNER) != 0) all.insert({list[i], list[i + 1], list[i + 2]});
        }
    }
    return all;
}

// Corners may be several steps of their ways from where they belong.
TEST(Cuts, LeaveOutNoTriangleOfCornersThatIsSeen) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 20000), 8, 130);
    const Residency residency = partly_resident(atlas, 1, 1);
    const glm::vec3 centre = extent_of(atlas).centre;
    const float size = extent_of(atlas).size;
    Random random(3);
    const auto unit = [&] { return static_cast<float>(random.below(20001)) / 10000 - 1; };
    size_t left_out = 0, seen = 0;
    for (int i = 0; i < 1500; ++i) {
        Camera camera;
        camera.eye = centre + glm::normalize(glm::vec3(unit(), unit(), unit()) + 0.01f) * size * 8.0f;
        camera.target = centre + glm::vec3(unit(), unit(), unit()) * size * 0.5f;
        camera.near_plane = size * 0.1f;
        camera.far_plane = size * 100;
        camera.fov_y = 0.035f;
        const View view = view_of(camera, 320, 180);
        camera.fov_y = 0.7f;
        const View wide = view_of(camera, 320, 180);
        CutRequest request;
        request.views = std::span(&view, 1);
        request.pixel_error = 20 * std::exp2(static_cast<double>(2 * unit()));
        request.cull_back_faces = false;
        PageDemand demand(residency.units());
        const CornerTriangles drawn = corner_triangles(from_scratch(residency, request, demand));
        request.views = std::span(&wide, 1);
        request.level_view = &view;
        for (const auto& triangle : corner_triangles(from_scratch(residency, request, demand))) {
            if (drawn.contains(triangle)) continue;
            ++left_out;
            std::array<glm::dvec3, 3> places;
            for (size_t k = 0; k < 3; ++k)
                places[k] = drawn_corner(atlas, view, request.pixel_error, corner_of(atlas, triangle[k]));
            const Frustum frustum = frustum_of(view);
            seen += std::ranges::none_of(frustum.planes(), [&](const glm::vec4& p) {
                return std::ranges::all_of(places, [&](const glm::dvec3& at) {
                    return glm::dot(glm::dvec3(p), at) + static_cast<double>(p.w) < 1e-6 * static_cast<double>(size);
                });
            });
        }
    }
    EXPECT_GT(left_out, 10000u);
    EXPECT_EQ(seen, 0u);
}

// Corners of the triangles that are drawn, object units.
std::vector<glm::dvec3> drawn_points(const Atlas& atlas, const Residency& residency, Glue& glue, const Cut& cut) {
    std::vector<glm::dvec3> drawn;
    size_t wrong = 0;
    for (const auto& [mask, indices] : cut.parts) {
        for (const uint32_t index : indices) drawn.push_back(atlas.point(vertex_of(residency, glue, index, wrong).id));
    }
    EXPECT_EQ(wrong, 0u);
    return drawn;
}

// Every fourth sample each way of all charts: how far the farthest of them is from what is drawn, object units.
double farthest_sample(const Atlas& atlas, std::span<const glm::dvec3> drawn) {
    double farthest = 0;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        for (uint32_t i = 0; i < 25; ++i) {
            const uint32_t step = atlas.cells_of(c) / 4;
            const glm::dvec3 point = atlas.point(atlas.texel(c, i % 5 * step, i / 5 * step));
            double nearest = 1e300;
            for (size_t t = 0; t + 2 < drawn.size(); t += 3) {
                const glm::dvec3 on = closest_on_triangle(point, drawn[t], drawn[t + 1], drawn[t + 2]);
                nearest = std::min(nearest, glm::distance(point, on));
            }
            farthest = std::max(farthest, nearest);
        }
    }
    return farthest;
}

// How far the farthest point of what is drawn is from a surface, object units; 21 points of each triangle.
double farthest_drawn(const ClosestSurface& surface, std::span<const glm::dvec3> drawn) {
    constexpr int steps = 5;
    double farthest = 0;
    for (size_t t = 0; t + 2 < drawn.size(); t += 3) {
        for (int i = 0; i <= steps; ++i) {
            for (int j = 0; i + j <= steps; ++j) {
                const glm::dvec3 along = drawn[t + 1] - drawn[t], across = drawn[t + 2] - drawn[t];
                const glm::dvec3 point = drawn[t] + along * (double{1} * i / steps) + across * (double{1} * j / steps);
                farthest = std::max(farthest, surface.closest(point).distance);
            }
        }
    }
    return farthest;
}

// All that is there is near to what is drawn, and what is drawn is near to something that is there.
TEST(Cuts, ShowWhatIsFarAwayWithinThePixelError) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 32, 24);
        std::vector<uint32_t> vertices;
        for (size_t t = 0; t < f.mesh.triangle_count(); ++t) {
            for (int k = 0; k < 3; ++k) vertices.push_back(f.mesh.vertex_of(t, k));
        }
        const ClosestSurface surface(f.mesh.positions, vertices);
        const Residency residency = partly_resident(atlas, 1, 1);
        Glue glue(atlas);
        for (const float away : {5.0f, 10.0f, 20.0f, 40.0f, 160.0f}) {
            float focal_px = 0;
            const Cut cut = cut_from_afar(atlas, residency, away, &focal_px);
            if (cut.triangles == 0) continue;
            const double pixel = static_cast<double>(extent_of(atlas).size * (away + 1) / focal_px);
            const std::vector<glm::dvec3> drawn = drawn_points(atlas, residency, glue, cut);
            EXPECT_LT(farthest_sample(atlas, drawn), 1.05 * pixel) << away << ", " << cut.triangles;
            EXPECT_LT(farthest_drawn(surface, drawn), 1.05 * pixel) << away << ", " << cut.triangles;
        }
    }
}

TEST(Cuts, FallApartWhereTheirRulesAreBroken) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64);
    // Errors that are not saturated.
    Atlas broken = atlas;
    Random random(3);
    for (uint32_t c = 0; c < broken.charts(); ++c) {
        for (uint32_t y = 1; y < broken.cells; ++y) {
            for (uint32_t x = 1; x < broken.cells; ++x)
                broken.sample_errors[broken.texel(c, x, y)] = static_cast<uint8_t>(150 + random.next() % 60);
        }
    }
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 16, 5), 0u);
    // Errors that glued samples do not share.
    broken = atlas;
    for (uint32_t c = 0; c < broken.charts(); ++c) {
        for (uint32_t k = 1; k < broken.cells; ++k)
            broken.sample_errors[broken.texel(c, k, 0)] =
                static_cast<uint8_t>(std::max(0, broken.sample_errors[broken.texel(c, k, 0)] - 8 * (c % 2 ? 1 : 3)));
    }
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 16, 5), 0u);
    // Corners that charts do not share.
    broken = atlas;
    for (uint32_t c = 0; c < broken.charts(); c += 3) std::swap(broken.chart_corners[c][0], broken.chart_corners[c][2]);
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 96, 5), 0u);
    // Corners that are not wanted where something of their charts is.
    broken = atlas;
    for (Corner& corner : broken.corners) corner.error = std::min<uint8_t>(corner.error, 150);
    EXPECT_GT(count_bad(Raster::bintree, broken, broken, 16, 5), 0u);
    // Pages that are used although what is next to them is not there.
    broken = atlas;
    broken.sides.assign(broken.sides.size(), GluedSide{});
    EXPECT_GT(count_bad(Raster::bintree, atlas, broken, 16, 5), 0u);
    // Nodes that do not know how coarse their neighbours are.
    EXPECT_GT(count_bad(Raster::grid, atlas, broken, 16, 5), 0u);
}

// Where they come to their places, leaves are left out run by run.
TEST(Cuts, LeaveOutOfLeavesOnlyWhatAViewCannotSee) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 32, 8, true);
    const Residency residency = partly_resident(atlas, 1, 1, 1);
    const auto [centre, size] = extent_of(atlas);
    Random random(29);
    size_t seen = 0, outside = 0, turned_away = 0;
    for (uint32_t i = 0; i < 100; ++i) {
        SCOPED_TRACE(i);
        std::vector<View> views = random_views(atlas, random);
        views[1] = shadow_view({0.3f, -1, 0.2f}, centre, size * 0.3f, 64);
        CutRequest request;
        request.views = views;
        request.forced_level = 0;
        request.forced_leaves = true;
        request.casters_alone = false;
        request.cull_back_faces = i % 4 != 0;
        PageDemand demand(residency.units());
        const Cut cut = from_scratch(residency, request, demand);
        for (uint32_t v = 0; v < views.size(); ++v) {
            std::set<std::array<uint32_t, 3>> drawn;
            for (const auto& [mask, indices] : cut.parts) {
                for (size_t t = 0; t < indices.size() && (mask >> v & 1) != 0; t += 3)
                    EXPECT_TRUE(drawn.insert({indices[t], indices[t + 1], indices[t + 2]}).second);
            }
            const Frustum frustum = frustum_of(views[v]);
            for (uint32_t part = 0; part < residency.topology().leaf_parts(); ++part) {
                const LeafPart& leaf = residency.leaf_part(part).part->part;
                const uint32_t first = LODE_VGI_LEAF | part * LODE_VGI_LEAF_VERTICES;
                std::vector<std::array<glm::vec3, 3>> left_out;
                for (const auto& [a, b, c] : leaf.triangles) {
                    if (drawn.contains({first + a, first + b, first + c})) continue;
                    const auto at = [&](uint8_t n) { return glm::vec3(atlas.leaf_point(leaf.vertices[n].position)); };
                    left_out.push_back({at(a), at(b), at(c)});
                }
                if (left_out.size() < leaf.triangles.size()) seen += leaf.triangles.size() - left_out.size();
                for (const auto& p : left_out) {
                    const bool beyond = is_beyond(frustum, p);
                    const glm::vec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
                    const bool faces_away = glm::dot(normal, views[0].eye - p[0]) <= 0;
                    EXPECT_TRUE(beyond || (v == 0 && request.cull_back_faces && faces_away)) << part;
                    if (left_out.size() == leaf.triangles.size()) continue;
                    ++(beyond ? outside : turned_away);
                }
            }
        }
    }
    // Of parts of which some is drawn.
    EXPECT_GT(seen, 100000u);
    EXPECT_GT(outside, seen / 100);
    EXPECT_GT(turned_away, seen / 100);
}

TEST(Cuts, GoOnFromTheOnesBeforeAndAreAsFromScratch) {
    uint64_t triangles = 0, taken_over = 0;
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 128, 8, true);
        const auto [centre, size] = extent_of(atlas);
        Residency residency = partly_resident(atlas, 0.9, 11, 0.8);
        const ChartTree tree(atlas);
        const auto sound = tree.validate(atlas);
        ASSERT_TRUE(sound) << sound.error().message;
        Random random(23);
        const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
        std::vector<uint32_t> slots(residency.pages());
        for (uint32_t n = 0; n < slots.size(); ++n) slots[n] = n;
        IncrementalCut kept;
        Camera camera;
        glm::vec3 way(0), look(0);
        CutRequest request;
        for (uint32_t i = 0; i < 90; ++i) {
            SCOPED_TRACE(i);
            if (i % 30 == 0) {
                camera.eye = centre + glm::vec3(unit(), unit(), unit()) * size * std::exp2(unit() * 2);
                camera.target = centre + glm::vec3(unit(), unit(), unit()) * size * 0.3f;
                way = glm::vec3(unit(), unit(), unit()) * size * std::exp2(unit() * 4 - 8);
                look = glm::vec3(unit(), unit(), unit()) * size * std::exp2(unit() * 4 - 8);
                request.pixel_error = std::exp2(random.unit() * 4 - 2);
                request.cull_back_faces = i % 60 == 0;
            }
            camera.near_plane = size * 1e-3f;
            camera.far_plane = size * 100;
            camera.eye += way;
            camera.target += look;
            // The instance goes now and then; margins come and go; pages do, and come back elsewhere.
            if (i % 30 >= 10 && i % 30 < 14) {
                request.object_to_world[3] += glm::vec4(way, 0);
                request.object_to_world[0] = {std::cos(0.01f * static_cast<float>(i)), 0,
                                              std::sin(0.01f * static_cast<float>(i)), 0};
            }
            request.margin = i % 7 < 3 ? CutMargin{} : CutMargin{0.5f * glm::length(way), 0.002f, 0.02f};
            request.forced_level = i % 30 == 25 ? 1 : -1;
            if (i % 30 >= 18) {
                for (int k = 0; k < 4; ++k) {
                    const auto number = static_cast<uint32_t>(random.next() % residency.pages());
                    if (number % residency.tree().pages() == 0) continue;
                    const bool was_there = residency.entry(number).texels != nullptr;
                    if (was_there) residency.drop(number);
                    if (was_there && random.next() % 4 == 0) continue;
                    const uint32_t chart = number / residency.tree().pages(), page = number % residency.tree().pages();
                    if (page >= tree_of(atlas, Layer::geometry, chart).pages()) continue;
                    slots[number] += residency.pages();
                    residency.put(number,
                                  std::make_shared<const GeometryPage>(packed_geometry(
                                      read_page(atlas, Layer::geometry, chart, page), residency.tree())),
                                  slots[number]);
                }
                for (int k = 0; k < 4; ++k) {
                    const auto part = static_cast<uint32_t>(random.next() % residency.topology().leaf_parts());
                    if (residency.holds_leaf_part(part)) {
                        residency.drop_leaf_part(part);
                    } else {
                        put_leaf_part(residency, atlas, part, part + 10000 * i);
                    }
                }
                residency.update();
                ASSERT_TRUE(residency.validate());
            }
            const std::array views{view_of(camera, 1280, 720), shadow_view({0.3f, -1, 0.2f}, centre, size * 0.4f, 64)};
            request.views = views;
            PageDemand demand(residency.units()), expected_demand(residency.units());
            const auto charts = tree.seen(Visibility(request, residency.about()), residency.about());
            const Cut made = cut_bintree(residency, request, charts, demand, kept);
            const Cut expected = from_scratch(residency, request, expected_demand);
            ASSERT_EQ(made.parts, expected.parts);
            ASSERT_EQ(made.triangles, expected.triangles);
            ASSERT_EQ(demand.all_touched(), expected_demand.all_touched());
            ASSERT_EQ(asked(demand), asked(expected_demand));
            for (const auto& part : made.parts) triangles += part.second.size() / 3;
            taken_over += kept.taken_over;
        }
    }
    EXPECT_GT(triangles, 100000u);
    EXPECT_GT(taken_over, triangles / 5) << "of " << triangles << ", where pages are missing";
}

// Leaves in their places, all of them there, of which views see some runs.
TEST(Cuts, OfLeavesGoOnFromTheOnesBefore) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 20000), 64, 8, true);
    const auto [centre, size] = extent_of(atlas);
    const Residency residency = partly_resident(atlas, 1, 1, 1);
    std::vector<uint32_t> charts(atlas.charts());
    std::iota(charts.begin(), charts.end(), 0u);
    Random random(31);
    uint64_t arrived = 0, taken_over = 0;
    for (uint32_t flight = 0; flight < 6; ++flight) {
        IncrementalCut kept;
        const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
        Camera camera;
        camera.near_plane = size * 1e-3f;
        camera.far_plane = size * 100;
        camera.eye = centre + glm::vec3(unit(), unit(), 2) * size * 0.4f;
        camera.target = centre + glm::vec3(unit(), unit(), unit()) * size * 0.3f;
        const glm::vec3 way = glm::vec3(unit(), unit(), unit()) * size * std::exp2(unit() * 2 - 10);
        for (uint32_t i = 0; i < 40; ++i) {
            SCOPED_TRACE(testing::Message() << flight << ", " << i);
            camera.eye += way;
            std::vector<View> views{view_of(camera, 1280, 720)};
            if (flight % 2 == 1) views.push_back(shadow_view({0.3f, -1, 0.2f}, centre, size * 0.4f, 64));
            CutRequest request;
            request.views = views;
            request.pixel_error = 0.05;
            PageDemand demand(residency.units()), expected_demand(residency.units());
            const Cut made = cut_bintree(residency, request, charts, demand, kept);
            ASSERT_EQ(made.parts, from_scratch(residency, request, expected_demand).parts);
            for (const auto& [mask, indices] : made.parts) {
                for (const uint32_t index : indices)
                    arrived += (index & (LODE_VGI_CORNER | LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES)) == LODE_VGI_LEAF;
            }
            taken_over += kept.taken_over;
        }
    }
    EXPECT_GT(arrived / 3, 200000u);
    EXPECT_GT(taken_over, arrived / 3 / 10);
}

// Three frames of a camera and an instance that go on and turn, as they do or a little less in the end.
std::array<FrameInput, 3> three_frames(const Atlas& atlas, Random& random, uint32_t i, double pixel_error) {
    const auto [centre, size] = extent_of(atlas);
    FrameInput last, now, next;
    Camera camera;
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    camera.eye = centre + glm::vec3(unit(), unit(), unit()) * size;
    camera.target = centre + glm::vec3(unit(), unit(), unit()) * size * 0.2f;
    const glm::vec3 step = glm::vec3(unit(), unit(), unit()) * size * 0.02f, drift = step * 0.2f;
    const glm::vec3 look = glm::vec3(unit(), unit(), unit()) * size * 0.02f;
    glm::mat4 place(1);
    const glm::vec3 way = glm::vec3(unit(), unit(), unit()) * size * 0.02f;
    const float turn = i % 3 == 0 ? 0 : unit() * 0.05f;
    const auto turned = [](float angle) {
        glm::mat4 m(1);
        m[0] = {std::cos(angle), std::sin(angle), 0, 0};
        m[1] = {-std::sin(angle), std::cos(angle), 0, 0};
        return m;
    };
    for (FrameInput* input : {&last, &now, &next}) {
        // Near and far planes follow, errors are steered.
        camera.near_plane = glm::distance(camera.eye, centre) * 0.01f;
        camera.far_plane = glm::distance(camera.eye, centre) + size;
        input->views = {view_of(camera, 1280, 720)};
        input->views[0].culls_back_faces = i % 2 == 0;
        input->instances = {Instance{}};
        input->instances.edit(0).object_to_world = place;
        input->budget.pixel_error = pixel_error * (last.views.empty() ? 1 : now.views.empty() ? 0.95 : 0.91);
        camera.eye += step + (now.views.empty() ? glm::vec3(0) : drift);
        camera.target += look;
        const float share = now.views.empty() ? 1.0f : 0.9f;
        place = turned(turn * share) * place;
        place[3] += glm::vec4(way * share, 0);
    }
    return {last, now, next};
}

// Vertices that are drawn for a region; those of leaves alike, whether they may move or not.
std::set<uint32_t> drawn_for(const CutRegion& region, const Residency& residency) {
    CutRequest request;
    const auto* moved = region.find_moved(0);
    request.object_to_world = (moved != nullptr ? moved->there : region.instances[0]).object_to_world;
    request.views = region.views;
    request.pixel_error = region.budget.pixel_error;
    request.cull_back_faces = region.views[0].culls_back_faces;
    request.margin = moved != nullptr ? moved->margin : region.margin;
    PageDemand demand(residency.units());
    std::set<uint32_t> drawn;
    for (const auto& [mask, indices] : from_scratch(residency, request, demand).parts) {
        for (const uint32_t index : indices) drawn.insert(is_leaf_vertex(index) ? index & ~LODE_VGI_LEAF_MOVES : index);
    }
    return drawn;
}

// What is drawn for a region of views against what is drawn for one of them.
struct Held {
    size_t held = 0, more = 0;
    void add(const CutRegion& region, const FrameInput& within, const Residency& residency) {
        const auto wide = drawn_for(region, residency), exact = drawn_for(CutRegion::of(within), residency);
        EXPECT_TRUE(std::ranges::includes(wide, exact));
        held += exact.size();
        more += wide.size();
    }
    void expect_more_than(size_t least) const {
        EXPECT_GT(held, least);
        EXPECT_LT(static_cast<double>(more) / static_cast<double>(held), 1.3) << "and not much else";
    }
};

TEST(Cuts, HoldWhateverAViewWithinTheirMarginWants) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64);
    const Residency residency = partly_resident(atlas, 1, 1);
    Random random(17);
    Held held;
    for (uint32_t i = 0; i < 40; ++i) {
        SCOPED_TRACE(i);
        const auto [last, now, next] = three_frames(atlas, random, i, 2);
        const auto region = CutRegion::after(last, now, Foresight::most);
        ASSERT_TRUE(region && region->covers(next)) << i;
        EXPECT_FALSE(CutRegion::of(now).covers(next));
        EXPECT_EQ(CutRegion::after(now, now, Foresight::most), CutRegion::of(now));
        FrameInput grown = now;
        grown.instances.edit(0).object_to_world[0] *= 1.01f;
        EXPECT_FALSE(CutRegion::after(now, grown, Foresight::most));
        EXPECT_FALSE(region->covers(grown));
        held.add(*region, next, residency);
    }
    held.expect_more_than(5000u);
    // What a region does not hold.
    FrameInput input;
    input.views = random_views(atlas, random);
    input.instances = {Instance{}};
    const CutRegion exact = CutRegion::of(input);
    EXPECT_TRUE(exact.covers(input));
    for (const auto& change : std::vector<std::function<void(FrameInput&)>>{
             [](FrameInput& f) { f.instances.push_back(Instance{}); }, [](FrameInput& f) { f.budget.forced_level = 1; },
             [](FrameInput& f) { f.budget.pixel_error *= 0.9; }, [](FrameInput& f) { f.budget.pixel_error *= 3; },
             [](FrameInput& f) { f.budget.max_triangles = 10; }, [](FrameInput& f) { f.views[0].eye.x += 1e-3f; },
             [](FrameInput& f) { f.views.pop_back(); }, [](FrameInput& f) { f.level_view = f.views[0]; }}) {
        FrameInput other = input;
        change(other);
        EXPECT_FALSE(exact.covers(other));
    }
}

// So near that leaves are drawn wherever something is seen.
TEST(Cuts, OfLeavesHoldWhateverAViewWithinTheirMarginSees) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64, 8, true);
    const Residency residency = partly_resident(atlas, 1, 1, 1);
    Random random(17);
    Held held;
    for (uint32_t i = 0; i < 40; ++i) {
        SCOPED_TRACE(i);
        const auto [last, now, next] = three_frames(atlas, random, i, 0.01);
        const auto region = CutRegion::after(last, now, Foresight::most);
        ASSERT_TRUE(region && region->covers(next)) << i;
        held.add(*region, next, residency);
    }
    held.expect_more_than(50000u);
}

// What instances share that are no nearer than a distance (shared_cuts.h).
TEST(Cuts, ForADistanceFitTogetherAndHoldWhateverIsNoNearerWants) {
    size_t triangles = 0, held = 0, more = 0;
    for (const bool leaves : {false, true}) {
        for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
            SCOPED_TRACE(f.name);
            const Atlas atlas = small_atlas(f.mesh, 64, 8, leaves);
            const Sphere around = ChartTree(atlas).sphere();
            Glue glue(atlas);
            Random random(7);
            const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
            for (uint32_t i = 0; i < 12; ++i) {
                const Residency residency = partly_resident(atlas, i % 4 == 0 ? 1 : 0.7 + 0.3 * random.unit(), mix64(i),
                                                            leaves ? 0.5 + random.unit() / 2 : 0);
                Camera camera;
                const glm::vec3 way = glm::normalize(glm::vec3(unit(), unit(), unit()) + 1e-3f);
                camera.eye = around.centre + way * around.radius * std::exp2(unit() * 2 + 3);
                camera.target = around.centre + glm::vec3(unit(), unit(), unit()) * around.radius;
                const View view = view_of(camera, 1280, 720);
                const auto nearest = static_cast<float>(InstanceDistance(view, {}).nearest(glm::mat4(1), around));
                ASSERT_GT(nearest, 0);
                CutRequest request;
                request.views = std::span(&view, 1);
                request.pixel_error = std::exp2(random.unit() * 5 - 2);
                request.distance = nearest * (1 - 0.08f * static_cast<float>(random.unit()));
                PageDemand demand(residency.units());
                const Cut shared = from_scratch(residency, request, demand);
                ASSERT_EQ(shared.parts.size(), 1u);
                const std::vector<uint32_t>& wide = shared.parts[0].second;
                triangles += wide.size() / 3;
                EXPECT_EQ(bad_edges(residency, glue, wide), 0u) << i;
                if (leaves) continue;
                // Of samples; corners have other numbers where they are shared.
                const auto samples_of = [](const Cut& cut) {
                    std::set<uint32_t> samples;
                    for (const auto& part : cut.parts) {
                        std::ranges::copy_if(part.second, std::inserter(samples, samples.end()),
                                             [](uint32_t index) { return (index & LODE_VGI_CORNER) == 0; });
                    }
                    return samples;
                };
                request.distance = std::nullopt;
                request.cull_back_faces = false;
                const auto all = samples_of(shared), own = samples_of(from_scratch(residency, request, demand));
                EXPECT_TRUE(std::ranges::includes(all, own)) << i;
                held += own.size();
                more += all.size();
            }
        }
    }
    EXPECT_GT(triangles, 100000u);
    EXPECT_GT(held, 20000u);
    EXPECT_LT(static_cast<double>(more) / static_cast<double>(held), 2) << "and not much else";
}

// While pages come and go.
TEST(Cuts, ForADistanceGoOnFromTheOnesBefore) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 128, 8, true);
    Residency residency = partly_resident(atlas, 0.95, 3, 0.5);
    Random random(9);
    const View view = random_views(atlas, random)[0];
    CutRequest request;
    request.views = std::span(&view, 1);
    request.distance = extent_of(atlas).size * 0.4f;
    request.pixel_error = 0.5;
    SharedCut shared;
    const BintreeCutter cutter;
    PageDemand demand(residency.units());
    EXPECT_FALSE(shared.is_good(residency, 1));
    size_t changes = 0;
    uint64_t taken_over = 0, triangles = 0;
    std::vector<uint32_t> before;
    for (uint32_t i = 0; i < 40; ++i) {
        SCOPED_TRACE(i);
        shared.make(cutter, residency, request, 1, demand);
        EXPECT_TRUE(shared.is_good(residency, 1));
        EXPECT_FALSE(shared.is_good(residency, 2));
        demand.clear();
        shared.add_to(demand, true);
        taken_over += shared.taken_over();
        PageDemand from_nothing(residency.units());
        const Cut cut = from_scratch(residency, request, from_nothing);
        ASSERT_EQ(shared.words().size(), cut.parts[0].second.size());
        std::vector<uint32_t> in_order(shared.words().size());
        TrianglesByKind by_kind(cut.parts[0].second, residency.tree().cells_per_page());
        for (size_t c = 0; c < by_kind.chunks(); ++c) by_kind.look_at(c);
        const auto runs = by_kind.runs();
        for (size_t c = 0; c < by_kind.chunks(); ++c) by_kind.copy(c, in_order.data());
        EXPECT_EQ(shared.words(), in_order);
        EXPECT_TRUE(std::ranges::equal(shared.runs(), runs, [](const auto& a, const auto& b) {
            return a.kinds == b.kinds && a.words == b.words;
        }));
        EXPECT_EQ(demand.all_touched(), from_nothing.all_touched());
        EXPECT_EQ(asked(demand), asked(from_nothing));
        demand.clear();
        changes += shared.words() != before;
        before = shared.words();
        triangles += before.size() / 3;
        for (int k = 0; k < 3; ++k) {
            const auto number = static_cast<uint32_t>(random.next() % residency.pages());
            const uint32_t chart = number / residency.tree().pages(), page = number % residency.tree().pages();
            if (page == 0 || page >= tree_of(atlas, Layer::geometry, chart).pages()) continue;
            if (residency.holds(number)) {
                residency.drop(number);
            } else {
                residency.put(number,
                              std::make_shared<const GeometryPage>(
                                  packed_geometry(read_page(atlas, Layer::geometry, chart, page), residency.tree())),
                              number);
            }
        }
        residency.update();
        EXPECT_FALSE(shared.is_good(residency, 1));
    }
    EXPECT_GT(changes, 20u);
    std::printf("%.2f of the triangles are taken over\n",
                static_cast<double>(taken_over) / static_cast<double>(triangles));
    EXPECT_GT(4 * taken_over, triangles);
}

TEST(Cuts, CountDepthInThePictureAndNoLessThanIsFarAsideAndNoFasterThanPointsMove) {
    Random random(4);
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    for (const float fov : {0.3f, 0.785f, 1.6f, 2.6f}) {
        Camera camera;
        camera.eye = {1, 2, 3};
        camera.target = {unit(), unit(), unit()};
        camera.fov_y = fov;
        const View view = view_of(camera, 1280, 720);
        const float corner = std::acos(view.corner_cosine());
        const float cosine = std::cos(2 * corner), sine = std::sin(2 * corner);
        int inside = 0, beyond = 0;
        for (int i = 0; i < 2000; ++i) {
            const glm::vec3 p = camera.eye + 5.0f * glm::vec3(unit(), unit(), unit()), seen = p - camera.eye;
            const float depth = glm::dot(seen, view.forward()), away = glm::length(seen),
                        counted = distance_metric(view, p), angle = std::acos(depth / away);
            if (angle < corner) { EXPECT_NEAR(counted, depth, 1e-4f); }
            if (angle > 2 * corner) { EXPECT_NEAR(counted, away, 1e-4f); }
            inside += angle < corner;
            beyond += angle > 2 * corner;
            EXPECT_GE(counted, std::max(depth, away * view.corner_cosine()) - 1e-4f);
            EXPECT_LE(counted, away + 1e-4f);
            const glm::vec3 q = p + unit() * glm::vec3(unit(), unit(), unit());
            EXPECT_LE(std::abs(distance_metric(view, q) - counted), glm::distance(p, q) * 1.0001f + 1e-4f);
            // As cuts have it.
            for (const float reach : {counted * 0.999f - 1e-4f, counted * 1.001f + 1e-4f}) {
                const glm::vec3 local = glm::mat3(view.world_to_view) * seen;
                EXPECT_EQ(gpu::lode_metric_within(reach, local.x, local.y, -local.z, 1, cosine, sine * sine),
                          reach > counted);
            }
        }
        EXPECT_GT(inside, 5);
        EXPECT_GT(beyond, fov < 1.7f ? 100 : 0);
    }
}

TEST_P(ErrorCuts, LeaveOutNoSampleThatCostsMoreThanThePixelError) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64);
    const Residency residency = partly_resident(atlas, 1, 1);
    const ErrorCodes codes(atlas.extent());
    Random random(7);
    for (uint32_t i = 0; i < 20; ++i) {
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        PageDemand demand(residency.units());
        std::set<std::tuple<uint32_t, uint32_t, uint32_t>> there;
        for (const uint32_t index : all_triangles(cut(residency, request, demand))) {
            const Sample s = sample_of(residency, index);
            there.insert({s.chart, s.x, s.y});
        }
        const double focal = static_cast<double>(views[0].focal_px);
        for (uint32_t c = 0; c < atlas.charts(); ++c) {
            for (uint32_t y = 0; y <= atlas.cells; ++y) {
                for (uint32_t x = 0; x <= atlas.cells; ++x) {
                    const size_t t = atlas.texel(c, x, y);
                    // Errors in the picture are as large as its depth makes them.
                    const glm::vec4 clip = views[0].world_to_clip() * glm::vec4(atlas.position(t), 1);
                    const bool seen = clip.w > 0 && std::abs(clip.x) < clip.w && std::abs(clip.y) < clip.w;
                    const double away =
                        seen ? static_cast<double>(clip.w) : glm::length(atlas.point(t) - glm::dvec3(views[0].eye));
                    const double error = static_cast<double>(codes.error(atlas.sample_errors[t]));
                    if (error * focal > 1.001 * away) {
                        ASSERT_TRUE(there.contains({c, x, y})) << c << " " << x << " " << y;
                    }
                }
            }
        }
    }
}

TEST(Cuts, DrawAForcedLevelOfAnyDepthsAsTheAtlasHasIt) {
    const Atlas atlas = uneven_atlas(60);
    const Residency residency = partly_resident(atlas, 1, 1);
    Random random(11);
    const auto views = random_views(atlas, random);
    Glue glue(atlas);
    for (uint32_t level = 0; level < atlas.levels(); ++level) {
        CutRequest request;
        request.views = views;
        request.forced_level = level;
        PageDemand demand(residency.units());
        const auto all = all_triangles(from_scratch(residency, request, demand));
        EXPECT_EQ(all.size() / 3, atlas.triangles_at(level));
        EXPECT_EQ(bad_edges(residency, glue, all), 0u);
    }
}

TEST_P(Cuts, DrawAForcedLevelAsTheAtlasHasIt) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 64);
        const Residency residency = partly_resident(atlas, 1, 1);
        Random random(11);
        const auto views = random_views(atlas, random);
        for (uint32_t level = 0; level < atlas.levels(); ++level) {
            CutRequest request;
            request.views = views;
            request.forced_level = level;
            PageDemand demand(residency.units());
            EXPECT_EQ(all_triangles(cut(residency, request, demand)).size() / 3, atlas.triangles_at(level));
        }
    }
}

// Whatever a tree of charts leaves out, no view sees.
TEST(ChartTree, FindsTheChartsThatAreSeen) {
    for (const TriMesh& mesh : {fixtures::repaired(Shape::rock, 6000), fixtures::grid_with_debris()}) {
        const Atlas atlas = small_atlas(mesh, 32, 24);
        const ChartTree tree(atlas);
        ASSERT_TRUE(tree.validate(atlas));
        const uint32_t per_chart = tree_of(atlas, Layer::geometry).pages();
        Random random(3);
        size_t found = 0, left_out = 0;
        for (int i = 0; i < 200; ++i) {
            auto views = random_views(atlas, random);
            if (i % 2 == 0) views.pop_back();  // else the shadow view sees all
            CutRequest request;
            request.views = views;
            request.cull_back_faces = i % 3 != 0;
            if (i % 5 == 0) request.margin = {extent_of(atlas).size * 0.1f, 0.05f, 0.1f};
            const Visibility visibility(request, atlas);
            std::vector<uint32_t> expected;
            for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
                if (visibility.seen(visibility.all(), chart * per_chart) != 0) expected.push_back(chart);
            }
            ASSERT_EQ(tree.seen(visibility, atlas), expected) << i;
            found += expected.size();
            left_out += atlas.charts() - expected.size();
        }
        EXPECT_GT(found, 1000u);
        EXPECT_GT(left_out, 1000u);
    }
}

TEST_P(Cuts, AreTheSameForAnyNumberOfThreadsAndAskForWhatIsMissing) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 128);
    Random random(13);
    for (uint32_t i = 0; i < 10; ++i) {
        const Residency residency = partly_resident(atlas, 0.5, i);
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        request.pixel_error = 0.25;
        set_thread_count(1);
        PageDemand one(residency.units()), many(residency.units());
        const Cut a = cut(residency, request, one);
        set_thread_count(8);
        const Cut b = cut(residency, request, many);
        set_thread_count(0);
        EXPECT_EQ(a.parts, b.parts);
        EXPECT_EQ(one.all_touched(), many.all_touched());
        EXPECT_EQ(asked(one), asked(many));
        for (const uint32_t number : one.all_asked()) EXPECT_FALSE(residency.holds(number));
    }
}

TEST_P(Cuts, GetWhatTheyAskForUntilNothingIsMissing) {
    // Whatever is asked for comes: in the end the cut is the one with every page there.
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::torus, 3000), 128);
    const Residency all = partly_resident(atlas, 1, 1);
    Random random(17);
    for (uint32_t i = 0; i < 6; ++i) {
        Residency some = partly_resident(atlas, 0, 1);
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        request.pixel_error = 0.5;
        PageDemand unused(all.units());
        const Cut wanted = cut(all, request, unused);
        uint32_t rounds = 0;
        for (;; ++rounds) {
            PageDemand demand(some.units());
            const Cut now = cut(some, request, demand);
            bool missing = false;
            for (const uint32_t number : demand.all_asked()) {
                missing = true;
                some.put(number, all.entry(number).texels, number);
            }
            some.update();
            if (missing) continue;
            EXPECT_EQ(now.parts, wanted.parts);
            break;
        }
        EXPECT_LE(rounds, 12u);
    }
}

bool is_half_a_square(const Sample (&s)[3]) {
    const auto [low_x, high_x] = std::minmax({s[0].x, s[1].x, s[2].x});
    const auto [low_y, high_y] = std::minmax({s[0].y, s[1].y, s[2].y});
    uint32_t corners = 0;
    for (const Sample& one : s) corners += (one.x == low_x || one.x == high_x) && (one.y == low_y || one.y == high_y);
    return corners == 3 && high_x - low_x == high_y - low_y;
}

TEST_P(Cuts, CullOnlyWhatAViewCannotSee) {
    // Every triangle that faces the camera inside its frustum is in the camera's parts.
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64);
    const Residency residency = partly_resident(atlas, 1, 1);
    Random random(19);
    size_t culled = 0;
    for (uint32_t i = 0; i < 30; ++i) {
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        PageDemand demand(residency.units());
        const Frustum frustum = frustum_of(views[0]);
        for (const auto& [mask, indices] : cut(residency, request, demand).parts) {
            if ((mask & 1) != 0) continue;
            for (size_t t = 0; t < indices.size(); t += 3) {
                std::array<glm::vec3, 3> p;
                Sample s[3];
                for (size_t k = 0; k < 3; ++k) {
                    s[k] = sample_of(residency, indices[t + k]);
                    p[k] = atlas.position(atlas.texel(s[k].chart, s[k].x, s[k].y));
                }
                ++culled;
                // Cones know nothing of what is collapsed: that may be left out, where it costs less than the error.
                if (GetParam() != Raster::bintree && !is_half_a_square(s)) continue;
                const glm::vec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
                if (glm::dot(normal, views[0].eye - p[0]) <= 0) continue;
                // Spheres are looser than triangles, never tighter.
                EXPECT_TRUE(is_beyond(frustum, p)) << i << " " << t;
            }
        }
    }
    EXPECT_GT(culled, 1000u);
}

TEST(GridCut, ByAreaHasNoCellWiderThanItMayBe) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 128);
    const Residency residency = partly_resident(atlas, 1, 1);
    Random random(29);
    size_t nodes = 0;
    for (uint32_t i = 0; i < 20; ++i) {
        const auto views = random_views(atlas, random);
        CutRequest request;
        request.views = views;
        request.pixel_error = std::exp2(random.unit() * 3 - 1);
        PageDemand demand(residency.units());
        const Cut cut = cut_grid(residency, request, demand, GridOutput::patches, GridRule::by_area);
        double widest = 0;
        for (const auto& [mask, words] : cut.parts) {
            if ((mask & 1) == 0) continue;
            for (size_t at = 0; at < words.size(); at += LODE_VGI_PATCH_WORDS) {
                const GridPatch patch = GridPatch::of_words(std::span(words).subspan(at, LODE_VGI_PATCH_WORDS));
                const uint32_t slot = patch.slots[0], size = patch.cells() << patch.level;
                const uint32_t chart = slot / residency.tree().pages();
                ++nodes;
                if (patch.level == 0) continue;  // nothing is finer
                // As wide as its corners are apart: less than the bound.
                const auto corner = [&](uint32_t dx, uint32_t dy) {
                    return atlas.point(atlas.texel(chart, patch.x + dx * size, patch.y + dy * size));
                };
                const double away = glm::length(0.5 * (corner(0, 0) + corner(1, 1)) - glm::dvec3(views[0].eye));
                widest = std::max(widest, glm::length(corner(1, 0) - corner(0, 0)) *
                                              static_cast<double>(views[0].focal_px) / away / patch.cells());
            }
        }
        EXPECT_LT(widest, pixels_per_cell * request.pixel_error) << i;
    }
    EXPECT_GT(nodes, 1000u);
}

TEST(GridCut, SaysTheSameAsPatchesAndAsTriangles) {
    for (const uint32_t cells : {4u, 16u, 128u}) {
        const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), cells);
        Random random(23);
        size_t patches = 0, smaller = 0;
        for (uint32_t i = 0; i < 12; ++i) {
            const Residency residency = partly_resident(atlas, i % 2 == 0 ? 1 : random.unit(), i);
            const auto views = random_views(atlas, random);
            CutRequest request;
            request.views = views;
            request.pixel_error = std::exp2(random.unit() * 6 - 1);
            PageDemand demand(residency.units()), again(residency.units());
            const Cut triangles = cut_grid(residency, request, demand, GridOutput::indices);
            const Cut nodes = cut_grid(residency, request, again, GridOutput::patches);
            EXPECT_EQ(triangles.triangles, nodes.triangles);
            EXPECT_EQ(demand.all_touched(), again.all_touched());
            ASSERT_EQ(triangles.parts.size(), nodes.parts.size());
            uint64_t counted = 0;
            for (size_t part = 0; part < nodes.parts.size(); ++part) {
                const auto& [mask, words] = nodes.parts[part];
                EXPECT_EQ(mask, triangles.parts[part].first);
                std::vector<uint32_t> indices;
                for (size_t w = 0; w < words.size(); w += LODE_VGI_PATCH_WORDS) {
                    const GridPatch patch = GridPatch::of_words(std::span(words).subspan(w));
                    const size_t before = indices.size();
                    patch.append_indices(atlas.cells, residency.tree().cells_per_page(), indices);
                    EXPECT_EQ(patch.triangles() * 3, indices.size() - before);
                    ++patches;
                    smaller += patch.cells() < 8;
                }
                EXPECT_EQ(indices, triangles.parts[part].second);
                if ((mask & 1) != 0) counted += indices.size() / 3;
            }
            EXPECT_EQ(counted, triangles.triangles);
        }
        EXPECT_GT(patches, 300u);
        EXPECT_GT(smaller, 0u);
    }
}

}  // namespace
}  // namespace lodestone::vgi
