#include "mesh/packed_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/random.h"

namespace lodestone {
namespace {

TEST(PackedTangents, AreWithinAHundredthOfADegree) {
    Random random(7);
    double largest = 0;
    for (int i = 0; i < 200000; ++i) {
        const auto at = [&] { return static_cast<float>(random.below(2001)) / 1000 - 1; };
        glm::vec3 direction(at(), at(), at());
        // Along axes and in planes, too.
        for (int k = 0; k < 3; ++k) {
            if (random.below(8) == 0) direction[k] = 0;
        }
        if (!(glm::length(direction) > 0)) continue;
        direction = glm::normalize(direction);
        const float side = random.below(2) == 0 ? -1.0f : 1.0f;
        const glm::vec4 found = unpack_tangent(pack_tangent({direction, side}));
        ASSERT_EQ(found.w, side);
        largest = std::max(largest, static_cast<double>(glm::distance(glm::vec3(found), direction)));
    }
    EXPECT_LT(std::asin(largest) * 180 / std::acos(-1.0), 0.01);
    EXPECT_EQ(pack_tangent(glm::vec4(0)), 0u);
    EXPECT_EQ(unpack_tangent(0), glm::vec4(0));
}

// Whatever a file holds.
TEST(PackedTangents, AnyWordIsOneOrNone) {
    TriMesh mesh;
    Random random(8);
    for (uint32_t i = 0; i < 100000; ++i) {
        // Corners of the octahedron's square and what lies beyond it among them.
        const uint32_t word =
            i < 4096 ? i * 0x100000u + (i % 2 == 0 ? 0x4000u : 0x20004000u) : static_cast<uint32_t>(random.below(~0u));
        mesh.tangents.push_back(unpack_tangent(word));
        mesh.normals.emplace_back(0, 0, 1);
    }
    mesh.positions.resize(mesh.tangents.size());
    mesh.set_identity_wedges();
    const auto valid = mesh.validate();
    EXPECT_TRUE(valid) << valid.error().message;
}

}  // namespace
}  // namespace lodestone
