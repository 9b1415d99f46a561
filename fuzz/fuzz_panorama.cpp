// Pictures of surroundings: Radiance's .hdr.
#include "fuzz/promise.h"
#include "light/panorama.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace lodestone;
    const auto read = decode_panorama(std::as_bytes(std::span(data, size)), "a.hdr");
    if (!read) {
        fuzz::check_error(read.error());
        fuzz::require(read.error().fault == Fault::format, "what is wrong is the file's fault");
        return 0;
    }
    fuzz::require(read->texels.size() == size_t{read->width} * read->height, "every texel is there");
    for (const glm::vec3 d : {glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(-0.6f, 0, -0.8f)}) {
        const glm::vec3 light = read->towards(d);
        fuzz::require(light.x >= 0 && light.y >= 0 && light.z >= 0 && light.x + light.y + light.z < 1e20f,
                      "radiance is a number");
    }
    return 0;
}
