// The backend vgi on whatever device is there; validation must stay silent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "base/random.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"
#include "render/device_test.h"
#include "render/squares_test.h"
#include "report/image_metrics.h"
#include "shaders/shared/vgi_cut.h"
#include "vgi/asset/codec/page_family.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/pulled_vertex.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/draw/vgi_source.h"
#include "vgi/study/grid_cut.h"
#include "vgi/study/grid_patch.h"
#include "vgi/study/patch_indices.h"

namespace lodestone {
namespace {

constexpr uint32_t picture_width = 320, picture_height = 240;

class VgiRenderTest : public DeviceTest {
protected:
    VgiRenderTest()
        : DeviceTest(picture_width, picture_height),
          path_(std::filesystem::temp_directory_path() /
                ("lodestone-vgi-render-" + std::to_string(getpid()) + ".lode")) {}
    void TearDown() override {
        DeviceTest::TearDown();
        for (const std::string& path : written_) std::filesystem::remove(path);
    }
    // The only atlas, or one more.
    std::shared_ptr<const vgi::AtlasFile> atlas_of(const TriMesh& mesh, bool leaves = false) {
        files_.clear();
        return another_atlas_of(mesh, 64, leaves);
    }
    std::shared_ptr<const vgi::AtlasFile> another_atlas_of(const TriMesh& mesh, uint32_t cells, bool leaves = false) {
        vgi::AtlasOptions options;
        options.leaves = leaves;
        options.clusters.clusters = 12;
        options.cells = cells;
        options.error_samples = 1000;
        vgi::AtlasReport report;
        const auto atlas = vgi::make_atlas(mesh, options, report);
        EXPECT_TRUE(atlas);
        const std::string path = path_.string() + std::to_string(files_.size());
        written_.insert(path);
        auto writer = ChunkWriter::create(path, {});
        EXPECT_TRUE(writer && vgi::write_chunks(*atlas, *writer) && writer->commit());
        auto opened = vgi::AtlasFile::open(*ChunkFile::open(path));
        EXPECT_TRUE(opened);
        return files_.emplace_back(std::make_shared<const vgi::AtlasFile>(std::move(*opened)));
    }
    // Draws, with those of the pages asked for that luck lets through.
    // mirror: executes the plans, too, where there is one.
    Picture draw(FrameSource& source, FrameInput input, const ShadingOptions& look, double luck, Random& random,
                 PlanMirror* mirror = nullptr) {
        constexpr int most_frames = 40, most_quiet = 3;
        std::vector<Arrival> arrivals;
        bool last = false;
        for (int quiet = 0, frames = 1; !last; ++frames) {
            input.frame = frame_++;
            input.completed_frame = *renderer_->completed_frame();
            input.arrivals = std::move(arrivals);
            Plan plan = source.plan(input);
            if (mirror != nullptr) {
                const auto mirrored = mirror->execute(plan, input);
                EXPECT_TRUE(mirrored) << mirrored.error().message;
            }
            arrivals = arrivals_of(plan, luck, random);
            quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
            last = quiet == most_quiet || frames == most_frames;
            // Nobody looks at those before the last.
            if (!last)
                std::erase_if(plan.commands, [](const Command& command) { return drawn_by(command) != nullptr; });
            input.readbacks = submit(plan, input, look);
        }
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture) << picture.error().message;
        return std::move(*picture);
    }
    // A debug view by `full` and by an atlas, with all pages there.
    std::pair<Picture, Picture> by_full_and_leaves(FrameSource& full,
                                                   const std::shared_ptr<const vgi::AtlasFile>& atlas,
                                                   const MaterialSet& looks, const FrameInput& input, DebugView view) {
        Random random(3);
        ShadingOptions look;
        look.debug = view;
        const auto drawn_by = [&](FrameSource& source) {
            EXPECT_TRUE(renderer_->load(source.recipe(), looks));
            frame_ = 0;
            return draw(source, input, look, 1, random);
        };
        Picture expected = drawn_by(full);
        auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 26, 1});
        EXPECT_TRUE(vgi);
        return {std::move(expected), drawn_by(**vgi)};
    }
    // What is read back of it.
    std::vector<ReadbackResult> submit(const Plan& plan, const FrameInput& input, const ShadingOptions& look) {
        const auto submitted = renderer_->submit(plan, input, look);
        EXPECT_TRUE(submitted) << submitted.error().message;
        EXPECT_TRUE(renderer_->wait());
        return renderer_->take_readbacks();
    }
    std::vector<Arrival> arrivals_of(const Plan& plan, double luck, Random& random) const {
        std::vector<Arrival> arrivals;
        for (const PageRequest& r : plan.requests) {
            if (random.unit() >= luck) {
                arrivals.push_back({r.id, {}});
                continue;
            }
            std::vector<std::byte> part(r.bytes);
            EXPECT_TRUE(files_[r.asset]->file().read_part(r.chunk, r.offset, part));
            arrivals.push_back({r.id, Blob(std::move(part))});
        }
        return arrivals;
    }
    // around: more pixels at each side.
    FrameInput look_from(const glm::vec3& eye, uint32_t around = 0) {
        Camera camera;
        camera.eye = eye;
        camera.near_plane = 0.05f;
        const uint32_t tall = picture_height + 2 * around;
        camera.fov_y =
            2 * std::atan(std::tan(camera.fov_y / 2) * static_cast<float>(tall) / static_cast<float>(picture_height));
        FrameInput input;
        input.views = {view_of(camera, picture_width + 2 * around, tall),
                       shadow_view(ShadingOptions{}.light_direction, {0, 0, 0}, 3, 512)};
        input.views[0].culls_back_faces = true;
        input.instances = {Instance{}};
        return input;
    }
    std::vector<std::shared_ptr<const vgi::AtlasFile>> files_;
    std::filesystem::path path_;  // of files, before their numbers
    std::set<std::string> written_;
    uint64_t frame_ = 0;
};

TriMesh mesh_of(Shape shape, size_t triangles) {
    TriMesh mesh = generate(shape, triangles, 5);
    EXPECT_TRUE(repair(mesh));
    return mesh;
}

struct FullMesh {
    std::vector<MeshVertex> vertices;
    std::vector<uint32_t> indices;
    std::unique_ptr<FrameSource> source;
    explicit FullMesh(const TriMesh& mesh) : vertices(pack_vertices(mesh)) {
        for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
        source = std::move(*open_fixed_levels({full_level(vertices, indices)}, uint64_t{1} << 28));
    }
};

TEST_F(VgiRenderTest, ShowsTheSurfaceThatFullShows) {
    Renderer& renderer = make();
    Random random(1);
    for (const Shape shape : {Shape::rock, Shape::torus, Shape::terrain}) {
        const TriMesh mesh = mesh_of(shape, 20000);
        const FrameInput input = look_from({0.4f, 1.1f, 2.4f});
        FullMesh full(mesh);
        ASSERT_TRUE(renderer.load(full.source->recipe(), plain()));
        frame_ = 0;
        const Picture expected = draw(*full.source, input, {}, 1, random);
        auto vgi = vgi::open_vgi({atlas_of(mesh)}, {uint64_t{1} << 26, 1});
        ASSERT_TRUE(vgi);
        ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
        frame_ = 0;
        const Picture picture = draw(**vgi, input, {}, 1, random);
        const auto mask = covered_union(picture, expected);
        EXPECT_GT(ssim(picture, expected, mask), 0.93) << static_cast<int>(shape);
        EXPECT_GT(psnr_db(picture, expected, mask), 27) << static_cast<int>(shape);
        EXPECT_EQ(background_leaks(picture, expected, 0), 0u);
    }
}

// Pixels that lie on none of these triangles, to a tenth of a pixel, of all that are covered.
std::pair<size_t, size_t> off_and_covered(const Picture& picture, const View& view,
                                          const std::vector<std::array<glm::vec3, 3>>& triangles) {
    std::vector<glm::vec3> corners;
    for (const auto& triangle : triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
    std::vector<uint32_t> indices(corners.size());
    std::iota(indices.begin(), indices.end(), 0u);
    const ClosestSurface surface(corners, indices);
    const PixelPlaces places(view);
    size_t off = 0, covered = 0;
    for (size_t y = 0; y < picture.height; ++y) {
        for (size_t x = 0; x < picture.width; ++x) {
            if (picture.colour[4 * (y * picture.width + x) + 3] == 0) continue;
            ++covered;
            const auto [world, pixels_per_unit] = places.of(picture, x, y);
            off += surface.closest(world).distance * pixels_per_unit > 0.1;
        }
    }
    return {off, covered};
}

// Samples, leaves and corners, on their ways as well: all are drawn where the mirror of the plan has them.
TEST_F(VgiRenderTest, DrawsEverythingWhereTheMirrorHasIt) {
    Renderer& renderer = make();
    Random random(2);
    const auto atlas = atlas_of(mesh_of(Shape::rock, 20000));
    for (const float away : {1.3f, 2.4f, 6.0f, 25.0f}) {
        for (const double pixel_error : {0.25, 1.0, 4.0}) {
            auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 28, 1});
            ASSERT_TRUE(vgi);
            ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
            frame_ = 0;
            FrameInput input = look_from(away * glm::normalize(glm::vec3(0.4f, 1.1f, 2.4f)));
            input.budget.pixel_error = pixel_error;
            PlanMirror mirror((*vgi)->recipe(), {vgi::pulled_vertex, vgi::patch_indices});
            const Picture picture = draw(**vgi, input, {}, 1, random, &mirror);
            const auto [off, covered] = off_and_covered(picture, input.views[0], mirror.triangles_of(0));
            EXPECT_GT(covered, 20u) << away;
            // Of what is seen edge on a rasteriser may extrapolate a depth.
            EXPECT_LE(off, covered / 2000) << away << ", " << pixel_error << ": of " << covered;
        }
    }
}

// Steps up and down again, each side with a normal of its own.
TriMesh stairs(int steps) {
    TriMesh mesh;
    const auto point = [&](int k, float z) {
        const int step = k / 2, up = (k + 1) / 2;
        return glm::vec3(2.0f * static_cast<float>(step) / static_cast<float>(steps) - 1,
                         0.08f * static_cast<float>(up % 2 == 0 ? 0 : 1), z);
    };
    const int places = 2 * steps + 1;
    for (int k = 0; k < places; ++k) {
        for (const float z : {-1.0f, 1.0f}) mesh.positions.push_back(point(k, z));
    }
    for (int k = 0; k + 1 < places; ++k) {
        const auto first = static_cast<uint32_t>(mesh.wedge_vertex.size());
        const auto vertex = static_cast<uint32_t>(2 * k);
        for (const uint32_t v : {vertex, vertex + 1, vertex + 3, vertex + 2}) mesh.wedge_vertex.push_back(v);
        const glm::vec3 along = point(k + 1, 0) - point(k, 0);
        mesh.normals.insert(mesh.normals.end(), 4, glm::normalize(glm::cross(glm::vec3(0, 0, 1), along)));
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
    }
    return mesh;
}

// How many pixels there are that both cover, and how many of them differ by more than `most` of 255 in a channel.
struct Compared {
    size_t covered = 0, off = 0;
};
Compared compared(const Picture& a, const Picture& b, int most) {
    Compared both;
    for (size_t i = 0; i < a.colour.size(); i += 4) {
        if (a.colour[i + 3] == 0 || b.colour[i + 3] == 0) continue;
        ++both.covered;
        bool off = false;
        for (size_t k = 0; k < 3; ++k) off = off || std::abs(int{a.colour[i + k]} - int{b.colour[i + k]}) > most;
        both.off += off;
    }
    return both;
}

// Between the two sides of an edge there is none: of samples around a place of a leaf those count that face its way.
TEST_F(VgiRenderTest, EdgesOfTheSourceStaySharpOnLeaves) {
    Renderer& renderer = make();
    TriMesh mesh = stairs(24);
    // What is level is light, what is upright dark.
    for (const glm::vec3& n : mesh.normals)
        mesh.colours.push_back(n.y > 0.5f ? glm::u8vec4(230, 220, 210, 255) : glm::u8vec4(20, 30, 40, 255));
    ASSERT_TRUE(mesh.validate());
    FrameInput input = look_from({0.7f, 2.2f, 0.4f});
    input.budget.pixel_error = 0.02;
    FullMesh full(mesh);
    files_.clear();
    const auto atlas = another_atlas_of(mesh, 64, true);
    for (const DebugView view : {DebugView::normal, DebugView::base_colour}) {
        const auto [expected, picture] = by_full_and_leaves(*full.source, atlas, plain(), input, view);
        const auto [covered, between] = compared(picture, expected, 40);
        EXPECT_GT(covered, 20000u);
        // Only samples have colours, and along an edge all around a place may be of the other side. If leaves did not
        // choose among them, 3,993 pixels would be between.
        EXPECT_LT(between, view == DebugView::normal ? covered / 2000 : covered / 60) << static_cast<int>(view);
    }
    EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
}

// Leaves are lit by the texture coordinates of the source, whose seams samples do not know.
TEST_F(VgiRenderTest, LeavesShowTexturesAsTheSourceHasThem) {
    make();
    Random random(4);
    TriMesh mesh = stairs(24);
    // Every side shows another piece of the texture, every other one mirrored.
    for (size_t side = 0; side < mesh.wedge_vertex.size() / 4; ++side) {
        const glm::vec2 corner(0.9 * random.unit(), 0.9 * random.unit()), size(side % 2 == 0 ? 0.08f : -0.08f, 0.1f);
        for (const glm::vec2 at : {glm::vec2(0, 0), glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(1, 0)})
            mesh.uvs.push_back(corner + at * size);
    }
    mesh.materials.assign(mesh.wedge_vertex.size(), 0);
    MaterialSet looks = plain();
    looks.materials[0].base_colour_texture.image = 0;
    looks.materials[0].normal_texture.image = 1;
    looks.images = {image_of(32, 32, 1), normals_of(32, 32, 2)};
    mesh.material_table = looks.materials;
    mesh.images = looks.images;
    ASSERT_TRUE(mesh.validate());
    FullMesh full(mesh);
    files_.clear();
    const auto atlas = another_atlas_of(mesh, 64, true);
    FrameInput input = look_from({0.5f, 1.9f, 0.6f});
    input.budget.pixel_error = 0.02;
    // Turned and mirrored.
    glm::mat4& m = input.instances.edit(0).object_to_world;
    m = glm::rotate(glm::scale(glm::mat4(1), {-0.9f, 0.9f, 0.9f}), 0.4f, glm::vec3(0, 1, 0));
    input.views[0].culls_back_faces = false;
    looks.mirrors = true;
    for (const DebugView view : {DebugView::uv, DebugView::base_colour, DebugView::normal}) {
        const auto [expected, picture] = by_full_and_leaves(*full.source, atlas, looks, input, view);
        // By the samples' texture coordinates it would be 30, 35 and 36.5 dB.
        EXPECT_GT(psnr_db(picture, expected, covered_union(picture, expected)), 38) << static_cast<int>(view);
    }
}

// Triangles may be off by some pixels; what is seen on them is where it belongs (shaders/shared/vgi_place.glsl).
TEST_F(VgiRenderTest, LooksUpWhatIsSeenOnTheSurfaceItself) {
    Renderer& renderer = make();
    Random random(9);
    // From where triangles are, it would be 0.955 and 0.924.
    for (const auto& [shape, least] : {std::pair{Shape::rock, 0.963}, std::pair{Shape::terrain, 0.935}}) {
        auto vgi = vgi::open_vgi({atlas_of(mesh_of(shape, 20000))}, {uint64_t{1} << 26, 1});
        ASSERT_TRUE(vgi);
        ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
        frame_ = 0;
        FrameInput input = look_from({0.3f, 1.1f, 1.9f});
        // One that is turned, scaled and mirrored, too.
        glm::mat4& m = input.instances.edit(0).object_to_world;
        m = glm::rotate(glm::scale(glm::mat4(1), {-0.9f, 0.9f, 0.9f}), 0.4f, glm::vec3(0, 1, 0));
        input.views[0].culls_back_faces = false;
        // Shadows' borders are where triangles are.
        input.views.pop_back();
        input.budget.pixel_error = 0.02;
        const Picture exact = draw(**vgi, input, {}, 1, random);
        input.budget.pixel_error = 3;
        const Picture coarse = draw(**vgi, input, {}, 1, random);
        EXPECT_GT(ssim(coarse, exact, covered_union(coarse, exact)), least) << static_cast<int>(shape);
    }
}

// Without `around` pixels at each side.
Picture middle_of(const Picture& picture, uint32_t around) {
    Picture middle;
    middle.width = picture.width - 2 * around;
    middle.height = picture.height - 2 * around;
    for (uint32_t y = around; y < picture.height - around; ++y) {
        const auto first = static_cast<ptrdiff_t>(y * picture.width + around), last = first + middle.width;
        middle.colour.insert(middle.colour.end(), picture.colour.begin() + 4 * first,
                             picture.colour.begin() + 4 * last);
        middle.depth.insert(middle.depth.end(), picture.depth.begin() + first, picture.depth.begin() + last);
    }
    return middle;
}

// Background that cannot be reached from the picture's border: none where what is drawn is star-shaped and whole.
size_t enclosed_background(const Picture& picture) {
    const auto w = static_cast<int>(picture.width), h = static_cast<int>(picture.height);
    std::vector<bool> reached(picture.colour.size() / 4, false);
    std::vector<std::pair<int, int>> stack;
    const auto visit = [&](int x, int y) {
        if (x < 0 || y < 0 || x >= w || y >= h) return;
        const auto i = static_cast<size_t>(y * w + x);
        if (reached[i] || picture.colour[4 * i + 3] > 0) return;
        reached[i] = true;
        stack.emplace_back(x, y);
    };
    for (int x = 0; x < w; ++x) {
        visit(x, 0);
        visit(x, h - 1);
    }
    for (int y = 0; y < h; ++y) {
        visit(0, y);
        visit(w - 1, y);
    }
    while (!stack.empty()) {
        const auto [x, y] = stack.back();
        stack.pop_back();
        for (int dy = -1; dy <= 1; ++dy) {
            for (int dx = -1; dx <= 1; ++dx) visit(x + dx, y + dy);
        }
    }
    size_t enclosed = 0;
    for (size_t i = 0; i < reached.size(); ++i) enclosed += picture.colour[4 * i + 3] == 0 && !reached[i];
    return enclosed;
}

TEST_F(VgiRenderTest, HasNoHoleFromAnyViewWithWhateverPages) {
    const TriMesh mesh = mesh_of(Shape::rock, 20000);
    Renderer& renderer = make();
    Random random(2);
    const std::array atlases{another_atlas_of(mesh, 64), another_atlas_of(mesh, 16, true)};
    size_t drawn = 0;
    // Where triangles cross the picture's border rasterisers cut them, and two that share an edge may get ends of it
    // that differ by a 256th of a pixel: some pixels around the picture are drawn and not looked at.
    constexpr uint32_t around = 16;
    ASSERT_TRUE(renderer.resize(picture_width + 2 * around, picture_height + 2 * around));
    const std::array rasters{vgi::Raster::bintree, vgi::Raster::grid, vgi::Raster::tess, vgi::Raster::device};
    for (int pool = 0; pool < 12; ++pool) {
        const auto raster = rasters[static_cast<size_t>(pool) % rasters.size()];
        files_ = {atlases[raster == vgi::Raster::bintree ? 1 : 0]};
        auto vgi = vgi::open_vgi(files_, {uint64_t{1} << (pool % 2 == 0 ? 22 : 26), 1, raster});
        ASSERT_TRUE(vgi) << vgi.error().message;
        ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
        frame_ = 0;
        for (int i = 0; i < 20; ++i) {
            const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
            const glm::vec3 eye = glm::normalize(glm::vec3(unit(), unit(), unit()) + glm::vec3(0.01f)) *
                                  (1.8f + 2 * static_cast<float>(random.unit()));
            FrameInput input = look_from(eye, around);
            input.budget.pixel_error = i % 3 == 0 ? 0.5 : i % 3 == 1 ? 1 : 6;
            const Picture picture = middle_of(draw(**vgi, input, {}, 0.08 * (pool + 1), random), around);
            ASSERT_EQ(picture.width, picture_width);
            EXPECT_EQ(enclosed_background(picture), 0u) << pool << " " << i;
            for (size_t k = 3; k < picture.colour.size(); k += 4) drawn += picture.colour[k] > 0;
        }
    }
    EXPECT_GT(drawn, 240u * 5000u);
}

TEST_F(VgiRenderTest, DrawsTheSameFromPoolsInPieces) {
    const TriMesh mesh = mesh_of(Shape::rock, 20000);
    Random random(3);
    const auto atlas = atlas_of(mesh, true);
    std::vector<Picture> pictures;
    for (const uint32_t limit : {0u, 1u << 20}) {
        RendererOptions options;
        options.segment_bytes_limit = limit;
        Renderer& renderer = make(options);
        auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 24, 1});
        ASSERT_TRUE(vgi);
        const auto loaded = renderer.load((*vgi)->recipe(), plain());
        ASSERT_TRUE(loaded) << loaded.error().message;
        frame_ = 0;
        pictures.push_back(draw(**vgi, look_from({0.4f, 0.6f, 2.2f}), {}, 1, random));
        EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
    }
    EXPECT_EQ(pictures[0].colour, pictures[1].colour);
}

// Flights along a cliff, and of what moves there: what casts no shadow that is seen need not be drawn for the light.
TEST_F(VgiRenderTest, ShadowsAreTheSameWhereWhatCastsNoneIsLeftOut) {
    const auto atlas = atlas_of(mesh_of(Shape::cliff, 20000), true);
    Renderer& renderer = make();
    std::array<std::vector<Picture>, 2> pictures;
    std::array<uint64_t, 2> shadow_indices{};
    for (const bool alone : {false, true}) {
        auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 26, 2});
        ASSERT_TRUE(vgi);
        ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
        frame_ = 0;
        Random random(4);
        for (int i = 0; i < 12; ++i) {
            const float way = static_cast<float>(i) / 12, turn = 6 * way;
            FrameInput input = look_from({0.7f - way, 0.4f + 0.2f * way, 0.7f - way});
            Camera camera;
            camera.eye = input.views[0].eye;
            camera.target = camera.eye + glm::vec3(std::sin(turn), -0.3f, std::cos(turn));
            camera.near_plane = 0.05f;
            input.views[0] = view_of(camera, picture_width, picture_height);
            input.views[1].shades_first_view_alone = alone;
            Instance beside{};
            beside.object_to_world =
                glm::rotate(glm::translate(glm::mat4(1), {0.3f, 0.5f, 0}), turn, glm::vec3(0.3f, 1, 0));
            beside.object_to_world = glm::scale(beside.object_to_world, glm::vec3(0.3f));
            input.instances.push_back(beside);
            pictures[alone].push_back(draw(**vgi, input, {}, 1, random));
            input.frame = frame_++;
            input.completed_frame = *renderer.completed_frame();
            for (const Command& command : (*vgi)->plan(input).commands) {
                const auto* const draw = std::get_if<Draw>(&command.what);
                if (draw != nullptr && draw->view == 1) shadow_indices[alone] += draw->count;
            }
        }
    }
    for (size_t i = 0; i < pictures[0].size(); ++i) EXPECT_EQ(pictures[0][i].colour, pictures[1][i].colour) << i;
    EXPECT_LT(static_cast<double>(shadow_indices[1]), 0.7 * static_cast<double>(shadow_indices[0]));
}

// A flight towards a rock, on which pools and lists grow and pages arrive and are evicted: with three frames in flight,
// a picture read now and then is the one that single frames give. Memory keeps to the budget, with what is replaced.
TEST_F(VgiRenderTest, FramesInFlightDrawWhatSingleFramesDraw) {
    const TriMesh mesh = mesh_of(Shape::rock, 20000);
    const std::array atlases{another_atlas_of(mesh, 64), another_atlas_of(mesh, 16, true)};
    for (const auto& [raster, budget] :
         {std::pair(vgi::Raster::bintree, uint64_t{1} << 26), std::pair(vgi::Raster::tess, uint64_t{1} << 26),
          std::pair(vgi::Raster::bintree, uint64_t{3} << 20)}) {
        std::vector<std::vector<uint8_t>> pictures;
        for (const uint32_t in_flight : {1u, 3u}) {
            RendererOptions options;
            options.frames_in_flight = in_flight;
            Renderer& renderer = make(options);
            if (raster == vgi::Raster::tess && !renderer.device().tessellates) break;
            files_ = {atlases[raster == vgi::Raster::bintree ? 1 : 0]};
            auto vgi = vgi::open_vgi(files_, {budget, 1, raster});
            ASSERT_TRUE(vgi) << vgi.error().message;
            ASSERT_TRUE(renderer.load((*vgi)->recipe(), plain()));
            Random random(3);
            std::vector<Arrival> arrivals;
            std::set<uint64_t> sizes;
            constexpr uint64_t frames = 16;
            for (uint64_t f = 0; f < frames; ++f) {
                FrameInput input = look_from({0.4f, 0.6f, 4.0f - 0.16f * static_cast<float>(f)});
                input.frame = f;
                // Whatever has left by now: evictions go by that of the slower of the two.
                ASSERT_TRUE(renderer.completed_frame());
                input.completed_frame = f < 3 ? 0 : f - 3;
                input.arrivals = std::move(arrivals);
                const Plan plan = (*vgi)->plan(input);
                arrivals = arrivals_of(plan, 1, random);
                ASSERT_TRUE(renderer.submit(plan, input, {}));
                sizes.insert(plan.stats.resident_bytes);
                EXPECT_LE(plan.stats.resident_bytes, budget);
                EXPECT_LE(renderer.buffer_bytes(), budget + 9 * 256) << "but for the device's alignment";
                if (f % 4 == 3) pictures.push_back(renderer.read_picture()->colour);
            }
            if (budget > uint64_t{1} << 24) { EXPECT_GT(sizes.size(), 3u) << "nothing grew"; }
            EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
        }
        if (pictures.empty()) continue;
        ASSERT_EQ(pictures.size(), 8u);
        for (size_t i = 0; i < 4; ++i) EXPECT_EQ(pictures[i], pictures[i + 4]) << i;
        EXPECT_NE(pictures[0], pictures[3]);
    }
}

TEST_F(VgiRenderTest, ColoursWhatSamplesWouldCostAndHowFarApartTheyAre) {
    const auto atlas = atlas_of(mesh_of(Shape::rock, 20000));
    Renderer& renderer = make();
    ShadingOptions look;
    Random random(6);
    const auto mean_red_over_blue = [&](vgi::Raster raster, DebugView view, double pixel_error) {
        auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 26, 1, raster});
        EXPECT_TRUE(vgi && renderer.load((*vgi)->recipe(), plain()));
        frame_ = 0;
        look.debug = view;
        FrameInput input = look_from({0.4f, 0.6f, 2.2f});
        input.budget.pixel_error = pixel_error;
        const Picture picture = draw(**vgi, input, look, 1, random);
        double red = 0, blue = 0;
        for (size_t i = 0; i < picture.colour.size(); i += 4) {
            if (picture.colour[i + 3] == 0) continue;
            red += picture.colour[i];
            blue += picture.colour[i + 2];
        }
        return red / blue;
    };
    // A bintree has what costs more than the pixel error; a grid also what is beside it and costs less.
    const double two = mean_red_over_blue(vgi::Raster::bintree, DebugView::error, 2),
                 half = mean_red_over_blue(vgi::Raster::bintree, DebugView::error, 0.5),
                 grid = mean_red_over_blue(vgi::Raster::grid, DebugView::error, 2);
    EXPECT_GT(two, half);
    EXPECT_GT(two, grid);
    // Samples are about as far apart as the mean.
    const double even = mean_red_over_blue(vgi::Raster::bintree, DebugView::stretch, 1);
    EXPECT_GT(even, 0.5);
    EXPECT_LT(even, 4.0);
    EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
}

// By their corners, each beginning with its least.
std::vector<std::array<glm::vec3, 3>> sorted(std::vector<std::array<glm::vec3, 3>> triangles) {
    const auto less = [](const glm::vec3& a, const glm::vec3& b) {
        return std::tuple(a.x, a.y, a.z) < std::tuple(b.x, b.y, b.z);
    };
    for (auto& t : triangles) std::rotate(t.begin(), std::ranges::min_element(t, less), t.end());
    std::ranges::sort(triangles, [&](const auto& a, const auto& b) {
        return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), less);
    });
    return triangles;
}

TEST_F(VgiRenderTest, TessellatesWhatTheGridDraws) {
    const TriMesh mesh = mesh_of(Shape::rock, 20000);
    Renderer& renderer = make();
    if (!renderer.device().tessellates) GTEST_SKIP() << renderer.device().name << " does not tessellate";
    const auto atlas = atlas_of(mesh);
    for (const double pixel_error : {0.25, 1.0, 4.0, 30.0}) {
        std::vector<Picture> pictures;
        std::vector<uint64_t> triangles;
        std::vector<std::vector<std::array<glm::vec3, 3>>> drawn;
        for (const auto raster : {vgi::Raster::grid, vgi::Raster::tess, vgi::Raster::device}) {
            Random random(4);
            // Room for the lists of all triangles: nobody has to raise the error.
            auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 28, 1, raster});
            ASSERT_TRUE(vgi);
            const auto loaded = renderer.load((*vgi)->recipe(), plain());
            ASSERT_TRUE(loaded) << loaded.error().message;
            frame_ = 0;
            FrameInput input = look_from({0.4f, 0.6f, 2.2f});
            input.budget.pixel_error = pixel_error;
            if (raster == vgi::Raster::device) {
                pictures.push_back(draw(**vgi, input, {}, 1, random));
            } else {
                PlanMirror mirror((*vgi)->recipe(), {vgi::pulled_vertex, vgi::patch_indices});
                pictures.push_back(draw(**vgi, input, {}, 1, random, &mirror));
                drawn.push_back(sorted(mirror.triangles_of(0)));
            }
            input.frame = input.completed_frame = frame_;
            triangles.push_back((*vgi)->plan(input).stats.triangles);
        }
        EXPECT_EQ(triangles[0], triangles[1]);
        EXPECT_EQ(triangles[0], triangles[2]);
        EXPECT_TRUE(drawn[0] == drawn[1]) << "the same triangles, bit for bit";
        // Corners may come in another order, which rounds otherwise; and where triangles seen edge-on meet just in the
        // middle of a pixel, a rasteriser may extrapolate their depths to beyond the far plane, or not.
        size_t covered = 0, unlike = 0, far = 0, order = 0, edges = 0;
        for (size_t i = 0; i < pictures[0].colour.size(); i += 4) {
            const auto* tess = &pictures[1].colour[i];
            covered += pictures[0].colour[i + 3] > 0;
            edges += pictures[0].colour[i + 3] != tess[3];
            order += !std::equal(tess, tess + 4, &pictures[2].colour[i]);
            int most = 0;
            for (size_t k = 0; k < 3; ++k)
                most = std::max(most, std::abs(pictures[0].colour[i + k] - pictures[1].colour[i + k]));
            unlike += most > 0;
            far += most > 8;
        }
        EXPECT_GT(covered, 5000u);
        EXPECT_LE(edges, 1u) << pixel_error;
        EXPECT_LE(order, 1u) << "the device's own nodes, in another order; at " << pixel_error;
        EXPECT_LT(unlike, covered / 20) << pixel_error;
        EXPECT_LE(far, covered / 1000) << pixel_error;
    }
    EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
}

// A node that is drawn, as its patch has it.
using PatchWords = std::array<uint32_t, LODE_VGI_PATCH_WORDS>;
std::vector<PatchWords> patches_of(std::span<const uint32_t> words, uint32_t views) {
    std::vector<PatchWords> patches;
    for (size_t at = 0; at < words.size(); at += LODE_VGI_PATCH_WORDS) {
        vgi::GridPatch patch = vgi::GridPatch::of_words(words.subspan(at, LODE_VGI_PATCH_WORDS));
        if (views != 0) patch.views = views;
        std::vector<uint32_t> again;
        patch.append_words(again);
        std::copy(again.begin(), again.end(), patches.emplace_back().begin());
    }
    return patches;
}
std::vector<uint32_t> words_of(const Blob& blob) {
    std::vector<uint32_t> words(blob.size() / sizeof(uint32_t));
    std::memcpy(words.data(), blob.data(), words.size() * sizeof(uint32_t));
    return words;
}

// By the views that see them, in the order of the words.
using PatchesByViews = std::map<uint32_t, std::vector<PatchWords>>;
void add_patches(std::span<const uint32_t> words, uint32_t views, PatchesByViews& to) {
    for (const PatchWords& patch : patches_of(words, views)) to[patch[0] >> LODE_VGI_PATCH_VIEWS].push_back(patch);
}

// An atlas that the device cuts, and what the processor needs to cut it, too: all its pages.
class AtlasToCut {
public:
    // first_page: among those of all atlases.
    AtlasToCut(const vgi::AtlasFile& file, uint32_t first_page)
        : about_(file.about()), tree_(vgi::tree_of(about_, vgi::Layer::geometry)), first_page_(first_page) {
        std::vector<vgi::Page> plain_pages;  // parents are pointed to while it grows
        plain_pages.reserve(pages());
        for (uint32_t chart = 0; chart < about_.charts(); ++chart) {
            for (uint32_t page = 0; page < tree_.pages(); ++page) {
                const vgi::Page* parent =
                    page == 0 ? nullptr : &plain_pages[size_t{chart} * tree_.pages() + tree_.parent(page)];
                const vgi::AtlasFile::PageName name{vgi::Layer::geometry, chart, page};
                const auto family = file.unpack(name, *file.read(name));
                EXPECT_TRUE(family);
                plain_pages.push_back(family->page(page, parent));
                texels_.push_back(
                    std::make_shared<const vgi::GeometryPage>(vgi::packed_geometry(plain_pages.back(), tree_)));
            }
        }
    }
    const vgi::Atlas& about() const { return about_; }
    uint32_t pages() const { return about_.charts() * tree_.pages(); }
    uint32_t first_page() const { return first_page_; }

    // With those pages that the table the device reads tells to be there.
    vgi::Residency residency(std::span<const uint32_t> table) const {
        vgi::Residency there(about_);
        for (uint32_t page = 0; page < pages(); ++page) {
            uint32_t level = 0, x = 0, y = 0;
            tree_.place(page % tree_.pages(), &level, &x, &y);
            const uint32_t entry = table[first_page_ + page];
            if ((entry & 15) == level) there.put(page, texels_[page], entry >> 4);  // else of a coarser page
        }
        there.update();
        return there;
    }

private:
    const vgi::Atlas& about_;
    vgi::PageTree tree_;
    uint32_t first_page_;
    std::vector<std::shared_ptr<const vgi::GeometryPage>> texels_;
};

// What the device wrote in a frame.
struct DeviceWrote {
    std::vector<uint32_t> table, list, records, findings;

    explicit DeviceWrote(std::span<const ReadbackResult> readbacks) {
        for (const ReadbackResult& r : readbacks) {
            if (r.tag == tag_of(vgi::page_table)) table = words_of(r.blob);
            if (r.tag == tag_of(vgi::draw_lists)) list = words_of(r.blob);
            if (r.tag == tag_of(vgi::cut_records)) records = words_of(r.blob);
            if (r.tag == tag_of(vgi::cut_findings)) findings = words_of(r.blob);
        }
    }
    static uint32_t tag_of(uint32_t buffer) { return 100 + buffer; }
    static void ask(const Recipe& recipe, Plan& plan) {
        for (const uint32_t b : {vgi::page_table, vgi::draw_lists, vgi::cut_records, vgi::cut_findings})
            plan.commands.push_back({Stage::update, Readback{b, 0, recipe.buffers[b].bytes, tag_of(b)}});
    }
    // Where the instance's draws say that its patches are, whatever view they are of; nothing of one without draws.
    PatchesByViews patches_of_instance(const Plan& plan, uint32_t instance) const {
        PatchesByViews found;
        for (const Command& command : plan.commands) {
            const auto* draw = std::get_if<DrawIndirect>(&command.what);
            if (draw == nullptr || plan.instance_ids[draw->draw.first_id] != instance) continue;
            const uint32_t first = draw->draw.words[LODE_VGI_WORD_PATCH];
            for (uint32_t r = 0; r < draw->draws; ++r) {
                const uint32_t* record = records.data() + draw->offset / sizeof(uint32_t) + 4 * r;
                if (record[0] == 0) continue;
                const auto part =
                    std::span(list).subspan(first + record[2] * LODE_VGI_PATCH_WORDS, record[0] * LODE_VGI_PATCH_WORDS);
                add_patches(part, 0, found);
                EXPECT_EQ(record[1], 1u);
                EXPECT_EQ(plan.instance_ids[record[3]], instance);
            }
            return found;
        }
        return found;
    }
};

// From any eye, with whatever pages are there, for instances of atlases of any sizes that lie anyhow, at any error: the
// same nodes, with the same neighbours, in the same views, in the same order, as the processor cuts, bit for bit; and
// the same pages are used and missed.
TEST_F(VgiRenderTest, TheDeviceCutsTheNodesThatTheProcessorCuts) {
    Renderer& renderer = make();
    if (!renderer.device().tessellates) GTEST_SKIP() << renderer.device().name << " does not tessellate";
    Random random(8);
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    size_t cuts = 0, nodes = 0, pages = 0, asked = 0, shadows_only = 0, unseen = 0;
    for (const int round : {0, 1, 2}) {
        atlas_of(mesh_of(round == 1 ? Shape::terrain : Shape::rock, 20000));
        if (round == 2) another_atlas_of(mesh_of(Shape::torus, 5000), 16);
        constexpr uint32_t instances = 3;
        auto source = vgi::open_vgi(files_, {uint64_t{1} << 26, instances, vgi::Raster::device});
        ASSERT_TRUE(source) << source.error().message;
        const auto loaded = renderer.load((*source)->recipe(), plain());
        ASSERT_TRUE(loaded) << loaded.error().message;
        std::vector<AtlasToCut> atlases;
        for (const auto& file : files_)
            atlases.emplace_back(*file, atlases.empty() ? 0 : atlases.back().first_page() + atlases.back().pages());
        std::vector<ReadbackResult> readbacks;
        std::vector<Arrival> arrivals;
        for (frame_ = 0; frame_ < 60; ++frame_) {
            const glm::vec3 eye = glm::normalize(glm::vec3(unit(), unit(), unit()) + glm::vec3(0.01f)) *
                                  (1.1f + 3 * static_cast<float>(random.unit()));
            FrameInput input = look_from(eye);
            input.views[0].culls_back_faces = frame_ % 3 != 0;
            if (frame_ % 4 == 0) input.views.pop_back();
            if (frame_ % 5 == 4) input.level_view = look_from(eye * 1.5f).views[0];
            input.instances.resize(1 + frame_ % instances);
            for (size_t i = 0; i < input.instances.size(); ++i) {
                Instance& instance = input.instances.edit(i);
                instance.asset = static_cast<uint32_t>((frame_ / 3 + i) % atlases.size());
                glm::mat4& m = instance.object_to_world;
                if (i > 0) {
                    m = glm::translate(glm::mat4(1), glm::vec3(unit(), unit(), unit()) * 2.0f);
                    m = glm::rotate(m, 3 * unit(), glm::normalize(glm::vec3(unit(), 1.1f, unit())));
                    m = glm::scale(m, glm::vec3(i == 2 ? -1 : 1, 0.7f + 0.4f * unit(), 1));
                }
                // No view sees the last but one, or any.
                if (frame_ % 12 == 11 || (frame_ % 6 == 5 && i == 1)) m[3] += glm::vec4(eye * 50.0f, 0);
            }
            input.budget.pixel_error = std::exp2(3 * static_cast<double>(unit()));
            input.budget.forced_level =
                frame_ % 7 == 6 ? static_cast<int64_t>(frame_) / 7 % atlases[0].about().levels() : -1;
            input.frame = frame_;
            input.completed_frame = frame_;
            input.readbacks = std::move(readbacks);
            input.arrivals = std::move(arrivals);
            Plan plan = (*source)->plan(input);
            DeviceWrote::ask((*source)->recipe(), plan);
            readbacks = submit(plan, input, {});
            arrivals = arrivals_of(plan, 0.1, random);
            const DeviceWrote wrote(readbacks);
            std::vector<vgi::Residency> residencies;
            std::vector<vgi::PageDemand> demands;
            for (const AtlasToCut& atlas : atlases) {
                ASSERT_GE(wrote.table.size(), atlas.first_page() + atlas.pages());
                residencies.push_back(atlas.residency(wrote.table));
                demands.emplace_back(residencies.back().units());
            }
            for (uint32_t i = 0; i < input.instances.size(); ++i) {
                const uint32_t asset = input.instances[i].asset;
                vgi::CutRequest request;
                request.object_to_world = input.instances[i].object_to_world;
                request.views = input.views;
                request.level_view = input.level_view ? &*input.level_view : nullptr;
                request.pixel_error = input.budget.pixel_error;
                // Level 0 is that of leaves, which only the bintree draws.
                request.forced_level = input.budget.forced_level - (input.budget.forced_level > 0 ? 1 : 0);
                request.cull_back_faces = input.views[0].culls_back_faces;
                PatchesByViews expected;
                const vgi::Cut cut =
                    vgi::cut_grid(residencies[asset], request, demands[asset], vgi::GridOutput::patches);
                for (const auto& [views, words] : cut.parts) {
                    add_patches(words, views, expected);
                    shadows_only += views == 2;
                }
                const PatchesByViews found = wrote.patches_of_instance(plan, i);
                ASSERT_EQ(found, expected) << "frame " << frame_ << " instance " << i;
                for (const auto& [views, patches] : found) nodes += patches.size();
                unseen += found.empty();
                ++cuts;
            }
            for (size_t a = 0; a < atlases.size(); ++a) {
                for (uint32_t page = 0; page < atlases[a].pages(); ++page) {
                    const uint32_t* of_page =
                        &wrote.findings[LODE_CUT_FIRST_FINDING + 2 * (atlases[a].first_page() + page)];
                    ASSERT_EQ(of_page[0] != 0, demands[a].touched(page)) << frame_ << " " << a << " " << page;
                    ASSERT_EQ(of_page[1] != 0, demands[a].wish(page) > 0) << frame_ << " " << a << " " << page;
                    pages += of_page[0] != 0;
                    asked += of_page[1] != 0;
                }
            }
        }
    }
    EXPECT_EQ(cuts, 360u);
    EXPECT_GT(nodes, 360u * 40u);
    EXPECT_GT(pages, 180u * 30u);
    EXPECT_GT(asked, 180u);
    EXPECT_GT(shadows_only, 10u) << "some nodes are in the shadow's view alone";
    EXPECT_GT(unseen, 20u) << "some instances are in no view";
}

// Nodes that the passes of a cut look at, each of them once: those of all lists but the last, which is of what is
// drawn.
TEST_F(VgiRenderTest, TheDeviceWorksOnWhatIsReachedAlone) {
    const auto atlas = atlas_of(mesh_of(Shape::rock, 20000));
    Renderer& renderer = make();
    if (!renderer.device().tessellates) GTEST_SKIP() << renderer.device().name << " does not tessellate";
    constexpr uint32_t instances = 4;
    auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 26, instances, vgi::Raster::device});
    ASSERT_TRUE(vgi && renderer.load((*vgi)->recipe(), plain()));
    Random random(10);
    const auto& buffers = (*vgi)->recipe().buffers;
    const uint64_t all_nodes = buffers[vgi::cut_states].bytes / sizeof(uint32_t) / instances;
    const auto listed = [&](FrameInput input) {
        draw(**vgi, input, {}, 1, random);
        input.frame = frame_++;
        input.completed_frame = *renderer.completed_frame();
        Plan plan = (*vgi)->plan(input);
        for (const uint32_t b : {vgi::cut_lists, vgi::cut_entries})
            plan.commands.push_back({Stage::update, Readback{b, 0, buffers[b].bytes, 100 + b}});
        std::vector<gpu::VgiCutList> lists(LODE_CUT_LIST_COUNT);
        std::vector<uint32_t> entries;
        for (const ReadbackResult& r : submit(plan, input, {})) {
            if (r.tag == 100 + vgi::cut_entries) entries = words_of(r.blob);
            if (r.tag == 100 + vgi::cut_lists) std::memcpy(lists.data(), r.blob.data(), r.blob.size());
        }
        std::vector<uint32_t> nodes;
        uint32_t groups = 0;
        for (uint32_t l = 0; l <= LODE_CUT_DRAWN; ++l) {
            const auto own = std::span(entries).subspan(lists[l].first, lists[l].entries);
            EXPECT_EQ(lists[l].groups_x, (lists[l].entries + LODE_CUT_GROUP - 1) / LODE_CUT_GROUP) << l;
            if (l == LODE_CUT_DRAWN) continue;
            EXPECT_LE(lists[l].first + lists[l].entries, lists[l + 1].first) << l;
            nodes.insert(nodes.end(), own.begin(), own.end());
            groups += lists[l].groups_x;
        }
        EXPECT_EQ(lists[LODE_CUT_ALL].groups_x, groups) << "what is cleared";
        std::ranges::sort(nodes);
        EXPECT_TRUE(std::ranges::adjacent_find(nodes) == nodes.end()) << "each node once";
        return nodes.size();
    };
    FrameInput near = look_from({0.3f, 0.5f, 1.6f}), far = look_from({9, 15, 48});
    near.budget.pixel_error = 0.25;
    const size_t charts = atlas->about().charts(), of_near = listed(near), of_far = listed(far);
    EXPECT_LE(of_near, all_nodes);
    // One test decides for all nodes of levels that lie in the same page, here down to level 2: 3 + 1 + 4 nodes, and
    // the 16 that they are divided into.
    EXPECT_LE(of_far, 24 * charts);
    EXPECT_LT(of_far, of_near / 3);
    EXPECT_GE(of_far, charts);
    // Instances that no view sees add nothing.
    near.instances.resize(instances);
    for (uint32_t i = 1; i < instances; ++i) near.instances.edit(i).object_to_world[3] = {0, 0, 100.0f * float(i), 1};
    EXPECT_EQ(listed(near), of_near);
    near.instances.edit(0).object_to_world[3] = {0, 0, 50, 1};
    EXPECT_EQ(listed(near), 0u);
    near.instances.edit(0).object_to_world[3] = {0, 0, 0, 1};
    EXPECT_EQ(listed(near), of_near);
}

TEST_F(VgiRenderTest, TheDeviceKeepsToABudgetOfTrianglesAndStaysThere) {
    const auto atlas = atlas_of(mesh_of(Shape::rock, 20000));
    Renderer& renderer = make();
    if (!renderer.device().tessellates) GTEST_SKIP() << renderer.device().name << " does not tessellate";
    auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << 26, 1, vgi::Raster::device});
    ASSERT_TRUE(vgi && renderer.load((*vgi)->recipe(), plain()));
    Random random(9);
    FrameInput input = look_from({0.4f, 0.6f, 2.2f});
    input.budget.pixel_error = 0.5;
    draw(**vgi, input, {}, 1, random);
    input.frame = input.completed_frame = frame_;
    const uint64_t all = (*vgi)->plan(input).stats.triangles;
    input.budget.max_triangles = all / 3;
    std::vector<double> raised;
    std::vector<uint64_t> triangles;
    for (int f = 0; f < 40; ++f) {
        input.frame = ++frame_;
        input.completed_frame = frame_;
        const Plan plan = (*vgi)->plan(input);
        input.readbacks = submit(plan, input, {});
        triangles.push_back(plan.stats.triangles);
        for (const auto& [name, value] : plan.stats.more) {
            if (name == "raised_error") raised.push_back(value);
        }
    }
    ASSERT_EQ(raised.size(), 40u);
    EXPECT_LE(triangles.back(), all / 3);
    EXPECT_GT(triangles.back(), all / 8);
    for (size_t f = 25; f < 40; ++f) EXPECT_EQ(raised[f], raised.back()) << f;
    EXPECT_GT(raised.back(), 1);
}

}  // namespace
}  // namespace lodestone
