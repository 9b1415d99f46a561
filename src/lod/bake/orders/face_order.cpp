#include "lod/bake/orders/face_order.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "base/check.h"
#include "lod/bake/orders/greedy_order.h"
#include "lod/bake/orders/keyframe_order.h"

namespace lodestone {

namespace {

class Classic final : public FaceOrderer {
public:
    std::string name() const override { return "classic"; }
    bool drops_dead() const override { return true; }
    std::vector<uint32_t> first_order(const OrderInput& input) override {
        std::vector<uint32_t> faces(input.death.size());
        std::iota(faces.begin(), faces.end(), 0u);
        std::stable_sort(faces.begin(), faces.end(),
                         [&](uint32_t a, uint32_t b) { return input.death[a] > input.death[b]; });
        return faces;
    }
    bool wants_order(uint32_t, uint32_t, uint32_t) override { return false; }
    void reorder(uint32_t, std::span<const uint32_t>, std::span<const uint32_t>, std::vector<uint32_t>&) override {}
};

class Static final : public FaceOrderer {
public:
    std::string name() const override { return "static"; }
    std::vector<uint32_t> first_order(const OrderInput& input) override {
        // meshoptimizer keeps the corners of a face in cyclic order but may begin with another one, so faces are found
        // again by rotating the smallest wedge to the front; among equal faces (none in a manifold) the first unused
        // one is taken.
        std::vector<uint32_t> ordered(input.indices.size());
        meshopt_optimizeVertexCache(ordered.data(), input.indices.data(), input.indices.size(), input.wedges);
        const auto key = [](const uint32_t* face) {
            const auto turn = std::min_element(face, face + 3) - face;
            return std::array<uint32_t, 3>{face[turn], face[(turn + 1) % 3], face[(turn + 2) % 3]};
        };
        std::vector<std::pair<std::array<uint32_t, 3>, uint32_t>> wanted(input.death.size()), given(input.death.size());
        for (uint32_t f = 0; f < wanted.size(); ++f) {
            wanted[f] = {key(&ordered[size_t{f} * 3]), f};
            given[f] = {key(&input.indices[size_t{f} * 3]), f};
        }
        std::sort(wanted.begin(), wanted.end());
        std::sort(given.begin(), given.end());
        std::vector<uint32_t> faces(wanted.size());
        for (size_t i = 0; i < wanted.size(); ++i) {
            LODE_CHECK(wanted[i].first == given[i].first, i);
            faces[wanted[i].second] = given[i].second;
        }
        return faces;
    }
    bool wants_order(uint32_t, uint32_t alive, uint32_t slots) override { return alive <= slots / 2; }
    void reorder(uint32_t, std::span<const uint32_t>, std::span<const uint32_t>, std::vector<uint32_t>&) override {}
};

}  // namespace

Result<std::unique_ptr<FaceOrderer>> face_orderer_named(const std::string& name, const OrderOptions& options) {
    if (name == "classic") return std::make_unique<Classic>();
    if (name == "static") return std::make_unique<Static>();
    if (name == "greedy") return make_greedy_orderer(options);
    if (name == "keyframe") return make_keyframe_orderer(options);
    return fail(Fault::usage,
                "order '" + name + "': no such face order; choose from classic, static, greedy, keyframe");
}

}  // namespace lodestone
