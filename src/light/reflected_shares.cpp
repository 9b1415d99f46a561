#include "light/reflected_shares.h"

#include <glm/geometric.hpp>

#include "light/lobe.h"

namespace lodestone {

namespace {

constexpr uint32_t shares_points = 1024;

// Smith's shadowing of both directions over what importance sampling divides by; cosines of eye and light.
float visible_share(float nv, float nl, float nh, float vh, float alpha) {
    const float a2 = alpha * alpha;
    const float shadowed = nl * std::sqrt(nv * nv * (1 - a2) + a2) + nv * std::sqrt(nl * nl * (1 - a2) + a2);
    return 2 * nl * vh / (shadowed * nh);
}

float fifth_power(float x) { return x * x * x * x * x; }

}  // namespace

glm::vec4 reflected_shares(float cosine, float roughness) {
    const float nv = std::clamp(cosine, 1e-3f, 0.9999f), alpha = alpha_of(roughness);
    const glm::vec3 eye(std::sqrt(1 - nv * nv), 0, nv);
    glm::vec3 sum(0), mean(0);
    for (uint32_t i = 0; i < shares_points; ++i) {
        const glm::vec2 point = even_point(i, shares_points);
        const glm::vec3 half = half_vector(point, alpha);
        const float vh = glm::dot(eye, half), nl = 2 * vh * half.z - nv;
        if (vh > 0 && nl > 0) {
            const float share = visible_share(nv, nl, half.z, vh, alpha), fresnel = fifth_power(1 - vh);
            sum.x += share * (1 - fresnel);
            sum.y += share * fresnel;
            mean += share * (2 * vh * half - eye);
        }
        // Matte: as dense as cosines.
        const float up = std::sqrt(point.x), aside = std::sqrt(1 - point.x);
        const float turn = 2 * std::numbers::pi_v<float> * point.y;
        const glm::vec3 light(aside * std::cos(turn), aside * std::sin(turn), up);
        sum.z += fifth_power(1 - glm::dot(eye, glm::normalize(eye + light)));
    }
    // Where the mean direction lies on the way from the normal to the mirrored eye.
    const float slope = -mean.x / mean.z;
    return {sum / static_cast<float>(shares_points), slope / (eye.x + slope * (1 - nv))};
}

}  // namespace lodestone
