#include "apps/embed/bake.h"

#include <unistd.h>

#include <bit>
#include <cstdlib>

#include "apps/embed/option_words.h"
#include "apps/options/bake_options.h"
#include "mesh/packed_vertices.h"

namespace lodestone {

namespace {

// given: words or a text.
template <class Given>
Result<BakeOptions> bake_options_given(const Given& given) {
    CLI::App command;
    BakeWords words;
    add_bake_options(command, words);
    if (auto done = parse_options(command, given); !done) return tl::unexpected(done.error());
    return bake_options_of(words);
}

// All of a material but its name.
std::vector<uint32_t> words_of(const Material& m) {
    std::vector<uint32_t> words{static_cast<uint32_t>(m.shading), static_cast<uint32_t>(m.alpha_mode),
                                m.double_sided ? 1u : 0u};
    const auto add = [&](float number) { words.push_back(std::bit_cast<uint32_t>(number)); };
    for (const float number :
         {m.base_colour.x, m.base_colour.y, m.base_colour.z, m.base_colour.w, m.alpha_cutoff, m.metallic, m.roughness,
          m.normal_scale, m.occlusion_strength, m.emission.x, m.emission.y, m.emission.z})
        add(number);
    for (const Texture* texture : m.textures()) {
        words.push_back(static_cast<uint32_t>(texture->image));
        for (const Wrap wrap : texture->wrap) words.push_back(static_cast<uint32_t>(wrap));
        for (int k = 0; k < 3; ++k) add(texture->place[k].x), add(texture->place[k].y);
        words.push_back(texture->second ? 1 : 0);
    }
    return words;
}

// Of all that an asset's bytes depend on.
Hash128 source_of(const TriMesh& mesh) {
    HashStream stream;
    const auto add = [&](const auto& values) { stream.add(std::as_bytes(std::span(values))); };
    const PresentAttributes has = attributes_of(mesh);
    const std::array<uint64_t, 6> sizes{
        mesh.positions.size(),
        mesh.triangles.size(),
        has.normals + 2u * has.uvs + 4u * has.colours + 8u * has.materials + 16u * has.second_uvs + 32u * has.tangents,
        mesh.material_table.size(),
        mesh.images.size(),
        mesh.wedge_count()};
    add(sizes);
    add(mesh.positions);
    add(mesh.wedge_vertex);
    add(mesh.triangles);
    for_attributes(add, mesh);
    for (const Material& material : mesh.material_table) {
        add(material.name);
        const auto words = words_of(material);
        add(words);
    }
    for (const Image& image : mesh.images) {
        const std::array<uint32_t, 2> size{image.width, image.height};
        add(size);
        add(image.texels);
    }
    return stream.digest();
}

// A folder of its own for a file that is about to lose its name.
class PassingFolder {
public:
    static Result<PassingFolder> create() {
        std::error_code error;
        const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
        std::string path = (folder / "lodestone-XXXXXX").string();
        if (error || mkdtemp(path.data()) == nullptr)
            return fail(Fault::machine, path + ": no folder can be made for temporary files; set TMPDIR to another");
        return PassingFolder(path);
    }
    ~PassingFolder() {
        std::error_code ignored;
        if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
    }
    PassingFolder(PassingFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
    PassingFolder& operator=(PassingFolder&&) = delete;
    std::filesystem::path file() const { return path_ / "asset.lode"; }

private:
    explicit PassingFolder(std::filesystem::path path) : path_(std::move(path)) {}
    std::filesystem::path path_;
};

}  // namespace

Result<BakeOptions> bake_options_of(const std::vector<std::string>& words) { return bake_options_given(words); }

Result<BakeOptions> bake_options_of_text(const std::string& text) { return bake_options_given(text); }

Result<BakedAsset> bake_mesh(const NamedMesh& mesh, const BakeOptions& options,
                             const std::optional<std::filesystem::path>& path, bool opened, const Progress& progress) {
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    std::optional<PassingFolder> folder;
    if (!path) {
        auto made = PassingFolder::create();
        if (!made) return tl::unexpected(made.error());
        folder.emplace(std::move(*made));
    }
    const std::filesystem::path out = path ? *path : folder->file();
    BakeInput input;
    input.mesh = mesh.mesh;
    input.source = source_of(mesh.mesh);
    input.name = mesh.name;
    auto report = bake_asset(std::move(input), options, out, progress);
    if (!report) return tl::unexpected(report.error());
    BakedAsset baked{std::move(*report), std::nullopt};
    if (!opened && path) return baked;
    auto asset = open_asset(out);
    if (!asset) return tl::unexpected(asset.error());
    baked.asset.emplace(std::move(*asset));
    return baked;
}

}  // namespace lodestone
