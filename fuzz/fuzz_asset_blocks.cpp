// Blocks of keyframes: what the check passes, reading stays inside of.
#include <algorithm>
#include <cstdlib>

#include "fuzz/watch.h"
#include "lod/asset/keyframe_blocks.h"

using namespace lodestone;

namespace {

// Returns how many bytes of slots and faces are in the block; 0 where it is refused.
size_t read_block(const std::vector<uint8_t>& bytes, uint32_t slots, uint32_t before, uint32_t wedges) {
    uint32_t dead_faces = 0;
    if (!check_keyframe_block(bytes, slots, before, wedges, dead_faces)) return 0;
    uint32_t alive = 0, dead = 0;
    read_keyframe_block(
        bytes.data(), slots,
        [&](uint32_t, uint32_t source) {
            if (source >= before) std::abort();
            ++alive;
        },
        [&](const DeadFace& face) {
            if (face.slot >= before || face.neighbour >= slots) std::abort();
            for (int k = 0; k < 3; ++k) {
                if (face.literal ? face.wedges[k] >= wedges : face.corners[k] > 2) std::abort();
            }
            ++dead;
        });
    if (alive != slots || dead != dead_faces) std::abort();
    return alive * sizeof(uint32_t) + dead * sizeof(DeadFace);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 4) return 0;
    const uint32_t slots = 1 + data[0] % keyframe_block_slots, before = 1 + (data[1] | data[2] << 8),
                   wedges = 1u << data[3] % 20;
    // A copy of its own, so that a sanitizer sees a step past the end.
    const std::vector<uint8_t> bytes(data + 4, data + size);
    const fuzz::Watch watch;
    watch.check(std::max(size, read_block(bytes, slots, before, wedges)));
    return 0;
}
