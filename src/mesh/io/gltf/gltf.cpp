// glTF 2.0 and GLB, parsed by tinygltf: nodes and their transforms, primitives, normals, tangents, texture coordinates,
// colours. Materials are read by materials.h. Quantised attributes are decoded, compressed ones unpacked
// (compressed/unpack_gltf.h).
#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <new>
#include <set>
#include <span>

#include "base/looks/srgb.h"
#include "base/text.h"
#include "mesh/io/compressed/unpack_gltf.h"
#include "mesh/io/formats.h"
#include "mesh/io/gltf/materials.h"
#include "mesh/io/gltf/values.h"

namespace lodestone {

namespace {

class GltfReader {
public:
    GltfReader(const SourceFile& file, const ReadOptions& options, ReadReport& report)
        : file_(file), options_(options), report_(report) {}

    TriMesh read() {
        parse();
        check_extensions();
        GltfMaterials materials = read_gltf_materials(file_, options_, model_, not_read_, mesh_, report_);
        warn_of_extensions(std::move(materials.told_extensions));
        texcoords_ = std::move(materials.texcoords);
        check_size();
        unpack();
        for_wanted([&](int mesh, const glm::dmat4& world) { add_mesh(mesh, world); });
        if (!model_.skins.empty()) warn("has a skin; the mesh is taken in its bind pose");
        if (!model_.animations.empty()) warn("has animations; they are left out");
        if (mesh_.triangles.empty()) {
            throw GltfFault{"", skipped_points_ ? "has points or lines and no triangles; point clouds are not read"
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
            const auto& primitives = mesh_numbered(mesh).primitives;
            const bool triangles =
                std::any_of(primitives.begin(), primitives.end(), [](const auto& p) { return makes_triangles(p); });
            if (triangles && glm::determinant(glm::dmat3(world)) != 0)
                placed.push_back({static_cast<uint32_t>(mesh), glm::mat4(world)});
        });
        return placed;
    }

    // Reads the files that the document names, and nothing of what they hold.
    void name_files() {
        // Without a "uri", however its letters are written, it names none.
        const std::string_view json = json_text(is_binary());
        if (json.find("uri") != json.npos || json.find("\\u") != json.npos) parse();
    }

private:
    void warn(const std::string& line) { file_.warn(report_, line); }

    // Files are looked for here, not by tinygltf, which would look elsewhere, too.
    tinygltf::FsCallbacks files() {
        tinygltf::FsCallbacks callbacks{};
        callbacks.FileExists = [](const std::string&, void*) { return true; };
        callbacks.ExpandFilePath = [](const std::string& name, void*) { return name; };
        callbacks.ReadWholeFile = [](std::vector<unsigned char>* into, std::string* error, const std::string& name,
                                     void* reader) {
            return static_cast<GltfReader*>(reader)->read_named(name, *into, *error);
        };
        callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
            return false;
        };
        callbacks.user_data = this;
        return callbacks;
    }

    bool read_named(const std::string& name, std::vector<unsigned char>& into, std::string& error) {
        auto content = file_.side_file(name, file_.limits.unpacked_bytes, report_);
        const auto failed = [&](const Error& why) {
            error = why.message;
            not_read_[name] = why.message;
            return false;
        };
        if (!content) return failed(content.error());
        const auto* begin = reinterpret_cast<const unsigned char*>(content->bytes.data());
        into.assign(begin, begin + content->bytes.size());
        if (auto whole = content->intact(); !whole) return failed(whole.error());
        return true;
    }

    bool is_binary() const { return file_.text().substr(0, 4) == "glTF"; }

    // The JSON of a GLB is its first chunk, behind twelve bytes of header and eight of the chunk's own.
    std::string_view json_text(bool binary) const {
        uint32_t bytes = 0;
        if (!binary) return file_.text();
        if (file_.size() < 20) throw GltfFault{"header", "the file is cut"};
        std::memcpy(&bytes, file_.content.bytes.data() + 12, 4);
        return file_.text().substr(20, bytes);
    }

    // tinygltf goes into what lies in each other by calling itself.
    static void check_depth(std::string_view json) {
        constexpr int deepest = 512;
        int depth = 0;
        bool in_string = false;
        for (size_t i = 0; i < json.size(); ++i) {
            const char c = json[i];
            if (in_string && c == '\\') {
                ++i;
            } else if (c == '"') {
                in_string = !in_string;
            } else if (!in_string && (c == '{' || c == '[')) {
                if (++depth > deepest) throw GltfFault{"", "has arrays and objects more than 512 deep in each other"};
            } else if (!in_string && (c == '}' || c == ']')) {
                --depth;
            }
        }
    }

    void parse() {
        tinygltf::TinyGLTF loader;
        std::string error, warning;
        loader.SetFsCallbacks(files());
        // Images are kept as they are in the file and decoded later, those that materials use. Those in a buffer stay
        // there: tinygltf does not look whether they are.
        loader.SetImageLoader(
            [](tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
               int size, void*) {
                if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
                image->as_is = true;
                return true;
            },
            nullptr);
        const auto* bytes = reinterpret_cast<const unsigned char*>(file_.content.bytes.data());
        if (file_.size() > 0xffffffffu) throw GltfFault{"", "is larger than 4 GiB; glTF cannot be"};
        const bool binary = is_binary();
        check_depth(json_text(binary));
        const std::string changed = changed_document(binary);
        if (!changed.empty()) bytes = reinterpret_cast<const unsigned char*>(changed.data());
        if (changed.size() > 0xffffffffu) throw GltfFault{"", "is larger than 4 GiB; glTF cannot be"};
        const auto size = static_cast<unsigned>(changed.empty() ? file_.size() : changed.size());
        bool good = false;
        try {
            good = binary ? loader.LoadBinaryFromMemory(&model_, &error, &warning, bytes, size, "")
                          : loader.LoadASCIIFromString(&model_, &error, &warning, reinterpret_cast<const char*>(bytes),
                                                       size, "");
        } catch (const std::bad_alloc&) {
            throw;  // no fault of the file
        } catch (const std::exception& e) {
            throw GltfFault{"", std::string("is no glTF that can be read: ") + e.what()};
        }
        if (!good) throw GltfFault{"", "is no glTF that can be read: " + one_line(error)};
    }

    // The file as tinygltf reads it, where what is compressed asks for that (unpack_gltf.h); else empty.
    std::string changed_document(bool binary) const {
        const std::string_view before = json_text(binary);
        std::string json = with_stand_ins(before);
        if (json.empty() || !binary) return json;
        json.resize((json.size() + 3) / 4 * 4, ' ');
        const std::string_view rest = file_.text().substr(20 + before.size());
        const uint64_t whole = 20 + json.size() + rest.size();
        if (whole > 0xffffffffu) throw GltfFault{"", "is larger than 4 GiB; glTF cannot be"};
        std::string made(file_.text().substr(0, 20));
        const auto put = [&](size_t at, uint64_t number) {
            const auto value = static_cast<uint32_t>(number);
            std::memcpy(made.data() + at, &value, 4);
        };
        put(8, whole);
        put(12, json.size());
        made += json;
        made += rest;
        return made;
    }

    // What is compressed of what is read.
    void unpack() {
        std::set<int> meshes;
        for_wanted([&](int number, const glm::dmat4&) {
            mesh_numbered(number);
            meshes.insert(number);
        });
        unpack_gltf(model_, meshes, file_.limits, [&](const std::string& line) { warn(line); });
    }

    static bool begins_with_one_of(const std::string& name, std::initializer_list<std::string_view> prefixes) {
        return std::any_of(prefixes.begin(), prefixes.end(),
                           [&](std::string_view prefix) { return name.rfind(prefix, 0) == 0; });
    }

    static bool is_read(const std::string& extension) {
        static constexpr std::array known = {
            "KHR_mesh_quantization", "KHR_draco_mesh_compression", "EXT_meshopt_compression",        "EXT_texture_webp",
            "KHR_texture_transform", "KHR_materials_unlit",        "KHR_materials_emissive_strength"};
        return std::ranges::find(known, extension) != known.end();
    }

    // A file that requires what we do not know may not have the shape we would read. What is known to leave shapes as
    // they are is done without.
    void check_extensions() const {
        for (const std::string& name : model_.extensionsRequired) {
            const bool same_shape =
                begins_with_one_of(name, {"KHR_materials_", "EXT_materials_", "KHR_texture_", "EXT_texture_",
                                          "MSFT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp", "KHR_animation_",
                                          "EXT_mesh_features", "EXT_structural_metadata"});
            if (!is_read(name) && !same_shape)
                throw GltfFault{"", "requires the extension " + printable(name.substr(0, 80)) +
                                        ", which is not read; export without it"};
        }
    }

    // A line for each that is not read. told: those of which another warning says so.
    void warn_of_extensions(std::set<std::string> told) {
        const auto warn_of = [&](const std::string& name, const char* verb) {
            if (is_read(name) || !told.insert(name).second) return;
            const bool looks = begins_with_one_of(name, {"KHR_materials_", "EXT_materials_"});
            warn(verb + (" the extension " + printable(name.substr(0, 80))) + ", which is left out" +
                 (looks ? "; materials look otherwise than they should" : ""));
        };
        for (const std::string& name : model_.extensionsRequired) warn_of(name, "requires");
        for (const std::string& name : model_.extensionsUsed) warn_of(name, "uses");
    }

    static int mode_of(const tinygltf::Primitive& primitive) {
        return primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    }
    static bool makes_triangles(const tinygltf::Primitive& primitive) {
        const int mode = mode_of(primitive);
        return mode == TINYGLTF_MODE_TRIANGLES || mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
               mode == TINYGLTF_MODE_TRIANGLE_FAN;
    }

    // Calls place(mesh, where it is) for what is to be read: one mesh, or all that stands in the scene.
    template <class Visit>
    void for_wanted(Visit&& place) const {
        if (options_.gltf_mesh >= 0)
            place(options_.gltf_mesh, glm::dmat4(1));
        else
            for_placed(place);
    }

    // Before anything is made: the vertices and triangles of all that will be read, by what accessors promise.
    void check_size() const {
        uint64_t vertices = 0, triangles = 0;
        const auto count_of = [&](int accessor) -> uint64_t {
            const bool there = accessor >= 0 && static_cast<size_t>(accessor) < model_.accessors.size();
            return there ? model_.accessors[static_cast<size_t>(accessor)].count : 0;
        };
        const auto check = [](const char* what, uint64_t number, uint64_t limit) {
            if (number > limit) throw GltfFault{"", over_limit(what, number, limit)};
        };
        for_wanted([&](int number, const glm::dmat4&) {
            for (const tinygltf::Primitive& primitive : mesh_numbered(number).primitives) {
                const auto positions = primitive.attributes.find("POSITION");
                if (positions == primitive.attributes.end() || !makes_triangles(primitive)) continue;
                const uint64_t corners = count_of(primitive.indices >= 0 ? primitive.indices : positions->second);
                const bool list = mode_of(primitive) == TINYGLTF_MODE_TRIANGLES;
                const uint64_t made = list ? corners / 3 : corners - std::min<uint64_t>(corners, 2);
                // Counts are of 64 bits, and might be any: each by itself first, so that sums do not overflow.
                check("triangles", made, file_.limits.triangles);
                check("vertices", count_of(positions->second), file_.limits.vertices);
                triangles += made;
                vertices += count_of(positions->second);
                check("vertices", vertices, file_.limits.vertices);
                check("triangles", triangles, file_.limits.triangles);
            }
        });
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
        std::vector<bool> met(model_.nodes.size(), false);
        for (const int node : model_.scenes[scene].nodes) visit(node, glm::dmat4(1), 0, met, place);
    }

    // met: the nodes visited so far. In glTF they form trees, so no document means more visits than it has nodes.
    template <class Visit>
    void visit(int number, const glm::dmat4& parent, uint32_t depth, std::vector<bool>& met, Visit& place) const {
        if (number < 0 || static_cast<size_t>(number) >= model_.nodes.size())
            throw GltfFault{"nodes", "one refers to a node that is not there"};
        if (met[static_cast<size_t>(number)]) {
            throw GltfFault{"nodes", "node " + std::to_string(number) +
                                         " has two parents, or is in a circle; in glTF nodes form trees"};
        }
        met[static_cast<size_t>(number)] = true;
        if (depth > file_.limits.gltf_depth) {
            throw GltfFault{"nodes", "are nested " + std::to_string(depth) + " deep or deeper; the limit is " +
                                         std::to_string(file_.limits.gltf_depth)};
        }
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
        for (const int child : node.children) visit(child, world, depth + 1, met, place);
    }

    const tinygltf::Mesh& mesh_numbered(int number) const {
        if (number < 0 || static_cast<size_t>(number) >= model_.meshes.size())
            throw GltfFault{"nodes", "one refers to a mesh that is not there"};
        return model_.meshes[static_cast<size_t>(number)];
    }

    GltfValues values_of(int accessor, const std::string& name, int width) const {
        return GltfValues(model_, {accessor, name, 3 * file_.limits.triangles}, width);
    }

    void add_mesh(int number, const glm::dmat4& world) {
        const tinygltf::Mesh& mesh = mesh_numbered(number);
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
        if (attribute("POSITION") < 0) throw GltfFault{name, "has no positions"};
        const GltfValues positions = values_of(attribute("POSITION"), name + " POSITION", 3);
        const size_t count = positions.size(), first = mesh_.positions.size();
        for (size_t i = 0; i < count; ++i) {
            const glm::vec3 p(world * glm::dvec4(positions(i, 0), positions(i, 1), positions(i, 2), 1));
            if (!finite(p))
                throw GltfFault{
                    name, "vertex " + std::to_string(i) + " has a coordinate that is not finite; mend or remove it"};
            mesh_.positions.push_back(p);
        }
        if (!primitive.targets.empty()) warn("has shapes to morph into; they are left out");
        add_normals(attribute("NORMAL"), name, world, count);
        add_uvs(primitive, name, count);
        add_colours(attribute("COLOR_0"), name, count);
        const uint16_t material = material_of(primitive);
        mesh_.materials.resize(first + count, material);
        if (attribute("NORMAL") >= 0 && mesh_.material_table[material].normal_texture.there())
            add_tangents(attribute("TANGENT"), name, world, count);
        add_triangles(primitive, mode, name, static_cast<uint32_t>(first), static_cast<uint32_t>(count),
                      glm::determinant(glm::dmat3(world)) < 0);
    }

    // In the mesh's table.
    uint16_t material_of(const tinygltf::Primitive& primitive) const {
        const bool there = primitive.material >= 0 && static_cast<size_t>(primitive.material) < model_.materials.size();
        return static_cast<uint16_t>(there ? primitive.material + 1 : 0);
    }

    void add_normals(int accessor, const std::string& name, const glm::dmat4& world, size_t count) {
        if (accessor < 0) {
            without_normals_ = true;
            mesh_.normals.resize(mesh_.normals.size() + count, glm::vec3(0, 0, 1));
            return;
        }
        const GltfValues normals = values_of(accessor, name + " NORMAL", 3);
        if (normals.size() != count) throw GltfFault{name, "has another number of normals than of positions"};
        const glm::dmat3 linear(world);
        const glm::dmat3 to_world =
            std::abs(glm::determinant(linear)) > 0 ? glm::transpose(glm::inverse(linear)) : glm::dmat3(1);
        for (size_t i = 0; i < count; ++i) {
            const glm::dvec3 n = to_world * glm::dvec3(normals(i, 0), normals(i, 1), normals(i, 2));
            const double length = glm::length(n);
            mesh_.normals.push_back(length > 0 && std::isfinite(length) ? glm::vec3(n / length) : glm::vec3(0, 0, 1));
        }
    }

    // What comes before has none, likewise what comes behind.
    void add_tangents(int accessor, const std::string& name, const glm::dmat4& world, size_t count) {
        if (accessor < 0) return;
        const GltfValues tangents = values_of(accessor, name + " TANGENT", 4);
        if (tangents.size() != count) throw GltfFault{name, "has another number of tangents than of positions"};
        const glm::dmat3 linear(world);
        const double side = glm::determinant(linear) < 0 ? -1 : 1;
        mesh_.tangents.resize(mesh_.positions.size() - count, glm::vec4(0));
        for (size_t i = 0; i < count; ++i) {
            const glm::dvec3 t = linear * glm::dvec3(tangents(i, 0), tangents(i, 1), tangents(i, 2));
            const double length = glm::length(t), w = tangents(i, 3) * side;
            const bool there = length > 0 && std::isfinite(length) && (w > 0 || w < 0);
            mesh_.tangents.push_back(there ? glm::vec4(t / length, w > 0 ? 1 : -1) : glm::vec4(0));
        }
    }

    void add_uvs(const tinygltf::Primitive& primitive, const std::string& name, size_t count) {
        const bool known = primitive.material >= 0 && static_cast<size_t>(primitive.material) < texcoords_.size();
        const GltfTexcoords from = known ? texcoords_[static_cast<size_t>(primitive.material)] : GltfTexcoords{};
        const size_t before = mesh_.uvs.size(), after = before + count;
        mesh_.uvs.resize(after, glm::vec2(0));
        if (fill_set(primitive, from.set, from.place, name, std::span(mesh_.uvs).last(count))) {
            has_uvs_ = true;
        } else if (from.set != 0) {
            warn_of_missing(from.set);
        }
        if (from.second < 0) return;
        // What comes before has none, and gets (0, 0); likewise what comes behind.
        std::vector<glm::vec2> second(count, glm::vec2(0));
        if (fill_set(primitive, from.second, GltfTexcoords{}.place, name, second)) {
            mesh_.second_uvs.resize(before, glm::vec2(0));
            mesh_.second_uvs.insert(mesh_.second_uvs.end(), second.begin(), second.end());
        } else {
            warn_of_missing(from.second);
        }
    }
    void warn_of_missing(int set) {
        warn("some primitives have no TEXCOORD_" + std::to_string(set) + ", which their material's texture needs");
    }
    // Returns whether the primitive has that set.
    bool fill_set(const tinygltf::Primitive& primitive, int set, const glm::dmat3x2& place, const std::string& name,
                  std::span<glm::vec2> into) const {
        const std::string key = "TEXCOORD_" + std::to_string(set);
        const auto attribute = primitive.attributes.find(key);
        if (attribute == primitive.attributes.end()) return false;
        const GltfValues uvs = values_of(attribute->second, name + " " + key, 2);
        if (uvs.size() != into.size())
            throw GltfFault{name, "has another number of texture coordinates than of positions"};
        for (size_t i = 0; i < into.size(); ++i) {
            const glm::vec2 uv(place * glm::dvec3(uvs(i, 0), uvs(i, 1), 1));
            into[i] = std::isfinite(uv.x) && std::isfinite(uv.y) ? uv : glm::vec2(0);
        }
        return true;
    }

    void add_colours(int accessor, const std::string& name, size_t count) {
        if (accessor < 0) {
            mesh_.colours.resize(mesh_.colours.size() + count, glm::u8vec4(255));
            return;
        }
        has_colours_ = true;
        const bool alpha = static_cast<size_t>(accessor) < model_.accessors.size() &&
                           model_.accessors[static_cast<size_t>(accessor)].type == TINYGLTF_TYPE_VEC4;
        const GltfValues colours = values_of(accessor, name + " COLOR_0", alpha ? 4 : 3);
        if (colours.size() != count) throw GltfFault{name, "has another number of colours than of positions"};
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
            const GltfValues values = values_of(primitive.indices, name + " indices", 1);
            check_index_type(model_.accessors[static_cast<size_t>(primitive.indices)].componentType, name);
            for (size_t i = 0; i < values.size(); ++i) {
                const double value = values(i, 0);
                if (!(value >= 0 && value < vertices))
                    throw GltfFault{name, "index " + std::to_string(i) + " refers to vertex " +
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
        const bool none = std::ranges::all_of(mesh_.tangents, [](const glm::vec4& t) { return t.w == 0; });
        mesh_.tangents.resize(none || without_normals_ ? 0 : mesh_.positions.size(), glm::vec4(0));
        if (!mesh_.second_uvs.empty()) {
            mesh_.second_uvs.resize(mesh_.positions.size(), glm::vec2(0));
        } else if (!has_uvs_) {
            mesh_.uvs.clear();
        }
        if (!has_colours_) mesh_.colours.clear();
        if (model_.materials.empty()) {
            mesh_.materials.clear();
            mesh_.material_table.clear();
        }
        if (options_.gltf_mesh >= 0) drop_unused_images(mesh_);
        mesh_.set_identity_wedges();
    }

    const SourceFile& file_;
    const ReadOptions& options_;
    ReadReport& report_;
    tinygltf::Model model_;
    TriMesh mesh_;
    GltfNotRead not_read_;
    std::vector<GltfTexcoords> texcoords_;  // per material of the file
    bool without_normals_ = false, has_uvs_ = false, has_colours_ = false, skipped_points_ = false;
};

}  // namespace

Result<TriMesh> read_gltf(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    try {
        return GltfReader(file, options, report).read();
    } catch (const GltfFault& wrong) { return file.wrong(wrong.place, wrong.what, wrong.fault); }
}

Result<void> name_files_of_gltf(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    try {
        GltfReader(file, options, report).name_files();
        return {};
    } catch (const GltfFault& wrong) { return file.wrong(wrong.place, wrong.what, wrong.fault); }
}

Result<std::vector<PlacedMesh>> read_gltf_nodes(const std::filesystem::path& path, const ReadOptions& options) {
    auto content = read_file(path, options.limits.unpacked_bytes);
    if (!content) return tl::unexpected(content.error());
    const SourceFile file{path, std::move(*content), options.limits, options.allow_outside, false};
    ReadReport report;
    try {
        return GltfReader(file, options, report).nodes();
    } catch (const GltfFault& wrong) { return file.wrong(wrong.place, wrong.what, wrong.fault); }
}

}  // namespace lodestone
