// Height maps: PNG of 16 bits and TIFF, told by content; those of odd size with their voids filled.
#include "fuzz/mutators.h"
#include "fuzz/read_check.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    lodestone::ReadOptions options;
    options.fill_voids = size % 2 == 1;
    if (options.fill_voids) options.void_height = 0.0f;
    lodestone::fuzz::check_mesh({{"a.tif", {reinterpret_cast<const char*>(data), size}}}, options);
    return 0;
}

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
    return lodestone::fuzz::mutate_png(data, size, most, seed);
}
