// An OBJ and its library: the input up to its first zero is the OBJ, the rest a.mtl.
#include <algorithm>

#include "fuzz/read_check.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const uint8_t* middle = std::find(data, data + size, uint8_t{0});
    const uint8_t* rest = middle == data + size ? middle : middle + 1;
    lodestone::fuzz::check_mesh({{"a.obj", {data, middle}}, {"a.mtl", {rest, data + size}}});
    return 0;
}
