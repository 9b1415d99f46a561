#include "tiles/check/tile_content.h"

#include <meshoptimizer.h>

#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "base/files/file.h"
#include "base/json.h"
#include "mesh/io/compressed/meshopt.h"
#include "mesh/limits.h"

namespace lodestone::tiles {

glm::dmat4 TileContent::to_tile() const {
    glm::dmat4 node;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) node[column][row] = matrix[static_cast<size_t>(column * 4 + row)];
    }
    const glm::dmat4 y_to_z{glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(0, -1, 0, 0),
                            glm::dvec4(0, 0, 0, 1)};
    return y_to_z * node;
}

glm::dvec3 TileContent::point(uint32_t vertex) const {
    const auto& p = positions[vertex];
    return glm::dvec3(to_tile() * glm::dvec4(p[0], p[1], p[2], 1));
}

namespace {

constexpr uint64_t most_count = uint64_t{1} << 26;  // vertices or indices of a tile

class GlbReader {
public:
    explicit GlbReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    // Json::exception where the description lacks something.
    Result<TileContent> read() {
        if (auto done = read_chunks(); !done) return tl::unexpected(done.error());
        if (json_.at("asset").at("version") != "2.0") return wrong("is not glTF 2.0");
        const Json& node = json_.at("nodes").at(json_.at("scenes").at(0).at("nodes").at(0).get<size_t>());
        TileContent content;
        content.bytes = bytes_.size();
        content.matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        if (node.contains("matrix")) content.matrix = node["matrix"].get<std::array<double, 16>>();
        for (const double number : content.matrix) {
            if (!std::isfinite(number)) return wrong("its node's matrix is not made of numbers");
        }
        const Json& primitives = json_.at("meshes").at(node.at("mesh").get<size_t>()).at("primitives");
        const auto positions = primitives.at(0).at("attributes").at("POSITION").get<size_t>();
        if (auto done = read_positions(positions, content); !done) return tl::unexpected(done.error());
        for (const Json& primitive : primitives) {
            if (primitive.value("mode", 4) != 4) return wrong("holds no triangles");
            if (primitive.at("attributes").at("POSITION") != positions)
                return wrong("its parts have vertices of their own");
            if (auto done = read_indices(primitive.at("indices").get<size_t>(), content); !done)
                return tl::unexpected(done.error());
        }
        return content;
    }

private:
    static tl::unexpected<Error> wrong(const std::string& what) { return fail(Fault::format, what); }
    uint32_t word(size_t at) const {
        uint32_t value = 0;
        std::memcpy(&value, bytes_.data() + at, 4);
        return value;
    }

    Result<void> read_chunks() {
        if (bytes_.size() < 20 || word(0) != 0x46546c67 || word(4) != 2) return wrong("is no binary glTF 2");
        if (word(8) != bytes_.size()) return wrong("its length is not what its header says");
        const size_t json_bytes = word(12);
        if (word(16) != 0x4e4f534a || json_bytes > bytes_.size() - 20) return wrong("its description has no end");
        const auto* text = reinterpret_cast<const char*>(bytes_.data() + 20);
        json_ = Json::parse(text, text + json_bytes);
        const size_t at = 20 + json_bytes;
        if (at == bytes_.size()) return {};
        if (bytes_.size() - at < 8 || word(at + 4) != 0x004e4942 || word(at) != bytes_.size() - at - 8)
            return wrong("its buffer has no end");
        bin_ = bytes_.subspan(at + 8);
        return {};
    }

    struct Values {
        std::vector<std::byte> bytes;
        size_t stride = 0, count = 0;
        int component = 0;
    };
    static size_t bytes_of(int component) {
        return component == 5120 || component == 5121 ? 1 : component == 5122 || component == 5123 ? 2 : 4;
    }

    // width: components of a value.
    Result<Values> values(const Json& accessor, size_t width) const {
        Values values;
        values.component = accessor.at("componentType").get<int>();
        values.count = accessor.at("count").get<size_t>();
        if (values.count > most_count) return wrong("an accessor counts more than a tile can have");
        if (accessor.contains("sparse")) return wrong("an accessor is sparse");
        const size_t element = width * bytes_of(values.component);
        const Json& view = json_.at("bufferViews").at(accessor.at("bufferView").get<size_t>());
        values.stride = view.value("byteStride", element);
        if (values.stride < element || values.stride > 256) return wrong("a view's stride does not hold its values");
        const size_t skip = accessor.value("byteOffset", size_t{0});
        const Json extensions = view.value("extensions", Json::object());
        auto bytes = extensions.contains("EXT_meshopt_compression")
                         ? unpacked(extensions["EXT_meshopt_compression"], values.stride, element)
                         : plain(view);
        if (!bytes) return tl::unexpected(bytes.error());
        if (skip > bytes->size() ||
            (values.count > 0 && (values.count - 1) * values.stride + element > bytes->size() - skip))
            return wrong("an accessor goes past its view");
        bytes->erase(bytes->begin(), bytes->begin() + static_cast<std::ptrdiff_t>(skip));
        values.bytes = std::move(*bytes);
        return values;
    }
    Result<std::span<const std::byte>> part(const Json& of) const {
        const auto offset = of.value("byteOffset", size_t{0}), length = of.at("byteLength").get<size_t>();
        if (of.at("buffer") != 0) return wrong("a view is of a buffer that is not in the file");
        if (offset > bin_.size() || length > bin_.size() - offset) return wrong("a view goes past the buffer");
        return bin_.subspan(offset, length);
    }
    Result<std::vector<std::byte>> plain(const Json& view) const {
        const auto bytes = part(view);
        if (!bytes) return tl::unexpected(bytes.error());
        return std::vector<std::byte>(bytes->begin(), bytes->end());
    }
    Result<std::vector<std::byte>> unpacked(const Json& packed, size_t stride, size_t element) const {
        const auto bytes = part(packed);
        if (!bytes) return tl::unexpected(bytes.error());
        const auto count = packed.at("count").get<size_t>();
        const std::string mode = packed.at("mode");
        if (count > most_count) return wrong("a compressed view counts more than a tile can have");
        if (packed.at("byteStride") != stride) return wrong("a compressed view has another stride");
        if (!meshopt_may_hold(bytes->size(), count * stride))
            return wrong("a compressed view promises more than its bytes can hold");
        std::vector<std::byte> values(count * stride);
        const auto* begin = reinterpret_cast<const unsigned char*>(bytes->data());
        int failed = 1;
        if (mode == "ATTRIBUTES" && stride % 4 == 0) {
            failed = meshopt_decodeVertexBuffer(values.data(), count, stride, begin, bytes->size());
        } else if (mode == "TRIANGLES" && count % 3 == 0 && stride == element && (element == 2 || element == 4)) {
            failed = meshopt_decodeIndexBuffer(values.data(), count, stride, begin, bytes->size());
        } else if (mode == "INDICES" && stride == element && (element == 2 || element == 4)) {
            failed = meshopt_decodeIndexSequence(values.data(), count, stride, begin, bytes->size());
        }
        if (failed != 0) return wrong("a compressed view cannot be unpacked");
        const std::string filter = packed.value("filter", "NONE");
        if (filter == "EXPONENTIAL" && stride % 4 == 0) {
            meshopt_decodeFilterExp(values.data(), count, stride);
        } else if (filter != "NONE") {
            return wrong("a compressed view has a filter that tiles do not have");
        }
        return values;
    }

    static float number(const Values& values, size_t at) {
        const std::byte* from = values.bytes.data() + at;
        const auto as = [&](auto value) {
            std::memcpy(&value, from, sizeof value);
            return static_cast<float>(value);
        };
        switch (values.component) {
            case 5120:
                return as(int8_t{});
            case 5121:
                return as(uint8_t{});
            case 5122:
                return as(int16_t{});
            case 5123:
                return as(uint16_t{});
            default:
                return as(float{});
        }
    }
    Result<void> read_positions(size_t number_of, TileContent& content) const {
        const Json& accessor = json_.at("accessors").at(number_of);
        if (accessor.at("type") != "VEC3" || accessor.value("normalized", false))
            return wrong("its positions are no three numbers as they are");
        const auto found = values(accessor, 3);
        if (!found) return tl::unexpected(found.error());
        content.low = accessor.at("min").get<std::array<float, 3>>();
        content.high = accessor.at("max").get<std::array<float, 3>>();
        for (size_t v = 0; v < found->count; ++v) {
            std::array<float, 3> p{};
            for (size_t k = 0; k < 3; ++k) {
                p[k] = number(*found, v * found->stride + k * bytes_of(found->component));
                if (!std::isfinite(p[k])) return wrong("a position is not a number");
                if (p[k] < content.low[k] || p[k] > content.high[k])
                    return wrong("a position is not between min and max");
            }
            content.positions.push_back(p);
        }
        return {};
    }
    Result<void> read_indices(size_t number_of, TileContent& content) const {
        const Json& accessor = json_.at("accessors").at(number_of);
        const auto found = values(accessor, 1);
        if (!found) return tl::unexpected(found.error());
        if (found->count % 3 != 0) return wrong("its indices are not three to a triangle");
        const size_t size = bytes_of(found->component);
        for (size_t i = 0; i < found->count; i += 3) {
            std::array<uint32_t, 3> triangle{};
            for (size_t k = 0; k < 3; ++k) {
                std::memcpy(&triangle[k], found->bytes.data() + (i + k) * found->stride, size);
                if (triangle[k] >= content.positions.size()) return wrong("an index is past the vertices");
            }
            content.triangles.push_back(triangle);
        }
        return {};
    }

    std::span<const std::byte> bytes_, bin_;
    Json json_;
};

}  // namespace

Result<TileContent> read_tile_content(const std::filesystem::path& path) {
    const auto file = MappedFile::open(path);
    if (!file) return tl::unexpected(file.error());
    try {
        auto content = GlbReader((*file)->bytes()).read();
        if (!content) return fail_at(path.string(), content.error());
        return content;
    } catch (const Json::exception& e) {
        return fail(Fault::format, path.string() + ": " + e.what() + "; make the tiles again");
    }
}

}  // namespace lodestone::tiles
