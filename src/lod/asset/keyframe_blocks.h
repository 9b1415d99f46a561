// How one keyframe's face order comes from the one before, as bytes: in blocks of 64 slots that are read on their own,
// so that a cursor can take up a new order, or bring back an old one, a block at a time.
//
// A block says for each of its slots which slot of the order before holds the face. Faces that died in between are in
// no slot of the new order; each is noted in the block of a face that still has all of its wedges, and is brought back
// from there. Numbers are LEB128 variable-length integers; signed ones are zigzag coded.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

constexpr uint32_t keyframe_block_slots = 64;  // of a whole block; the last of a keyframe may have fewer

// A face that died, as it was at the keyframe.
struct DeadFace {
    uint32_t slot = 0;                 // in the order before
    uint8_t neighbour = 0;             // slot within the block whose face has its wedges ...
    std::array<uint8_t, 3> corners{};  // ... at these corners, 0 .. 2
    bool literal = false;              // no such face: wedges holds them
    std::array<uint32_t, 3> wedges{};  // only where literal
};

// Writes a block.
// sources: per slot of the block, 1 .. 64 of them, its slot in the order before. dead: by rising neighbour. Appends to
// bytes.
void write_keyframe_block(std::span<const uint32_t> sources, std::span<const DeadFace> dead,
                          std::vector<uint8_t>& bytes);

// Reads a block that check_keyframe_block has passed. alive(i, source) for each slot i of the block in turn, then
// dead(const DeadFace&) for each face that died.
template <class Alive, class Dead>
void read_keyframe_block(const uint8_t* at, uint32_t slots, Alive&& alive, Dead&& dead);

// Whether the bytes are one whole block of `slots` slots, all slots of the order before below slots_before and all
// wedges below `wedges`.
bool check_keyframe_block(std::span<const uint8_t> bytes, uint32_t slots, uint32_t slots_before, uint32_t wedges,
                          uint32_t& dead_faces);

// -----------------------------------------------------------------------------------------------------------------

// How numbers lie in a block; for read_keyframe_block() alone.
namespace keyframe_bytes {
// A dead face begins with (neighbour - that of the dead face before) * codes + code.
constexpr uint32_t literal_code = 27;  // below: the three corners as digits of base 3
constexpr uint32_t codes = 28;         // literal_code and those below

// Reads a LEB128 number and moves on behind it.
inline uint32_t take(const uint8_t*& at) {
    uint32_t value = *at & 0x7f;
    for (uint32_t shift = 7; (*at++ & 0x80) != 0; shift += 7)
        value |= static_cast<uint32_t>(*at & 0x7f) << (shift & 31);
    return value;
}
inline uint32_t unzigzag(uint32_t coded) { return (coded >> 1) ^ (0u - (coded & 1)); }  // modulo 2^32
}  // namespace keyframe_bytes

template <class Alive, class Dead>
void read_keyframe_block(const uint8_t* at, uint32_t slots, Alive&& alive, Dead&& dead) {
    using namespace keyframe_bytes;
    std::array<uint32_t, keyframe_block_slots> source;
    uint32_t expected = take(at);
    for (uint32_t i = 0; i < slots; ++i) {
        if (i > 0) expected += unzigzag(take(at));
        source[i] = expected++;
        alive(i, source[i]);
    }
    DeadFace face;
    for (uint32_t left = take(at); left > 0; --left) {
        const uint32_t step_and_code = take(at), code = step_and_code % codes;
        face.neighbour = static_cast<uint8_t>(face.neighbour + step_and_code / codes);
        face.slot = source[face.neighbour] + unzigzag(take(at));
        face.literal = code == literal_code;
        if (face.literal) {
            for (uint32_t& wedge : face.wedges) wedge = take(at);
        } else {
            face.corners = {static_cast<uint8_t>(code / 9), static_cast<uint8_t>(code / 3 % 3),
                            static_cast<uint8_t>(code % 3)};
        }
        dead(face);
    }
}

}  // namespace lodestone
