#include "apps/viewer/shader_reload.h"

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include <algorithm>
#include <deque>
#include <memory>

#include "base/files/file.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

constexpr std::pair<const char*, EShLanguage> stages[] = {{".vert", EShLangVertex},
                                                          {".frag", EShLangFragment},
                                                          {".comp", EShLangCompute},
                                                          {".tesc", EShLangTessControl},
                                                          {".tese", EShLangTessEvaluation}};

Result<std::string> text_of(const fs::path& path) {
    auto file = read_file(path);
    if (!file) return tl::unexpected(file.error());
    return std::string(reinterpret_cast<const char*>(file->bytes.data()), file->bytes.size());
}

// Includes are named from the folder of all shaders.
class Includer final : public glslang::TShader::Includer {
public:
    explicit Includer(fs::path folder) : folder_(std::move(folder)) {}
    IncludeResult* includeLocal(const char* name, const char*, size_t depth) override {
        constexpr size_t deepest = 32;
        auto text = depth < deepest ? text_of(folder_ / name) : Result<std::string>(fail(Fault::format, "too deep"));
        if (!text) return nullptr;
        texts_.push_back(std::move(*text));
        results_.push_back(std::make_unique<IncludeResult>(name, texts_.back().data(), texts_.back().size(), nullptr));
        return results_.back().get();
    }
    void releaseInclude(IncludeResult*) override {}  // all at once, with this

private:
    fs::path folder_;
    std::deque<std::string> texts_;
    std::vector<std::unique_ptr<IncludeResult>> results_;
};

// The line of a compiler's log that says what is wrong.
std::string first_error(const std::string& log) {
    size_t begin = log.find("ERROR: ");
    if (begin == std::string::npos) return "does not compile";
    begin += std::string("ERROR: ").size();
    return log.substr(begin, log.find('\n', begin) - begin);
}

Result<std::vector<uint32_t>> compile(const fs::path& folder, const std::string& name) {
    const fs::path path = folder / name;
    const auto stage = std::ranges::find_if(stages, [&](const auto& s) { return path.extension() == s.first; });
    if (stage == std::end(stages)) return fail(Fault::format, path.string() + ": is no shader");
    auto text = text_of(path);
    if (!text) return tl::unexpected(text.error());
    glslang::TShader shader(stage->second);
    const char* string = text->c_str();
    const std::string shown = path.string();
    const char* names[] = {shown.c_str()};
    const int length = static_cast<int>(text->size());
    shader.setStringsWithLengthsAndNames(&string, &length, names, 1);
    shader.setEnvInput(glslang::EShSourceGlsl, stage->second, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_3);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_6);
    const auto messages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    Includer includer(folder);
    if (!shader.parse(GetDefaultResources(), 460, false, messages, includer))
        return fail(Fault::format, first_error(shader.getInfoLog()));
    glslang::TProgram program;
    program.addShader(&shader);
    if (!program.link(messages)) return fail(Fault::format, shown + ": " + first_error(program.getInfoLog()));
    std::vector<uint32_t> words;
    // As the build does it (cmake/LodestoneShaders.cmake), so that what has not changed gives the same words.
    glslang::SpvOptions options;
    options.stripDebugInfo = true;
    glslang::GlslangToSpv(*program.getIntermediate(stage->second), words, &options);
    return words;
}

}  // namespace

void ReplacedShaders::undo() const {
    for (const auto& [name, code] : before_) add_shader(name, code);
}

Result<ReplacedShaders> compile_shaders(const fs::path& folder) {
    static const bool started = glslang::InitializeProcess();
    if (!started) return fail(Fault::machine, "the shader compiler cannot be started");
    static std::deque<std::vector<uint32_t>> kept;  // what the library refers to
    std::map<std::string, std::vector<uint32_t>> made;
    for (const std::string& name : shader_names()) {
        auto words = compile(folder, name);
        if (!words) return tl::unexpected(words.error());
        made.emplace(name, std::move(*words));
    }
    std::map<std::string, ShaderCode> before;
    for (auto& [name, words] : made) {
        const ShaderCode old = shader_code(name);
        if (std::ranges::equal(old.compiled, words)) continue;
        before.emplace(name, old);
        kept.push_back(std::move(words));
        add_shader(name, {kept.back(), kept.back()});
    }
    return ReplacedShaders(std::move(before));
}

}  // namespace lodestone
