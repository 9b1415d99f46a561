#include "vgi/unwrap/old_looks.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesh/textures/texture_lookup.h"
#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

namespace {

// Between the four texels around.
glm::vec4 look_up(const OldImage& from, const glm::dvec2& offset, Texels texels) {
    return looked_up(*from.image, texels, from.at + from.by_x * offset.x + from.by_y * offset.y, from.wrap);
}

const Material& white() {
    static const Material material;
    return material;
}

// What an attribute of wedges is at places of a triangle of the source; 0 where there is none.
template <class T, class Value>
std::array<T, 3> attribute_at(const std::vector<Value>& values, const Triangle& triangle,
                              const CutPlaces::Corners& places) {
    std::array<T, 3> at{};
    for (size_t k = 0; k < 3 && !values.empty(); ++k) {
        const glm::dvec2 place(places[k]);
        at[k] = T(values[triangle[0]]) * (1 - place.x - place.y) + T(values[triangle[1]]) * place.x +
                T(values[triangle[2]]) * place.y;
    }
    return at;
}

// Where a texture is looked up there.
std::array<glm::dvec2, 3> looked_up_at(const TriMesh& source, const Triangle& triangle, const Texture& texture,
                                       const CutPlaces::Corners& places) {
    auto at = attribute_at<glm::dvec2>(source.uvs_of(texture), triangle, places);
    for (glm::dvec2& uv : at) uv = glm::dmat3x2(texture.place) * glm::dvec3(uv, 1);
    return at;
}

}  // namespace

OldLooks::OldLooks(const TriMesh& source, const Unwrapped& unwrapped, uint32_t triangle, uint32_t resolution, Look look,
                   float brightest)
    : look_(look), brightest_(brightest), material_(&white()) {
    const SurfaceTriangle& part = unwrapped.parts[triangle];
    const Triangle& was = source.triangles[part.source];
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t wedge = unwrapped.mesh.triangles[triangle][k];
        corners_[k] = glm::dvec2(unwrapped.mesh.uvs[wedge]) * static_cast<double>(resolution);
    }
    twice_area_ = cross(corners_[1] - corners_[0], corners_[2] - corners_[0]);
    if (source.material_table.empty() || flat()) return;
    material_ = &source.material_table[source.materials.empty() ? 0 : source.materials[was[0]]];
    if (source.uvs.empty()) return;
    const std::array<const Texture*, look_count> textures = {&material_->base_colour_texture,
                                                             &material_->metallic_roughness_texture,
                                                             &material_->normal_texture, &material_->emission_texture};
    const auto old = [&](const Texture& texture) {
        return looked_up_at(source, was, texture, unwrapped.places.of(part));
    };
    const Texture& texture = *textures[static_cast<size_t>(look)];
    place(images_[0], source, texture, old(texture));
    if (look == Look::surface)
        place(images_[1], source, material_->occlusion_texture, old(material_->occlusion_texture));
    if (look == Look::normals && images_[0].image != nullptr)
        set_frames(unwrapped, triangle, old(texture),
                   attribute_at<glm::dvec4>(source.tangents, was, unwrapped.places.of(part)));
}

void OldLooks::place(OldImage& image, const TriMesh& source, const Texture& texture,
                     const std::array<glm::dvec2, 3>& at) const {
    if (!texture.there()) return;
    image.image = &source.images[static_cast<size_t>(texture.image)];
    image.wrap = texture.wrap;
    const glm::dvec2 e = corners_[1] - corners_[0], f = corners_[2] - corners_[0], old_e = at[1] - at[0],
                     old_f = at[2] - at[0];
    image.at = at[0];
    image.by_x = (old_e * f.y - old_f * e.y) / twice_area_;
    image.by_y = (old_f * e.x - old_e * f.x) / twice_area_;
}

void OldLooks::set_frames(const Unwrapped& unwrapped, uint32_t triangle, const std::array<glm::dvec2, 3>& at,
                          const std::array<glm::dvec4, 3>& tangents) {
    const TriMesh& mesh = unwrapped.mesh;
    const glm::dvec3 p(mesh.position_of(triangle, 0));
    const glm::dvec3 first = glm::dvec3(mesh.position_of(triangle, 1)) - p,
                     second = glm::dvec3(mesh.position_of(triangle, 2)) - p;
    const auto frame_of = [&](const std::array<glm::dvec2, 3>& texcoords) {
        return tangent_frame(first, second, texcoords[1] - texcoords[0], texcoords[2] - texcoords[0]);
    };
    old_frame_ = frame_of(at);
    new_frame_ = frame_of(corners_);
    const glm::dvec2 e = corners_[1] - corners_[0], f = corners_[2] - corners_[0];
    const auto spread = [&](const auto& of, auto& start, auto& by_x, auto& by_y) {
        start = of[0];
        by_x = ((of[1] - of[0]) * f.y - (of[2] - of[0]) * e.y) / twice_area_;
        by_y = ((of[2] - of[0]) * e.x - (of[1] - of[0]) * f.x) / twice_area_;
    };
    spread(tangents, tangent_, tangent_by_x_, tangent_by_y_);
    normal_ = glm::cross(first, second);
    if (mesh.normals.empty()) return;
    std::array<glm::dvec3, 3> normals{};
    for (size_t k = 0; k < 3; ++k) normals[k] = mesh.normals[mesh.triangles[triangle][k]];
    spread(normals, normal_, normal_by_x_, normal_by_y_);
}

double OldLooks::texels_per_texel() const {
    double most = 0;
    for (const OldImage& image : images_) {
        if (image.image == nullptr) continue;
        const glm::dvec2 size(image.image->width, image.image->height);
        most = std::max({most, glm::length(image.by_x * size), glm::length(image.by_y * size)});
    }
    return most;
}

// Turned about the surface's normal from the old frame to the new one.
glm::vec4 OldLooks::normal_at(const glm::dvec2& offset) const {
    const glm::vec4 straight(0, 0, 1, 1);
    if (images_[0].image == nullptr) return straight;
    const glm::dvec3 found = 2.0 * glm::dvec3(look_up(images_[0], offset, Texels::numbers)) - 1.0;
    const glm::dvec3 bent = found * glm::dvec3(material_->normal_scale, material_->normal_scale, 1);
    glm::dvec3 n = normal_ + normal_by_x_ * offset.x + normal_by_y_ * offset.y;
    const double length = glm::length(n);
    if (!(length > 0)) return straight;
    n /= length;
    const glm::dvec4 tangent = tangent_ + tangent_by_x_ * offset.x + tangent_by_y_ * offset.y;
    const auto was = (tangent.w != 0 ? tangent_frame(tangent, n) : old_frame_).upright(n), is = new_frame_.upright(n);
    const double bent_length = glm::length(bent);
    if (!was || !is || !(bent_length > 0)) return straight;
    const glm::dvec3 along = bent.x * (*was)[0] + bent.y * (*was)[1];
    const double across = glm::dot(along, (*is)[0]), up = glm::dot(along, (*is)[1]);
    return {glm::dvec3(across, up, bent.z) / bent_length, 1};
}

glm::vec4 OldLooks::at(const glm::dvec2& offset) const {
    const OldImage &first = images_[0], &second = images_[1];
    if (look_ == Look::normals) return normal_at(offset);
    if (look_ == Look::surface) {
        glm::vec4 value(1, material_->roughness, material_->metallic, 1);
        if (first.image != nullptr) {
            const glm::vec4 t = look_up(first, offset, Texels::numbers);
            value *= glm::vec4(1, t.y, t.z, 1);
        }
        if (second.image != nullptr)
            value.x = 1 + material_->occlusion_strength * (look_up(second, offset, Texels::numbers).x - 1);
        return value;
    }
    if (look_ == Look::emission) {
        glm::vec4 value(material_->emission / brightest_, 1);
        if (first.image != nullptr) value *= look_up(first, offset, Texels::colours);
        return {glm::vec3(value), 1};
    }
    glm::vec4 value = material_->base_colour;
    if (first.image != nullptr) value *= look_up(first, offset, Texels::colours);
    // glTF's opaque materials have no alpha, whatever their textures hold.
    if (material_->shading != Shading::plain && material_->alpha_mode == AlphaMode::opaque) value.w = 1;
    return value;
}

}  // namespace lodestone::vgi
