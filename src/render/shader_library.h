// SPIR-V embedded in the program, by name. cmake/LodestoneShaders.cmake writes the functions that add shaders; tests
// add theirs the same way.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lodestone {

// Adds a shader.
// name: "folder/file.stage". The words must live as long as the program.
void add_shader(const std::string& name, std::span<const uint32_t> words);

// Empty where there is no such shader.
std::span<const uint32_t> shader_words(const std::string& name);

// Of all there are.
std::vector<std::string> shader_names();

}  // namespace lodestone
