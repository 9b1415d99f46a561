#include "render/vulkan/loaded_libraries.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

namespace lodestone {
namespace {

bool is_loaded(const char* name) {
    void* const there = dlopen(name, RTLD_LAZY | RTLD_NOLOAD);
    if (there != nullptr) dlclose(there);
    return there != nullptr;
}

// Two libraries of the C library's own that nothing here links.
TEST(LoadedLibraries, StayThoughNobodyHoldsThem) {
    constexpr const char *kept = "libanl.so.1", *other = "libBrokenLocale.so.1";
    ASSERT_FALSE(is_loaded(kept));
    ASSERT_FALSE(is_loaded(other));
    void* const held_before = dlopen(other, RTLD_LAZY);
    ASSERT_NE(held_before, nullptr);
    const LoadedLibraries before;
    void* const held = dlopen(kept, RTLD_LAZY);
    ASSERT_NE(held, nullptr);
    before.keep_new();
    dlclose(held);
    dlclose(held_before);
    EXPECT_TRUE(is_loaded(kept));
    EXPECT_FALSE(is_loaded(other)) << "it was there before";
}

}  // namespace
}  // namespace lodestone
