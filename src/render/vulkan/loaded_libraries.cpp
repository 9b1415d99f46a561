#include "render/vulkan/loaded_libraries.h"

#include <dlfcn.h>
#include <link.h>

namespace lodestone {

namespace {

std::set<std::string> names_of_loaded() {
    std::set<std::string> names;
    dl_iterate_phdr(
        [](dl_phdr_info* info, size_t, void* to) {
            if (info->dlpi_name != nullptr && info->dlpi_name[0] != '\0')
                static_cast<std::set<std::string>*>(to)->insert(info->dlpi_name);
            return 0;
        },
        &names);
    return names;
}

}  // namespace

LoadedLibraries::LoadedLibraries() : names_(names_of_loaded()) {}

void LoadedLibraries::keep_new() const {
    for (const std::string& name : names_of_loaded()) {
        // The handle is never given back. What has no file of its own is nothing that could be unloaded.
        if (!names_.contains(name)) dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE);
    }
}

}  // namespace lodestone
