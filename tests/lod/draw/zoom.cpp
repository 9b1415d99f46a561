#include "lod/draw/zoom.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "frame/plan_mirror.h"
#include "frame/screen_error.h"
#include "lod/asset/vertex_places.h"
#include "lod/draw/morphed_vertex.h"
#include "shaders/shared/lod_morph.h"

namespace lodestone {

namespace {

// What is drawn where each wedge of full detail is: itself while it lasts, and then what it became. wedges: drawn.
std::vector<glm::vec3> drawn_places(const ProgressiveMesh& pm, const PlanMirror& mirror, bool geomorph,
                                    uint32_t wedges) {
    const std::vector<uint32_t> at = vertex_places(pm, 0);
    std::vector<glm::vec3> places(pm.vertices.size());
    for (uint32_t w = 0; w < places.size(); ++w) {
        if (w >= wedges) {
            places[w] = places[pm.parents[pm.wedges_at(0) - 1 - w]];
        } else if (geomorph) {
            places[w] = morphed_vertex(mirror, mirror.draws().back().draw, {}, 0, at[w]);
        } else {
            const auto& p = pm.vertices[w].position;
            places[w] = {p[0], p[1], p[2]};
        }
    }
    return places;
}

glm::dvec2 pixel_of(const View& view, const glm::vec3& place) {
    const glm::dvec4 clip = glm::dmat4(view.world_to_clip()) * glm::dvec4(glm::dvec3(place), 1);
    return {clip.x / clip.w * view.width / 2, clip.y / clip.w * view.height / 2};
}

}  // namespace

ZoomFigures zoom_on(std::shared_ptr<const ProgressiveMesh> pm, const LodOptions& lod, const ZoomOptions& options) {
    auto source = open_lod({pm}, lod);
    LODE_CHECK(source);
    PlanMirror mirror((*source)->recipe(), {morphed_vertex, {}});
    std::vector<glm::vec3> positions;
    for (const MeshVertex& v : pm->vertices) positions.emplace_back(v.position[0], v.position[1], v.position[2]);
    const Sphere sphere = bounding_sphere_of(positions);
    ZoomFigures figures;
    figures.frames = options.frames;
    std::vector<glm::vec3> before;
    FrameInput input;
    input.instances.resize(1);
    input.budget.pixel_error = options.pixel_error;
    double triangles_before = 0;
    for (uint32_t frame = 0; frame <= options.frames; ++frame) {
        const View seen_before = frame > 0 ? input.views[0] : View{};
        const double distance = options.nearest * sphere.radius * std::pow(options.growth, frame);
        Camera camera;
        camera.target = sphere.centre;
        camera.eye = sphere.centre + glm::vec3(0, 0, static_cast<float>(distance));
        camera.near_plane = 0.01f * sphere.radius;
        camera.far_plane = 10000 * sphere.radius;
        input.views = {view_of(camera, options.width, options.height)};
        input.frame = frame;
        const Plan plan = (*source)->plan(input);
        const auto done = mirror.execute(plan, input);
        LODE_CHECK(done);
        const auto triangles = static_cast<double>(plan.stats.triangles);
        figures.mean_triangles += triangles / (options.frames + 1);
        const uint32_t level = pm->level_for_triangles(plan.stats.triangles);
        std::vector<glm::vec3> places = drawn_places(*pm, mirror, lod.geomorph, pm->wedges_at(level));
        if (frame == 0) figures.first_triangles = static_cast<uint32_t>(triangles);
        figures.last_triangles = static_cast<uint32_t>(triangles);
        if (frame > 0 && triangles != triangles_before) {
            ++figures.changed;
            figures.most_changed =
                std::max(figures.most_changed, std::abs(triangles - triangles_before) / triangles_before);
        }
        for (size_t w = 0; w < before.size(); ++w) {
            if (before[w] == places[w]) continue;
            const double way = glm::distance(pixel_of(seen_before, before[w]), pixel_of(seen_before, places[w]));
            if (way > figures.farthest) figures.farthest_frame = frame;
            figures.farthest = std::max(figures.farthest, way);
        }
        triangles_before = triangles;
        before = std::move(places);
    }
    return figures;
}

}  // namespace lodestone
