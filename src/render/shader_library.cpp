#include "render/shader_library.h"

#include <map>

namespace lodestone {

void add_built_in_shaders();  // generated from shaders/

namespace {
std::map<std::string, std::span<const uint32_t>>& library() {
    static std::map<std::string, std::span<const uint32_t>> shaders;
    return shaders;
}
}  // namespace

void add_shader(const std::string& name, std::span<const uint32_t> words) { library()[name] = words; }

std::span<const uint32_t> shader_words(const std::string& name) {
    static const bool added = (add_built_in_shaders(), true);
    static_cast<void>(added);
    const auto found = library().find(name);
    return found == library().end() ? std::span<const uint32_t>{} : found->second;
}

}  // namespace lodestone
