// What tests of drawn volumes share: a few emitters, a device, and what rays found on it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame/plan_mirror.h"
#include "mesh/tri_mesh.h"
#include "render/device_test.h"
#include "volume/draw/analytic.h"
#include "volume/volume_source.h"

namespace lodestone {

// Pixels of the pictures.
inline constexpr uint32_t width = 96, height = 54;

// A few particles that stand still, in a ball of radius 0.5 around the origin.
volume::Emitter puff();
// One ball without displacement, of one density.
volume::Emitter ball(float density, float radius = 0.4f);
// A square of two triangles, as wide as it is said, in any plane.
TriMesh plate(const glm::vec3& centre, const glm::vec3& right, const glm::vec3& up);

FrameInput look_from(const glm::vec3& eye, const glm::vec3& target = glm::vec3(0));

struct Pixel {
    glm::vec3 light{0};
    float through = 1;
};

class VolumeDrawTest : public DeviceTest {
protected:
    VolumeDrawTest() : DeviceTest(width, height) {}

    // The scene is the mesh, or nothing.
    void load(std::vector<volume::Emitter> emitters, const volume::VolumeOptions& options = {},
              const TriMesh* mesh = nullptr);

    // Draws a frame; what the volumes' rays found is then in `pixels`, what was drawn in `picture`.
    void draw(FrameInput input, const ShadingOptions& look = {});

    // Decibels by which the rays differ from the reference, of pixels in which that has something. Light and what
    // shines through count alike.
    double psnr_to(const AnalyticVolume& reference, const View& view) const;
    double depth_at(const View& view, uint32_t x, uint32_t y) const {
        const double d = picture_.depth[size_t{y} * width + x], n = view.near_plane, r = view.far_plane;
        return n * r / (d * (r - n) + n);
    }
    const Pixel& centre() const { return pixels_[size_t{height / 2} * width + width / 2]; }

    // A PNG in the folder that LODESTONE_TEST_PICTURES names, if it is set.
    void save(const char* name) const;

    std::unique_ptr<volume::VolumeSource> volumes_;
    std::unique_ptr<FrameSource> scene_;
    std::optional<PlanMirror> mirror_;
    std::vector<Pixel> pixels_;
    Picture picture_;
    PlanStats stats_;
    std::vector<std::string> warnings_;
    FrameCounters counters_;
    uint64_t frame_ = 0;
};

}  // namespace lodestone
