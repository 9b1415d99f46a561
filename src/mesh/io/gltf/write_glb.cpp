#include "mesh/io/gltf/write_glb.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <set>
#include <utility>

#include "base/files/file.h"
#include "base/json.h"
#include "base/looks/srgb.h"
#include "mesh/io/gltf/material_json.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little);

constexpr int vertex_target = 34962, index_target = 34963;
constexpr int signed_short = 5122, unsigned_short = 5123, unsigned_int = 5125, real = 5126;
constexpr const char *compression_name = "EXT_meshopt_compression", *webp_name = "EXT_texture_webp";
using Encoding = WriteOptions::Encoding;

const char* media_type_of(WriteOptions::Textures format) {
    return format == WriteOptions::Textures::jpeg   ? "image/jpeg"
           : format == WriteOptions::Textures::webp ? "image/webp"
                                                    : "image/png";
}

class GlbWriter {
public:
    GlbWriter(const TriMesh& mesh, const WriteOptions& options) : mesh_(mesh), options_(options) {}

    Result<void> write(const fs::path& path) {
        json_["asset"] = {{"version", "2.0"}, {"generator", "lodestone"}};
        json_["scene"] = 0;
        json_["scenes"] = {{{"nodes", {0}}}};
        json_["nodes"] = {{{"mesh", 0}}};
        add_positions();
        add_other_attributes();
        if (!mesh_.material_table.empty()) {
            if (auto done = add_materials(); !done) return done;
        }
        add_primitives();
        add_buffers();
        return write_file(path);
    }

private:
    void add_buffers() {
        json_["buffers"] = {{{"byteLength", bin_.size()}}};
        if (options_.encoding != Encoding::plain) required_.insert("KHR_mesh_quantization");
        if (options_.encoding == Encoding::meshopt) {
            required_.insert(compression_name);
            json_["buffers"].push_back(
                {{"byteLength", unpacked_bytes_}, {"extensions", {{compression_name, {{"fallback", true}}}}}});
        }
        if (!required_.empty()) json_["extensionsRequired"] = required_;
        used_.merge(required_);
        if (!used_.empty()) json_["extensionsUsed"] = used_;
    }

    Result<void> write_file(const fs::path& path) {
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

    // Where the next bytes begin.
    size_t append(const void* bytes, size_t size) {
        bin_.resize((bin_.size() + 3) / 4 * 4);
        const size_t begin = bin_.size();
        const auto* from = static_cast<const std::byte*>(bytes);
        bin_.insert(bin_.end(), from, from + size);
        return begin;
    }

    // As it is, or compressed. stride: of an element in bytes.
    size_t add_view(const void* values, size_t count, size_t stride, int target) {
        Json view = {{"buffer", 0}, {"byteLength", count * stride}};
        if (target == vertex_target) view["byteStride"] = stride;
        if (target != 0) view["target"] = target;
        if (options_.encoding == Encoding::meshopt && target != 0 && count > 0) {
            add_compressed(view, values, count, stride);
        } else {
            view["byteOffset"] = append(values, count * stride);
        }
        json_["bufferViews"].push_back(view);
        return json_["bufferViews"].size() - 1;
    }

    void add_compressed(Json& view, const void* values, size_t count, size_t stride) {
        const bool indices = view["target"] == index_target;
        std::vector<unsigned char> packed;
        if (indices) {
            const auto* index = static_cast<const uint32_t*>(values);
            packed.resize(meshopt_encodeIndexBufferBound(count, mesh_.wedge_count()));
            packed.resize(meshopt_encodeIndexBuffer(packed.data(), packed.size(), index, count));
        } else {
            packed.resize(meshopt_encodeVertexBufferBound(count, stride));
            packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), values, count, stride));
        }
        unpacked_bytes_ = (unpacked_bytes_ + 3) / 4 * 4;
        view["buffer"] = 1;
        view["byteOffset"] = unpacked_bytes_;
        unpacked_bytes_ += count * stride;
        view["extensions"][compression_name] = {
            {"buffer", 0},          {"byteOffset", append(packed.data(), packed.size())}, {"byteLength", packed.size()},
            {"byteStride", stride}, {"mode", indices ? "TRIANGLES" : "ATTRIBUTES"},       {"count", count}};
    }

    // What an accessor's numbers are.
    struct Kind {
        int component;
        const char* type;
        bool normalised = false;
    };
    template <class T>
    size_t add_accessor(const std::vector<T>& values, const Kind& kind, int target) {
        Json accessor = {{"bufferView", add_view(values.data(), values.size(), sizeof(T), target)},
                         {"componentType", kind.component},
                         {"count", values.size()},
                         {"type", kind.type}};
        if (kind.normalised) accessor["normalized"] = true;
        json_["accessors"].push_back(accessor);
        return json_["accessors"].size() - 1;
    }

    // Quantised positions are whole numbers along the longest side; the node brings them to their place.
    void add_positions() {
        std::vector<glm::vec3> positions;
        for (const uint32_t v : mesh_.wedge_vertex) positions.push_back(mesh_.positions[v]);
        Box box = bounding_box(positions);
        if (options_.encoding == Encoding::plain) {
            attributes_["POSITION"] = add_accessor(positions, {real, "VEC3"}, vertex_target);
        } else {
            constexpr float steps = 65535;
            const glm::vec3 size = box.high - box.low;
            const float longest = std::max({size.x, size.y, size.z});
            const float step = longest > 0 ? longest / steps : 1;
            std::vector<glm::u16vec4> whole;  // of which the fourth is padding: views begin at multiples of four bytes
            whole.reserve(positions.size());
            glm::vec3 low(steps), high(0);
            for (const glm::vec3& p : positions) {
                const glm::vec3 at = glm::clamp(glm::round((p - box.low) / step), glm::vec3(0), glm::vec3(steps));
                whole.emplace_back(glm::u16vec3(at), 0);
                low = glm::min(low, at);
                high = glm::max(high, at);
            }
            attributes_["POSITION"] = add_accessor(whole, {unsigned_short, "VEC3"}, vertex_target);
            json_["nodes"][0]["translation"] = {box.low.x, box.low.y, box.low.z};
            json_["nodes"][0]["scale"] = {step, step, step};
            box = {low, high};
        }
        json_["accessors"].back()["min"] = {box.low.x, box.low.y, box.low.z};
        json_["accessors"].back()["max"] = {box.high.x, box.high.y, box.high.z};
    }

    void add_other_attributes() {
        const bool quantised = options_.encoding != Encoding::plain;
        if (!mesh_.normals.empty()) {
            attributes_["NORMAL"] = quantised
                                        ? add_accessor(small_normals(), {signed_short, "VEC3", true}, vertex_target)
                                        : add_accessor(mesh_.normals, {real, "VEC3"}, vertex_target);
        }
        if (!mesh_.tangents.empty()) {
            tangents_ = quantised ? add_accessor(small_tangents(), {signed_short, "VEC4", true}, vertex_target)
                                  : add_accessor(written_tangents(), {real, "VEC4"}, vertex_target);
        }
        for (const auto& [name, uvs] : {std::pair{"TEXCOORD_0", &mesh_.uvs}, {"TEXCOORD_1", &mesh_.second_uvs}}) {
            if (uvs->empty()) continue;
            attributes_[name] = quantised && !options_.exact_uvs && within_square(*uvs)
                                    ? add_accessor(small_uvs(*uvs), {unsigned_short, "VEC2", true}, vertex_target)
                                    : add_accessor(*uvs, {real, "VEC2"}, vertex_target);
        }
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
        attributes_["COLOR_0"] = add_accessor(colours, {unsigned_short, "VEC4", true}, vertex_target);
    }

    std::vector<glm::i16vec4> small_normals() const {
        std::vector<glm::i16vec4> small;
        for (const glm::vec3& n : mesh_.normals) small.emplace_back(glm::i16vec3(glm::round(n * 32767.0f)), 0);
        return small;
    }
    // glTF has one for every vertex of a primitive; any will do for those of primitives without.
    std::vector<glm::vec4> written_tangents() const {
        std::vector<glm::vec4> written = mesh_.tangents;
        for (glm::vec4& t : written) {
            if (t.w == 0) t = {1, 0, 0, 1};
        }
        return written;
    }
    std::vector<glm::i16vec4> small_tangents() const {
        std::vector<glm::i16vec4> small;
        for (const glm::vec4& t : written_tangents()) small.emplace_back(glm::round(t * 32767.0f));
        return small;
    }
    static bool within_square(const std::vector<glm::vec2>& uvs) {
        return std::ranges::all_of(
            uvs, [](const glm::vec2& uv) { return uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1; });
    }
    static std::vector<glm::u16vec2> small_uvs(const std::vector<glm::vec2>& uvs) {
        std::vector<glm::u16vec2> small;
        for (const glm::vec2& uv : uvs) small.emplace_back(glm::round(uv * 65535.0f));
        return small;
    }

    Result<void> add_materials() {
        for (const Image& image : mesh_.images) {
            auto bytes = encoded_texture(image, options_);
            if (!bytes) return tl::unexpected(bytes.error());
            json_["images"].push_back({{"bufferView", add_view(bytes->data(), bytes->size(), 1, 0)},
                                       {"mimeType", media_type_of(options_.textures)}});
        }
        WrittenTexcoords texcoords;
        if (!mesh_.uvs.empty()) texcoords.first = glm::dmat3x2{{1, 0}, {0, 1}, {0, 0}};
        texcoords.second = !mesh_.second_uvs.empty();
        MaterialJson made = material_json(mesh_.material_table, texcoords);
        if (options_.textures == WriteOptions::Textures::webp) refer_to_webp(made.textures);
        used_.insert(made.extensions.begin(), made.extensions.end());
        add_to_document(json_, std::move(made));
        return {};
    }

    // glTF's own textures have PNG or JPEG.
    void refer_to_webp(Json& textures) {
        for (Json& texture : textures) {
            texture["extensions"][webp_name]["source"] = texture["source"];
            texture.erase("source");
        }
        if (!textures.empty()) required_.insert(webp_name);
    }

    void add_primitives() {
        Json primitives = Json::array();
        const size_t materials = mesh_.materials.empty() ? 1 : mesh_.material_table.size();
        // A material's triangles that have tangents, and those that have none.
        std::vector<std::array<std::vector<uint32_t>, 2>> indices(materials);
        for (const Triangle& t : mesh_.triangles) {
            auto& to = indices[mesh_.materials.empty() ? 0 : mesh_.materials[t[0]]][has_tangents(t) ? 0 : 1];
            to.insert(to.end(), t.begin(), t.end());
        }
        for (size_t i = 0; i < 2 * materials; ++i) {
            const std::vector<uint32_t>& of = indices[i / 2][i % 2];
            if (of.empty()) continue;
            Json primitive = {{"attributes", attributes_},
                              {"indices", add_accessor(of, {unsigned_int, "SCALAR"}, index_target)}};
            if (i % 2 == 0) primitive["attributes"]["TANGENT"] = tangents_;
            if (!mesh_.material_table.empty()) primitive["material"] = i / 2;
            primitives.push_back(primitive);
        }
        json_["meshes"] = {{{"primitives", primitives}}};
    }
    bool has_tangents(const Triangle& triangle) const {
        return !mesh_.tangents.empty() &&
               std::ranges::all_of(triangle, [&](uint32_t w) { return mesh_.tangents[w].w != 0; });
    }

    const TriMesh& mesh_;
    const WriteOptions options_;
    Json json_, attributes_;
    std::vector<std::byte> bin_;
    size_t tangents_ = 0;         // their accessor
    size_t unpacked_bytes_ = 0;   // of what is compressed
    std::set<std::string> used_;  // extensions
    std::set<std::string> required_;
};

}  // namespace

Result<std::vector<std::byte>> encoded_texture(const Image& image, const WriteOptions& options) {
    switch (options.textures) {
        case WriteOptions::Textures::jpeg:
            return encode_jpeg(image, options.quality);
        case WriteOptions::Textures::webp:
            return encode_webp(image, options.quality);
        case WriteOptions::Textures::png:
            break;
    }
    return encode_png(image);
}

const char* extension_of(WriteOptions::Textures format) {
    return format == WriteOptions::Textures::jpeg ? ".jpg" : format == WriteOptions::Textures::webp ? ".webp" : ".png";
}

Result<void> write_glb(const TriMesh& mesh, const fs::path& path, const WriteOptions& options) {
    return GlbWriter(mesh, options).write(path);
}

}  // namespace lodestone
