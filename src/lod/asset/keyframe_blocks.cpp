#include "lod/asset/keyframe_blocks.h"

#include "base/check.h"

namespace lodestone {

namespace {

using keyframe_bytes::codes;
using keyframe_bytes::literal_code;

// Most bytes of a number, and of a dead face.
constexpr size_t number_bytes = 5, dead_bytes = 5 * number_bytes;

inline void put(uint32_t value, uint8_t*& at) {
    // One or two bytes, without a branch; the second is written over where there is but one.
    if (value < 1u << 14) {
        const uint32_t more = value >= 0x80 ? 1 : 0;
        at[0] = static_cast<uint8_t>((value & 0x7f) | more << 7);
        at[1] = static_cast<uint8_t>(value >> 7);
        at += 1 + more;
        return;
    }
    for (; value >= 0x80; value >>= 7) *at++ = static_cast<uint8_t>(value | 0x80);
    *at++ = static_cast<uint8_t>(value);
}

uint32_t zigzag(uint32_t difference) {
    const auto value = static_cast<int32_t>(difference);
    return (difference << 1) ^ static_cast<uint32_t>(value >> 31);
}

// Stops at the end of its bytes.
class Checked {
public:
    explicit Checked(std::span<const uint8_t> bytes) : bytes_(bytes) {}
    bool byte(uint8_t& value) {
        if (at_ == bytes_.size()) return false;
        value = bytes_[at_++];
        return true;
    }
    bool number(uint32_t& value) {
        value = 0;
        uint8_t part = 0x80;
        for (uint32_t shift = 0; (part & 0x80) != 0; shift += 7) {
            if (shift > 28 || !byte(part)) return false;
            value |= static_cast<uint32_t>(part & 0x7f) << shift;
        }
        return true;
    }
    bool at_end() const { return at_ == bytes_.size(); }

private:
    std::span<const uint8_t> bytes_;
    size_t at_ = 0;
};

}  // namespace

void write_keyframe_block(std::span<const uint32_t> sources, std::span<const DeadFace> dead,
                          std::vector<uint8_t>& bytes) {
    LODE_CHECK(!sources.empty() && sources.size() <= keyframe_block_slots, sources.size());
    const size_t begin = bytes.size();
    bytes.resize(begin + (sources.size() + 1) * number_bytes + dead.size() * dead_bytes);
    uint8_t* at = bytes.data() + begin;
    put(sources[0], at);
    for (size_t i = 1; i < sources.size(); ++i) put(zigzag(sources[i] - sources[i - 1] - 1), at);
    put(static_cast<uint32_t>(dead.size()), at);
    uint32_t neighbour = 0;
    for (const DeadFace& face : dead) {
        LODE_CHECK(face.neighbour >= neighbour && face.neighbour < sources.size(), face.neighbour, neighbour);
        const uint32_t corners = face.corners[0] * 9u + face.corners[1] * 3u + face.corners[2];
        put((face.neighbour - neighbour) * codes + (face.literal ? literal_code : corners), at);
        neighbour = face.neighbour;
        put(zigzag(face.slot - sources[face.neighbour]), at);
        if (face.literal) {
            for (const uint32_t wedge : face.wedges) put(wedge, at);
        }
    }
    bytes.resize(static_cast<size_t>(at - bytes.data()));
}

bool check_keyframe_block(std::span<const uint8_t> bytes, uint32_t slots, uint32_t slots_before, uint32_t wedges,
                          uint32_t& dead_faces) {
    Checked in(bytes);
    std::array<uint32_t, keyframe_block_slots> source;
    uint32_t number = 0, expected = 0;
    for (uint32_t i = 0; i < slots; ++i) {
        if (!in.number(number)) return false;
        expected += i == 0 ? number : keyframe_bytes::unzigzag(number);
        if (expected >= slots_before) return false;
        source[i] = expected++;
    }
    if (!in.number(dead_faces)) return false;
    for (uint32_t d = 0, neighbour = 0; d < dead_faces; ++d) {
        if (!in.number(number) || number / codes >= slots - neighbour) return false;
        neighbour += number / codes;
        const uint32_t code = number % codes;
        if (!in.number(number) || source[neighbour] + keyframe_bytes::unzigzag(number) >= slots_before) return false;
        for (uint32_t k = 0; code == literal_code && k < 3; ++k) {
            if (!in.number(number) || number >= wedges) return false;
        }
    }
    return in.at_end();
}

}  // namespace lodestone
