// glTF 2.0 and GLB, parsed by tinygltf: nodes and their transforms, primitives, normals, texture coordinates, colours,
// materials. Quantised attributes are decoded; compressed ones are refused by the extension's name.
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include "base/srgb.h"
#include "mesh/io/formats.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

constexpr int deepest_node = 256;
constexpr uint64_t most_corners = 0xfffffff0u;

struct WrongFile {
    std::string place, what;
};

// The numbers of an accessor, checked against its buffer: `width` of them per element.
class Values {
public:
    Values(const tinygltf::Model& model, int accessor_number, const std::string& name, int width)
        : width_(width), name_(name) {
        if (accessor_number < 0 || static_cast<size_t>(accessor_number) >= model.accessors.size())
            throw WrongFile{name, "refers to an accessor that is not there"};
        const tinygltf::Accessor& accessor = model.accessors[static_cast<size_t>(accessor_number)];
        count_ = accessor.count;
        const int components = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type));
        if (components < width)
            throw WrongFile{name, "has " + std::to_string(components) + " numbers per element; " +
                                      std::to_string(width) + " are needed"};
        if (count_ > most_corners) throw WrongFile{name, "has too many elements"};
        scale_ = accessor.normalized ? scale_of(accessor.componentType) : 1;
        const size_t size = component_size(accessor.componentType);
        if (accessor.bufferView >= 0) {
            const int stride = accessor.ByteStride(view_of(model, accessor.bufferView));
            load(model,
                 {accessor.bufferView, accessor.byteOffset, accessor.componentType, stride,
                  size * static_cast<size_t>(components), count_},
                 [&](size_t i, size_t k, double value) { at(i, k) = value * scale_; });
        } else {
            // Without a view an accessor is zeros (and a sparse part); only believable counts are.
            if (!accessor.sparse.isSparse) throw WrongFile{name, "has no data; its compression is not read"};
            values_.assign(count_ * static_cast<size_t>(width_), 0);
        }
        if (accessor.sparse.isSparse) add_sparse(model, accessor, size * static_cast<size_t>(components));
        if (accessor.normalized) {
            for (double& v : values_) v = std::max(v, -1.0);
        }
    }
    size_t size() const { return count_; }
    double operator()(size_t i, size_t k) const { return values_[i * static_cast<size_t>(width_) + k]; }

private:
    static size_t component_size(int type) {
        const int32_t size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(type));
        if (size <= 0) throw WrongFile{"accessor", "has an unknown component type"};
        return static_cast<size_t>(size);
    }
    static double scale_of(int type) {
        switch (type) {
            case TINYGLTF_COMPONENT_TYPE_BYTE:
                return 1.0 / 127;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return 1.0 / 255;
            case TINYGLTF_COMPONENT_TYPE_SHORT:
                return 1.0 / 32767;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return 1.0 / 65535;
            default:
                return 1;
        }
    }
    static double number(const unsigned char* from, int type) {
        const auto as = [&]<class T>(T value) {
            std::memcpy(&value, from, sizeof value);
            return static_cast<double>(value);
        };
        switch (type) {
            case TINYGLTF_COMPONENT_TYPE_BYTE:
                return as(int8_t{});
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return as(uint8_t{});
            case TINYGLTF_COMPONENT_TYPE_SHORT:
                return as(int16_t{});
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return as(uint16_t{});
            case TINYGLTF_COMPONENT_TYPE_INT:
                return as(int32_t{});
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
                return as(uint32_t{});
            case TINYGLTF_COMPONENT_TYPE_DOUBLE:
                return as(double{});
            default:
                return as(float{});
        }
    }
    double& at(size_t i, size_t k) { return values_[i * static_cast<size_t>(width_) + k]; }
    const tinygltf::BufferView& view_of(const tinygltf::Model& model, int number) const {
        if (number < 0 || static_cast<size_t>(number) >= model.bufferViews.size())
            throw WrongFile{name_, "refers to a buffer view that is not there"};
        return model.bufferViews[static_cast<size_t>(number)];
    }

    // Elements in a buffer view.
    struct Elements {
        int view;
        size_t offset;  // bytes from the view's begin
        int type;       // of a component, TINYGLTF_COMPONENT_TYPE_...
        int stride;     // bytes; 0 or less where elements follow each other without gaps
        size_t bytes;   // of an element
        size_t count;
    };
    // put(i, k, number) for the numbers of every element.
    template <class Put>
    void load(const tinygltf::Model& model, const Elements& from, const Put& put) {
        const tinygltf::BufferView& view = view_of(model, from.view);
        if (view.buffer < 0 || static_cast<size_t>(view.buffer) >= model.buffers.size())
            throw WrongFile{name_, "refers to a buffer that is not there"};
        const auto& bytes = model.buffers[static_cast<size_t>(view.buffer)].data;
        const size_t step = from.stride > 0 ? static_cast<size_t>(from.stride) : from.bytes;
        const bool view_fits = view.byteOffset <= bytes.size() && view.byteLength <= bytes.size() - view.byteOffset;
        const bool fits =
            view_fits &&
            (from.count == 0 || (from.offset <= view.byteLength && from.bytes <= view.byteLength - from.offset &&
                                 (from.count - 1) <= (view.byteLength - from.offset - from.bytes) / step));
        if (!fits) throw WrongFile{name_, "reaches past the end of its buffer; the file is cut or its header is wrong"};
        if (values_.empty()) values_.assign(count_ * static_cast<size_t>(width_), 0);
        const unsigned char* base = bytes.data() + view.byteOffset + from.offset;
        const size_t size = component_size(from.type);
        for (size_t i = 0; i < from.count; ++i) {
            for (size_t k = 0; k < static_cast<size_t>(width_) && k * size < from.bytes; ++k)
                put(i, k, number(base + i * step + k * size, from.type));
        }
    }

    void add_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element_bytes) {
        const auto count = static_cast<size_t>(std::max(accessor.sparse.count, 0));
        const auto& indices = accessor.sparse.indices;
        const auto& values = accessor.sparse.values;
        std::vector<size_t> places(count);
        const int width = std::exchange(width_, 1);
        load(model,
             {indices.bufferView, static_cast<size_t>(indices.byteOffset), indices.componentType, 0,
              component_size(indices.componentType), count},
             [&](size_t i, size_t, double value) {
                 places[i] = static_cast<size_t>(value);
                 if (places[i] >= count_) throw WrongFile{name_, "has a sparse index out of range"};
             });
        width_ = width;
        load(model,
             {values.bufferView, static_cast<size_t>(values.byteOffset), accessor.componentType, 0, element_bytes,
              count},
             [&](size_t i, size_t k, double value) { at(places[i], k) = value * scale_; });
    }

    int width_;
    std::string name_;
    size_t count_ = 0;
    double scale_ = 1;
    std::vector<double> values_;
};

class GltfReader {
public:
    GltfReader(const SourceFile& file, const ReadOptions& options, ReadReport& report)
        : file_(file), options_(options), report_(report) {}

    TriMesh read() {
        parse();
        check_extensions();
        read_materials();
        if (options_.gltf_mesh >= 0) {
            add_mesh(options_.gltf_mesh, glm::dmat4(1));
        } else {
            for_placed([&](int mesh, const glm::dmat4& world) { add_mesh(mesh, world); });
        }
        if (!model_.skins.empty()) warn("has a skin; the mesh is taken in its bind pose");
        if (!model_.animations.empty()) warn("has animations; they are left out");
        if (mesh_.triangles.empty()) {
            throw WrongFile{"", skipped_points_ ? "has points or lines and no triangles; point clouds are not read"
                                                : "has no triangles; there is nothing to read"};
        }
        finish();
        return std::move(mesh_);
    }

    std::vector<PlacedMesh> nodes() {
        parse();
        check_extensions();
        std::vector<PlacedMesh> placed;
        for_placed([&](int mesh, const glm::dmat4& world) {
            if (static_cast<size_t>(mesh) >= model_.meshes.size())
                throw WrongFile{"nodes", "one refers to a mesh that is not there"};
            const auto& primitives = model_.meshes[static_cast<size_t>(mesh)].primitives;
            const bool triangles =
                std::any_of(primitives.begin(), primitives.end(), [](const auto& p) { return makes_triangles(p); });
            if (triangles && glm::determinant(glm::dmat3(world)) != 0)
                placed.push_back({static_cast<uint32_t>(mesh), glm::mat4(world)});
        });
        return placed;
    }

private:
    void warn(const std::string& line) {
        if (std::find(report_.warnings.begin(), report_.warnings.end(), line) == report_.warnings.end())
            report_.warnings.push_back(line);
    }

    void parse() {
        tinygltf::TinyGLTF loader;
        std::string error, warning;
        // Images are kept as they are in the file and decoded later, those that materials use.
        loader.SetImageLoader(
            [](tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
               int size, void*) {
                image->image.assign(bytes, bytes + size);
                image->as_is = true;
                return true;
            },
            nullptr);
        const auto* bytes = reinterpret_cast<const unsigned char*>(file_.content.bytes.data());
        if (file_.size() > 0xffffffffu) throw WrongFile{"", "is larger than 4 GiB; glTF cannot be"};
        const auto size = static_cast<unsigned>(file_.size());
        const std::string folder = file_.path.parent_path().string();
        const bool binary = file_.text().substr(0, 4) == "glTF";
        bool good = false;
        try {
            good = binary ? loader.LoadBinaryFromMemory(&model_, &error, &warning, bytes, size, folder)
                          : loader.LoadASCIIFromString(&model_, &error, &warning, reinterpret_cast<const char*>(bytes),
                                                       size, folder);
        } catch (const std::exception& e) {
            throw WrongFile{"", std::string("is no glTF that can be read: ") + e.what()};
        }
        if (!good) throw WrongFile{"", "is no glTF that can be read: " + one_line(error)};
    }

    static std::string one_line(std::string text) {
        while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
        std::replace(text.begin(), text.end(), '\n', ' ');
        return text.substr(0, 200);
    }

    void check_extensions() {
        static constexpr std::array<std::string_view, 3> geometry_we_read = {
            "KHR_mesh_quantization", "KHR_texture_transform", "KHR_lights_punctual"};
        for (const std::string& extension : model_.extensionsRequired) {
            const bool known =
                std::find(geometry_we_read.begin(), geometry_we_read.end(), extension) != geometry_we_read.end() ||
                extension.rfind("KHR_materials_", 0) == 0;
            if (!known)
                throw WrongFile{"", "requires the extension " + extension + ", which is not read; export without it"};
        }
    }

    void read_materials() {
        Material plain;
        plain.name = "default";
        mesh_.material_table.push_back(plain);  // of primitives without one
        if (model_.materials.size() > 65534) throw WrongFile{"materials", "there are more than 65534"};
        for (const tinygltf::Material& from : model_.materials) {
            Material material;
            material.name = from.name;
            material.double_sided = from.doubleSided;
            const auto& pbr = from.pbrMetallicRoughness;
            for (size_t k = 0; k < 4 && k < pbr.baseColorFactor.size(); ++k)
                material.base_colour[static_cast<int>(k)] = static_cast<float>(pbr.baseColorFactor[k]);
            if (pbr.baseColorTexture.index >= 0 && options_.load_images)
                material.base_colour_image = texture(pbr.baseColorTexture.index);
            mesh_.material_table.push_back(material);
        }
    }

    int32_t texture(int number) {
        if (static_cast<size_t>(number) >= model_.textures.size()) return -1;
        const int source = model_.textures[static_cast<size_t>(number)].source;
        if (source < 0 || static_cast<size_t>(source) >= model_.images.size()) return -1;
        const auto [found, fresh] = images_.try_emplace(source, -1);
        if (!fresh) return found->second;
        const tinygltf::Image& image = model_.images[static_cast<size_t>(source)];
        const std::string name = !image.uri.empty()    ? image.uri
                                 : !image.name.empty() ? image.name
                                                       : "image " + std::to_string(source);
        auto decoded = decode_image(std::as_bytes(std::span(image.image)), name);
        if (!decoded) {
            warn("texture '" + name.substr(0, 80) +
                 "' is missing or cannot be decoded; its material keeps its plain colour");
            return -1;
        }
        mesh_.images.push_back(std::move(*decoded));
        return found->second = static_cast<int32_t>(mesh_.images.size()) - 1;
    }

    static int mode_of(const tinygltf::Primitive& primitive) {
        return primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    }
    static bool makes_triangles(const tinygltf::Primitive& primitive) {
        const int mode = mode_of(primitive);
        return mode == TINYGLTF_MODE_TRIANGLES || mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
               mode == TINYGLTF_MODE_TRIANGLE_FAN;
    }

    // Calls place(mesh, where it is) for all that stands in the scene; of files without one, for every mesh.
    template <class Visit>
    void for_placed(Visit&& place) const {
        if (model_.scenes.empty()) {
            for (size_t m = 0; m < model_.meshes.size(); ++m) place(static_cast<int>(m), glm::dmat4(1));
            return;
        }
        const size_t scene = model_.defaultScene >= 0 && static_cast<size_t>(model_.defaultScene) < model_.scenes.size()
                                 ? static_cast<size_t>(model_.defaultScene)
                                 : 0;
        for (const int node : model_.scenes[scene].nodes) visit(node, glm::dmat4(1), 0, place);
    }

    template <class Visit>
    void visit(int number, const glm::dmat4& parent, int depth, Visit& place) const {
        if (number < 0 || static_cast<size_t>(number) >= model_.nodes.size())
            throw WrongFile{"nodes", "one refers to a node that is not there"};
        if (depth > deepest_node) throw WrongFile{"nodes", "are nested more than 256 deep or in a circle"};
        const tinygltf::Node& node = model_.nodes[static_cast<size_t>(number)];
        glm::dmat4 local(1);
        if (node.matrix.size() == 16) {
            local = glm::make_mat4(node.matrix.data());
        } else {
            glm::dvec3 t(0), s(1);
            glm::dquat r(1, 0, 0, 0);
            if (node.translation.size() == 3) t = glm::make_vec3(node.translation.data());
            if (node.rotation.size() == 4)
                r = glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
            if (node.scale.size() == 3) s = glm::make_vec3(node.scale.data());
            local = glm::mat4_cast(r);
            for (int k = 0; k < 3; ++k) local[k] *= s[k];
            local[3] = glm::dvec4(t, 1);
        }
        const glm::dmat4 world = parent * local;
        // A skinned mesh stands where its joints say, not where its node is.
        if (node.mesh >= 0) place(node.mesh, node.skin >= 0 ? glm::dmat4(1) : world);
        for (const int child : node.children) visit(child, world, depth + 1, place);
    }

    void add_mesh(int number, const glm::dmat4& world) {
        if (static_cast<size_t>(number) >= model_.meshes.size())
            throw WrongFile{"nodes", "one refers to a mesh that is not there"};
        const tinygltf::Mesh& mesh = model_.meshes[static_cast<size_t>(number)];
        for (size_t p = 0; p < mesh.primitives.size(); ++p) {
            add_primitive(mesh.primitives[p], "mesh " + std::to_string(number) + " primitive " + std::to_string(p),
                          world);
        }
    }

    void add_primitive(const tinygltf::Primitive& primitive, const std::string& name, const glm::dmat4& world) {
        const int mode = mode_of(primitive);
        if (!makes_triangles(primitive)) {
            skipped_points_ = true;
            warn("has points or lines; they are left out");
            return;
        }
        const auto attribute = [&](const char* key) {
            const auto found = primitive.attributes.find(key);
            return found == primitive.attributes.end() ? -1 : found->second;
        };
        if (attribute("POSITION") < 0) throw WrongFile{name, "has no positions"};
        const Values positions(model_, attribute("POSITION"), name + " POSITION", 3);
        const size_t count = positions.size(), first = mesh_.positions.size();
        if (first + count > most_corners) throw WrongFile{name, "brings more vertices than 32-bit indices can name"};
        for (size_t i = 0; i < count; ++i) {
            const glm::vec3 p(world * glm::dvec4(positions(i, 0), positions(i, 1), positions(i, 2), 1));
            if (!finite(p))
                throw WrongFile{
                    name, "vertex " + std::to_string(i) + " has a coordinate that is not finite; mend or remove it"};
            mesh_.positions.push_back(p);
        }
        add_normals(attribute("NORMAL"), name, world, count);
        add_uvs(attribute("TEXCOORD_0"), name, count);
        add_colours(attribute("COLOR_0"), name, count);
        const bool has_material =
            primitive.material >= 0 && static_cast<size_t>(primitive.material) < model_.materials.size();
        mesh_.materials.resize(first + count, static_cast<uint16_t>(has_material ? primitive.material + 1 : 0));
        add_triangles(primitive, mode, name, static_cast<uint32_t>(first), static_cast<uint32_t>(count),
                      glm::determinant(glm::dmat3(world)) < 0);
    }

    void add_normals(int accessor, const std::string& name, const glm::dmat4& world, size_t count) {
        if (accessor < 0) {
            without_normals_ = true;
            mesh_.normals.resize(mesh_.normals.size() + count, glm::vec3(0, 0, 1));
            return;
        }
        const Values normals(model_, accessor, name + " NORMAL", 3);
        if (normals.size() != count) throw WrongFile{name, "has another number of normals than of positions"};
        const glm::dmat3 linear(world);
        const glm::dmat3 to_world =
            std::abs(glm::determinant(linear)) > 0 ? glm::transpose(glm::inverse(linear)) : glm::dmat3(1);
        for (size_t i = 0; i < count; ++i) {
            const glm::dvec3 n = to_world * glm::dvec3(normals(i, 0), normals(i, 1), normals(i, 2));
            const double length = glm::length(n);
            mesh_.normals.push_back(length > 0 && std::isfinite(length) ? glm::vec3(n / length) : glm::vec3(0, 0, 1));
        }
    }

    void add_uvs(int accessor, const std::string& name, size_t count) {
        if (accessor < 0) {
            mesh_.uvs.resize(mesh_.uvs.size() + count, glm::vec2(0));
            return;
        }
        has_uvs_ = true;
        const Values uvs(model_, accessor, name + " TEXCOORD_0", 2);
        if (uvs.size() != count) throw WrongFile{name, "has another number of texture coordinates than of positions"};
        for (size_t i = 0; i < count; ++i) {
            const glm::vec2 uv(static_cast<float>(uvs(i, 0)), static_cast<float>(uvs(i, 1)));
            mesh_.uvs.push_back(std::isfinite(uv.x) && std::isfinite(uv.y) ? uv : glm::vec2(0));
        }
    }

    void add_colours(int accessor, const std::string& name, size_t count) {
        if (accessor < 0) {
            mesh_.colours.resize(mesh_.colours.size() + count, glm::u8vec4(255));
            return;
        }
        has_colours_ = true;
        const bool alpha = static_cast<size_t>(accessor) < model_.accessors.size() &&
                           model_.accessors[static_cast<size_t>(accessor)].type == TINYGLTF_TYPE_VEC4;
        const Values colours(model_, accessor, name + " COLOR_0", alpha ? 4 : 3);
        if (colours.size() != count) throw WrongFile{name, "has another number of colours than of positions"};
        // glTF's are linear, ours are sRGB.
        const auto byte = [](double c) { return static_cast<uint8_t>(c >= 0 ? std::min(c, 1.0) * 255 + 0.5 : 0.0); };
        for (size_t i = 0; i < count; ++i) {
            const auto channel = [&](size_t k) { return byte(srgb_from_linear(std::clamp(colours(i, k), 0.0, 1.0))); };
            mesh_.colours.emplace_back(channel(0), channel(1), channel(2), alpha ? byte(colours(i, 3)) : uint8_t{255});
        }
    }

    void add_triangles(const tinygltf::Primitive& primitive, int mode, const std::string& name, uint32_t first,
                       uint32_t vertices, bool mirrored) {
        std::vector<uint32_t> indices;
        if (primitive.indices >= 0) {
            const Values values(model_, primitive.indices, name + " indices", 1);
            for (size_t i = 0; i < values.size(); ++i) {
                const double value = values(i, 0);
                if (!(value >= 0 && value < vertices))
                    throw WrongFile{name, "index " + std::to_string(i) + " refers to vertex " +
                                              std::to_string(static_cast<int64_t>(value)) + "; there are " +
                                              std::to_string(vertices)};
                indices.push_back(static_cast<uint32_t>(value));
            }
        } else {
            for (uint32_t i = 0; i < vertices; ++i) indices.push_back(i);
        }
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            mesh_.triangles.push_back(mirrored ? Triangle{first + a, first + c, first + b}
                                               : Triangle{first + a, first + b, first + c});
        };
        if (mode == TINYGLTF_MODE_TRIANGLES) {
            for (size_t i = 0; i + 2 < indices.size(); i += 3) add(indices[i], indices[i + 1], indices[i + 2]);
        } else {
            for (size_t i = 0; i + 2 < indices.size(); ++i) {
                if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
                    add(indices[0], indices[i + 1], indices[i + 2]);
                else if (i % 2 == 0)
                    add(indices[i], indices[i + 1], indices[i + 2]);
                else
                    add(indices[i + 1], indices[i], indices[i + 2]);
            }
        }
    }

    void finish() {
        if (without_normals_) mesh_.normals.clear();
        if (!has_uvs_) mesh_.uvs.clear();
        if (!has_colours_) mesh_.colours.clear();
        if (model_.materials.empty()) {
            mesh_.materials.clear();
            mesh_.material_table.clear();
        }
        if (options_.gltf_mesh >= 0) drop_unused_images();
        mesh_.set_identity_wedges();
    }

    // Of materials that the mesh has nothing of.
    void drop_unused_images() {
        std::vector<bool> used(mesh_.material_table.size(), false);
        for (const uint16_t material : mesh_.materials) used[material] = true;
        std::vector<int32_t> number(mesh_.images.size(), -1);
        std::vector<Image> images;
        for (size_t m = 0; m < used.size(); ++m) {
            int32_t& image = mesh_.material_table[m].base_colour_image;
            if (image < 0) continue;
            int32_t& becomes = number[static_cast<size_t>(image)];
            if (used[m] && becomes < 0) {
                becomes = static_cast<int32_t>(images.size());
                images.push_back(std::move(mesh_.images[static_cast<size_t>(image)]));
            }
            image = used[m] ? becomes : -1;
        }
        mesh_.images = std::move(images);
    }

    const SourceFile& file_;
    const ReadOptions& options_;
    ReadReport& report_;
    tinygltf::Model model_;
    TriMesh mesh_;
    std::map<int, int32_t> images_;
    bool without_normals_ = false, has_uvs_ = false, has_colours_ = false, skipped_points_ = false;
};

}  // namespace

Result<TriMesh> read_gltf(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    try {
        return GltfReader(file, options, report).read();
    } catch (const WrongFile& wrong) { return file.wrong(wrong.place, wrong.what); }
}

Result<std::vector<PlacedMesh>> read_gltf_nodes(const std::filesystem::path& path) {
    auto content = read_file(path);
    if (!content) return tl::unexpected(content.error());
    const SourceFile file{path, std::move(*content)};
    ReadReport report;
    try {
        return GltfReader(file, {}, report).nodes();
    } catch (const WrongFile& wrong) { return file.wrong(wrong.place, wrong.what); }
}

}  // namespace lodestone
