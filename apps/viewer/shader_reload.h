// Shaders compiled anew while the program runs, in place of those it was built with.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "render/shader_library.h"

namespace lodestone {

// What was in the library before; undo() puts it back.
class ReplacedShaders {
public:
    explicit ReplacedShaders(std::map<std::string, ShaderCode> before) : before_(std::move(before)) {}
    size_t count() const { return before_.size(); }
    void undo() const;

private:
    std::map<std::string, ShaderCode> before_;
};

// Compiles every shader of the library from `folder` (laid out as shaders/) and replaces those that have changed; these
// are not optimised.
// Fault::format where one is not there or does not compile, with the compiler's message; then nothing is replaced.
Result<ReplacedShaders> compile_shaders(const std::filesystem::path& folder);

}  // namespace lodestone
