// A cache-aware face order made of vertex fans: the whole remaining fan of a cached vertex is emitted at a time.
// Kin of Lin and Yu, "An improved vertex caching scheme for 3D mesh rendering", IEEE TVCG 2006, and of Sander, Nehab,
// Barczak, "Fast triangle reordering for vertex locality and reduced overdraw", SIGGRAPH 2007 (tipsify); the cost is
// ours.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

// The fan of a vertex costs
//   miss * vertices it brings in - face * its faces - finished * vertices it finishes + evicted * vertices it pushes
//   out that are still needed, and - age * (how long the vertex has been cached) / cache where it outlives its fan, + 1
//   where not.
// The cheapest is next.
struct FanWeights {
    double miss = 1.21, face = 0.67, finished = 0.92, age = 0.4, evicted = 1.27;
};
// Two sets that orders are tried with.
inline constexpr FanWeights small_fans{}, large_fans{1.53, 0.83, 0.81, 0.42, 1.23};

// Instead of the cheapest fan, the one of several that leads to the least cost some way ahead: vertices brought in, and
// those pushed out that must be brought in again. Two ways that draw the same faces and end in the same cache are one.
struct Rollouts {
    uint32_t candidates = 1;  // 1: none are tried out
    uint32_t faces = 100;     // how far ahead
    uint32_t fans = 3;        // emitted of the best before looking again
    // The faces as they are at a later level, or none: what this level brings in counts as well.
    std::span<const uint32_t> later = {};  // as Fans::indices
};

// The fans of an index list, for any number of orders of it.
class Fans {
public:
    // indices: three vertices per face, each below `vertices`; they are kept.
    Fans(std::span<const uint32_t> indices, uint32_t vertices);

    struct Spoke {
        uint32_t vertex;
        uint32_t faces;  // left with both this vertex and the hub, corner by corner
    };

    std::span<const uint32_t> indices;
    uint32_t vertices;
    std::vector<uint32_t> first, faces_of;  // per vertex: its faces, once per corner
    std::vector<uint32_t> first_spoke;      // per vertex: in spokes
    std::vector<Spoke> spokes;              // and one at the end that nothing reads
    std::vector<std::array<uint32_t, 6>>
        ends;                  // per face: the spokes of its sides, both ways; of one without length the last
    uint32_t most_spokes = 0;  // of a vertex
    const std::atomic<bool>* stop = nullptr;  // once it is set, orders end soon: what is left comes as it lies
};

// Faces (positions in indices / 3) in drawing order, made for a FIFO of `cache` entries, 3 .. 1024. Degenerate faces
// come where their vertices are. Time is linear in faces times cache.
// lead: so many faces were drawn before, those that come first in indices; they are not in what is returned.
std::vector<uint32_t> fan_order(const Fans& fans, uint32_t cache, const FanWeights& weights,
                                const Rollouts& rollouts = {}, uint32_t lead = 0);

}  // namespace lodestone
