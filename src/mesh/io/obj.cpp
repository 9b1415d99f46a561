// Wavefront OBJ and its MTL: vertices (with colours), texture coordinates, normals, polygons, materials; the rest is
// stepped over.
#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <map>
#include <set>
#include <span>
#include <unordered_map>

#include "mesh/io/formats.h"
#include "mesh/io/text_cursor.h"

namespace lodestone {

namespace {

constexpr uint32_t absent = ~0u;

// What a corner refers to. Corners that refer to the same are one wedge.
struct Corner {
    uint32_t position = absent, uv = absent, normal = absent, material = 0;
    bool operator==(const Corner&) const = default;
};
struct CornerHash {
    size_t operator()(const Corner& c) const {
        uint64_t h = c.position * 0x9e3779b97f4a7c15ull;
        h = (h ^ c.uv) * 0xbf58476d1ce4e5b9ull;
        h = (h ^ (h >> 31) ^ c.normal) * 0x94d049bb133111ebull;
        return static_cast<size_t>((h ^ (h >> 29)) + c.material);
    }
};

class ObjReader {
public:
    ObjReader(const SourceFile& file, const ReadOptions& options, ReadReport& report)
        : file_(file), options_(options), report_(report), cursor_(file.text(), '#', true) {}

    Result<TriMesh> read() {
        for (; !cursor_.at_end(); cursor_.next_line()) {
            const std::string_view key = cursor_.word();
            Result<void> done;
            if (key == "v")
                done = read_position();
            else if (key == "vt")
                done = read_uv();
            else if (key == "vn")
                done = read_normal();
            else if (key == "f")
                done = read_face();
            else if (key == "usemtl")
                use_material(std::string(cursor_.rest()));
            else if (key == "mtllib")
                read_library(std::string(cursor_.rest()));
            else if (key == "curv" || key == "surf")
                note_once("curves and surfaces are left out; export triangles");
            if (!done) return tl::unexpected(done.error());
        }
        if (mesh_.triangles.empty()) return file_.wrong("", "has no faces; there is nothing to read");
        add_attributes();
        return std::move(mesh_);
    }

    // Reads the libraries that the file names, and nothing else of it.
    void name_files() {
        const std::string_view text = file_.text();
        const auto more = [&] {
            return text.find("mtllib", static_cast<size_t>(cursor_.position() - text.data())) != text.npos;
        };
        for (; more(); cursor_.next_line()) {
            const std::string_view key = cursor_.word();
            if (key == "mtllib")
                read_library(std::string(cursor_.rest()));
            else if (key == "usemtl")
                cursor_.rest();  // a name may have what begins a comment elsewhere
        }
    }

private:
    Result<void> read_position() {
        glm::vec3 p;
        if (!cursor_.number(p.x) || !cursor_.number(p.y) || !cursor_.number(p.z))
            return file_.wrong_line(cursor_.line(), "a vertex needs three numbers");
        if (!finite(p)) return file_.wrong_line(cursor_.line(), "a coordinate is not finite; mend or remove it");
        float more[4] = {};
        int count = 0;
        while (count < 4 && cursor_.number(more[count])) ++count;
        // "x y z r g b"; a single number more is a weight.
        if (count == 3) {
            const auto byte = [](float c) {
                return static_cast<uint8_t>(c >= 0 ? std::min(c, 1.0f) * 255 + 0.5f : 0.0f);
            };
            if (colours_.size() == mesh_.positions.size())
                colours_.emplace_back(byte(more[0]), byte(more[1]), byte(more[2]), 255);
        }
        mesh_.positions.push_back(p);
        return within("vertices", mesh_.positions.size(), file_.limits.vertices);
    }

    Result<void> within(const char* what, uint64_t number, uint64_t limit) const {
        return number <= limit ? Result<void>{} : file_.within(what, number, limit);
    }

    Result<void> read_uv() {
        glm::vec2 uv(0);
        if (!cursor_.number(uv.x)) return file_.wrong_line(cursor_.line(), "a texture coordinate needs a number");
        cursor_.number(uv.y);
        // OBJ's texture origin is at the bottom, ours at the top.
        uvs_.push_back(std::isfinite(uv.x) && std::isfinite(uv.y) ? glm::vec2(uv.x, 1 - uv.y) : glm::vec2(0));
        return within("texture coordinates", uvs_.size(), file_.limits.vertices);
    }

    Result<void> read_normal() {
        glm::vec3 n;
        if (!cursor_.number(n.x) || !cursor_.number(n.y) || !cursor_.number(n.z))
            return file_.wrong_line(cursor_.line(), "a normal needs three numbers");
        const float length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
        normals_.push_back(length > 0 && std::isfinite(length) ? n / length : glm::vec3(0, 0, 1));
        return within("normals", normals_.size(), file_.limits.vertices);
    }

    // One of "17", "-3": counted from 1, or back from the newest.
    Result<uint32_t> index(std::string_view text, size_t count, const char* kind) {
        int64_t value = 0;
        if (!TextCursor::parse(text, value))
            return file_.wrong_line(cursor_.line(), "'" + std::string(text.substr(0, 40)) + "' is no index");
        const int64_t at = value < 0 ? static_cast<int64_t>(count) + value : value - 1;
        if (at < 0 || at >= static_cast<int64_t>(count)) {
            return file_.wrong_line(cursor_.line(), "refers to " + std::string(kind) + " " + std::to_string(value) +
                                                        "; the file has " + std::to_string(count) + " up to here");
        }
        return static_cast<uint32_t>(at);
    }

    // As index, but what is not there is left out: a mesh is worth reading without.
    Result<uint32_t> attribute_index(std::string_view text, size_t count, const char* kind) {
        int64_t value = 0;
        if (!TextCursor::parse(text, value))
            return file_.wrong_line(cursor_.line(), "'" + std::string(text.substr(0, 40)) + "' is no index");
        const int64_t at = value < 0 ? static_cast<int64_t>(count) + value : value - 1;
        if (at >= 0 && at < static_cast<int64_t>(count)) return static_cast<uint32_t>(at);
        note_once("some faces refer to " + std::string(kind) + " that are not there; they go without");
        return absent;
    }

    Result<void> read_face() {
        fan_.clear();
        for (std::string_view word = cursor_.word(); !word.empty(); word = cursor_.word()) {
            Corner corner;
            corner.material = material_;
            const size_t slash = word.find('/');
            auto position = index(word.substr(0, slash), mesh_.positions.size(), "vertex");
            if (!position) return tl::unexpected(position.error());
            corner.position = *position;
            if (slash != std::string_view::npos) {
                const size_t second = word.find('/', slash + 1);
                const std::string_view uv =
                    word.substr(slash + 1, second == std::string_view::npos ? second : second - slash - 1);
                if (!uv.empty()) {
                    auto at = attribute_index(uv, uvs_.size(), "texture coordinates");
                    if (!at) return tl::unexpected(at.error());
                    corner.uv = *at;
                }
                if (second != std::string_view::npos && second + 1 < word.size()) {
                    auto at = attribute_index(word.substr(second + 1), normals_.size(), "normals");
                    if (!at) return tl::unexpected(at.error());
                    corner.normal = *at;
                }
            }
            fan_.push_back(wedge_of(corner));
            if (auto done = within("wedges", corners_.size(), file_.limits.vertices); !done) return done;
        }
        if (fan_.size() < 3)
            return file_.wrong_line(cursor_.line(),
                                    "a face has " + std::to_string(fan_.size()) + " corners; it needs three or more");
        add_fan(mesh_.triangles, fan_, report_);
        return within("triangles", mesh_.triangles.size(), file_.limits.triangles);
    }

    uint32_t wedge_of(const Corner& corner) {
        const auto [found, fresh] = wedges_.try_emplace(corner, static_cast<uint32_t>(corners_.size()));
        if (fresh) corners_.push_back(corner);
        return found->second;
    }

    void use_material(const std::string& name) {
        const auto [found, fresh] =
            material_numbers_.try_emplace(name, static_cast<uint32_t>(mesh_.material_table.size()));
        if (fresh) {
            if (mesh_.material_table.size() >= file_.limits.materials) {
                material_numbers_.erase(found);
                note_once("has more materials than the limit of " + std::to_string(file_.limits.materials) +
                          "; the rest is drawn with the last");
                return;
            }
            Material material;
            material.name = name;
            mesh_.material_table.push_back(material);
        }
        material_ = found->second;
        used_material_ = true;
    }

    void read_library(const std::string& name) {
        if (!libraries_.insert(name).second) return;  // it says the same as before
        auto content = file_.side_file(name, file_.limits.library_bytes, report_);
        const auto without = [&](const Error& why) {
            note_once("material library '" + name + "' cannot be read (" + why.message + "); its materials are white");
        };
        if (!content) return without(content.error());
        read_materials(*content);
        if (auto whole = content->intact(); !whole) without(whole.error());
    }

    void read_materials(const FileBytes& library) {
        const std::string_view text(reinterpret_cast<const char*>(library.bytes.data()), library.bytes.size());
        Material* material = nullptr;
        const uint32_t before = material_;
        const bool used_before = used_material_;
        for (TextCursor line(text, '#'); !line.at_end(); line.next_line()) {
            const std::string_view key = line.word();
            if (key == "newmtl") {
                use_material(std::string(line.rest()));
                material = &mesh_.material_table[material_];
            } else if (material == nullptr) {
                continue;
            } else {
                read_member(key, line, *material);
            }
        }
        material_ = before;
        used_material_ = used_before;
    }

    // A line of a material.
    void read_member(std::string_view key, TextCursor& line, Material& material) {
        const auto read = [&](std::span<float> into) {
            std::array<float, 3> numbers{};
            for (size_t k = 0; k < into.size(); ++k) {
                if (!line.number(numbers[k]) || !std::isfinite(numbers[k])) return;
            }
            std::copy_n(numbers.begin(), into.size(), into.begin());
        };
        if (key == "Kd") {
            read(std::span(&material.base_colour.x, 3));
        } else if (key == "d") {
            float& alpha = material.base_colour.w;
            read(std::span(&alpha, 1));
            if (alpha > 0 && alpha < 1 && material.alpha_mode == AlphaMode::opaque)
                material.alpha_mode = AlphaMode::blend;
        } else if (key == "Pm" || key == "Pr") {
            float& into = key == "Pm" ? material.metallic : material.roughness;
            read(std::span(&into, 1));
            into = std::clamp(into, 0.0f, 1.0f);
            material.shading = Shading::metallic_roughness;
        } else if (key == "Ke") {
            read(std::span(&material.emission.x, 3));
            material.emission = glm::clamp(material.emission, 0.0f, 65504.0f);
        } else if (key.starts_with("map_") || key == "norm") {
            read_map(key, std::string(line.rest()), material);
        }
    }

    void read_map(std::string_view key, std::string name, Material& material) {
        if (!options_.load_images) return;
        if (key == "norm") read_scale(name, material.normal_scale);
        if (!name.empty() && name[0] == '-') name.erase(0, name.rfind(' ') + 1);  // options come before the name
        if (key == "map_d") {
            // Alpha of the colour's own image; others are not read.
            const auto found = textures_.find(name);
            if (found != textures_.end() && found->second >= 0 && found->second == material.base_colour_texture.image)
                material.alpha_mode = AlphaMode::mask;
            return;
        }
        Texture* texture = key == "map_Kd"   ? &material.base_colour_texture
                           : key == "map_Ke" ? &material.emission_texture
                           : key == "norm"   ? &material.normal_texture
                                             : nullptr;
        if (texture == nullptr) return;
        const auto [found, fresh] = textures_.try_emplace(name, -1);
        if (fresh) found->second = load_texture(file_, name, mesh_, report_);
        texture->image = found->second;
        // A map takes the colour's place.
        if (found->second >= 0 && texture == &material.base_colour_texture)
            material.base_colour = {1, 1, 1, material.base_colour.w};
        if (texture != &material.emission_texture) return;
        if (found->second < 0)
            leave_out(material, *texture);
        else if (material.emission == glm::vec3(0))
            material.emission = glm::vec3(1);
    }

    // "-bm 0.5 image": how strong a normal map is.
    static void read_scale(const std::string& options, float& scale) {
        const size_t at = options.find("-bm ");
        if (at == options.npos) return;
        TextCursor cursor(std::string_view(options).substr(at + 4), '#');
        float number = 1;
        if (cursor.number(number) && std::isfinite(number)) scale = std::clamp(number, -65504.0f, 65504.0f);
    }

    void add_attributes() {
        bool some_uv = false, all_normals = true, some_normal = false;
        for (const Corner& c : corners_) {
            some_uv = some_uv || c.uv != absent;
            some_normal = some_normal || c.normal != absent;
            all_normals = all_normals && c.normal != absent;
        }
        if (some_normal && !all_normals)
            report_.warnings.emplace_back("some faces have no normals; all are computed from the shape");
        const bool coloured = !colours_.empty() && colours_.size() == mesh_.positions.size();
        if (!colours_.empty() && !coloured)
            report_.warnings.emplace_back("some vertices have no colour; colours are left out");
        // Faces before the first usemtl refer to material 0, whichever that is by now; without any usemtl materials do
        // not matter.
        if (!used_material_) mesh_.material_table.clear();
        for (const Corner& c : corners_) {
            mesh_.wedge_vertex.push_back(c.position);
            if (some_uv) mesh_.uvs.push_back(c.uv != absent ? uvs_[c.uv] : glm::vec2(0));
            if (all_normals) mesh_.normals.push_back(normals_[c.normal]);
            if (coloured) mesh_.colours.push_back(colours_[c.position]);
            if (used_material_) mesh_.materials.push_back(static_cast<uint16_t>(c.material));
        }
        if (!used_material_) mesh_.images.clear();
    }

    void note_once(const std::string& line) { file_.warn(report_, line); }

    const SourceFile& file_;
    const ReadOptions& options_;
    ReadReport& report_;
    TextCursor cursor_;
    TriMesh mesh_;
    std::vector<glm::vec2> uvs_;
    std::vector<glm::vec3> normals_;
    std::vector<glm::u8vec4> colours_;  // per position
    std::vector<Corner> corners_;       // per wedge
    std::unordered_map<Corner, uint32_t, CornerHash> wedges_;
    std::vector<uint32_t> fan_;
    std::map<std::string, uint32_t> material_numbers_;
    std::map<std::string, int32_t> textures_;
    std::set<std::string> libraries_;
    uint32_t material_ = 0;
    bool used_material_ = false;
};

}  // namespace

Result<TriMesh> read_obj(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    return ObjReader(file, options, report).read();
}

Result<void> name_files_of_obj(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    ObjReader(file, options, report).name_files();
    return {};
}

}  // namespace lodestone
