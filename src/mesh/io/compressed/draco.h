// Meshes that Draco has compressed. Its decoder runs in a process of its own, under limits of memory and time, so that
// whatever a file makes it do ends that process alone.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"

namespace lodestone {

// What a file promises of a compressed mesh.
struct DracoPromise {
    struct Attribute {
        uint32_t id = 0;          // Draco's unique id
        uint32_t components = 0;  // numbers of each vertex, 1 .. 4
        bool normalised = false;  // whole numbers stand for 0 .. 1 or -1 .. 1
        auto operator<=>(const Attribute&) const = default;
    };
    std::vector<Attribute> attributes;
    uint64_t vertices = 0, indices = 0;  // of the mesh; another number is refused
    auto operator<=>(const DracoPromise&) const = default;
};

struct DracoMesh {
    std::vector<uint32_t> indices;           // three per triangle, each below the number of vertices
    std::vector<std::vector<float>> values;  // per attribute: components times vertices
};

// Limits on the process that decodes.
struct DracoLimits {
    uint64_t memory_bytes = uint64_t{256} << 20;  // besides what vertices and triangles take
    double seconds = 20;                          // besides what they take, of processor time
};

// Fault::format where the bytes are no such mesh, or the decoder crashed, took too long or too much memory;
// Fault::machine where no process can be started.
Result<DracoMesh> decode_draco(std::span<const unsigned char> bytes, const DracoPromise& promise,
                               const DracoLimits& limits = {});
// What that process does, without limits, in the one that calls it: for fuzz/fuzz_draco.cpp, which no file reaches.
// Throws std::bad_alloc.
Result<DracoMesh> decode_draco_here(std::span<const unsigned char> bytes, const DracoPromise& promise);

}  // namespace lodestone
