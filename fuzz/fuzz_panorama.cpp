// Pictures of surroundings: Radiance's .hdr.
#include <algorithm>
#include <cstdio>

#include "fuzz/promise.h"
#include "fuzz/watch.h"
#include "light/panorama.h"

using namespace lodestone;

namespace {

// Bytes of the rows that are there, where a later one is what is wrong.
size_t bytes_before(const Error& error) {
    size_t row = 0, rows = 0;
    const bool told = std::sscanf(error.message.c_str(), "a.hdr: row %zu of %zu", &row, &rows) == 2;
    return told ? row * 2 * rows * sizeof(glm::u8vec4) : 0;
}

// Returns the bytes of what was decoded.
size_t decode(std::span<const std::byte> bytes) {
    const auto read = decode_panorama(bytes, "a.hdr");
    if (!read) {
        fuzz::check_error(read.error());
        fuzz::require(read.error().fault == Fault::format, "what is wrong is the file's fault");
        return bytes_before(read.error());
    }
    fuzz::require(read->texels.size() == size_t{read->width} * read->height, "every texel is there");
    for (const glm::vec3 d : {glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(-0.6f, 0, -0.8f)}) {
        const glm::vec3 light = read->towards(d);
        fuzz::require(light.x >= 0 && light.y >= 0 && light.z >= 0 && light.x + light.y + light.z < 1e20f,
                      "radiance is a number");
    }
    return read->texels.size() * sizeof read->texels[0];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const fuzz::Watch watch;
    watch.check(std::max(size, decode(std::as_bytes(std::span(data, size)))));
    return 0;
}
