#include "render/shader_library.h"

#include <map>

namespace lodestone {

void add_built_in_shaders();  // generated from shaders/

namespace {
std::map<std::string, ShaderCode>& library() {
    static std::map<std::string, ShaderCode> shaders;
    return shaders;
}

const std::map<std::string, ShaderCode>& all_shaders() {
    static const bool added = (add_built_in_shaders(), true);
    static_cast<void>(added);
    return library();
}

}  // namespace

void add_shader(const std::string& name, const ShaderCode& code) { library()[name] = code; }

ShaderCode shader_code(const std::string& name) {
    const auto& shaders = all_shaders();
    const auto found = shaders.find(name);
    return found == shaders.end() ? ShaderCode{} : found->second;
}

std::vector<std::string> shader_names() {
    std::vector<std::string> names;
    for (const auto& [name, code] : all_shaders()) names.push_back(name);
    return names;
}

}  // namespace lodestone
