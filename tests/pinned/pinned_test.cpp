// What bakes, plans and pictures are, byte for byte, so that nothing changes without being meant to.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "baseline/discrete.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "lod/draw/lod_source.h"
#include "mesh/packed_vertices.h"
#include "pinned/pins.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/vgi_source.h"
#ifdef LODESTONE_WITH_RENDER
#include "render/renderer.h"
#endif

namespace lodestone {
namespace {

struct Subject {
    std::string name;
    TriMesh mesh;
};
// One of each kind: closed and open, hanging over, with a handle, with seams, in pieces.
std::vector<Subject> subjects() {
    return {{"rock", fixtures::repaired(Shape::rock, 6000)},      {"terrain", fixtures::repaired(Shape::terrain, 5000)},
            {"cliff", fixtures::repaired(Shape::cliff, 4000)},    {"vase", fixtures::repaired(Shape::vase, 4000)},
            {"torus", fixtures::repaired(Shape::torus, 3000, 1)}, {"debris", fixtures::grid_with_debris()}};
}
TriMesh rock() { return fixtures::repaired(Shape::rock, 6000); }

ProgressiveMesh progressive(const TriMesh& mesh) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    EXPECT_TRUE(list);
    auto pm = bake_progressive_mesh(mesh, *list, {"static", "classic", "greedy", "keyframe"});
    EXPECT_TRUE(pm);
    const auto errors = measure_errors(*pm, {5000, 1});
    EXPECT_TRUE(errors);
    pm->set_errors(*errors);
    return std::move(*pm);
}

vgi::Atlas atlas_of(const TriMesh& mesh) {
    vgi::AtlasOptions options;
    options.clusters.clusters = 12;
    options.cells = 64;
    options.error_samples = 1000;
    vgi::AtlasReport report;
    auto atlas = vgi::make_atlas(mesh, options, report);
    EXPECT_TRUE(atlas) << atlas.error().message;
    return std::move(*atlas);
}

void add_text(HashStream& hash, const std::string& text) {
    hash.add(std::as_bytes(std::span(text.data(), text.size())));
}

// A file that goes when the test ends.
class Pinned : public testing::Test {
protected:
    void TearDown() override { std::filesystem::remove(path_); }
    template <class Asset>
    ChunkFile written(const Asset& asset) {
        auto writer = ChunkWriter::create(path_, {});
        EXPECT_TRUE(writer);
        if constexpr (std::is_same_v<Asset, vgi::Atlas>) {
            EXPECT_TRUE(vgi::write_chunks(asset, *writer));
        } else {
            EXPECT_TRUE(asset.write_chunks(*writer));
        }
        EXPECT_TRUE(writer->commit());
        auto file = ChunkFile::open(path_);
        EXPECT_TRUE(file);
        return *file;
    }
    // Chunks as they are stored, but for those that a library has compressed.
    static Hash128 content_of(const ChunkFile& file) {
        HashStream all;
        for (const ChunkInfo& chunk : file.chunks()) {
            if (chunk.name.ends_with("_pages") || chunk.name.ends_with("_ends")) continue;
            if (chunk.name == "lod/blocks" || chunk.name == "lod/table") continue;
            add_text(all, chunk.name);
            all.add(*file.bytes(chunk.name));
        }
        return all.digest();
    }
    // What is played of a progressive mesh.
    static Hash128 played(const ChunkFile& file) {
        HashStream all;
        const auto pm = ProgressiveMesh::open(file);
        EXPECT_TRUE(pm);
        const auto add = [&](auto values) { all.add(std::as_bytes(values)); };
        add(pm->vertices);
        add(pm->wedge_vertex);
        add(pm->ecols);
        add(pm->parents);
        add(pm->errors);
        for (const FaceOrder& order : pm->orders) {
            add_text(all, order.name);
            add(order.indices);
            add(order.first_corner);
            add(order.corners);
            add(order.tswaps);
            add(order.cycle_lengths);
            add(order.cycle_slots);
            add(order.keyframes);
            add(order.block_ends);
            add(order.block_bytes);
        }
        return all.digest();
    }
    const std::filesystem::path path_ =
        std::filesystem::temp_directory_path() / ("lodestone-pinned-" + std::to_string(getpid()) + ".lode");
};

TEST_F(Pinned, Assets) {
    for (const Subject& s : subjects()) {
        SCOPED_TRACE(s.name);
        const ChunkFile lod = written(progressive(s.mesh));
        pins::expect("asset " + s.name + " lod", content_of(lod));
        pins::expect("asset " + s.name + " lod played", played(lod));
        const auto chain = make_discrete_chain(s.mesh);
        ASSERT_TRUE(chain);
        pins::expect("asset " + s.name + " discrete", content_of(written(*chain)));
        const ChunkFile file = written(atlas_of(s.mesh));
        HashStream decoded;
        add_text(decoded, content_of(file).hex());
        const auto atlas = vgi::open_atlas(file);
        ASSERT_TRUE(atlas);
        for (const vgi::Layer layer : {vgi::Layer::geometry, vgi::Layer::attributes}) {
            for (uint32_t chart = 0; chart < atlas->charts(); ++chart) {
                for (const vgi::Page& page : vgi::read_pages(*atlas, layer, chart))
                    decoded.add(std::as_bytes(std::span(page.values)));
            }
        }
        pins::expect("asset " + s.name + " vgi", decoded.digest());
    }
}

constexpr uint32_t width = 320, height = 240, shadow_texels = 256;

// Round two rocks, one of them turning, from far to near.
FrameInput frame_of_flight(uint64_t frame, uint64_t frames) {
    const float t = static_cast<float>(frame) / static_cast<float>(frames);
    Camera camera;
    const float away = 6 - 4.4f * t;
    camera.eye = {away * std::sin(3 * t), 0.6f, away * std::cos(3 * t)};
    camera.near_plane = 0.05f;
    FrameInput input;
    input.views = {view_of(camera, width, height), shadow_view({0.2f, -1, 0.1f}, {0, 0, 0}, 3, shadow_texels)};
    input.views[0].culls_back_faces = true;
    input.instances.resize(2);
    const float turn = 0.02f * static_cast<float>(frame);
    input.instances.edit(1).object_to_world = {{0.5f * std::cos(turn), 0, 0.5f * std::sin(turn), 0},
                                               {0, 0.5f, 0, 0},
                                               {-0.5f * std::sin(turn), 0, 0.5f * std::cos(turn), 0},
                                               {1.5f, 0.2f, 0.4f, 1}};
    input.budget.pixel_error = frame < frames / 2 ? 1 : 2;
    input.budget.upload_bytes = 400'000;
    input.frame = frame;
    input.completed_frame = frame > 1 ? frame - 1 : 0;
    return input;
}

using Sources = std::vector<std::pair<std::string, std::unique_ptr<FrameSource>>>;

class PinnedFrames : public Pinned {
protected:
    // Every backend in every way it can draw, on the rock.
    Sources sources() {
        mesh_ = rock();
        file_ = std::make_shared<const vgi::AtlasFile>(std::move(*vgi::AtlasFile::open(written(atlas_of(mesh_)))));
        lod_ = std::make_shared<const ProgressiveMesh>(progressive(mesh_));
        vertices_ = pack_vertices(mesh_);
        for (const Triangle& t : mesh_.triangles) indices_.insert(indices_.end(), t.begin(), t.end());
        Sources all;
        const auto add = [&](const std::string& name, Result<std::unique_ptr<FrameSource>> source) {
            ASSERT_TRUE(source) << source.error().message;
            all.emplace_back(name, std::move(*source));
        };
        const uint64_t plenty = uint64_t{1} << 28;
        add("full", open_fixed_levels({full_level(vertices_, indices_)}, plenty));
        auto chain = std::make_shared<const DiscreteChain>(std::move(*make_discrete_chain(mesh_)));
        add("discrete", open_fixed_levels({fixed_levels_of(std::move(chain))}, plenty));
        for (const FaceOrder& order : lod_->orders)
            add("lod " + order.name, open_lod({lod_}, {.order = order.name, .instances = 2}));
        add("lod geomorph", open_lod({lod_}, {.order = "keyframe", .instances = 2, .geomorph = true}));
        const std::pair<const char*, vgi::Raster> rasters[] = {{"bintree", vgi::Raster::bintree},
                                                               {"grid", vgi::Raster::grid},
                                                               {"grid-area", vgi::Raster::grid_area},
                                                               {"tess", vgi::Raster::tess},
                                                               {"device", vgi::Raster::device}};
        for (const auto& [name, raster] : rasters)
            add(std::string("vgi ") + name, vgi::open_vgi({file_}, {plenty, 2, raster}));
        add("vgi small", vgi::open_vgi({file_}, {uint64_t{3} << 20, 2}));
        return all;
    }
    std::vector<Arrival> arrivals_of(const Plan& plan) const {
        std::vector<Arrival> arrivals;
        for (const PageRequest& r : plan.requests) {
            std::vector<std::byte> part(r.bytes);
            EXPECT_TRUE(file_->file().read_part(r.chunk, r.offset, part));
            arrivals.push_back({r.id, Blob(std::move(part))});
        }
        return arrivals;
    }
    TriMesh mesh_;
    std::shared_ptr<const vgi::AtlasFile> file_;
    std::shared_ptr<const ProgressiveMesh> lod_;
    std::vector<MeshVertex> vertices_;
    std::vector<uint32_t> indices_;
};

TEST_F(PinnedFrames, Plans) {
    constexpr uint64_t frames = 60;
    for (const auto& [name, source] : sources()) {
        SCOPED_TRACE(name);
        HashStream all;
        std::vector<Arrival> arrivals;
        for (uint64_t frame = 0; frame < frames; ++frame) {
            FrameInput input = frame_of_flight(frame, frames);
            input.arrivals = std::move(arrivals);
            const Plan plan = source->plan(input);
            arrivals = arrivals_of(plan);
            add_text(all, hash_of_plan(plan).hex());
        }
        ASSERT_TRUE(source->validate());
        pins::expect("plans " + name, all.digest());
    }
}

#ifdef LODESTONE_WITH_RENDER
TEST_F(PinnedFrames, Pictures) {
    const auto devices = list_devices();
    if (!devices || devices->empty()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    RendererOptions options;
    options.width = width;
    options.height = height;
    options.shadow_size = shadow_texels;
    auto renderer = Renderer::create(options);
    ASSERT_TRUE(renderer) << renderer.error().message;
    const DeviceInfo device = (*renderer)->device();
    if (const std::string driver = device.name + ", " + device.driver; !pins::taken_with(driver))
        GTEST_SKIP() << "pictures were taken with another driver than " << driver;
    for (const auto& [name, source] : sources()) {
        if (name != "full" && name != "discrete" && name != "lod keyframe" && name != "vgi bintree") continue;
        ASSERT_TRUE((*renderer)->load(source->recipe(), {{Material{}}, {}}));
        std::vector<Arrival> arrivals;
        for (uint64_t frame = 0; frame < 24; ++frame) {
            FrameInput input = frame_of_flight(40, 60);
            input.budget.upload_bytes = ~uint64_t{0};
            input.frame = frame;
            input.completed_frame = *(*renderer)->completed_frame();
            input.arrivals = std::move(arrivals);
            const Plan plan = source->plan(input);
            ASSERT_TRUE((*renderer)->submit(plan, input, {}));
            ASSERT_TRUE((*renderer)->wait());
            arrivals = arrivals_of(plan);
        }
        const auto picture = (*renderer)->read_picture();
        ASSERT_TRUE(picture);
        pins::expect("picture " + name + ", " + pins::processor(), hash_of(std::span<const uint8_t>(picture->colour)));
    }
}
#endif

}  // namespace
}  // namespace lodestone
