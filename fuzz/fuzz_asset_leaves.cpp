// Parts of leaves below their checksums: whatever the bytes are, they are refused, or are a part that is the same once
// it is coded anew. Input: attributes and mode; then the part's bytes as they are, or numbers that a part is made of
// and where to damage what it is coded as: few inputs are streams of the right lengths.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>

#include "fuzz/mutators.h"
#include "fuzz/promise.h"
#include "fuzz/watch.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaves.h"

using namespace lodestone;
using namespace lodestone::vgi;

namespace {

// Any vertex, most often near the one before.
LeafVertex random_vertex(FuzzedDataProvider& from, const LeafVertex& before, const AtlasAttributes& has) {
    LeafVertex v = before;
    const bool near = from.ConsumeBool();
    for (uint32_t& p : v.position) {
        const uint32_t most = (1u << leaf_bits) - 1;
        p = near ? std::min(most, p + from.ConsumeIntegral<uint8_t>()) : from.ConsumeIntegralInRange<uint32_t>(0, most);
    }
    for (uint16_t& p : v.place) p = from.ConsumeIntegralInRange<uint16_t>(0, leaf_places);
    v.border = from.ConsumeIntegralInRange<uint8_t>(0, 8);
    v.step = v.border > 0 && !v.is_corner() ? from.ConsumeIntegral<uint8_t>() : uint8_t{0};
    for (int8_t& n : v.attributes.normal) n = from.ConsumeIntegral<int8_t>();
    if (has.uvs) v.attributes.uv = {from.ConsumeIntegral<uint16_t>(), from.ConsumeIntegral<uint16_t>()};
    if (has.colours && !has.baked) v.attributes.colour = glm::u8vec4(from.ConsumeIntegral<uint8_t>());
    if (has.materials) v.attributes.material = from.ConsumeIntegral<uint16_t>();
    return v;
}

// Corners of triangles are vertices that were there before, or the next new one.
LeafPart random_part(FuzzedDataProvider& from, const AtlasAttributes& has) {
    LeafPart part;
    part.triangles.resize(from.ConsumeIntegralInRange<uint32_t>(1, most_leaf_triangles));
    for (auto& triangle : part.triangles) {
        for (uint8_t& corner : triangle) {
            const auto next = static_cast<uint32_t>(part.vertices.size());
            const auto back =
                from.ConsumeIntegralInRange<uint32_t>(next < most_leaf_vertices ? 0 : 1, std::max(1u, next));
            if (back == 0 || next == 0) {
                corner = static_cast<uint8_t>(next);
                part.vertices.push_back(random_vertex(from, next == 0 ? LeafVertex{} : part.vertices.back(), has));
            } else {
                corner = static_cast<uint8_t>(next - back);
            }
        }
    }
    return part;
}

size_t bytes_of(const LeafPart& part) {
    return part.vertices.size() * sizeof(LeafVertex) + part.triangles.size() * sizeof part.triangles[0];
}

// What is read is the same once it is coded anew. Returns its size; 0 where it is refused.
size_t check_bytes(std::span<const std::byte> bytes, const AtlasAttributes& attributes) {
    const auto part = decode_leaf(bytes, attributes);
    if (!part) {
        fuzz::check_error(part.error());
        return 0;
    }
    fuzz::require(part->vertices.size() <= most_leaf_vertices && part->triangles.size() <= most_leaf_triangles,
                  "a part is no larger than a slot");
    const auto again = decode_leaf(encode_leaf(*part, attributes), attributes);
    fuzz::require_good(again, "a part that was read can be coded");
    fuzz::require(*again == *part, "and is the same then");
    return bytes_of(*part);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 2) return 0;
    const auto bit = [&](int number) { return (data[0] >> number & 1) != 0; };
    AtlasAttributes attributes{{true, bit(0), bit(1), bit(2)}, false, false};
    attributes.baked = bit(4);
    const std::span<const uint8_t> rest(data + 2, size - 2);
    std::vector<std::byte> bytes;
    size_t most = size;  // the larger of what is given and what is coded
    const fuzz::Watch watch;
    if (data[1] % 4 == 0) {
        const auto raw = std::as_bytes(rest);
        bytes.assign(raw.begin(), raw.end());
    } else {
        const size_t damage = data[1] % 4 == 1 ? 0 : std::min<size_t>(rest.size(), data[1] / 4);
        FuzzedDataProvider from(rest.data(), rest.size() - damage);
        const LeafPart part = random_part(from, attributes);
        most = std::max(most, bytes_of(part));
        bytes = encode_leaf(part, attributes);
        if (damage == 0) {
            const auto read = decode_leaf(bytes, attributes);
            fuzz::require_good(read, "a part is read");
            fuzz::require(*read == part, "a part is read as it was coded");
        }
        const LeafPart ordered = in_coding_order(part);
        fuzz::require(ordered.triangles.size() == part.triangles.size() &&
                          ordered.vertices.size() == part.vertices.size() && in_coding_order(ordered) == ordered,
                      "the order of coding leaves nothing out, and stays as it is");
        if (bit(3)) bytes = encode_leaf(ordered, attributes);
        fuzz::damage(bytes, rest.last(damage));
    }
    watch.check(std::max(most, check_bytes(bytes, attributes)));
    return 0;
}
