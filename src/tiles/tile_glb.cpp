#include "tiles/tile_glb.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>
#include <set>
#include <span>

#include "base/check.h"
#include "base/json.h"
#include "base/looks/srgb.h"
#include "mesh/io/gltf/material_json.h"

namespace lodestone::tiles {

std::optional<Encoding> encoding_named(const std::string& name) {
    if (name == "meshopt") return Encoding::meshopt;
    if (name == "quantised") return Encoding::quantised;
    if (name == "plain") return Encoding::plain;
    return std::nullopt;
}

namespace {

using vgi::Atlas;

static_assert(std::endian::native == std::endian::little);

constexpr int signed_byte = 5120, unsigned_short = 5123, unsigned_int = 5125, real = 5126;
constexpr int vertex_target = 34962, index_target = 34963;

// Values of one attribute as they are stored, `stride` bytes each, a multiple of four.
struct Stream {
    std::vector<std::byte> bytes;
    size_t stride = 4;
    Json accessor;                    // but for its view and count
    std::vector<std::byte> filtered;  // the same for the filter EXPONENTIAL, where that is used
};

template <class T, size_t N>
void append(Stream& stream, const std::array<T, N>& values) {
    const size_t at = stream.bytes.size();
    stream.bytes.resize(at + stream.stride);
    std::memcpy(stream.bytes.data() + at, values.data(), N * sizeof(T));
}

// Binary glTF in the making.
class Glb {
public:
    Glb(const Atlas& atlas, TileMesh mesh, const GlbOptions& options)
        : atlas_(atlas), mesh_(std::move(mesh)), options_(options) {}

    std::vector<std::byte> run() {
        json_["asset"] = {{"version", "2.0"}, {"generator", "lodestone"}};
        json_["scene"] = 0;
        json_["scenes"] = {{{"nodes", {0}}}};
        json_["nodes"] = {{{"mesh", 0}, {"matrix", matrix()}}};
        split_by_material();
        order();
        add_attributes();
        add_primitives();
        add_materials();
        add_buffers();
        return whole();
    }

private:
    bool integers() const { return options_.encoding != Encoding::plain; }
    bool compressed() const { return options_.encoding == Encoding::meshopt; }

    // From the lattice to glTF's axes, column by column.
    std::array<double, 16> matrix() const {
        const double s = atlas_.step;
        const glm::dvec3& o = atlas_.origin;
        if (options_.up == UpAxis::y) return {s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, o.x, o.y, o.z, 1};
        return {s, 0, 0, 0, 0, 0, -s, 0, 0, s, 0, 0, o.x, o.z, -o.y, 1};
    }

    // Index lists, one per material that is used.
    void split_by_material() {
        const size_t count = mesh_.materials.empty() ? 1 : atlas_.material_table.size();
        lists_.resize(count);
        surface_.resize(count, 0);
        for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
            const size_t m = mesh_.materials.empty() ? 0 : mesh_.materials[t];
            lists_[m].insert(lists_[m].end(), mesh_.triangles[t].begin(), mesh_.triangles[t].end());
            if (t < mesh_.surface_triangles) surface_[m] = lists_[m].size();
        }
    }

    // Triangles for the vertex cache, vertices as triangles need them: both compress best so. Those of the surface come
    // first, as vertices that close borders alone may be of leaves.
    void order() {
        const size_t count = mesh_.vertices.size();
        std::vector<uint32_t> all, closing;
        for (size_t m = 0; m < lists_.size(); ++m) {
            const auto surface = std::span(lists_[m]).first(surface_[m]),
                       rest = std::span(lists_[m]).subspan(surface_[m]);
            for (const auto part : {surface, rest})
                meshopt_optimizeVertexCache(part.data(), part.data(), part.size(), count);
            all.insert(all.end(), surface.begin(), surface.end());
            closing.insert(closing.end(), rest.begin(), rest.end());
        }
        all.insert(all.end(), closing.begin(), closing.end());
        std::vector<uint32_t> remap(count);
        const size_t used = meshopt_optimizeVertexFetchRemap(remap.data(), all.data(), all.size(), count);
        std::vector<TileVertex> ordered(used);
        for (size_t v = 0; v < count; ++v) {
            if (remap[v] != ~0u) ordered[remap[v]] = mesh_.vertices[v];
        }
        mesh_.vertices = std::move(ordered);
        for (auto& list : lists_) {
            for (uint32_t& i : list) i = remap[i];
        }
    }

    // Whether positions are stored as integers: where all of them are.
    bool whole_positions() const {
        const uint32_t fraction = (1u << place_shift(atlas_)) - 1;
        return integers() && std::ranges::all_of(mesh_.vertices, [&](const TileVertex& v) {
                   return ((v.position[0] | v.position[1] | v.position[2]) & fraction) == 0;
               });
    }
    Stream positions() const {
        const bool whole = whole_positions();
        Stream stream;
        stream.stride = whole ? 8 : 12;
        glm::dvec3 low(1 << 16), high(0);
        for (const TileVertex& v : mesh_.vertices) {
            const glm::dvec3 at = in_steps(atlas_, v.position);
            low = glm::min(low, at);
            high = glm::max(high, at);
            if (whole) {
                append(stream, std::array<uint16_t, 3>{static_cast<uint16_t>(at.x), static_cast<uint16_t>(at.y),
                                                       static_cast<uint16_t>(at.z)});
            } else {
                append(stream, std::array<float, 3>{static_cast<float>(at.x), static_cast<float>(at.y),
                                                    static_cast<float>(at.z)});
            }
        }
        if (compressed() && !whole) stream.filtered = filtered_positions();
        stream.accessor = {{"componentType", whole ? unsigned_short : real}, {"type", "VEC3"}};
        if (whole) {
            stream.accessor["min"] = std::array{std::lround(low.x), std::lround(low.y), std::lround(low.z)};
            stream.accessor["max"] = std::array{std::lround(high.x), std::lround(high.y), std::lround(high.z)};
        } else {
            stream.accessor["min"] = std::array{low.x, low.y, low.z};
            stream.accessor["max"] = std::array{high.x, high.y, high.z};
        }
        return stream;
    }
    // Floats as the filter EXPONENTIAL of EXT_meshopt_compression has them: an exponent of two in the highest byte, and
    // an integer. Samples have whole numbers, so that they take no more than 16 bits.
    std::vector<std::byte> filtered_positions() const {
        const uint32_t shift = place_shift(atlas_), fraction = (1u << shift) - 1;
        Stream words;
        words.stride = 12;
        for (const TileVertex& v : mesh_.vertices) {
            const auto& [x, y, z] = v.position;
            const bool whole = ((x | y | z) & fraction) == 0;
            const uint32_t exponent = (whole ? 0u : 0u - shift) << 24, less = whole ? shift : 0;
            append(words, std::array<uint32_t, 3>{exponent | x >> less, exponent | y >> less, exponent | z >> less});
        }
        return std::move(words.bytes);
    }
    Stream normals() const {
        Stream stream;
        stream.stride = integers() ? 4 : 12;
        stream.accessor = {{"componentType", integers() ? signed_byte : real}, {"type", "VEC3"}};
        if (integers()) stream.accessor["normalized"] = true;
        for (const TileVertex& v : mesh_.vertices) {
            const glm::vec3 n = vgi::unpack_octahedral(v.normal);
            const auto byte = [](float x) { return static_cast<int8_t>(std::lround(x * 127)); };
            if (integers()) {
                append(stream, std::array<int8_t, 3>{byte(n.x), byte(n.y), byte(n.z)});
            } else {
                append(stream, std::array<float, 3>{n.x, n.y, n.z});
            }
        }
        return stream;
    }
    // Of integers the texture's transform makes coordinates.
    Stream uvs() const {
        Stream stream;
        stream.stride = integers() ? 4 : 8;
        stream.accessor = {{"componentType", integers() ? unsigned_short : real}, {"type", "VEC2"}};
        if (integers()) stream.accessor["normalized"] = true;
        for (const TileVertex& v : mesh_.vertices) {
            if (integers()) {
                append(stream, v.uv);
            } else {
                const glm::vec2 uv = atlas_.uv_low + atlas_.uv_step * glm::vec2(v.uv[0], v.uv[1]);
                append(stream, std::array<float, 2>{uv.x, uv.y});
            }
        }
        return stream;
    }
    // glTF's colours are linear; 16 bits keep what 8 of sRGB hold.
    Stream colours() const {
        std::array<uint16_t, 256> linear{};
        for (size_t i = 0; i < linear.size(); ++i)
            linear[i] = static_cast<uint16_t>(std::lround(65535 * linear_from_srgb(static_cast<double>(i) / 255)));
        Stream stream;
        stream.stride = 8;
        stream.accessor = {{"componentType", unsigned_short}, {"type", "VEC4"}, {"normalized", true}};
        for (const TileVertex& v : mesh_.vertices) {
            const glm::u8vec4& c = v.colour;
            append(stream,
                   std::array<uint16_t, 4>{linear[c.x], linear[c.y], linear[c.z], static_cast<uint16_t>(c.w * 257)});
        }
        return stream;
    }

    void add_attributes() {
        attributes_["POSITION"] = add_stream(positions());
        attributes_["NORMAL"] = add_stream(normals());
        if (textured()) attributes_["TEXCOORD_0"] = add_stream(uvs());
        if (!atlas_.colours.empty()) attributes_["COLOR_0"] = add_stream(colours());
    }
    // Texture coordinates without a texture would say nothing.
    bool textured() const { return !atlas_.uvs.empty() && !atlas_.images.empty(); }

    size_t add_stream(Stream stream) {
        const size_t count = stream.bytes.size() / stream.stride;
        std::vector<std::byte> packed;
        if (compressed()) {
            packed.resize(meshopt_encodeVertexBufferBound(count, stream.stride));
            const auto& values = stream.filtered.empty() ? stream.bytes : stream.filtered;
            const size_t bytes = meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                                            packed.size(), values.data(), count, stream.stride);
            LODE_CHECK(bytes > 0, count, stream.stride);
            packed.resize(bytes);
        }
        const size_t view = add_view(stream.bytes, packed, stream.stride, count, "ATTRIBUTES");
        json_["bufferViews"][view]["byteStride"] = stream.stride;
        if (!stream.filtered.empty())
            json_["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]["filter"] = "EXPONENTIAL";
        return add_accessor(std::move(stream.accessor), view, count);
    }
    size_t add_indices(const std::vector<uint32_t>& indices) {
        const bool narrow = mesh_.vertices.size() < 65536;
        const size_t size = narrow ? 2 : 4;
        std::vector<std::byte> bytes(indices.size() * size), packed;
        for (size_t i = 0; i < indices.size(); ++i) std::memcpy(bytes.data() + i * size, &indices[i], size);
        if (compressed()) {
            packed.resize(meshopt_encodeIndexBufferBound(indices.size(), mesh_.vertices.size()));
            const size_t count = meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(packed.data()),
                                                           packed.size(), indices.data(), indices.size());
            LODE_CHECK(count > 0, indices.size());
            packed.resize(count);
        }
        const size_t view = add_view(bytes, packed, size, indices.size(), "TRIANGLES");
        return add_accessor({{"componentType", narrow ? unsigned_short : unsigned_int}, {"type", "SCALAR"}}, view,
                            indices.size());
    }
    size_t add_accessor(Json accessor, size_t view, size_t count) {
        accessor["bufferView"] = view;
        accessor["count"] = count;
        json_["accessors"].push_back(std::move(accessor));
        return json_["accessors"].size() - 1;
    }
    // packed: the same compressed, where tiles are; mode: by what codec.
    size_t add_view(std::span<const std::byte> bytes, std::span<const std::byte> packed, size_t stride, size_t count,
                    const char* mode) {
        Json view = {{"target", mode == std::string("TRIANGLES") ? index_target : vertex_target},
                     {"byteLength", bytes.size()}};
        if (compressed()) {
            view["buffer"] = 1;
            view["byteOffset"] = unpacked_bytes_;
            unpacked_bytes_ += (bytes.size() + 3) / 4 * 4;
            view["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                             {"byteOffset", bin_.size()},
                                                             {"byteLength", packed.size()},
                                                             {"byteStride", stride},
                                                             {"count", count},
                                                             {"mode", mode}};
        } else {
            view["buffer"] = 0;
            view["byteOffset"] = bin_.size();
        }
        const auto stored = compressed() ? packed : bytes;
        bin_.insert(bin_.end(), stored.begin(), stored.end());
        bin_.resize((bin_.size() + 3) / 4 * 4);
        json_["bufferViews"].push_back(std::move(view));
        return json_["bufferViews"].size() - 1;
    }

    void add_primitives() {
        Json primitives = Json::array();
        for (size_t m = 0; m < lists_.size(); ++m) {
            if (lists_[m].empty()) continue;
            primitives.push_back({{"attributes", attributes_}, {"indices", add_indices(lists_[m])}, {"material", m}});
        }
        json_["meshes"] = {{{"primitives", primitives}}};
    }

    void add_materials() {
        std::vector<Material> table = atlas_.material_table;
        if (table.empty()) {
            table.emplace_back();
            if (atlas_.colours.empty()) table[0].base_colour = {0.6f, 0.6f, 0.6f, 1};
        }
        if (lists_.size() < table.size()) table.resize(lists_.size());
        MaterialJson made = material_json(table, {texcoords(), false});
        used_ = made.extensions;
        add_to_document(json_, std::move(made));
        if (!textured()) return;
        for (const std::string& uri : options_.image_uris) json_["images"].push_back({{"uri", uri}});
    }
    // From those stored to the mesh's.
    std::optional<glm::dmat3x2> texcoords() const {
        if (!textured()) return std::nullopt;
        if (!integers()) return glm::dmat3x2{{1, 0}, {0, 1}, {0, 0}};
        const glm::dvec2 step = 65535.0 * glm::dvec2(atlas_.uv_step);
        return glm::dmat3x2{{step.x, 0}, {0, step.y}, glm::dvec2(atlas_.uv_low)};
    }

    void add_buffers() {
        json_["buffers"] = {{{"byteLength", bin_.size()}}};
        std::set<std::string> required;
        if (compressed()) {
            json_["buffers"].push_back(
                {{"byteLength", unpacked_bytes_}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
            required.insert("EXT_meshopt_compression");
        }
        if (integers()) required.insert("KHR_mesh_quantization");
        // Where textures lie, integers do not say without it.
        if (integers() && used_.contains("KHR_texture_transform")) required.insert("KHR_texture_transform");
        if (!required.empty()) json_["extensionsRequired"] = required;
        used_.merge(required);
        if (!used_.empty()) json_["extensionsUsed"] = used_;
    }

    std::vector<std::byte> whole() const {
        std::string text = json_.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const auto total = static_cast<uint32_t>(12 + 8 + text.size() + 8 + bin_.size());
        const uint32_t head[] = {0x46546c67, 2, total, static_cast<uint32_t>(text.size()), 0x4e4f534a};
        const uint32_t bin_head[] = {static_cast<uint32_t>(bin_.size()), 0x004e4942};
        std::vector<std::byte> bytes(total);
        size_t at = 0;
        const auto add = [&](std::span<const std::byte> part) {
            std::memcpy(bytes.data() + at, part.data(), part.size());
            at += part.size();
        };
        add(std::as_bytes(std::span(head)));
        add(std::as_bytes(std::span(text.data(), text.size())));
        add(std::as_bytes(std::span(bin_head)));
        add(bin_);
        return bytes;
    }

    const Atlas& atlas_;
    TileMesh mesh_;
    const GlbOptions& options_;
    std::vector<std::vector<uint32_t>> lists_;  // by material: the surface's first
    std::vector<size_t> surface_;               // by material: how many of these indices are the surface's
    Json json_, attributes_;
    std::vector<std::byte> bin_;
    size_t unpacked_bytes_ = 0;
    std::set<std::string> used_;  // extensions
};

}  // namespace

std::vector<std::byte> encode_glb(const Atlas& atlas, TileMesh mesh, const GlbOptions& options) {
    // Those that EXT_meshopt_compression names.
    static std::once_flag versions;
    std::call_once(versions, [] {
        meshopt_encodeVertexVersion(0);
        meshopt_encodeIndexVersion(1);
    });
    return Glb(atlas, std::move(mesh), options).run();
}

}  // namespace lodestone::tiles
