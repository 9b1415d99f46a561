#include "mesh/io/gltf/materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <set>

#include "base/text.h"
#include "mesh/io/gltf/values.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

constexpr float largest = 65504;  // of what has no bound: pictures are half floats

// A factor of a file, which may be any number.
float within(double value, float low, float high, float otherwise) {
    return std::isfinite(value) ? static_cast<float>(std::clamp<double>(value, low, high)) : otherwise;
}

// What a material says of one of its textures.
struct TextureUse {
    int number = -1;  // -1: it has none
    GltfTexcoords texcoords;
};

void set_pair(const tinygltf::Value& transform, const char* key, glm::dvec2& into) {
    if (!transform.Has(key) || transform.Get(key).ArrayLen() != 2) return;
    into = {transform.Get(key).Get(0).GetNumberAsDouble(), transform.Get(key).Get(1).GetNumberAsDouble()};
}

// Scaled, turned, moved.
void apply_transform(const tinygltf::Value& transform, GltfTexcoords& texcoords) {
    glm::dvec2 offset(0), scale(1);
    double angle = 0;
    set_pair(transform, "offset", offset);
    set_pair(transform, "scale", scale);
    if (transform.Has("rotation")) angle = transform.Get("rotation").GetNumberAsDouble();
    const double c = std::cos(angle), s = std::sin(angle);
    texcoords.place = {{c * scale.x, -s * scale.x}, {s * scale.y, c * scale.y}, offset};
    if (!transform.Has("texCoord")) return;
    const double set = transform.Get("texCoord").GetNumberAsDouble();
    if (set >= 0 && set < 1e6) texcoords.set = static_cast<int>(set);
}

template <class Info>
TextureUse use_of(const Info& info) {
    TextureUse use{info.index, {info.texCoord, glm::dmat3x2{{1, 0}, {0, 1}, {0, 0}}}};
    const auto extension = info.extensions.find("KHR_texture_transform");
    if (extension != info.extensions.end()) apply_transform(extension->second, use.texcoords);
    return use;
}

// What makes of coordinates moved by `base` those moved by `place`; nothing where there is no such thing.
std::optional<glm::mat3x2> place_after(const glm::dmat3x2& base, const glm::dmat3x2& place) {
    if (place == base) return Texture{}.place;
    const auto whole = [](const glm::dmat3x2& m) {
        return glm::dmat3(glm::dvec3(m[0], 0), glm::dvec3(m[1], 0), glm::dvec3(m[2], 1));
    };
    const double area = base[0].x * base[1].y - base[0].y * base[1].x;
    if (!std::isfinite(area) || area == 0) return std::nullopt;
    const glm::mat3x2 after(place * glm::inverse(whole(base)));
    for (int k = 0; k < 3; ++k) {
        if (!(std::abs(after[k].x) <= 1e6f && std::abs(after[k].y) <= 1e6f)) return std::nullopt;
    }
    return after;
}

class MaterialReader {
public:
    MaterialReader(const SourceFile& file, const ReadOptions& options, const tinygltf::Model& model,
                   const GltfNotRead& not_read, TriMesh& mesh, ReadReport& report)
        : file_(file), options_(options), model_(model), not_read_(not_read), mesh_(mesh), report_(report) {}

    GltfMaterials read() {
        Material plain;
        plain.name = "default";
        mesh_.material_table.push_back(plain);
        if (model_.materials.size() + 1 > file_.limits.materials)
            throw GltfFault{"", over_limit("materials", model_.materials.size() + 1, file_.limits.materials)};
        GltfMaterials materials;
        for (const tinygltf::Material& from : model_.materials) {
            Material material = factors_of(from);
            materials.texcoords.push_back(add_textures(from, material));
            mesh_.material_table.push_back(material);
        }
        warn_of_extensions_alone();
        for (const auto& [extension, textures] : extensions_alone_) materials.told_extensions.insert(extension);
        return materials;
    }

private:
    void warn(const std::string& line) { file_.warn(report_, line); }

    // All but textures.
    Material factors_of(const tinygltf::Material& from) {
        Material material;
        material.name = from.name;
        material.double_sided = from.doubleSided;
        material.shading =
            from.extensions.contains("KHR_materials_unlit") ? Shading::unlit : Shading::metallic_roughness;
        const auto& pbr = from.pbrMetallicRoughness;
        for (size_t k = 0; k < 4 && k < pbr.baseColorFactor.size(); ++k)
            material.base_colour[static_cast<int>(k)] = within(pbr.baseColorFactor[k], 0, 1, 1);
        material.metallic = within(pbr.metallicFactor, 0, 1, 1);
        material.roughness = within(pbr.roughnessFactor, 0, 1, 1);
        material.normal_scale = within(from.normalTexture.scale, -largest, largest, 1);
        material.occlusion_strength = within(from.occlusionTexture.strength, 0, 1, 1);
        const double strength = emissive_strength(from);
        for (size_t k = 0; k < 3 && k < from.emissiveFactor.size(); ++k)
            material.emission[static_cast<int>(k)] = within(from.emissiveFactor[k] * strength, 0, largest, 0);
        if (from.alphaMode == "MASK") {
            material.alpha_mode = AlphaMode::mask;
            material.alpha_cutoff = within(from.alphaCutoff, 0, largest, 0.5f);
        } else if (from.alphaMode == "BLEND") {
            material.alpha_mode = AlphaMode::blend;
        } else if (from.alphaMode != "OPAQUE") {
            warn(called(material) + " has an alphaMode that glTF does not know; it is opaque");
        }
        return material;
    }

    static double emissive_strength(const tinygltf::Material& from) {
        const auto extension = from.extensions.find("KHR_materials_emissive_strength");
        const bool there = extension != from.extensions.end() && extension->second.Has("emissiveStrength");
        return there ? extension->second.Get("emissiveStrength").GetNumberAsDouble() : 1;
    }

    static std::string called(const Material& material) {
        return "material '" + printable(material.name.substr(0, 80)) + "'";
    }

    GltfTexcoords add_textures(const tinygltf::Material& from, Material& material) {
        const std::array<TextureUse, 5> uses = {use_of(from.pbrMetallicRoughness.baseColorTexture),
                                                use_of(from.pbrMetallicRoughness.metallicRoughnessTexture),
                                                use_of(from.normalTexture), use_of(from.occlusionTexture),
                                                use_of(from.emissiveTexture)};
        const auto* first = std::ranges::find_if(uses, [](const TextureUse& use) { return use.number >= 0; });
        if (first == uses.end()) return {};
        GltfTexcoords sets = first->texcoords;
        const std::string first_name = texture_names[static_cast<size_t>(first - uses.begin())];
        for (size_t k = 0; k < uses.size(); ++k) {
            if (uses[k].number >= 0) add_texture(uses[k], k, first_name, material, sets);
        }
        return sets;
    }

    // k: of the material's textures. first_name: of the one on sets.set. Sets the second set where it is the first on
    // another.
    void add_texture(const TextureUse& use, size_t k, const std::string& first_name, Material& material,
                     GltfTexcoords& sets) {
        Texture& texture = *material.textures()[k];
        const auto left_out = [&](const std::string& why) {
            warn(called(material) + ": its texture of " + texture_names[k] + " is left out: " + why);
            leave_out(material, texture);
        };
        const bool second = use.texcoords.set != sets.set;
        const auto place = place_after(second ? GltfTexcoords{}.place : sets.place, use.texcoords.place);
        if (second && sets.second >= 0 && use.texcoords.set != sets.second) {
            left_out("it lies on TEXCOORD_" + std::to_string(use.texcoords.set) + ", others of the material on " +
                     "TEXCOORD_" + std::to_string(sets.set) + " and TEXCOORD_" + std::to_string(sets.second) +
                     "; two sets are read");
        } else if (!place) {
            left_out(second ? "its transform has numbers that are too large"
                            : "the transform of " + first_name + " cannot be undone");
        } else if (options_.load_images && static_cast<size_t>(use.number) >= model_.textures.size()) {
            left_out("texture " + std::to_string(use.number) + " is not there; the file has " +
                     std::to_string(model_.textures.size()));
        } else if (!options_.load_images || !look_up(use.number, texture)) {
            leave_out(material, texture);
        } else {
            texture.place = *place;
            texture.second = second;
            if (second) sets.second = use.texcoords.set;
        }
    }

    // Whether its image could be had; a warning says why not. number: below that of textures.
    bool look_up(int number, Texture& texture) {
        const tinygltf::Texture& from = model_.textures[static_cast<size_t>(number)];
        texture.image = image(from, number);
        if (from.sampler >= 0 && static_cast<size_t>(from.sampler) < model_.samplers.size()) {
            const tinygltf::Sampler& sampler = model_.samplers[static_cast<size_t>(from.sampler)];
            texture.wrap = {wrap_of(sampler.wrapS), wrap_of(sampler.wrapT)};
        }
        return texture.there();
    }
    static Wrap wrap_of(int word) {
        return word == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? Wrap::clamp
               : word == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror
                                                               : Wrap::repeat;
    }

    // A texture without an image that could be used.
    void warn_of_unusable(const std::string& name, const std::string& why) {
        warn("texture '" + printable(name.substr(0, 80)) + "' cannot be used (" + why +
             "); its material keeps its plain colour");
    }
    static std::string name_of(const tinygltf::Texture& texture, int number) {
        return texture.name.empty() ? std::to_string(number) : texture.name;
    }

    // The number of a texture's image in the file: one that EXT_texture_webp names before the one beside it.
    static int source_of(const tinygltf::Texture& texture) {
        const auto webp = texture.extensions.find("EXT_texture_webp");
        const bool there = webp != texture.extensions.end() && webp->second.Has("source");
        const int source = there ? webp->second.Get("source").GetNumberAsInt() : -1;
        return source >= 0 ? source : texture.source;
    }

    // Into the mesh's, or -1.
    int32_t image(const tinygltf::Texture& texture, int number) {
        const int source = source_of(texture);
        if (source >= 0 && static_cast<size_t>(source) < model_.images.size()) return image(source);
        const auto not_webp = [](const auto& extension) { return extension.first != "EXT_texture_webp"; };
        if (source >= 0)
            warn_of_unusable(name_of(texture, number), "image " + std::to_string(source) +
                                                           " is not there; the file has " +
                                                           std::to_string(model_.images.size()));
        else if (const auto other = std::ranges::find_if(texture.extensions, not_webp);
                 other != texture.extensions.end())
            extensions_alone_[other->first].insert(number);
        else
            warn_of_unusable(name_of(texture, number), "it names no image");
        return -1;
    }

    // A line for each extension, however many textures have their images by it alone.
    void warn_of_extensions_alone() {
        for (const auto& [extension, textures] : extensions_alone_) {
            const int first = *textures.begin();
            const size_t others = textures.size() - 1;
            const std::string name = name_of(model_.textures[static_cast<size_t>(first)], first).substr(0, 80);
            warn("texture '" + printable(name) + "'" +
                 (others == 0 ? " has its image" : " and " + std::to_string(others) + " more have their images") +
                 " by " + printable(extension.substr(0, 80)) +
                 " alone, which is not read; their materials keep their plain colours");
        }
    }

    // Into the mesh's, or -1. source: below the number of images.
    int32_t image(int source) {
        const auto [found, fresh] = images_.try_emplace(source, -1);
        if (!fresh) return found->second;
        const tinygltf::Image& image = model_.images[static_cast<size_t>(source)];
        std::string name = !image.uri.empty()    ? image.uri
                           : !image.name.empty() ? image.name
                                                 : "image " + std::to_string(source);
        name = printable(name.substr(0, 80));
        const auto added = file_.add_image(decoded(image, name), mesh_);
        if (added) return found->second = *added;
        warn_of_unusable(name, added.error().message);
        return -1;
    }

    Result<Image> decoded(const tinygltf::Image& image, const std::string& name) {
        if (const auto not_read = not_read_.find(image.uri); not_read != not_read_.end())
            return fail(Fault::format, not_read->second);
        try {
            const std::span<const unsigned char> bytes =
                image.bufferView < 0 ? std::span(image.image) : bytes_of_view(model_, image.bufferView, name);
            return file_.decode_texture(std::as_bytes(bytes), name, report_);
        } catch (const GltfFault& fault) { return fail(Fault::format, fault.what); }
    }

    const SourceFile& file_;
    const ReadOptions& options_;
    const tinygltf::Model& model_;
    const GltfNotRead& not_read_;
    TriMesh& mesh_;
    ReadReport& report_;
    std::map<int, int32_t> images_;  // of the file, and their numbers in the mesh
    // Textures that have their images by an extension alone that is not read.
    std::map<std::string, std::set<int>> extensions_alone_;
};

}  // namespace

GltfMaterials read_gltf_materials(const SourceFile& file, const ReadOptions& options, const tinygltf::Model& model,
                                  const GltfNotRead& not_read, TriMesh& mesh, ReadReport& report) {
    return MaterialReader(file, options, model, not_read, mesh, report).read();
}

void drop_unused_images(TriMesh& mesh) {
    std::vector<bool> used(mesh.material_table.size(), false);
    for (const uint16_t material : mesh.materials) used[material] = true;
    std::vector<int32_t> number(mesh.images.size(), -1);
    std::vector<Image> images;
    for (size_t m = 0; m < used.size(); ++m) {
        for (Texture* texture : mesh.material_table[m].textures()) {
            if (!texture->there()) continue;
            if (!used[m]) {
                texture->image = -1;
                continue;
            }
            int32_t& becomes = number[static_cast<size_t>(texture->image)];
            if (becomes < 0) {
                becomes = static_cast<int32_t>(images.size());
                images.push_back(std::move(mesh.images[static_cast<size_t>(texture->image)]));
            }
            texture->image = becomes;
        }
    }
    mesh.images = std::move(images);
}

}  // namespace lodestone
