#include "render/vulkan/loaded_libraries.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <link.h>

#include <set>
#include <string>

#include "render/renderer.h"

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

std::set<std::string> all_loaded() {
    std::set<std::string> names;
    dl_iterate_phdr(
        [](dl_phdr_info* info, size_t, void* to) {
            static_cast<std::set<std::string>*>(to)->insert(info->dlpi_name);
            return 0;
        },
        &names);
    return names;
}

TEST(LoadedLibraries, ADriverIsStillThereWhenItsDeviceIsGone) {
    RendererOptions options;
    options.width = options.height = 16;
    auto renderer = Renderer::create(options);
    if (!renderer) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const std::set<std::string> with_device = all_loaded();
    renderer->reset();
    EXPECT_EQ(all_loaded(), with_device);
}

}  // namespace
}  // namespace lodestone
