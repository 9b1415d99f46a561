#include "mesh/io/write.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "base/files/file.h"
#include "mesh/io/gltf/material_json.h"
#include "mesh/io/gltf/write_glb.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little);

template <class T>
void append(std::vector<std::byte>& to, const T* values, size_t count) {
    const auto* bytes = reinterpret_cast<const std::byte*>(values);
    to.insert(to.end(), bytes, bytes + count * sizeof(T));
}

Result<void> write_ply(const TriMesh& mesh, const fs::path& path) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.wedge_count()) +
                         "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.uvs.empty()) header += "property float s\nproperty float t\n";
    if (!mesh.colours.empty())
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    if (!mesh.materials.empty()) header += "property ushort material_index\n";
    header += "element face " + std::to_string(mesh.triangle_count()) +
              "\nproperty list uchar int vertex_indices\nend_header\n";
    if (auto done = file->write(header); !done) return done;
    std::vector<std::byte> block;
    const auto flush = [&](bool last) -> Result<void> {
        if (!last && block.size() < (size_t{1} << 20)) return {};
        auto done = file->write(block);
        block.clear();
        return done;
    };
    for (size_t w = 0; w < mesh.wedge_count(); ++w) {
        append(block, &mesh.positions[mesh.wedge_vertex[w]], 1);
        if (!mesh.normals.empty()) append(block, &mesh.normals[w], 1);
        if (!mesh.uvs.empty()) {
            const glm::vec2 uv(mesh.uvs[w].x, 1 - mesh.uvs[w].y);  // PLY's origin is at the bottom
            append(block, &uv, 1);
        }
        if (!mesh.colours.empty()) append(block, &mesh.colours[w], 1);
        if (!mesh.materials.empty()) append(block, &mesh.materials[w], 1);
        if (auto done = flush(false); !done) return done;
    }
    for (const Triangle& t : mesh.triangles) {
        const uint8_t three = 3;
        append(block, &three, 1);
        append(block, t.data(), 3);
        if (auto done = flush(false); !done) return done;
    }
    if (auto done = flush(true); !done) return done;
    return file->commit();
}

// Shortest text that reads back as the same float.
void add_number(std::string& text, float value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    text += ' ';
    text.append(digits, end);
}

std::string material_name(const TriMesh& mesh, size_t m) {
    std::string name =
        mesh.material_table[m].name.empty() ? "material" + std::to_string(m) : mesh.material_table[m].name;
    for (char& c : name) {
        if (c == ' ' || c == '\t' || c == '\n') c = '_';
    }
    return name;
}

Result<void> write_text(const fs::path& path, const std::string& text) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(text); !done) return done;
    return file->commit();
}

Result<void> write_image(const Image& image, const fs::path& path, const WriteOptions& options) {
    auto bytes = encoded_texture(image, options);
    if (!bytes) return fail_at(path.string(), bytes.error());
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(*bytes); !done) return done;
    return file->commit();
}

// Whether MTL has a word for a texture of a material.
bool fits_mtl(const Material& m, const Texture& texture) {
    const bool known =
        &texture == &m.base_colour_texture || &texture == &m.normal_texture || &texture == &m.emission_texture;
    return known && texture.place == Texture{}.place && !texture.second;
}

// Whether a material is blended by what its texture holds. MTL has map_d for that and for masks alike.
bool blends_by_texture(const TriMesh& mesh, const Material& m) {
    const Texture& texture = m.base_colour_texture;
    return m.alpha_mode == AlphaMode::blend && texture.there() && fits_mtl(m, texture) &&
           has_alpha(mesh.images[static_cast<size_t>(texture.image)]);
}

// The materials of an OBJ, with their images beside it.
class MaterialLibrary {
public:
    // path: of the OBJ.
    MaterialLibrary(const TriMesh& mesh, const fs::path& path, const WriteOptions& options)
        : mesh_(mesh), path_(path), options_(options), written_(mesh.images.size(), false) {}

    Result<void> write(const fs::path& library) {
        for (size_t m = 0; m < mesh_.material_table.size(); ++m) {
            mtl_ += "newmtl " + material_name(mesh_, m) + "\n";
            if (auto done = add(mesh_.material_table[m]); !done) return done;
        }
        return write_text(library, mtl_);
    }

private:
    Result<void> add(Material m) {
        // A JPEG as map_d would let through what is bright.
        const bool cut_out = options_.textures != WriteOptions::Textures::jpeg &&
                             (m.alpha_mode == AlphaMode::mask || blends_by_texture(mesh_, m));
        for (Texture* texture : m.textures()) {
            if (!fits_mtl(m, *texture)) leave_out(m, *texture);
        }
        line("Kd", {m.base_colour.x, m.base_colour.y, m.base_colour.z});
        line("d", {m.alpha_mode == AlphaMode::opaque ? 1 : m.base_colour.w});
        if (m.shading == Shading::metallic_roughness) {
            line("Pm", {m.metallic});
            line("Pr", {m.roughness});
        }
        if (m.emission != glm::vec3(0)) line("Ke", {m.emission.x, m.emission.y, m.emission.z});
        std::string normals = "norm";
        if (m.normal_scale != 1) {
            normals += " -bm";
            add_number(normals, m.normal_scale);
        }
        for (const auto& [word, texture] : {std::pair{std::string("map_Kd"), &m.base_colour_texture},
                                            {"map_Ke", &m.emission_texture},
                                            {normals, &m.normal_texture}}) {
            if (auto done = add_map(word, *texture); !done) return done;
        }
        return cut_out ? add_map("map_d", m.base_colour_texture) : Result<void>{};
    }

    void line(const char* word, std::initializer_list<float> numbers) {
        mtl_ += word;
        for (const float number : numbers) add_number(mtl_, number);
        mtl_ += '\n';
    }

    Result<void> add_map(const std::string& word, const Texture& texture) {
        if (!texture.there()) return {};
        const auto number = static_cast<size_t>(texture.image);
        const std::string image =
            path_.stem().string() + "-" + std::to_string(number) + extension_of(options_.textures);
        mtl_ += word + " " + image + "\n";
        if (written_[number]) return {};
        written_[number] = true;
        return write_image(mesh_.images[number], path_.parent_path() / image, options_);
    }

    const TriMesh& mesh_;
    const fs::path& path_;
    const WriteOptions& options_;
    std::vector<bool> written_;  // per image
    std::string mtl_;
};

// Positions, with the colours of their first wedges; texture coordinates; normals.
void add_obj_vertices(std::string& text, const TriMesh& mesh) {
    std::vector<uint32_t> first_wedge(mesh.vertex_count(), ~0u);
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w)
        first_wedge[mesh.wedge_vertex[w]] = std::min(first_wedge[mesh.wedge_vertex[w]], w);
    for (size_t v = 0; v < mesh.vertex_count(); ++v) {
        text += 'v';
        for (int k = 0; k < 3; ++k) add_number(text, mesh.positions[v][k]);
        if (!mesh.colours.empty() && first_wedge[v] != ~0u) {
            for (int k = 0; k < 3; ++k) add_number(text, static_cast<float>(mesh.colours[first_wedge[v]][k]) / 255);
        }
        text += '\n';
    }
    for (const glm::vec2& uv : mesh.uvs) {
        text += "vt";
        add_number(text, uv.x);
        add_number(text, 1 - uv.y);
        text += '\n';
    }
    for (const glm::vec3& n : mesh.normals) {
        text += "vn";
        for (int k = 0; k < 3; ++k) add_number(text, n[k]);
        text += '\n';
    }
}

void add_obj_faces(std::string& text, const TriMesh& mesh) {
    uint32_t material = ~0u;
    for (const Triangle& t : mesh.triangles) {
        const uint32_t own = mesh.materials.empty() ? 0 : mesh.materials[t[0]];
        if (!mesh.material_table.empty() && own != material) {
            material = own;
            text += "usemtl " + material_name(mesh, material) + "\n";
        }
        text += 'f';
        for (const uint32_t w : t) {
            const std::string attribute = std::to_string(w + 1);
            text += ' ' + std::to_string(mesh.wedge_vertex[w] + 1);
            if (!mesh.uvs.empty() || !mesh.normals.empty()) text += '/';
            if (!mesh.uvs.empty()) text += attribute;
            if (!mesh.normals.empty()) text += '/' + attribute;
        }
        text += '\n';
    }
}

Result<void> write_obj(const TriMesh& mesh, const fs::path& path, const WriteOptions& options) {
    std::string text;
    if (!mesh.material_table.empty()) {
        fs::path library = path;
        library.replace_extension(".mtl");
        if (auto done = MaterialLibrary(mesh, path, options).write(library); !done) return done;
        text += "mtllib " + library.filename().string() + "\n";
    }
    add_obj_vertices(text, mesh);
    add_obj_faces(text, mesh);
    return write_text(path, text);
}

// Lines of what a format does not hold.
class Lost {
public:
    Lost(const TriMesh& mesh, std::string format) : mesh_(mesh), format_(std::move(format)) {}

    void add(const std::string& what) { lines_.push_back(format_ + " does not hold " + what + "; GLB does"); }
    // Where some materials have it.
    template <class Has>
    void add_of_materials(const std::string& what, const Has& has) {
        const auto count = std::ranges::count_if(mesh_.material_table, has);
        if (count > 0) add(what + " of " + std::to_string(count) + " materials");
    }
    void add_attributes() {
        if (!mesh_.second_uvs.empty()) add("the second set of texture coordinates");
        if (!mesh_.tangents.empty()) add("tangents");
    }
    std::vector<std::string> take() { return std::move(lines_); }

private:
    const TriMesh& mesh_;
    std::string format_;
    std::vector<std::string> lines_;
};

bool has_textures(const Material& m) {
    return std::ranges::any_of(m.textures(), [](const Texture* texture) { return texture->there(); });
}

// Whether a material says more than a name and its textures.
bool has_factors(Material m) {
    m.name.clear();
    for (Texture* texture : m.textures()) *texture = {};
    return m != Material{};
}

std::vector<std::string> lost_by_ply(const TriMesh& mesh) {
    Lost lost(mesh, "PLY");
    lost.add_of_materials("the textures", has_textures);
    lost.add_of_materials("colours and other factors", has_factors);
    lost.add_attributes();
    return lost.take();
}

// Whether wedges of a vertex have different colours.
bool colours_have_seams(const TriMesh& mesh) {
    std::vector<uint32_t> first(mesh.vertex_count(), ~0u);
    for (uint32_t w = 0; w < mesh.colours.size(); ++w) {
        uint32_t& of_vertex = first[mesh.wedge_vertex[w]];
        if (of_vertex == ~0u) of_vertex = w;
        if (glm::u8vec3(mesh.colours[w]) != glm::u8vec3(mesh.colours[of_vertex])) return true;
    }
    return false;
}

std::vector<std::string> lost_by_obj(const TriMesh& mesh) {
    Lost lost(mesh, "OBJ");
    for (size_t k = 0; k < texture_names.size(); ++k) {
        lost.add_of_materials("the textures of " + std::string(texture_names[k]), [k](const Material& m) {
            const Texture& texture = *m.textures()[k];
            return texture.there() && !fits_mtl(m, texture);
        });
    }
    lost.add_of_materials("the wrap of textures", [](const Material& m) {
        return std::ranges::any_of(m.textures(), [&](const Texture* texture) {
            return texture->there() && fits_mtl(m, *texture) && texture->wrap != Texture{}.wrap;
        });
    });
    lost.add_of_materials("the unlit shading", [](const Material& m) { return m.shading == Shading::unlit; });
    lost.add_of_materials("the second side", [](const Material& m) { return m.double_sided; });
    lost.add_of_materials("the cutoff of masks", [](const Material& m) {
        return m.alpha_mode == AlphaMode::mask && m.alpha_cutoff != Material{}.alpha_cutoff;
    });
    lost.add_of_materials("masks without a texture", [](const Material& m) {
        const bool told = m.base_colour_texture.there() && fits_mtl(m, m.base_colour_texture);
        return m.alpha_mode == AlphaMode::mask && !told;
    });
    lost.add_of_materials("blending by a texture, which is written as a mask,",
                          [&](const Material& m) { return blends_by_texture(mesh, m); });
    lost.add_attributes();
    if (std::ranges::any_of(mesh.colours, [](const glm::u8vec4& c) { return c.w != 255; }))
        lost.add("alpha of colours of vertices");
    if (colours_have_seams(mesh)) lost.add("more than one colour of a vertex");
    return lost.take();
}

}  // namespace

Result<void> check_write(const fs::path& path) {
    const std::string extension = path.extension().string();
    if (extension == ".ply" || extension == ".obj" || extension == ".glb") return {};
    return fail(Fault::usage, path.string() + ": the name must end in .ply, .obj or .glb");
}

std::vector<std::string> lost_in_writing(const TriMesh& mesh, const fs::path& path) {
    const std::string extension = path.extension().string();
    if (extension == ".glb") return unwritable_textures(mesh.material_table);
    if (extension == ".ply") return lost_by_ply(mesh);
    return extension == ".obj" ? lost_by_obj(mesh) : std::vector<std::string>();
}

Result<void> write_mesh(const TriMesh& mesh, const fs::path& path, const WriteOptions& options) {
    if (auto good = check_write(path); !good) return good;
    const std::string extension = path.extension().string();
    if (extension == ".ply") return write_ply(mesh, path);
    if (extension == ".obj") return write_obj(mesh, path, options);
    return write_glb(mesh, path, options);
}

}  // namespace lodestone
