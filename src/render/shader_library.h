// SPIR-V embedded in the program, by name. cmake/LodestoneShaders.cmake writes the functions that add shaders; tests
// add theirs the same way.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lodestone {

// What drivers get of a shader, and what the compiler made of its text: the same where it was not optimised.
struct ShaderCode {
    std::span<const uint32_t> words, compiled;
};

// Adds a shader, or replaces the one of that name.
// name: "folder/file.stage". What code refers to must live as long as the program.
void add_shader(const std::string& name, const ShaderCode& code);

// Empty where there is no such shader.
ShaderCode shader_code(const std::string& name);

inline std::span<const uint32_t> shader_words(const std::string& name) { return shader_code(name).words; }

// Of all there are.
std::vector<std::string> shader_names();

}  // namespace lodestone
