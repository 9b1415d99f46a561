#include "fuzz/read_check.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    lodestone::fuzz::check_mesh({{"a.ply", {reinterpret_cast<const char*>(data), size}}});
    return 0;
}
