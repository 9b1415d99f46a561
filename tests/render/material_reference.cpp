#include "render/material_reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/looks/srgb.h"

namespace lodestone {

namespace {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

// Where a texel number lies that is beyond the image.
int64_t wrapped(int64_t at, int64_t size, Wrap wrap) {
    if (wrap == Wrap::clamp) return std::clamp<int64_t>(at, 0, size - 1);
    const int64_t period = wrap == Wrap::mirror ? 2 * size : size;
    const int64_t in = ((at % period) + period) % period;
    return in < size ? in : period - 1 - in;
}

// What the numbers of a texture are.
enum class Holds { colours, numbers };

dvec4 texel(const Image& image, const Texture& texture, Holds holds, int64_t x, int64_t y) {
    const auto column = static_cast<size_t>(wrapped(x, image.width, texture.wrap[0]));
    const auto row = static_cast<size_t>(wrapped(y, image.height, texture.wrap[1]));
    const glm::u8vec4 bytes = image.texels[row * image.width + column];
    dvec4 value = dvec4(bytes) / 255.0;
    for (int k = 0; holds == Holds::colours && k < 3; ++k) value[k] = linear_from_srgb(value[k]);
    return value;
}

dvec2 moved(const Texture& texture, const dvec2& uv) {
    return dvec2(texture.place[0]) * uv.x + dvec2(texture.place[1]) * uv.y + dvec2(texture.place[2]);
}

// Of a point of a square: by set, its texture coordinates, and the ways along which they grow; its tangent.
struct Coordinates {
    std::array<dvec2, 2> uv;
    std::array<std::array<dvec3, 2>, 2> along;
    dvec4 tangent;
};

// Bilinear, of the finest level. White where there is no texture.
dvec4 looked_up(const MaterialSet& set, const Texture& texture, Holds holds, const Coordinates& coordinates) {
    if (texture.image < 0) return dvec4(1);
    const Image& image = set.images[static_cast<size_t>(texture.image)];
    const dvec2 at = moved(texture, coordinates.uv[texture.second ? 1 : 0]) * dvec2(image.width, image.height) - 0.5;
    const dvec2 low = glm::floor(at), f = at - low;
    const auto x = static_cast<int64_t>(low.x), y = static_cast<int64_t>(low.y);
    const auto row = [&](int64_t down) {
        return glm::mix(texel(image, texture, holds, x, down), texel(image, texture, holds, x + 1, down), f.x);
    };
    return glm::mix(row(y), row(y + 1), f.y);
}

struct Light {
    dvec3 to_light, colour, sky, ground;
    const Surroundings& around;
    dvec3 hemisphere(double height) const { return glm::mix(ground, sky, height * 0.5 + 0.5); }
};

// Cook and Torrance's microfacets, of the distribution of Trowbridge and Reitz, Smith's shadowing with both directions
// correlated, Schlick's Fresnel term; for light of irradiance 1 straight on.
dvec3 reflected(const dvec3& base, double metallic, double roughness, const dvec3& n, const dvec3& v, const dvec3& l) {
    const double pi = std::acos(-1.0), a = roughness * roughness, a2 = a * a;
    const dvec3 h = glm::normalize(v + l), f0 = glm::mix(dvec3(0.04), base, metallic);
    const double nl = glm::dot(n, l), nv = glm::dot(n, v), nh = glm::dot(n, h), vh = glm::dot(v, h);
    if (nl <= 0) return dvec3(0);
    const double d = a2 / (pi * std::pow(nh * nh * (a2 - 1) + 1, 2));
    const double lambda_l = (std::sqrt(1 + a2 * (1 / (nl * nl) - 1)) - 1) / 2;
    const double lambda_v = (std::sqrt(1 + a2 * (1 / (nv * nv) - 1)) - 1) / 2;
    const double g = 1 / (1 + lambda_l + lambda_v);
    const dvec3 fresnel = f0 + (1.0 - f0) * std::pow(1 - vh, 5);
    return ((1.0 - fresnel) * base * (1 - metallic) / pi + fresnel * d * g / (4 * nl * nv)) * nl;
}

// A direction about n, for its height over the surface and its turn.
dvec3 about(const dvec3& n, double height, double turn) {
    const dvec3 other = std::abs(n.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 0, 1);
    const dvec3 s = glm::normalize(glm::cross(n, other)), t = glm::cross(n, s);
    const double aside = std::sqrt(std::max(0.0, 1 - height * height));
    return height * n + aside * (std::cos(turn) * s + std::sin(turn) * t);
}

// The same BRDF, over surroundings of any kind. Directions of the matte part are as dense as cosines, those of the
// other as microfacets; each of `steps` squared has the same share.
dvec3 reflected_surroundings(const dvec3& base, double metallic, double roughness, const dvec3& n, const dvec3& v,
                             const Surroundings& around) {
    constexpr int steps = 40;
    const double pi = std::acos(-1.0), a2 = std::pow(roughness, 4), nv = glm::dot(n, v);
    const dvec3 f0 = glm::mix(dvec3(0.04), base, metallic);
    const auto fresnel = [&](double vh) { return f0 + (1.0 - f0) * std::pow(1 - vh, 5); };
    const auto lambda = [&](double c) { return (std::sqrt(1 + a2 * (1 / (c * c) - 1)) - 1) / 2; };
    dvec3 matte(0), shiny(0);
    for (int i = 0; i < steps; ++i) {
        const double share = (i + 0.5) / steps, spread = std::sqrt((1 - share) / (1 + (a2 - 1) * share));
        for (int k = 0; k < steps; ++k) {
            const double turn = 2 * pi * (k + 0.5 * (i % 2)) / steps;
            const dvec3 l = about(n, std::sqrt(share), turn);
            matte += (1.0 - fresnel(glm::dot(v, glm::normalize(v + l)))) * around(l);
            const dvec3 h = about(n, spread, turn), m = 2 * glm::dot(v, h) * h - v;
            const double vh = glm::dot(v, h), nl = glm::dot(n, m), nh = glm::dot(n, h);
            if (nl <= 0 || vh <= 0) continue;
            shiny += fresnel(vh) * (vh / (nh * nv * (1 + lambda(nl) + lambda(nv)))) * around(m);
        }
    }
    return (matte * base * (1 - metallic) + shiny) / static_cast<double>(steps * steps);
}

// Of a sky and a ground of one colour each: what the specular lobe sends on is a fit by Karis (2014); its horizon is as
// wide as the lobe.
dvec3 reflected_around(const dvec3& base, double metallic, double roughness, const dvec3& n, const dvec3& v,
                       const Light& light) {
    if (light.around) return reflected_surroundings(base, metallic, roughness, n, v, light.around);
    const dvec3 f0 = glm::mix(dvec3(0.04), base, metallic);
    const double nv = std::clamp(glm::dot(n, v), 0.0, 1.0), a = roughness * roughness;
    const dvec4 r = roughness * dvec4(-1, -0.0275, -0.572, 0.022) + dvec4(1, 0.0425, 1.04, -0.04);
    const double a004 = std::min(r.x * r.x, std::exp2(-9.28 * nv)) * r.x + r.y;
    const dvec3 mirrored = 2 * glm::dot(n, v) * n - v;
    const double height = std::clamp(glm::mix(mirrored.y / std::max(a, 0.02), n.y, a), -1.0, 1.0);
    return base * (1 - metallic) * (1.0 - f0) * light.hemisphere(n.y) +
           (f0 * (-1.04 * a004 + r.z) + 1.04 * a004 + r.w) * light.hemisphere(height);
}

dvec3 mapped(const MaterialSet& set, const Material& m, const Coordinates& coordinates, const dvec3& n) {
    const Texture& texture = m.normal_texture;
    if (texture.image < 0) return n;
    const auto& [along_u, along_v] = coordinates.along[texture.second ? 1 : 0];
    dvec3 map = dvec3(looked_up(set, texture, Holds::numbers, coordinates)) * 2.0 - 1.0;
    map.x *= static_cast<double>(m.normal_scale);
    map.y *= static_cast<double>(m.normal_scale);
    if (coordinates.tangent.w != 0) {
        const dvec3 given(coordinates.tangent), tangent = glm::normalize(given - n * glm::dot(n, given));
        return glm::normalize(tangent * map.x + glm::cross(n, tangent) * coordinates.tangent.w * map.y + n * map.z);
    }
    // The way along which the texture's own first coordinate grows, and its second does not.
    const dvec2 a = texture.place[0], b = texture.place[1];
    const double det = a.x * b.y - b.x * a.y;
    const dvec3 t = (b.y * along_u - a.y * along_v) / det, down = (a.x * along_v - b.x * along_u) / det;
    const dvec3 tangent = glm::normalize(t - n * glm::dot(n, t));
    dvec3 up = glm::cross(n, tangent);
    if (glm::dot(up, down) > 0) up = -up;
    return glm::normalize(tangent * map.x + up * map.y + n * map.z);
}

struct Shaded {
    dvec3 colour;
    double alpha;
};

Shaded shaded(const MaterialSet& set, const LookedAtSquare& square, const dvec3& p, const dvec3& eye,
              const Light& light) {
    const Material& m = set.materials[square.material];
    const double across = (square.turned ? -p.x : p.x) * 0.5 + 0.5, down = 0.5 - p.y * 0.5;
    const dvec2 span = dvec2(square.uv_high) - dvec2(square.uv_low);
    const dvec2 second_span = dvec2(square.second_high) - dvec2(square.second_low);
    const dvec3 rightwards(square.turned ? -1 : 1, 0, 0), downwards(0, -1, 0);
    const Coordinates uv{
        {dvec2(square.uv_low) + span * dvec2(across, down),
         dvec2(square.second_low) + second_span * dvec2(down, across)},
        {{{rightwards / span.x, downwards / span.y}, {downwards / second_span.x, rightwards / second_span.y}}},
        dvec4(square.tangent)};
    const dvec3 v = glm::normalize(eye - p);
    const dvec3 front(0, 0, square.turned ? -1 : 1);
    dvec3 n = mapped(set, m, uv, front);
    if (glm::dot(front, v) < 0) n = -n;
    const dvec4 texture = looked_up(set, m.base_colour_texture, Holds::colours, uv);
    const dvec3 base = dvec3(m.base_colour) * dvec3(texture);
    Shaded s{base, static_cast<double>(m.base_colour.w) * texture.w};
    if (m.shading == Shading::unlit) return s;
    const dvec4 factors = looked_up(set, m.metallic_roughness_texture, Holds::numbers, uv);
    const double metallic = static_cast<double>(m.metallic) * factors.z;
    const double roughness = std::max(static_cast<double>(m.roughness) * factors.y, 0.045);
    const double occlusion = looked_up(set, m.occlusion_texture, Holds::numbers, uv).x;
    s.colour = (1 + static_cast<double>(m.occlusion_strength) * (occlusion - 1)) *
                   reflected_around(base, metallic, roughness, n, v, light) +
               reflected(base, metallic, roughness, n, v, light.to_light) * light.colour +
               dvec3(m.emission) * dvec3(looked_up(set, m.emission_texture, Holds::colours, uv));
    return s;
}

}  // namespace

Picture reference_picture(const std::vector<LookedAtSquare>& squares, const MaterialSet& set, const Camera& camera,
                          uint32_t width, uint32_t height, const ShadingOptions& look, const Surroundings& around) {
    Picture picture;
    picture.width = width;
    picture.height = height;
    const Light light{glm::normalize(-dvec3(look.light_direction)), look.light_colour, look.sky_colour,
                      look.ground_colour, around};
    const dvec3 eye = camera.eye, forward = glm::normalize(dvec3(camera.target) - eye);
    const dvec3 right = glm::normalize(glm::cross(forward, dvec3(camera.up))), up = glm::cross(right, forward);
    const double half = std::tan(static_cast<double>(camera.fov_y) / 2);
    // From back to front: blended ones lie over what is behind.
    std::vector<LookedAtSquare> sorted = squares;
    std::ranges::stable_sort(sorted, {}, [&](const LookedAtSquare& s) { return -std::abs(camera.eye.z - s.height); });
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            const double sx = (2 * (x + 0.5) / width - 1) * half * width / height,
                         sy = (1 - 2 * (y + 0.5) / height) * half;
            const dvec3 ray = forward + sx * right + sy * up;
            dvec3 colour = around ? around(glm::normalize(ray)) : dvec3(look.background);
            bool covered = false;
            for (const LookedAtSquare& square : sorted) {
                const Material& m = set.materials[square.material];
                const double t = (static_cast<double>(square.height) - eye.z) / ray.z;
                const dvec3 p = eye + t * ray;
                const bool from_behind = (eye.z > static_cast<double>(square.height)) == square.turned;
                if (t <= 0 || std::abs(p.x) > 1 || std::abs(p.y) > 1 || (from_behind && !m.double_sided)) continue;
                const Shaded s = shaded(set, square, p, eye, light);
                if (m.alpha_mode == AlphaMode::mask && s.alpha < static_cast<double>(m.alpha_cutoff)) continue;
                colour = m.alpha_mode == AlphaMode::blend ? glm::mix(colour, s.colour, s.alpha) : s.colour;
                covered = true;
            }
            for (int k = 0; k < 3; ++k) {
                picture.colour.push_back(
                    static_cast<uint8_t>(std::lround(255 * srgb_from_linear(std::clamp(colour[k], 0.0, 1.0)))));
            }
            picture.colour.push_back(covered ? 255 : 0);
        }
    }
    return picture;
}

}  // namespace lodestone
