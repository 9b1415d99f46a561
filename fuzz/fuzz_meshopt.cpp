// Buffer views of EXT_meshopt_compression: mode, filter, stride and number of elements, then the stream.
#include <algorithm>
#include <cstdint>
#include <span>

#include "fuzz/promise.h"
#include "fuzz/watch.h"
#include "mesh/io/compressed/meshopt.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 5) return 0;
    static constexpr const char* modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES", "OTHERS"};
    static constexpr const char* filters[] = {"", "NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "OTHER"};
    const lodestone::MeshoptView view{static_cast<uint64_t>(data[2] | data[3] << 8), data[1], modes[data[0] & 3],
                                      filters[(data[0] >> 2) % 6]};
    constexpr uint64_t most_bytes = uint64_t{1} << 20;
    const lodestone::fuzz::Watch watch;
    const auto unpacked = lodestone::decode_meshopt(std::span(data, size).subspan(4), view, most_bytes);
    if (unpacked) {
        lodestone::fuzz::require(unpacked->size() == view.count * view.stride, "as many bytes as the view says");
        lodestone::fuzz::require(unpacked->size() <= most_bytes, "no more than the limit");
    } else {
        lodestone::fuzz::check_error(unpacked.error());
    }
    watch.check(std::max(size, unpacked ? unpacked->size() : 0));
    return 0;
}
