// The backend vgi on whatever device is there; validation must stay silent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <tuple>

#include "base/random.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "mesh/generate.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"
#include "render/device_test.h"
#include "report/image_metrics.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/pulled_vertex.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/draw/vgi_source.h"
#include "vgi/study/grid_cut.h"
#include "vgi/study/grid_patch.h"
#include "vgi/study/patch_indices.h"

namespace lodestone {
namespace {

constexpr uint32_t width = 320, height = 240;

class VgiRenderTest : public DeviceTest {
protected:
    VgiRenderTest()
        : DeviceTest(width, height),
          path_(std::filesystem::temp_directory_path() /
                ("lodestone-vgi-render-" + std::to_string(getpid()) + ".lode")) {}
    void TearDown() override {
        DeviceTest::TearDown();
        std::filesystem::remove(path_);
    }
    std::shared_ptr<const vgi::AtlasFile> atlas_of(const TriMesh& mesh) {
        vgi::AtlasOptions options;
        options.clusters.clusters = 12;
        options.cells = 64;
        options.error_samples = 1000;
        vgi::AtlasReport report;
        const auto atlas = vgi::make_atlas(mesh, options, report);
        EXPECT_TRUE(atlas);
        auto writer = ChunkWriter::create(path_, {});
        EXPECT_TRUE(writer && vgi::write_chunks(*atlas, *writer) && writer->commit());
        auto opened = vgi::AtlasFile::open(*ChunkFile::open(path_));
        EXPECT_TRUE(opened);
        file_ = std::make_shared<const vgi::AtlasFile>(std::move(*opened));
        return file_;
    }
    // Draws, with those of the pages asked for that luck lets through.
    // mirror: executes the plans, too, where there is one.
    Picture draw(FrameSource& source, FrameInput input, const ShadingOptions& look, double luck, Random& random,
                 PlanMirror* mirror = nullptr) {
        std::vector<Arrival> arrivals;
        for (int quiet = 0, frames = 0; quiet < 3 && frames < 40; ++frames) {
            input.frame = frame_++;
            input.completed_frame = *renderer_->completed_frame();
            input.arrivals = std::move(arrivals);
            const Plan plan = source.plan(input);
            if (mirror != nullptr) {
                const auto mirrored = mirror->execute(plan, input);
                EXPECT_TRUE(mirrored) << mirrored.error().message;
            }
            input.readbacks = submit(plan, input, look);
            arrivals = arrivals_of(plan, luck, random);
            quiet = arrivals.empty() && input.arrivals.empty() ? quiet + 1 : 0;
        }
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture) << picture.error().message;
        return std::move(*picture);
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
            EXPECT_TRUE(file_->file().read_part(r.chunk, r.offset, part));
            arrivals.push_back({r.id, Blob(std::move(part))});
        }
        return arrivals;
    }
    // around: more pixels at each side.
    FrameInput look_from(const glm::vec3& eye, uint32_t around = 0) {
        Camera camera;
        camera.eye = eye;
        camera.near_plane = 0.05f;
        const uint32_t tall = height + 2 * around;
        camera.fov_y =
            2 * std::atan(std::tan(camera.fov_y / 2) * static_cast<float>(tall) / static_cast<float>(height));
        FrameInput input;
        input.views = {view_of(camera, width + 2 * around, tall),
                       shadow_view(ShadingOptions{}.light_direction, {0, 0, 0}, 3, 512)};
        input.views[0].culls_back_faces = true;
        input.instances = {Instance{}};
        return input;
    }
    std::shared_ptr<const vgi::AtlasFile> file_;
    std::filesystem::path path_;
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

MaterialSet plain() { return {{SurfaceMaterial{}}, 0, 0, {}}; }

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
        EXPECT_EQ(background_leaks(picture, expected), 0u);
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
    const auto atlas = atlas_of(mesh);
    size_t drawn = 0;
    // Where triangles cross the picture's border rasterisers cut them, and two that share an edge may get ends of it
    // that differ by a 256th of a pixel: some pixels around the picture are drawn and not looked at.
    constexpr uint32_t around = 16;
    ASSERT_TRUE(renderer.resize(width + 2 * around, height + 2 * around));
    const std::array rasters{vgi::Raster::bintree, vgi::Raster::grid, vgi::Raster::tess, vgi::Raster::device};
    for (int pool = 0; pool < 12; ++pool) {
        const auto raster = rasters[static_cast<size_t>(pool) % rasters.size()];
        auto vgi = vgi::open_vgi({atlas}, {uint64_t{1} << (pool % 2 == 0 ? 22 : 26), 1, raster});
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
            ASSERT_EQ(picture.width, width);
            EXPECT_EQ(enclosed_background(picture), 0u) << pool << " " << i;
            for (size_t k = 3; k < picture.colour.size(); k += 4) drawn += picture.colour[k] > 0;
        }
    }
    EXPECT_GT(drawn, 240u * 5000u);
}

TEST_F(VgiRenderTest, DrawsTheSameFromPoolsInPieces) {
    const TriMesh mesh = mesh_of(Shape::rock, 20000);
    Random random(3);
    const auto atlas = atlas_of(mesh);
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

// From any eye, with whatever pages are there, for instances that lie anyhow, at any error: the same nodes, with the
// same neighbours, in the same views, as the processor cuts, bit for bit.
TEST_F(VgiRenderTest, TheDeviceCutsTheNodesThatTheProcessorCuts) {
    Renderer& renderer = make();
    if (!renderer.device().tessellates) GTEST_SKIP() << renderer.device().name << " does not tessellate";
    Random random(8);
    const auto unit = [&] { return static_cast<float>(random.unit()) * 2 - 1; };
    size_t cuts = 0, nodes = 0, pages = 0, shadows_only = 0;
    for (const Shape shape : {Shape::rock, Shape::terrain}) {
        const auto atlas = atlas_of(mesh_of(shape, 20000));
        const vgi::Atlas& about = atlas->about();
        constexpr uint32_t instances = 3;
        auto source = vgi::open_vgi({atlas}, {uint64_t{1} << 26, instances, vgi::Raster::device});
        ASSERT_TRUE(source) << source.error().message;
        const auto loaded = renderer.load((*source)->recipe(), plain());
        ASSERT_TRUE(loaded) << loaded.error().message;
        const auto& buffers = (*source)->recipe().buffers;
        std::vector<ReadbackResult> readbacks;
        std::vector<Arrival> arrivals;
        // Pages as they are told to be there by the table the device reads.
        std::vector<std::shared_ptr<const vgi::GeometryPage>> texels;
        const vgi::PageTree tree = vgi::tree_of(about, vgi::Layer::geometry);
        const auto channels = vgi::channels_of(about.attributes, vgi::Layer::geometry);
        std::vector<vgi::Page> plain_pages;  // parents are pointed to while it grows
        plain_pages.reserve(size_t{about.charts()} * tree.pages());
        for (uint32_t chart = 0; chart < about.charts(); ++chart) {
            for (uint32_t page = 0; page < tree.pages(); ++page) {
                const vgi::Page* parent =
                    page == 0 ? nullptr : &plain_pages[size_t{chart} * tree.pages() + tree.parent(page)];
                const vgi::AtlasFile::PageName name{vgi::Layer::geometry, chart, page};
                const auto family = atlas->unpack(name, channels, *atlas->read(name));
                ASSERT_TRUE(family);
                plain_pages.push_back(family->page(page, parent));
                texels.push_back(
                    std::make_shared<const vgi::GeometryPage>(vgi::packed_geometry(plain_pages.back(), tree)));
            }
        }
        for (frame_ = 0; frame_ < 60; ++frame_) {
            const glm::vec3 eye = glm::normalize(glm::vec3(unit(), unit(), unit()) + glm::vec3(0.01f)) *
                                  (1.1f + 3 * static_cast<float>(random.unit()));
            FrameInput input = look_from(eye);
            input.views[0].culls_back_faces = frame_ % 3 != 0;
            if (frame_ % 4 == 0) input.views.pop_back();
            if (frame_ % 5 == 4) input.level_view = look_from(eye * 1.5f).views[0];
            input.instances.resize(1 + frame_ % instances);
            for (size_t i = 1; i < input.instances.size(); ++i) {
                glm::mat4& m = input.instances.edit(i).object_to_world;
                m = glm::translate(glm::mat4(1), glm::vec3(unit(), unit(), unit()) * 2.0f);
                m = glm::rotate(m, 3 * unit(), glm::normalize(glm::vec3(unit(), 1.1f, unit())));
                m = glm::scale(m, glm::vec3(i == 2 ? -1 : 1, 0.7f + 0.4f * unit(), 1));
            }
            input.budget.pixel_error = std::exp2(3 * static_cast<double>(unit()));
            input.budget.forced_level = frame_ % 7 == 6 ? static_cast<int64_t>(frame_) / 7 % about.levels() : -1;
            input.frame = frame_;
            input.completed_frame = frame_;
            input.readbacks = std::move(readbacks);
            input.arrivals = std::move(arrivals);
            Plan plan = (*source)->plan(input);
            for (const uint32_t b : {vgi::page_table, vgi::draw_lists, vgi::cut_records})
                plan.commands.push_back({Stage::update, Readback{b, 0, buffers[b].bytes, 100 + b}});
            readbacks = submit(plan, input, {});
            arrivals = arrivals_of(plan, 0.1, random);
            std::vector<uint32_t> table, list, records;
            for (const ReadbackResult& r : readbacks) {
                if (r.tag == 100 + vgi::page_table) table = words_of(r.blob);
                if (r.tag == 100 + vgi::draw_lists) list = words_of(r.blob);
                if (r.tag == 100 + vgi::cut_records) records = words_of(r.blob);
            }
            ASSERT_GE(table.size(), texels.size());
            vgi::Residency residency(about);
            for (uint32_t page = 0; page < texels.size(); ++page) {
                uint32_t level = 0, x = 0, y = 0;
                tree.place(page % tree.pages(), &level, &x, &y);
                if ((table[page] & 15) != level) continue;  // of a coarser page
                residency.put(page, texels[page], table[page] >> 4);
                ++pages;
            }
            residency.update();
            for (uint32_t i = 0; i < input.instances.size(); ++i) {
                vgi::CutRequest request;
                request.object_to_world = input.instances[i].object_to_world;
                request.views = input.views;
                request.level_view = input.level_view ? &*input.level_view : nullptr;
                request.pixel_error = input.budget.pixel_error;
                request.forced_level = input.budget.forced_level;
                request.cull_back_faces = input.views[0].culls_back_faces;
                vgi::PageDemand demand(residency.pages());
                std::vector<PatchWords> expected, found;
                const vgi::Cut cut = vgi::cut_grid(residency, request, demand, vgi::GridOutput::patches);
                for (const auto& [views, words] : cut.parts) {
                    for (const PatchWords& patch : patches_of(words, views)) expected.push_back(patch);
                    shadows_only += views == 2;
                }
                // Where the instance's draws say that its patches are.
                uint32_t first = ~0u, first_record = 0, of_draw = 0;
                for (const Command& command : plan.commands) {
                    const auto* draw = std::get_if<DrawIndirect>(&command.what);
                    if (draw == nullptr || command.stage != Stage::depth || of_draw++ != i) continue;
                    first = draw->draw.words[LODE_VGI_WORD_PATCH];
                    first_record = static_cast<uint32_t>(draw->offset / sizeof(uint32_t));
                    for (uint32_t r = 0; r < draw->draws; ++r) {
                        const uint32_t* record = records.data() + first_record + 4 * r;
                        const auto part = std::span(list).subspan(first + record[2] * LODE_VGI_PATCH_WORDS,
                                                                  record[0] * LODE_VGI_PATCH_WORDS);
                        for (const PatchWords& patch : patches_of(part, 0)) found.push_back(patch);
                        EXPECT_EQ(record[3], i);
                    }
                }
                std::ranges::sort(expected);
                std::ranges::sort(found);
                ASSERT_EQ(found, expected) << "frame " << frame_ << " instance " << i;
                nodes += found.size();
                ++cuts;
            }
        }
    }
    EXPECT_EQ(cuts, 240u);
    EXPECT_GT(nodes, 240u * 50u);
    EXPECT_GT(pages, 120u * 40u);
    EXPECT_GT(shadows_only, 10u) << "some nodes are in the shadow's view alone";
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
