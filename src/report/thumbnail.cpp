#include "report/thumbnail.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace lodestone {

namespace {

// Where a corner falls: texels, and depth that grows away from who looks.
struct Seen {
    glm::vec3 right, up, forward, centre;
    float scale = 1, half_width = 0, half_height = 0;

    glm::vec3 operator()(const glm::vec3& p) const {
        const glm::vec3 d = p - centre;
        return {half_width + glm::dot(d, right) * scale, half_height - glm::dot(d, up) * scale, glm::dot(d, forward)};
    }
};

Seen look_at(const TriMesh& mesh, uint32_t width, uint32_t height) {
    Seen seen;
    const Box box = bounding_box(mesh.positions);
    seen.forward = glm::normalize(glm::vec3(-0.55f, -0.45f, -0.7f));
    seen.right = glm::normalize(glm::cross(seen.forward, glm::vec3(0, 1, 0)));
    seen.up = glm::cross(seen.right, seen.forward);
    seen.centre = box.centre();
    seen.half_width = static_cast<float>(width) / 2;
    seen.half_height = static_cast<float>(height) / 2;
    float across = 1e-30f, along = 1e-30f;
    for (const glm::vec3& p : mesh.positions) {
        across = std::max(across, std::abs(glm::dot(p - seen.centre, seen.right)));
        along = std::max(along, std::abs(glm::dot(p - seen.centre, seen.up)));
    }
    seen.scale = 0.95f * std::min(seen.half_width / across, seen.half_height / along);
    return seen;
}

class Canvas {
public:
    Canvas(uint32_t width, uint32_t height) : depth_(size_t{width} * height, std::numeric_limits<float>::max()) {
        image_.width = width;
        image_.height = height;
        image_.texels.assign(depth_.size(), glm::u8vec4(0));
    }

    void draw(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, uint8_t grey) {
        const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
        const auto low = [](float p, float q, float r) {
            return std::max(0.0f, std::ceil(std::min({p, q, r}) - 0.5f));
        };
        const auto high = [](float p, float q, float r, uint32_t size) {
            return std::min(static_cast<float>(size) - 1, std::floor(std::max({p, q, r}) - 0.5f));
        };
        for (float y = low(a.y, b.y, c.y); y <= high(a.y, b.y, c.y, image_.height); ++y) {
            for (float x = low(a.x, b.x, c.x); x <= high(a.x, b.x, c.x, image_.width); ++x) {
                const float px = x + 0.5f, py = y + 0.5f;
                const float v = ((px - a.x) * (c.y - a.y) - (py - a.y) * (c.x - a.x)) / area;
                const float w = ((b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x)) / area;
                if (v >= 0 && w >= 0 && v + w <= 1) put(x, y, a.z + v * (b.z - a.z) + w * (c.z - a.z), grey);
            }
        }
    }
    Image take() { return std::move(image_); }

private:
    void put(float x, float y, float depth, uint8_t grey) {
        const size_t at = static_cast<size_t>(y) * image_.width + static_cast<size_t>(x);
        if (depth >= depth_[at]) return;
        depth_[at] = depth;
        image_.texels[at] = {grey, grey, grey, 255};
    }

    Image image_;
    std::vector<float> depth_;
};

}  // namespace

Image thumbnail_of(const TriMesh& mesh, uint32_t width, uint32_t height) {
    const Seen seen = look_at(mesh, width, height);
    Canvas canvas(width, height);
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::vec3 a = mesh.position_of(t, 0), b = mesh.position_of(t, 1), c = mesh.position_of(t, 2);
        const glm::vec3 normal = glm::cross(b - a, c - a);
        const float length = glm::length(normal);
        if (!(length > 0) || !std::isfinite(length)) continue;
        // Scans are not always turned outwards, so both sides are lit.
        const float light = std::abs(glm::dot(normal, seen.forward)) / length;
        canvas.draw(seen(a), seen(b), seen(c), static_cast<uint8_t>(60 + 175 * std::min(1.0f, light)));
    }
    return canvas.take();
}

}  // namespace lodestone
