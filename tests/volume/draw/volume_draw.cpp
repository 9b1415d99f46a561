#include "volume/draw/volume_draw.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "mesh/io/image_file.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"

namespace lodestone {

using volume::Emitter;
using volume::VolumeOptions;
using volume::VolumeSource;

Emitter puff() {
    Emitter e;
    e.velocity = glm::vec3(0);
    e.velocity_spread = 0;
    e.turning = 0;
    e.spread = 0.3f;
    e.particles = 4;
    e.radius_from = e.radius_to = 0.4f;
    e.fade = 0;
    e.look.density_from = 5;
    e.look.density_to = 0;
    e.look.colour_from = {0.9f, 0.7f, 0.5f};
    e.look.colour_to = {0.4f, 0.6f, 0.8f};
    return e;
}

Emitter ball(float density, float radius) {
    Emitter e = puff();
    e.spread = 0;
    e.particles = 1;
    e.displacement = 0;
    e.radius_from = e.radius_to = radius;
    e.look.density_from = e.look.density_to = density;
    e.look.colour_to = e.look.colour_from;
    return e;
}

FrameInput look_from(const glm::vec3& eye, const glm::vec3& target) {
    Camera camera;
    camera.eye = eye;
    camera.target = target;
    camera.near_plane = 0.05f;
    camera.far_plane = 20;
    FrameInput input;
    input.views = {view_of(camera, width, height), shadow_view(ShadingOptions{}.light_direction, {0, 0, 0}, 3, 512)};
    input.light_direction = ShadingOptions{}.light_direction;
    return input;
}

TriMesh plate(const glm::vec3& centre, const glm::vec3& right, const glm::vec3& up) {
    TriMesh mesh;
    for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
        mesh.positions.push_back(centre + static_cast<float>(x) * right + static_cast<float>(y) * up);
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.set_identity_wedges();
    compute_normals(mesh);
    return mesh;
}

void VolumeDrawTest::load(std::vector<Emitter> emitters, const VolumeOptions& options, const TriMesh* mesh) {
    if (renderer_ == nullptr) make();
    auto opened = VolumeSource::open(std::move(emitters), options);
    ASSERT_TRUE(opened) << opened.error().message;
    volumes_ = std::move(*opened);
    scene_.reset();
    if (mesh != nullptr) {
        std::vector<uint32_t> indices;
        for (const Triangle& t : mesh->triangles) indices.insert(indices.end(), t.begin(), t.end());
        auto source = open_fixed_levels({full_level(pack_vertices(*mesh), indices)}, uint64_t{1} << 30);
        ASSERT_TRUE(source);
        scene_ = std::move(*source);
    }
    mirror_.emplace(volumes_->recipe());
    frame_ = 0;
    const MaterialSet materials{{Material{}}, {}};
    const auto loaded = renderer_->load(scene_ ? scene_->recipe() : Recipe{}, materials, 0, &volumes_->recipe());
    ASSERT_TRUE(loaded) << loaded.error().message;
}

void VolumeDrawTest::draw(FrameInput input, const ShadingOptions& look) {
    input.frame = frame_++;
    if (scene_) input.instances = std::vector<Instance>{Instance{}};
    Plan plan = volumes_->plan(input);
    const auto good = volumes_->validate();
    EXPECT_TRUE(good) << good.error().message;
    stats_ = plan.stats;
    warnings_ = plan.warnings;
    const auto mirrored = mirror_->execute(plan, input);
    EXPECT_TRUE(mirrored) << mirrored.error().message;
    const bool marched =
        std::ranges::any_of(plan.commands, [](const Command& c) { return c.stage == Stage::composite; });
    if (marched)
        plan.commands.push_back(
            {Stage::composite, Readback{volumes_->result_buffer(), 0, uint64_t{8} * width * height, 7}});
    const Plan scene = scene_ ? scene_->plan(input) : Plan{};
    const auto submitted = renderer_->submit(scene, input, look, 0, &plan);
    ASSERT_TRUE(submitted) << submitted.error().message;
    auto read = renderer_->read_picture();
    ASSERT_TRUE(read) << read.error().message;
    picture_ = std::move(*read);
    for (const FrameCounters& counters : renderer_->take_counters()) counters_ = counters;
    pixels_.assign(size_t{width} * height, Pixel{});
    for (const ReadbackResult& r : renderer_->take_effect_readbacks()) {
        const glm::uvec4 those = volumes_->marched();
        for (size_t i = 0; i < pixels_.size(); ++i) {
            const size_t x = i % width, y = i / width;
            if (x < those.x || y < those.y || x >= those.z || y >= those.w) continue;
            uint32_t words[2];
            std::memcpy(words, r.blob.data() + 8 * i, sizeof words);
            const glm::vec2 a = glm::unpackHalf2x16(words[0]), b = glm::unpackHalf2x16(words[1]);
            pixels_[i] = {{a.x, a.y, b.x}, b.y};
        }
    }
}

double VolumeDrawTest::psnr_to(const AnalyticVolume& reference, const View& view) const {
    double sum = 0;
    size_t count = 0;
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            const double depth = depth_at(view, x, y);
            const AnalyticVolume::Ray ray = reference.march(view, x, y, depth);
            if (ray.through >= 0.999) continue;
            const Pixel& p = pixels_[size_t{y} * width + x];
            const glm::dvec3 d = glm::dvec3(p.light) - ray.light;
            sum += glm::dot(d, d) + (double(p.through) - ray.through) * (double(p.through) - ray.through);
            count += 4;
        }
    }
    return 10 * std::log10(static_cast<double>(count) / sum);
}

void VolumeDrawTest::save(const char* name) const {
    const char* folder = std::getenv("LODESTONE_TEST_PICTURES");
    if (folder == nullptr) return;
    Image image{picture_.width, picture_.height, {}};
    for (size_t i = 0; i < picture_.colour.size(); i += 4)
        image.texels.emplace_back(picture_.colour[i], picture_.colour[i + 1], picture_.colour[i + 2], 255);
    ASSERT_TRUE(write_png(image, std::string(folder) + "/" + name + ".png"));
}

}  // namespace lodestone
