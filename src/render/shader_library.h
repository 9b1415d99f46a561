// SPIR-V embedded in the program, by name. cmake/LodestoneShaders.cmake writes the functions that add shaders; tests
// add theirs the same way.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lodestone {

// A shader in SPIR-V.
struct ShaderCode {
    std::span<const uint32_t> words;     // that drivers get
    std::span<const uint32_t> compiled;  // that the compiler made of its text; the same where it was not optimised
};

// Adds a shader, or replaces the one of that name.
// name: "folder/file.stage". What code refers to must live as long as the program.
void add_shader(const std::string& name, const ShaderCode& code);

// Empty where there is no such shader.
ShaderCode shader_code(const std::string& name);

// ShaderCode::words of it.
inline std::span<const uint32_t> shader_words(const std::string& name) { return shader_code(name).words; }

// Of all there are.
std::vector<std::string> shader_names();

}  // namespace lodestone
