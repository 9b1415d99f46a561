#include "mesh/io/write.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/files/file.h"
#include "base/srgb.h"
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

Result<std::vector<std::byte>> encoded(const Image& image, const WriteOptions& options) {
    return options.jpeg_quality > 0 ? encode_jpeg(image, options.jpeg_quality) : encode_png(image);
}

Result<void> write_image(const Image& image, const fs::path& path, const WriteOptions& options) {
    auto bytes = encoded(image, options);
    if (!bytes) return fail_at(path.string(), bytes.error());
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(*bytes); !done) return done;
    return file->commit();
}

// The materials of an OBJ, with their images beside it. path: of the OBJ.
Result<void> write_material_library(const TriMesh& mesh, const fs::path& path, const fs::path& library,
                                    const WriteOptions& options) {
    const std::string extension = options.jpeg_quality > 0 ? ".jpg" : ".png";
    std::vector<bool> written(mesh.images.size(), false);
    std::string mtl;
    for (size_t m = 0; m < mesh.material_table.size(); ++m) {
        const Material& material = mesh.material_table[m];
        mtl += "newmtl " + material_name(mesh, m) + "\nKd";
        for (int k = 0; k < 3; ++k) add_number(mtl, material.base_colour[k]);
        mtl += "\nd";
        add_number(mtl, material.base_colour.w);
        mtl += '\n';
        if (material.base_colour_image >= 0) {
            const auto number = static_cast<size_t>(material.base_colour_image);
            const std::string image = path.stem().string() + "-" + std::to_string(number) + extension;
            if (!written[number]) {
                if (auto done = write_image(mesh.images[number], path.parent_path() / image, options); !done)
                    return done;
                written[number] = true;
            }
            mtl += "map_Kd " + image + "\n";
        }
    }
    return write_text(library, mtl);
}

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
        if (!mesh.materials.empty() && mesh.materials[t[0]] != material) {
            material = mesh.materials[t[0]];
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
    if (!mesh.materials.empty()) {
        fs::path library = path;
        library.replace_extension(".mtl");
        if (auto done = write_material_library(mesh, path, library, options); !done) return done;
        text += "mtllib " + library.filename().string() + "\n";
    }
    add_obj_vertices(text, mesh);
    add_obj_faces(text, mesh);
    return write_text(path, text);
}

// Binary glTF 2.0: one buffer, one node, one primitive per material over shared vertices.
class GlbWriter {
public:
    GlbWriter(const TriMesh& mesh, const WriteOptions& options) : mesh_(mesh), options_(options) {}

    Result<void> write(const fs::path& path) {
        json_["asset"] = {{"version", "2.0"}, {"generator", "lodestone"}};
        json_["scene"] = 0;
        json_["scenes"] = {{{"nodes", {0}}}};
        json_["nodes"] = {{{"mesh", 0}}};
        add_attributes();
        if (!mesh_.materials.empty()) {
            if (auto done = add_materials(); !done) return done;
        }
        add_primitives();
        json_["buffers"] = {{{"byteLength", bin_.size()}}};
        std::string text = json_.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        bin_.resize((bin_.size() + 3) / 4 * 4);
        const uint64_t total = 12 + 8 + text.size() + 8 + bin_.size();
        if (total > 0xffffffffu)
            return fail(Fault::machine, path.string() + ": the mesh is too large for GLB; write PLY");
        auto file = OutputFile::create(path);
        if (!file) return tl::unexpected(file.error());
        const uint32_t head[] = {0x46546c67, 2, static_cast<uint32_t>(total), static_cast<uint32_t>(text.size()),
                                 0x4e4f534a};
        const uint32_t bin_head[] = {static_cast<uint32_t>(bin_.size()), 0x004e4942};
        if (auto done = file->write(std::as_bytes(std::span(head))); !done) return done;
        if (auto done = file->write(text); !done) return done;
        if (auto done = file->write(std::as_bytes(std::span(bin_head))); !done) return done;
        if (auto done = file->write(bin_); !done) return done;
        return file->commit();
    }

private:
    template <class T>
    size_t add_view(const T* values, size_t count, int target) {
        bin_.resize((bin_.size() + 3) / 4 * 4);
        nlohmann::json view = {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", count * sizeof(T)}};
        if (target != 0) view["target"] = target;
        append(bin_, values, count);
        json_["bufferViews"].push_back(view);
        return json_["bufferViews"].size() - 1;
    }
    template <class T>
    size_t add_accessor(const std::vector<T>& values, int component, const char* type, int target,
                        bool normalized = false) {
        nlohmann::json accessor = {{"bufferView", add_view(values.data(), values.size(), target)},
                                   {"componentType", component},
                                   {"count", values.size()},
                                   {"type", type}};
        if (normalized) accessor["normalized"] = true;
        json_["accessors"].push_back(accessor);
        return json_["accessors"].size() - 1;
    }

    void add_attributes() {
        constexpr int vertices = 34962, real = 5126;
        std::vector<glm::vec3> positions;
        for (const uint32_t v : mesh_.wedge_vertex) positions.push_back(mesh_.positions[v]);
        attributes_["POSITION"] = add_accessor(positions, real, "VEC3", vertices);
        const Box box = bounding_box(positions);
        json_["accessors"].back()["min"] = {box.low.x, box.low.y, box.low.z};
        json_["accessors"].back()["max"] = {box.high.x, box.high.y, box.high.z};
        if (!mesh_.normals.empty()) attributes_["NORMAL"] = add_accessor(mesh_.normals, real, "VEC3", vertices);
        if (!mesh_.uvs.empty()) attributes_["TEXCOORD_0"] = add_accessor(mesh_.uvs, real, "VEC2", vertices);
        if (mesh_.colours.empty()) return;
        // glTF's colours are linear; 16 bits keep what 8 of sRGB hold.
        std::vector<glm::u16vec4> colours;
        for (const glm::u8vec4& c : mesh_.colours) {
            glm::u16vec4 linear;
            for (int k = 0; k < 3; ++k)
                linear[k] = static_cast<uint16_t>(std::lround(65535 * linear_from_srgb(c[k] / 255.0)));
            linear.w = static_cast<uint16_t>(c.w * 257);
            colours.push_back(linear);
        }
        attributes_["COLOR_0"] = add_accessor(colours, 5123, "VEC4", vertices, true);
    }

    Result<void> add_materials() {
        for (const Image& image : mesh_.images) {
            auto bytes = encoded(image, options_);
            if (!bytes) return tl::unexpected(bytes.error());
            json_["images"].push_back({{"bufferView", add_view(bytes->data(), bytes->size(), 0)},
                                       {"mimeType", options_.jpeg_quality > 0 ? "image/jpeg" : "image/png"}});
            json_["textures"].push_back({{"source", json_["images"].size() - 1}});
        }
        for (const Material& m : mesh_.material_table) {
            nlohmann::json pbr = {
                {"baseColorFactor", {m.base_colour.x, m.base_colour.y, m.base_colour.z, m.base_colour.w}},
                {"metallicFactor", 0}};
            if (m.base_colour_image >= 0) pbr["baseColorTexture"] = {{"index", m.base_colour_image}};
            json_["materials"].push_back(
                {{"name", m.name}, {"pbrMetallicRoughness", pbr}, {"doubleSided", m.double_sided}});
        }
        return {};
    }

    void add_primitives() {
        nlohmann::json primitives = nlohmann::json::array();
        const size_t materials = mesh_.materials.empty() ? 1 : mesh_.material_table.size();
        for (size_t m = 0; m < materials; ++m) {
            std::vector<uint32_t> indices;
            for (const Triangle& t : mesh_.triangles) {
                if (mesh_.materials.empty() || mesh_.materials[t[0]] == m)
                    indices.insert(indices.end(), t.begin(), t.end());
            }
            if (indices.empty()) continue;
            nlohmann::json primitive = {{"attributes", attributes_},
                                        {"indices", add_accessor(indices, 5125, "SCALAR", 34963)}};
            if (!mesh_.materials.empty()) primitive["material"] = m;
            primitives.push_back(primitive);
        }
        json_["meshes"] = {{{"primitives", primitives}}};
    }

    const TriMesh& mesh_;
    const WriteOptions options_;
    nlohmann::json json_, attributes_;
    std::vector<std::byte> bin_;
};

}  // namespace

Result<void> check_write(const fs::path& path) {
    const std::string extension = path.extension().string();
    if (extension == ".ply" || extension == ".obj" || extension == ".glb") return {};
    return fail(Fault::usage, path.string() + ": the name must end in .ply, .obj or .glb");
}

Result<void> write_mesh(const TriMesh& mesh, const fs::path& path, const WriteOptions& options) {
    if (auto good = check_write(path); !good) return good;
    const std::string extension = path.extension().string();
    if (extension == ".ply") return write_ply(mesh, path);
    if (extension == ".obj") return write_obj(mesh, path, options);
    return GlbWriter(mesh, options).write(path);
}

}  // namespace lodestone
