#include "vgi/draw/vgi_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "frame/screen_error.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/cut/bintree_cut.h"
#include "vgi/draw/pulled_vertex.h"
#include "vgi/extract/extract.h"
#include "vgi/study/patch_indices.h"

namespace lodestone::vgi {
namespace {

// How far away a flight begins and ends, and what it flies to: the first instance counts.
struct Approach {
    float from = 3.4f, to = 3.3f;
    std::vector<Instance> instances = {Instance{}};
};

class VgiSourceTest : public testing::Test {
protected:
    static void SetUpTestSuite() {
        path_ = path_of("rock");
        mesh_ = generate(Shape::rock, 20000, 3);
        ASSERT_TRUE(repair(mesh_));
        bake(mesh_, path_);
    }
    static void TearDownTestSuite() { std::filesystem::remove(path_); }

    static std::filesystem::path path_of(const std::string& name) {
        return std::filesystem::temp_directory_path() /
               ("lodestone-vgi-" + name + "-" + std::to_string(getpid()) + ".lode");
    }
    static void bake(const TriMesh& mesh, const std::filesystem::path& path, bool leaves = true) {
        AtlasOptions options;
        options.leaves = leaves;
        options.clusters.clusters = 12;
        bake(mesh, path, options);
    }
    static void bake(const TriMesh& mesh, const std::filesystem::path& path, AtlasOptions options) {
        options.error_samples = 1000;
        AtlasReport report;
        const auto atlas = make_atlas(mesh, options, report);
        ASSERT_TRUE(atlas);
        auto writer = ChunkWriter::create(path, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(write_chunks(*atlas, *writer));
        ASSERT_TRUE(writer->commit());
    }
    static std::shared_ptr<const AtlasFile> atlas(const std::filesystem::path& path = path_) {
        const auto file = ChunkFile::open(path);
        EXPECT_TRUE(file);
        auto opened = AtlasFile::open(*file);
        EXPECT_TRUE(opened) << opened.error().message;
        return std::make_shared<const AtlasFile>(std::move(*opened));
    }
    static std::unique_ptr<FrameSource> source(uint64_t bytes = uint64_t{1} << 28) {
        auto opened = open_vgi({atlas()}, {bytes, 3, Raster::bintree, true});
        EXPECT_TRUE(opened) << opened.error().message;
        return opened ? std::move(*opened) : nullptr;
    }
    static Arrival answer(const PageRequest& request) {
        static const auto file = atlas();
        return answer(request, *file);
    }
    static Arrival answer(const PageRequest& request, const AtlasFile& file) {
        std::vector<std::byte> part(request.bytes);
        EXPECT_TRUE(file.file().read_part(request.chunk, request.offset, part));
        return {request.id, Blob(std::move(part))};
    }
    static FrameInput look_from(const glm::vec3& eye, uint64_t frame) {
        Camera camera;
        camera.eye = eye;
        camera.target = {0, 0, 0};
        FrameInput input;
        input.views = {view_of(camera, 640, 360), shadow_view({0.2f, -1, 0.1f}, {0, 0, 0}, 2, 256)};
        input.views[0].culls_back_faces = true;
        input.instances = {Instance{}};
        input.frame = frame;
        input.completed_frame = frame > 1 ? frame - 1 : 0;
        return input;
    }
    static double figure(const Plan& plan, const std::string& name) {
        for (const auto& [key, value] : plan.stats.more) {
            if (key == name) return value;
        }
        ADD_FAILURE() << name;
        return 0;
    }

    using Position = decltype(PlanMirror::Puller::position);
    // Flies towards it and calls each(mirror, input) for frames that have all they ask for.
    template <class Each>
    static void fly(const AtlasFile& file, const Position& position, Each&& each, const Approach& flight = {}) {
        auto vgi = open_vgi({std::make_shared<const AtlasFile>(file)}, {uint64_t{1} << 28, 3});
        ASSERT_TRUE(vgi);
        PlanMirror mirror((*vgi)->recipe(), {position, patch_indices});
        std::vector<Arrival> arrivals;
        uint64_t frame = 0;
        for (float distance = flight.from; distance > flight.to; distance *= 0.998f) {
            FrameInput input;
            for (int quiet = 0; quiet < 3; ++frame) {
                input = look_from(glm::vec3(0.3f, 0.2f, 1) * distance, frame);
                input.views[0].culls_back_faces = false;  // all of it, all the time
                input.instances = flight.instances;
                input.arrivals = std::move(arrivals);
                arrivals.clear();
                const Plan plan = (*vgi)->plan(input);
                ASSERT_TRUE(mirror.execute(plan, input));
                for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r, file));
                quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
            }
            each(mirror, input);
        }
    }
    static double pixels(double length, const glm::vec3& at, const View& view) {
        return length * static_cast<double>(view.focal_px) / static_cast<double>(glm::distance(at, view.eye));
    }
    // All that is drawn, each corner of a triangle for itself.
    struct Drawn {
        std::vector<glm::vec3> corners;
        std::vector<uint32_t> indices;
        explicit Drawn(const PlanMirror& mirror) {
            for (const auto& triangle : mirror.triangles_of(0))
                corners.insert(corners.end(), triangle.begin(), triangle.end());
            indices.resize(corners.size());
            std::iota(indices.begin(), indices.end(), 0u);
        }
    };
    // How many pixels what is drawn moves at most from frame to frame.
    static double farthest_motion(const AtlasFile& file, const Approach& flight = {}) {
        std::vector<glm::vec3> last;
        double largest = 0;
        fly(
            file, pulled_vertex,
            [&](const PlanMirror& mirror, const FrameInput& input) {
                Drawn now(mirror);
                if (!last.empty()) {
                    const ClosestSurface surface(now.corners, now.indices);
                    for (size_t i = 0; i < last.size(); i += 3) {
                        const double moved = surface.closest(glm::dvec3(last[i])).distance;
                        largest = std::max(largest, pixels(moved, last[i], input.views[0]));
                    }
                }
                last = std::move(now.corners);
            },
            flight);
        return largest;
    }
    // Of vertices of leaves, in pixels from frame to frame: how far those that stay move at most; how far those that
    // appear are from what was drawn before.
    struct LeafMotion {
        double farthest = 0, rms_of_new = 0;
        size_t stay = 0, appear = 0, far = 0;  // far: more than 0.35 from it
    };
    static LeafMotion leaf_motion(const AtlasFile& file, const Position& position) {
        LeafMotion motion;
        std::map<uint32_t, glm::vec3> last;
        std::optional<Drawn> surface;
        fly(file, position, [&](const PlanMirror& mirror, const FrameInput& input) {
            std::map<uint32_t, glm::vec3> now;
            for (const auto& draw : mirror.draws()) {
                for (const uint32_t index : mirror.is_shown(draw) ? draw.indices : std::span<const uint32_t>()) {
                    if ((index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0)
                        now[index & ~LODE_VGI_LEAF_MOVES] = position(mirror, draw.draw, input, 0, index);
                }
            }
            if (surface) {
                const ClosestSurface before(surface->corners, surface->indices);
                for (const auto& [index, at] : now) {
                    const auto was = last.find(index);
                    if (was != last.end()) {
                        ++motion.stay;
                        motion.farthest =
                            std::max(motion.farthest, pixels(glm::distance(at, was->second), at, input.views[0]));
                        continue;
                    }
                    const double off = pixels(before.closest(glm::dvec3(at)).distance, at, input.views[0]);
                    ++motion.appear;
                    motion.rms_of_new += off * off;
                    motion.far += off > 0.35;
                }
            }
            last = std::move(now);
            surface.emplace(mirror);
        });
        motion.rms_of_new = std::sqrt(motion.rms_of_new / static_cast<double>(std::max<size_t>(motion.appear, 1)));
        return motion;
    }

    static std::filesystem::path path_;
    static TriMesh mesh_;
    std::set<uint64_t> outstanding_;  // ids that were asked for
};
std::filesystem::path VgiSourceTest::path_;
TriMesh VgiSourceTest::mesh_;

TEST_F(VgiSourceTest, DrawsFromTheFirstFrameAndGetsFinerAsPagesArrive) {
    const auto vgi = source();
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    std::vector<Arrival> arrivals;
    uint64_t before = 0;
    int quiet = 0;
    for (uint64_t frame = 0; frame < 60; ++frame) {
        FrameInput input = look_from({0.4f, 0.5f, 1.6f}, frame);
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        const auto valid = vgi->validate();
        ASSERT_TRUE(valid) << valid.error().message;
        EXPECT_GT(plan.stats.triangles, 1000u);
        // Leaves have fewer triangles than the samples they are drawn in place of.
        if (figure(plan, "leaf_parts_resident") == 0) {
            EXPECT_GE(plan.stats.triangles, before);
            before = plan.stats.triangles;
        }
        for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
        quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
        if (quiet == 3) {
            EXPECT_EQ(figure(plan, "pages_missing"), 0);
            EXPECT_EQ(figure(plan, "leaf_parts_missing"), 0);
            EXPECT_EQ(plan.stats.uploaded_bytes, 0u) << "nothing changes any more";
            // What is drawn lies on the surface.
            const auto triangles = mirror.triangles_of(0);
            EXPECT_EQ(triangles.size(), plan.stats.triangles);
            std::vector<uint32_t> indices;
            for (size_t t = 0; t < mesh_.triangle_count(); ++t)
                for (int k = 0; k < 3; ++k) indices.push_back(mesh_.vertex_of(t, k));
            const ClosestSurface surface(mesh_.positions, indices);
            const auto focal = static_cast<double>(input.views[0].focal_px);
            for (size_t t = 0; t < triangles.size(); t += 11) {
                for (const glm::vec3& p : triangles[t]) {
                    const double away = glm::distance(p, input.views[0].eye);
                    EXPECT_LT(surface.closest(glm::dvec3(p)).distance * focal / away, 1.5);
                }
            }
            EXPECT_GT(figure(plan, "leaf_parts_resident"), 0);
            return;
        }
    }
    FAIL() << "pages never stop being asked for";
}

TEST_F(VgiSourceTest, AsksForNoPageThatAtlasesLeaveOut) {
    const auto path = path_of("debris");
    bake(fixtures::grid_with_debris(), path);
    const auto file = atlas(path);
    std::filesystem::remove(path);
    ASSERT_GT(std::ranges::count(file->about().trimmed_levels, 2), 0);
    auto opened = open_vgi({file}, {uint64_t{1} << 28, 3});
    ASSERT_TRUE(opened) << opened.error().message;
    std::vector<Arrival> arrivals;
    for (uint64_t frame = 0, quiet = 0; frame < 200; ++frame) {
        FrameInput input = look_from({0.4f, 0.8f, 1.6f}, frame);
        input.budget.forced_level = 1;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = (*opened)->plan(input);
        for (const PageRequest& r : plan.requests) {
            ASSERT_GT(r.bytes, 0u);
            arrivals.push_back(answer(r, *file));
        }
        quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
        if (quiet < 3) continue;
        EXPECT_EQ(figure(plan, "pages_missing"), 0);
        EXPECT_EQ(figure(plan, "pages_failed"), 0);
        EXPECT_GT(plan.stats.triangles, 2 * file->about().triangles_at(1) / 3) << "but for what no view shows";
        return;
    }
    FAIL() << "pages never stop being asked for";
}

// Pages without samples of their own take nothing to read, and leaves in their squares are drawn as any.
TEST_F(VgiSourceTest, ReadsNothingOfPagesThatAreNotSampled) {
    const auto path = path_of("uneven");
    AtlasOptions options;
    options.leaves = true;
    options.clusters.clusters = 4;
    options.samples_per_triangle = 0.75;
    bake(fixtures::uneven_rock(), path, options);
    const auto file = atlas(path);
    std::filesystem::remove(path);
    const Atlas& about = file->about();
    size_t empty = 0;
    for (uint32_t c = 0; c < about.charts(); ++c) {
        const PageTree tree = tree_of(about, Layer::geometry, c);
        for (uint32_t f = 0; f < tree.families(); ++f) empty += !tree.has_samples(f);
    }
    ASSERT_GT(empty, 0u);
    auto opened = open_vgi({file}, {uint64_t{1} << 28, 3});
    ASSERT_TRUE(opened) << opened.error().message;
    std::vector<Arrival> arrivals;
    Plan plan;
    for (uint64_t frame = 0; frame < 100; ++frame) {
        FrameInput input = look_from({0.4f, 0.8f, 3.6f}, frame);
        input.views[0].culls_back_faces = false;
        input.budget.forced_level = 0;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        plan = (*opened)->plan(input);
        for (const PageRequest& r : plan.requests) {
            ASSERT_GT(r.bytes, 0u);
            arrivals.push_back(answer(r, *file));
        }
    }
    EXPECT_EQ(figure(plan, "pages_missing"), 0);
    EXPECT_EQ(figure(plan, "pages_failed"), 0);
    EXPECT_EQ(figure(plan, "leaf_parts_missing"), 0);
    EXPECT_EQ(plan.stats.triangles, *file->leaf_triangles());
}

TEST_F(VgiSourceTest, AnswersEqualInputsWithEqualPlans) {
    const auto a = source(), b = source();
    std::vector<Arrival> arrivals;
    Random random(5);
    for (uint64_t frame = 0; frame < 40; ++frame) {
        const float angle = 0.1f * static_cast<float>(frame);
        FrameInput input = look_from(glm::vec3(std::sin(angle), 0.3f, std::cos(angle)) * 1.7f, frame);
        input.budget.upload_bytes = 200000;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan p = a->plan(input), q = b->plan(input);
        ASSERT_EQ(hash_of_plan(p), hash_of_plan(q)) << frame;
        ASSERT_EQ(p, q);
        if (frame > 0) { EXPECT_LE(p.stats.uploaded_bytes, 200000u + p.stats.triangles * 200 + 100000); }
        for (const PageRequest& r : p.requests) {
            if (random.unit() < 0.8) arrivals.push_back(answer(r));
        }
    }
}

TEST_F(VgiSourceTest, GetsCoarserAndNeverBreaksWithRoomForFewPagesAndPagesThatFail) {
    const auto about = atlas();
    const uint64_t base_bytes = uint64_t{about->about().charts()} * 2 * 8720;
    EXPECT_THAT(open_vgi({atlas()}, {base_bytes / 2, 1}).error().message, testing::HasSubstr("raise the budget"));
    const auto vgi = source(base_bytes * 2);
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    Random random(9);
    std::vector<Arrival> arrivals;
    double evicted = 0, failed = 0;
    for (uint64_t frame = 0; frame < 200; ++frame) {
        const float angle = 0.05f * static_cast<float>(frame);
        FrameInput input =
            look_from(glm::vec3(std::sin(angle), 0.3f, std::cos(angle)) * (1.3f + 0.3f * std::sin(angle * 3)), frame);
        input.budget.pixel_error = 0.5;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        const auto valid = vgi->validate();
        ASSERT_TRUE(valid) << valid.error().message;
        EXPECT_LE(plan.stats.resident_bytes, base_bytes * 2);
        EXPECT_GT(plan.stats.triangles, 500u);
        EXPECT_LE(plan.requests.size(), 128u);
        evicted += figure(plan, "pages_evicted");
        failed = figure(plan, "pages_failed");
        for (const PageRequest& r : plan.requests) {
            Arrival arrival = answer(r);
            if (const double luck = random.unit(); luck < 0.05) {
                arrival.blob = {};
            } else if (luck < 0.1) {
                arrival.blob = Blob(std::vector<std::byte>(100, std::byte{7}));
            } else if (luck < 0.15) {
                continue;  // lost
            }
            arrivals.push_back(arrival);
        }
    }
    EXPECT_GT(evicted, 0);
    EXPECT_GT(failed, 0);
}

// Leaves of several parts each, of which not all fit: what comes must not push out what came for another.
TEST_F(VgiSourceTest, AsksForNoMoreOnceTheRoomForLeavesIsFull) {
    AtlasOptions options;
    options.leaves = true;
    options.clusters.clusters = 4;
    options.cells = 8;
    const auto path = path_of("dense");
    bake(mesh_, path, options);
    const auto file = atlas(path);
    std::filesystem::remove(path);
    ASSERT_GT(file->about().leaves.back().parts_end, 2 * file->about().leaves.size()) << "leaves have several parts";
    for (const uint64_t kib : {500u, 700u, 900u, 1300u}) {
        const auto vgi = open_vgi({file}, {kib << 10, 3});
        ASSERT_TRUE(vgi) << vgi.error().message;
        std::vector<Arrival> arrivals;
        size_t late = 0;
        double missing = 0, evicted = 0;
        for (uint64_t frame = 0; frame < 150; ++frame) {
            FrameInput input = look_from({0.3f, 0.2f, 2.2f}, frame);
            input.views[0].culls_back_faces = false;
            input.budget.pixel_error = 0.1;
            input.arrivals = std::move(arrivals);
            arrivals.clear();
            const Plan plan = (*vgi)->plan(input);
            for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r, *file));
            if (frame >= 100) late += plan.requests.size();
            missing = figure(plan, "leaf_parts_missing");
            evicted = figure(plan, "pages_evicted");
        }
        EXPECT_GT(missing, 0) << kib;
        EXPECT_LT(evicted, 1) << kib;
        EXPECT_EQ(late, 0u) << kib;
    }
}

// Of two atlases, so that a number can be a page's of one and not of the other.
TEST_F(VgiSourceTest, ArrivalsThatNobodyAskedForChangeNothing) {
    const auto pair_of_rocks = [] {
        auto opened = open_vgi({atlas(), atlas()}, {uint64_t{1} << 28, 3});
        EXPECT_TRUE(opened) << opened.error().message;
        return std::move(*opened);
    };
    const auto calm = pair_of_rocks(), bothered = pair_of_rocks();
    const auto file = atlas();
    Random random(11);
    std::vector<Arrival> arrivals;
    for (uint64_t frame = 0; frame < 30; ++frame) {
        const float angle = 0.1f * static_cast<float>(frame);
        FrameInput input = look_from(glm::vec3(std::sin(angle), 0.3f, std::cos(angle)) * 1.7f, frame);
        input.instances = {Instance{}, Instance{1, 0, glm::mat4(1)}};
        input.arrivals = arrivals;
        const Plan expected = calm->plan(input);
        std::set<uint64_t> asked;
        for (const Arrival& arrival : arrivals) asked.insert(arrival.request);
        const uint64_t pages = uint64_t{file->about().charts()} * tree_of(file->about(), Layer::geometry).pages();
        for (int i = 0; i < 40; ++i) {
            const uint64_t any = static_cast<uint64_t>(random.unit() * 4294967296.0);
            const std::array<uint64_t, 7> ids{
                any << 32 | any,                             // anything
                any % 3 << 40 | any % pages << 1,            // a page that was not asked for, perhaps of no atlas
                uint64_t{1} << 40 | (pages + any % 9) << 1,  // of the second atlas, past its end
                uint64_t{any % 2} << 40,                     // a coarsest page
                uint64_t{0xffffff} << 40 | any % pages,
                (any % 127 + 1) << 33 | (any % pages) << 1,  // bits that no id has
                ~uint64_t{0}};
            const uint64_t id = ids[static_cast<size_t>(i) % ids.size()];
            const auto atlas_of = id >> 40;
            if (asked.contains(id) || (atlas_of < 2 && outstanding_.contains(id))) continue;
            const size_t at = input.arrivals.empty() ? 0 : any % input.arrivals.size();
            input.arrivals.insert(input.arrivals.begin() + static_cast<ptrdiff_t>(at),
                                  {id, Blob(std::vector<std::byte>(any % 300, std::byte{9}))});
        }
        const Plan plan = bothered->plan(input);
        ASSERT_EQ(hash_of_plan(plan), hash_of_plan(expected)) << frame;
        ASSERT_EQ(plan.requests, expected.requests);
        ASSERT_TRUE(bothered->validate());
        arrivals.clear();
        for (const PageRequest& r : plan.requests) {
            outstanding_.insert(r.id);
            if (random.unit() < 0.7) arrivals.push_back(answer(r, *file));
        }
    }
    EXPECT_GT(outstanding_.size(), 100u);
}

// What `extract --level source` writes is what is drawn where everything is a leaf: triangle by triangle, on the
// leaves' lattice. Drawn are triangles between equal corners as well, which have no area.
TEST_F(VgiSourceTest, DrawsWhatIsExtractedWhereEverythingIsALeaf) {
    const auto vgi = source();
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    std::vector<Arrival> arrivals;
    uint64_t frame = 0;
    for (int quiet = 0; quiet < 3; ++frame) {
        FrameInput input = look_from({0.4f, 0.5f, 4}, frame);
        input.views.resize(1);
        input.views[0].culls_back_faces = false;
        input.budget.forced_level = 0;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        ASSERT_TRUE(mirror.execute(plan, input));
        for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
        quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
    }
    const auto whole = open_atlas(atlas()->file());
    ASSERT_TRUE(whole);
    const glm::dvec3 origin = whole->leaf_point({0, 0, 0});
    const double step = whole->step / (1u << whole->leaf_shift);
    using OnLattice = std::array<std::array<int64_t, 3>, 3>;
    const auto on_lattice = [&](const std::array<glm::vec3, 3>& triangle) {
        OnLattice is{};
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3 at = (glm::dvec3(triangle[k]) - origin) / step;
            for (int axis = 0; axis < 3; ++axis) is[k][static_cast<size_t>(axis)] = std::llround(at[axis]);
        }
        std::rotate(is.begin(), std::ranges::min_element(is), is.end());
        return is;
    };
    const TriMesh extracted = extract_leaves(*whole);
    std::vector<OnLattice> drawn, written;
    for (const auto& triangle : mirror.triangles_of(0)) {
        const OnLattice is = on_lattice(triangle);
        if (is[0] != is[1] && is[1] != is[2] && is[2] != is[0]) drawn.push_back(is);
    }
    for (size_t t = 0; t < extracted.triangle_count(); ++t)
        written.push_back(
            on_lattice({extracted.position_of(t, 0), extracted.position_of(t, 1), extracted.position_of(t, 2)}));
    std::ranges::sort(drawn);
    std::ranges::sort(written);
    EXPECT_GT(written.size(), 5000u);
    EXPECT_EQ(drawn.size(), written.size());
    EXPECT_TRUE(drawn == written);
}

// A page that is not what it should be is drawn as the coarser one, and that is said once.
TEST_F(VgiSourceTest, DamagedPagesAreNotDrawnAndToldOfOnce) {
    const auto vgi = source();
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    std::vector<Arrival> arrivals;
    std::vector<std::string> warnings;
    double failed = 0;
    for (uint64_t frame = 0; frame < 40; ++frame) {
        FrameInput input = look_from({0.4f, 0.5f, 1.6f}, frame);
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        warnings.insert(warnings.end(), plan.warnings.begin(), plan.warnings.end());
        failed = figure(plan, "pages_failed");
        for (const PageRequest& r : plan.requests) {
            Arrival arrival = answer(r);
            std::vector<std::byte> bytes(arrival.blob.data(), arrival.blob.data() + arrival.blob.size());
            bytes[bytes.size() / 2] ^= std::byte{4};
            arrivals.push_back({r.id, Blob(std::move(bytes))});
        }
    }
    EXPECT_GT(failed, 10);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], testing::HasSubstr(path_.string()));
    EXPECT_THAT(warnings[0], testing::HasSubstr("is damaged"));
    EXPECT_THAT(warnings[0], testing::HasSubstr("coarser ones are drawn"));
}

TEST_F(VgiSourceTest, MakesCutsBesideTheFrameBeforeWhereTheCameraMovesSteadily) {
    const auto vgi = source();
    std::vector<Arrival> arrivals;
    for (uint64_t frame = 0; frame < 60; ++frame) {
        const bool jumps = frame == 0 || frame == 40;
        const float angle = 0.02f * static_cast<float>(frame) + (frame >= 40 ? 2.0f : 0.0f);
        FrameInput input = look_from(glm::vec3(std::sin(angle), 0.3f, std::cos(angle)) * 1.7f, frame);
        input.budget.pixel_error = 1 + 0.3 * std::sin(0.1 * static_cast<double>(frame));
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        // After a jump the way on is not known either.
        if (jumps || frame == 1 || frame == 41) {
            if (jumps) { EXPECT_EQ(figure(plan, "cut_in_frame"), 1); }
        } else {
            EXPECT_EQ(figure(plan, "cut_in_frame"), 0) << frame;
        }
        for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
    }
}

// Where it will be next, by the way it came, it would be among hundreds at once.
TEST_F(VgiSourceTest, GivesUpOnWhatACameraThatJumpsMightSeeNext) {
    const auto vgi = source();
    const auto at = [&](float distance, uint64_t frame) {
        FrameInput input = look_from({0, 0, distance}, frame);
        input.views.resize(1);
        input.instances.assign(400, Instance{});
        for (uint32_t i = 0; i < 400; ++i) {
            const float angle = 0.0157f * static_cast<float>(i);
            input.instances.edit(i).object_to_world[3] = glm::vec4(60 * std::sin(angle), 60 * std::cos(angle), -100, 1);
        }
        return input;
    };
    // The finest pages are there, so that what is near has many triangles.
    std::vector<Arrival> arrivals;
    uint64_t frame = 0;
    const auto settle = [&](float distance) {
        for (int i = 0; i < 20; ++i) {
            FrameInput input = at(distance, frame++);
            input.budget.forced_level = 1;
            input.arrivals = std::move(arrivals);
            arrivals.clear();
            for (const PageRequest& r : vgi->plan(input).requests) arrivals.push_back(answer(r));
        }
    };
    settle(600);
    for (const float distance : {600.0f, 599.0f, 598.0f, 597.0f})
        EXPECT_EQ(figure(vgi->plan(at(distance, frame++)), "cuts_given_up"), 0);
    const Plan jumped = vgi->plan(at(250, frame++)), after = vgi->plan(at(250, frame++));
    EXPECT_EQ(figure(after, "cuts_given_up"), 1);
    EXPECT_EQ(figure(after, "cut_in_frame"), 0) << "what was cut in the frame before is as good";
    EXPECT_EQ(figure(after, "raised_error"), 1);
    EXPECT_EQ(after.stats.triangles, jumped.stats.triangles);
    EXPECT_EQ(after.stats.instances_drawn, jumped.stats.instances_drawn);
}

TEST_F(VgiSourceTest, MakesCutsBesideTheFrameBeforeWhereInstancesMoveSteadilyAndLosesNothingWhenTheyStop) {
    // A rock that moves and stops is drawn as one that has stood there all the time.
    std::array<uint64_t, 2> triangles{};
    for (const bool moves : {false, true}) {
        const auto vgi = source();
        std::vector<Arrival> arrivals;
        for (uint64_t frame = 0; frame < 60; ++frame) {
            FrameInput input = look_from({0.4f, 0.5f, 1.6f}, frame);
            const uint64_t step = moves ? std::min<uint64_t>(frame, 10) : 10;
            input.instances.edit(0).object_to_world[3].x = 1e-3f * static_cast<float>(step);
            input.arrivals = std::move(arrivals);
            arrivals.clear();
            const Plan plan = vgi->plan(input);
            triangles[moves] = plan.stats.triangles;
            const auto valid = vgi->validate();
            ASSERT_TRUE(valid) << valid.error().message;
            // It is not known before that it will go; where it stops, the last cut is still good.
            EXPECT_EQ(figure(plan, "cut_in_frame"), frame == 0 || (moves && frame == 1)) << frame;
            for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
        }
    }
    EXPECT_EQ(triangles[0], triangles[1]);
}

TEST_F(VgiSourceTest, SeesFromInstancesThatTurnWhatTheyWouldSeeStanding) {
    // Rocks on a turntable, the camera going its own way: nothing is drawn coarser than a cut for that frame has it.
    const auto vgi = source();
    std::vector<Arrival> arrivals;
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    std::vector<uint32_t> indices;
    for (size_t t = 0; t < mesh_.triangle_count(); ++t)
        for (int k = 0; k < 3; ++k) indices.push_back(mesh_.vertex_of(t, k));
    const ClosestSurface surface(mesh_.positions, indices);
    for (uint64_t frame = 0; frame < 60; ++frame) {
        FrameInput input = look_from({0.4f + 0.002f * static_cast<float>(frame), 0.5f, 1.6f}, frame);
        const float angle = 0.03f * static_cast<float>(frame) + (frame >= 50 ? 1.0f : 0.0f);
        const glm::mat4 m(std::cos(angle), 0, -std::sin(angle), 0, 0, 1, 0, 0, std::sin(angle), 0, std::cos(angle), 0,
                          0.1f, 0, -0.2f, 1);
        input.instances.edit(0).object_to_world = m;
        input.instances.push_back(Instance{});
        input.instances.edit(1).object_to_world[3] = {-1, 0, -1, 1};
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        EXPECT_EQ(figure(plan, "cut_in_frame"), frame < 2 || frame == 50 || frame == 51) << frame;
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
        if (frame < 40) continue;  // pages are still on their way
        const auto focal = static_cast<double>(input.views[0].focal_px);
        const auto triangles = mirror.triangles_of(0);
        EXPECT_GT(triangles.size(), 1000u);
        for (size_t t = 0; t < triangles.size(); t += 7) {
            const glm::vec3 centre = (triangles[t][0] + triangles[t][1] + triangles[t][2]) / 3.0f;
            const float away = glm::distance(glm::vec3(m * glm::vec4(centre, 1)), input.views[0].eye);
            EXPECT_LT(surface.closest(glm::dvec3(centre)).distance * focal / static_cast<double>(away), 1.5);
        }
    }
}

TEST_F(VgiSourceTest, KeepsToABudgetOfTriangles) {
    const auto vgi = source();
    std::vector<Arrival> arrivals;
    for (uint64_t frame = 0; frame < 20; ++frame) {
        FrameInput input = look_from({0.4f, 0.5f, 1.6f}, frame);
        input.budget.max_triangles = 3000;
        input.arrivals = std::move(arrivals);
        arrivals.clear();
        const Plan plan = vgi->plan(input);
        EXPECT_LE(plan.stats.triangles, 3000u);
        EXPECT_GT(figure(plan, "raised_error"), 1);
        for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r));
    }
}

TEST_F(VgiSourceTest, DrawsACoarseLevelAsItIsWhereNoErrorIsLargeEnoughForTheBudget) {
    const auto drawn = [](uint64_t most, int64_t level) {
        const auto vgi = source();
        PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
        // A needle, whose errors count as if it were as thick as long, right before the eye.
        FrameInput input = look_from({0.1f, 0, 0}, 0);
        input.views[0].culls_back_faces = false;
        glm::mat4& m = input.instances.edit(0).object_to_world;
        m[0][0] = m[2][2] = 0.01f;
        input.budget.max_triangles = most;
        input.budget.forced_level = level;
        const Plan plan = vgi->plan(input);
        EXPECT_TRUE(mirror.execute(plan, input));
        EXPECT_EQ(std::bit_cast<float>(mirror.draws().back().draw.words[LODE_VGI_WORD_MAGNIFICATION]), 0);
        return mirror.triangles_of(0);
    };
    const auto level = atlas()->about().levels() - 2;
    const auto asked = drawn(~uint64_t{0}, level);
    ASSERT_FALSE(asked.empty());
    EXPECT_EQ(drawn(asked.size(), -1), asked) << "vertices are not moved towards a coarser level";
}

TEST_F(VgiSourceTest, DrawsEveryInstanceAndCullsForEachView) {
    const auto vgi = source();
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    FrameInput input = look_from({0, 0, 6}, 0);
    input.views[1] = shadow_view({0.2f, -1, 0.1f}, {0, 0, 0}, 5, 256);
    input.instances.assign(3, Instance{});
    input.instances.edit(1).object_to_world[3] = glm::vec4(2, 0, 0, 1);
    input.instances.edit(2).object_to_world[3] = glm::vec4(0, 0, 100, 1);  // behind the camera, out of the light
    const Plan plan = vgi->plan(input);
    ASSERT_TRUE(mirror.execute(plan, input));
    EXPECT_EQ(plan.stats.instances_drawn, 2u);
    EXPECT_EQ(plan.stats.instances_culled, 1u);
    EXPECT_FALSE(mirror.triangles_of(0).empty());
    EXPECT_FALSE(mirror.triangles_of(1).empty());
    EXPECT_TRUE(mirror.triangles_of(2).empty());
    uint64_t shadow = 0, shown = 0;
    for (const auto& draw : mirror.draws()) {
        if (draw.stage == Stage::shadow) shadow += draw.indices.size();
        if (mirror.is_shown(draw)) shown += draw.indices.size();
    }
    EXPECT_GT(shadow, 0u);
    EXPECT_EQ(shown / 3, plan.stats.triangles);
    EXPECT_LT(shown, shadow) << "the camera sees no back faces, the light needs them";
}

// What is drawn of an instance none of whose charts may be whole, as a cut for this view and this instance has it.
std::vector<std::array<glm::vec3, 3>> cut_for_itself(const Atlas& about, const PlanMirror& mirror,
                                                     const FrameInput& input, uint32_t instance) {
    const Residency nothing(about);
    CutRequest request;
    request.views = std::span(input.views).first(1);
    request.object_to_world = input.instances[instance].object_to_world;
    request.pixel_error = input.budget.pixel_error;
    PageDemand demand(nothing.units());
    IncrementalCut kept;
    const Cut cut = cut_bintree(nothing, request, {}, demand, kept);
    // Any draw of the asset has what its vertices are told.
    const auto draw = std::ranges::find_if(mirror.draws(), [&](const auto& d) { return mirror.is_shown(d); });
    std::vector<std::array<glm::vec3, 3>> triangles;
    for (const auto& [mask, indices] : cut.parts) {
        for (size_t t = 0; t < indices.size(); t += 3) {
            std::array<glm::vec3, 3> corners;
            for (size_t k = 0; k < 3; ++k)
                corners[k] = pulled_vertex(mirror, draw->draw, input, instance, indices[t + k]);
            triangles.push_back(corners);
        }
    }
    return triangles;
}
// Those with three corners, each from its least on, in order.
std::vector<std::array<float, 9>> sorted(const std::vector<std::array<glm::vec3, 3>>& triangles) {
    std::vector<std::array<float, 9>> all;
    for (const auto& corners : triangles) {
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
        std::array<float, 9> least{};
        for (size_t first = 0; first < 3; ++first) {
            std::array<float, 9> turned{};
            for (size_t k = 0; k < 9; ++k) turned[k] = corners[(first + k / 3) % 3][static_cast<int>(k % 3)];
            if (first == 0 || turned < least) least = turned;
        }
        all.push_back(least);
    }
    std::ranges::sort(all);
    return all;
}

// Rocks all around a camera that flies and turns, some of which turn, too.
class FarRocks {
public:
    // heading, turn: of the camera, radians, radians a step.
    explicit FarRocks(uint32_t count, float heading = 0, float turn = 0.02f) : heading_(heading), turn_(turn) {
        Random random(5);
        std::vector<Instance> all(count);
        for (Instance& rock : all) {
            const auto at = [&] { return static_cast<float>(random.uniform(-1, 1)); };
            rock.object_to_world = glm::mat4(static_cast<float>(random.uniform(0.5, 2)));
            rock.object_to_world[3] = glm::vec4(1500 * at(), 300 * at(), 1500 * at(), 1);
        }
        input_.instances = all;
        input_.views.resize(2);
        input_.budget.pixel_error = 0.4f;
    }
    // way: what the camera has gone, in steps.
    const FrameInput& frame(uint64_t number, float way) {
        const float t = way;
        Camera camera;
        camera.eye = glm::vec3(3 * t, 10, 500 - 4 * t);
        const float to = heading_ + turn_ * t;
        camera.target = camera.eye + glm::vec3(std::sin(to), -0.05f, -std::cos(to));
        camera.far_plane = 5000;
        input_.views = {view_of(camera, 640, 360), shadow_view({0.2f, -1, 0.1f}, {0, 0, 0}, 900, 256)};
        input_.frame = number;
        input_.completed_frame = number > 1 ? number - 1 : 0;
        for (uint32_t i = 0; i < input_.instances.size(); i += 7) {
            glm::mat4& to_world = input_.instances.edit(i).object_to_world;
            const float s = std::sin(0.01f), c = std::cos(0.01f);
            const glm::vec4 x = to_world[0], z = to_world[2];
            to_world[0] = c * x + s * z;
            to_world[2] = c * z - s * x;
        }
        return input_;
    }
    // Whether all of it is in the picture.
    bool is_within(uint32_t i) const {
        const Sphere around = to_world(Sphere{glm::vec3(0), 2}, input_.instances[i].object_to_world);
        const Frustum seen = frustum_of(input_.views[0]);
        return std::ranges::all_of(seen.planes(), [&](const glm::vec4& plane) {
            return glm::dot(glm::vec3(plane), around.centre) + plane.w > around.radius;
        });
    }

private:
    float heading_, turn_;
    FrameInput input_;
};

// Many draw what one of them would, by few draws.
TEST_F(VgiSourceTest, SharesCutsAmongInstancesThatAreFarAwayAndDrawsEachAsItIsSeen) {
    const auto vgi = source();
    const auto file = atlas();
    PlanMirror mirror(vgi->recipe(), {pulled_vertex, patch_indices});
    FarRocks rocks(3000);
    size_t compared = 0, triangles = 0, shared = 0;
    for (uint64_t frame = 0; frame < 8; ++frame) {
        const FrameInput& input = rocks.frame(frame, static_cast<float>(frame));
        const Plan plan = vgi->plan(input);
        ASSERT_TRUE(mirror.execute(plan, input));
        EXPECT_EQ(figure(plan, "cut_in_frame"), frame < 2 ? 1 : 0) << frame;
        std::vector<uint32_t> drawn_with(input.instances.size(), 0), draws(input.instances.size(), 0);
        std::vector<bool> of_corners(input.instances.size(), true);
        uint64_t shown = 0;
        for (const auto& draw : mirror.draws()) {
            if (!mirror.is_shown(draw)) continue;
            shown += draw.indices.size() / 3 * draw.instances.size();
            for (const uint32_t i : draw.instances) {
                drawn_with[i] = static_cast<uint32_t>(draw.instances.size());
                of_corners[i] = of_corners[i] && std::ranges::all_of(draw.indices, [](uint32_t index) {
                                    return (index & LODE_VGI_CORNER) != 0;
                                });
                ++draws[i];
            }
        }
        EXPECT_EQ(shown, plan.stats.triangles);
        EXPECT_EQ(plan.stats.instances_drawn, std::ranges::count_if(draws, [](uint32_t n) { return n > 0; }));
        EXPECT_GT(plan.stats.instances_drawn, 500u);
        EXPECT_LT(mirror.draws().size(), plan.stats.instances_drawn / 2);
        for (uint32_t i = static_cast<uint32_t>(frame); i < input.instances.size(); i += 8) {
            if (!rocks.is_within(i) || drawn_with[i] < 2 || !of_corners[i]) continue;
            ASSERT_EQ(draws[i], 1u);
            const auto all = sorted(mirror.triangles_of(i));
            EXPECT_EQ(all, sorted(cut_for_itself(file->about(), mirror, input, i))) << frame << ", " << i;
            ++compared;
            shared += drawn_with[i];
            triangles += all.size();
        }
    }
    EXPECT_GT(compared, 400u);
    EXPECT_GT(triangles, 4 * compared);
    EXPECT_GT(shared, 10 * compared) << "instances to a draw";
}

// At distances where samples are drawn, too: whatever a rock would be drawn with if it were alone is there.
TEST_F(VgiSourceTest, SharesCutsWithSamplesAndDrawsAllThatOneAloneWants) {
    const auto path = path_of("shared");
    bake(mesh_, path, false);
    const auto file = atlas(path);
    std::filesystem::remove(path);
    Random random(11);
    std::vector<Instance> rocks(60);
    for (Instance& rock : rocks) {
        rock.object_to_world = glm::mat4(static_cast<float>(random.uniform(0.5, 1.5)));
        rock.object_to_world[3] = glm::vec4(random.uniform(-8, 8), random.uniform(-4, 4), random.uniform(-40, -12), 1);
    }
    // What is drawn once all pages are there; of each instance its corners' places.
    struct Seen {
        std::vector<std::set<std::array<float, 3>>> places;
        size_t shared = 0;  // draws of samples of several instances
        uint64_t triangles = 0;
    };
    const auto settled = [&](const std::vector<Instance>& instances) {
        auto vgi = open_vgi({file}, {uint64_t{1} << 28, static_cast<uint32_t>(instances.size())});
        EXPECT_TRUE(vgi);
        PlanMirror mirror((*vgi)->recipe(), {pulled_vertex, patch_indices});
        std::vector<Arrival> arrivals;
        Seen seen;
        uint64_t frame = 0;
        for (int quiet = 0; quiet < 3; ++frame) {
            FrameInput input = look_from({0, 0, 0.01f}, frame);
            input.instances = instances;
            input.arrivals = std::exchange(arrivals, {});
            const Plan plan = (*vgi)->plan(input);
            EXPECT_TRUE(mirror.execute(plan, input));
            for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r, *file));
            quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
            seen.triangles = plan.stats.triangles;
            if (frame > 200) ADD_FAILURE() << "pages come without end";
            if (frame > 200) break;
        }
        for (uint32_t i = 0; i < instances.size(); ++i) {
            auto& places = seen.places.emplace_back();
            for (const auto& triangle : mirror.triangles_of(i)) {
                for (const glm::vec3& p : triangle) places.insert({p.x, p.y, p.z});
            }
        }
        for (const auto& draw : mirror.draws()) {
            seen.shared += draw.instances.size() > 1 && (draw.indices[0] & LODE_VGI_CORNER) == 0;
        }
        return seen;
    };
    const Seen among = settled(rocks);
    EXPECT_GT(among.shared, 10u);
    size_t compared = 0, places = 0;
    uint64_t alone = 0;
    for (size_t i = 0; i < rocks.size(); ++i) {
        const Seen itself = settled({rocks[i]});
        EXPECT_EQ(itself.shared, 0u);
        EXPECT_TRUE(std::ranges::includes(among.places[i], itself.places[0])) << i;
        compared += itself.places[0].size() > 100;
        places += itself.places[0].size();
        alone += itself.triangles;
    }
    EXPECT_GT(compared, 20u);
    EXPECT_GT(places, 10000u);
    std::printf("%.2f times the triangles that all have alone\n",
                static_cast<double>(among.triangles) / static_cast<double>(alone));
    EXPECT_LT(among.triangles, 3 * alone);
}

// A camera that goes on as it did is foreseen: cuts made beside the frame before hold little more than it sees. One
// that goes by fits and starts is not, and cuts allow for that.
TEST_F(VgiSourceTest, AllowsForAsMuchAsTheCameraWasOffFromWhatWasForeseen) {
    struct Flight {
        const char* name;
        bool steady;
        float heading, turn;  // as FarRocks has them
        double most;
    };
    for (const auto& [name, steady, heading, turn, most] : {Flight{"straight on", true, 0.3f, 0, 1.15},
                                                            {"in a curve", true, 0, 0.02f, 1.3},
                                                            {"by fits and starts", false, 0, 0.02f, 2}}) {
        SCOPED_TRACE(name);
        const auto vgi = source();
        FarRocks rocks(3000, heading, turn);
        Random random(3);
        uint64_t more = 0, exact = 0, cut_in_frame = 0;
        float way = 0;
        for (uint64_t frame = 0; frame < 24; ++frame) {
            way += steady ? 4 : 4 * static_cast<float>(random.uniform(0.7, 1.3));
            const FrameInput& input = rocks.frame(frame, way);
            const Plan plan = vgi->plan(input);
            if (frame < 12) continue;
            more += plan.stats.triangles;
            exact += source()->plan(input).stats.triangles;
            cut_in_frame += static_cast<uint64_t>(figure(plan, "cut_in_frame"));
        }
        const double share = static_cast<double>(more) / static_cast<double>(exact);
        std::printf("%s: %.3f of the triangles that are seen\n", name, share);
        EXPECT_LE(cut_in_frame, steady ? 0u : 4u);
        EXPECT_GE(share, 1);
        EXPECT_LT(share, most);
    }
}

TEST_F(VgiSourceTest, MovesNothingFarInOneFrame) {
    // Flying towards the rock, vertices that stay are where they were, and those that appear do so in place: the
    // surface drawn moves by less than a fraction of the pixel error from frame to frame. So it is with samples; where
    // leaves appear, samples on their sides do so at once, within the pixel error.
    const auto path = path_of("samples");
    bake(mesh_, path, false);
    const auto file = atlas(path);
    std::filesystem::remove(path);
    EXPECT_LT(farthest_motion(*file), 0.35);
    EXPECT_LT(farthest_motion(*atlas()), 1);
    // Where it shares cuts with another, and goes from one to the next, within the pixel error.
    Approach shared{8.0f, 6.4f, {Instance{}, Instance{}}};
    shared.instances[1].object_to_world[3] = glm::vec4(0.5f, 0, 0, 1);
    const double moved = farthest_motion(*file, shared);
    std::printf("%.3f pixels where cuts are shared\n", moved);
    EXPECT_LT(moved, 0.5);
}

TEST_F(VgiSourceTest, MovesLeavesToTheirPlacesFromWhereSamplesWere) {
    const LeafMotion moves = leaf_motion(*atlas(), pulled_vertex);
    EXPECT_LT(moves.farthest, 0.35);
    EXPECT_GT(moves.farthest, 0.001) << "they move";
    EXPECT_GT(moves.appear, 1000u);
    EXPECT_GT(moves.stay, 10000u);
    EXPECT_LT(moves.far, moves.appear / 25);
    // Leaves that are in their places from the first.
    const LeafMotion jumps = leaf_motion(
        *atlas(), [](const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t i, uint32_t index) {
            Draw still = draw;
            if ((index & LODE_VGI_CORNER) == 0 && (index & LODE_VGI_LEAF) != 0)
                still.words[LODE_VGI_WORD_MAGNIFICATION] = std::bit_cast<uint32_t>(0.0f);
            return pulled_vertex(mirror, still, input, i, index);
        });
    EXPECT_EQ(jumps.farthest, 0);
    EXPECT_EQ(jumps.appear, moves.appear);
    EXPECT_LT(2 * moves.rms_of_new, jumps.rms_of_new);
    EXPECT_GT(jumps.far, jumps.appear / 15);
    EXPECT_GT(jumps.far, 5 * moves.far) << "many appear far from where they were";
}

// A rock in a texture of smooth colours.
TriMesh painted_rock() {
    TriMesh mesh = generate(Shape::rock, 5000, 3);
    EXPECT_TRUE(repair(mesh));
    mesh.uvs.clear();
    for (const uint32_t v : mesh.wedge_vertex) {
        const glm::vec3 n = glm::normalize(mesh.positions[v]);
        mesh.uvs.emplace_back(0.5f + 0.4f * n.x, 0.5f + 0.4f * n.y);
    }
    Image image{256, 256, {}};
    for (uint32_t i = 0; i < 256 * 256; ++i) {
        const uint32_t row = i / 256;
        const auto x = static_cast<float>(i % 256), y = static_cast<float>(row);
        const auto wave = [&](float a, float b) { return static_cast<uint8_t>(128 + 100 * std::sin(a * x + b * y)); };
        image.texels.emplace_back(wave(0.1f, 0.05f), wave(0.02f, -0.1f), wave(0.05f, 0.08f), 255);
    }
    mesh.images = {std::move(image)};
    mesh.material_table.resize(1);
    mesh.material_table[0].base_colour_texture.image = 0;
    return mesh;
}

// Beside an atlas of whole pages and alone.
TEST_F(VgiSourceTest, ChartsOfFewCellsTakeNoMoreRoomThanTheyFill) {
    const auto path = path_of("few-cells");
    AtlasOptions options;
    options.clusters.clusters = 60;
    options.cells = 8;
    bake(mesh_, path, options);
    const std::array files{atlas(path), atlas()};
    const uint32_t charts = files[0]->about().charts();
    ASSERT_EQ(files[0]->about().cells, 8u);
    ASSERT_EQ(tree_of(files[1]->about(), Layer::geometry).cells_per_page(), page_cells);
    struct Shown {
        uint64_t bytes = 0;
        double pages = 0;
        std::vector<std::array<glm::vec3, 3>> triangles;
        std::vector<glm::vec3> normals;
    };
    // assets: of what is drawn beside each other, into files; what is told is of files[0].
    const auto shown = [&](const std::vector<size_t>& assets, uint64_t budget) {
        Shown all;
        std::vector<std::shared_ptr<const AtlasFile>> opened;
        for (const size_t asset : assets) opened.push_back(files[asset]);
        auto vgi = open_vgi(opened, {budget, 2});
        EXPECT_TRUE(vgi) << vgi.error().message;
        if (!vgi) return all;
        for (const BufferSpec& buffer : (*vgi)->recipe().buffers) all.bytes += buffer.bytes;
        PlanMirror mirror((*vgi)->recipe(), {pulled_vertex, patch_indices});
        std::vector<Arrival> arrivals;
        FrameInput input;
        for (uint64_t frame = 0; frame < 40; ++frame) {
            input = look_from({0.3f, 0.2f, 2.5f}, frame);
            input.instances.assign(assets.size(), Instance{});
            for (uint32_t i = 0; i < assets.size(); ++i) input.instances.edit(i).asset = i;
            input.arrivals = std::exchange(arrivals, {});
            const Plan plan = (*vgi)->plan(input);
            const auto done = mirror.execute(plan, input);
            EXPECT_TRUE(done) << done.error().message;
            for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r, *opened[r.asset]));
            all.pages = figure(plan, "pages_resident");
        }
        const auto valid = (*vgi)->validate();
        EXPECT_TRUE(valid) << valid.error().message;
        const auto of = static_cast<uint32_t>(std::ranges::find(assets, size_t{0}) - assets.begin());
        all.triangles = mirror.triangles_of(of);
        for (const auto& draw : mirror.draws()) {
            if (!mirror.is_shown(draw) || draw.draw.words[LODE_VGI_WORD_ASSET] != of) continue;
            for (const uint32_t index : draw.indices)
                all.normals.push_back(pulled_attributes(mirror, draw.draw, input, of, index).normal);
        }
        return all;
    };
    // A whole page of positions takes 8,720 bytes, and one of attributes half as many.
    const uint64_t whole_pages = uint64_t{charts} * 13000;
    const Shown alone = shown({0}, whole_pages / 3), first = shown({0, 1}, uint64_t{1} << 28),
                last = shown({1, 0}, uint64_t{1} << 28), roomy = shown({0}, uint64_t{1} << 28);
    EXPECT_LT(alone.bytes, whole_pages / 3);
    EXPECT_EQ(roomy.pages, 2.0 * charts);
    ASSERT_GT(roomy.triangles.size(), 1000u);
    for (const Shown* other : {&first, &last}) {
        EXPECT_EQ(other->triangles, roomy.triangles);
        EXPECT_EQ(other->normals, roomy.normals);
    }
    std::filesystem::remove(path);
}

// In the same plan: blocks in a smaller pool, pages and small levels where shaders look for them, of an atlas without
// colours, too.
TEST_F(VgiSourceTest, HoldsTexturesInBlocksOfHalfTheSize) {
    const auto path = path_of("painted");
    AtlasOptions options;
    options.clusters.clusters = 8;
    options.bake_textures = true;
    bake(painted_rock(), path, options);
    const auto bare = path_of("bare");
    TriMesh without = mesh_;
    without.uvs.clear();
    bake(without, bare, options);
    struct Shown {
        double bytes = 0;
        std::vector<PulledAttributes> vertices;
    };
    const auto shown = [&](bool in_blocks) {
        Shown all;
        const std::array files{atlas(path), atlas(bare)};
        auto vgi =
            open_vgi({files[0], files[1]}, {.resident_bytes = uint64_t{1} << 28, .textures_in_blocks = in_blocks});
        EXPECT_TRUE(vgi);
        PlanMirror mirror((*vgi)->recipe(), {pulled_vertex, patch_indices});
        std::vector<Arrival> arrivals;
        FrameInput input;
        for (uint64_t frame = 0; frame < 30; ++frame) {
            input = look_from({0.3f, 0.2f, 2.5f}, frame);
            input.instances = {Instance{}, Instance{1, 0, glm::translate(glm::mat4(1), glm::vec3(1.2f, 0, 0))}};
            input.arrivals = std::exchange(arrivals, {});
            const Plan plan = (*vgi)->plan(input);
            EXPECT_TRUE(mirror.execute(plan, input));
            for (const PageRequest& r : plan.requests) arrivals.push_back(answer(r, *files[r.asset]));
            all.bytes = figure(plan, "attribute_bytes_resident");
        }
        EXPECT_TRUE((*vgi)->validate());
        for (const auto& draw : mirror.draws()) {
            for (const uint32_t index : mirror.is_shown(draw) ? draw.indices : std::span<const uint32_t>())
                all.vertices.push_back(pulled_attributes(mirror, draw.draw, input, 0, index));
        }
        return all;
    };
    const Shown plain = shown(false), blocks = shown(true);
    EXPECT_LT(blocks.bytes, 0.6 * plain.bytes);
    ASSERT_EQ(blocks.vertices.size(), plain.vertices.size());
    ASSERT_GT(plain.vertices.size(), 20000u);
    double squared = 0;
    size_t differ = 0;
    for (size_t i = 0; i < plain.vertices.size(); ++i) {
        const PulledAttributes &a = plain.vertices[i], &b = blocks.vertices[i];
        EXPECT_EQ(a.material, b.material);
        EXPECT_GT(glm::dot(a.normal, b.normal), 0.98f);
        differ += a.colour != b.colour;
        const glm::vec3 off = glm::vec3(a.colour) - glm::vec3(b.colour);
        squared += static_cast<double>(glm::dot(off, off));
    }
    EXPECT_GT(differ, 0u);
    EXPECT_LT(std::sqrt(squared / static_cast<double>(3 * plain.vertices.size())), 2.5);
    std::filesystem::remove(path);
    std::filesystem::remove(bare);
}

}  // namespace
}  // namespace lodestone::vgi
