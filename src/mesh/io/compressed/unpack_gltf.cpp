#include "mesh/io/compressed/unpack_gltf.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/json.h"
#include "mesh/io/compressed/draco.h"
#include "mesh/io/compressed/meshopt.h"
#include "mesh/io/gltf/values.h"

namespace lodestone {

namespace {

constexpr const char* meshopt_name = "EXT_meshopt_compression";
constexpr const char* draco_name = "KHR_draco_mesh_compression";

std::string text_of(const tinygltf::Value& value, const char* key) {
    return value.Has(key) && value.Get(key).IsString() ? value.Get(key).Get<std::string>() : std::string();
}
// Whole numbers of 0 and above; nothing for others.
std::optional<uint64_t> number_of(const tinygltf::Value& value, const char* key) {
    if (!value.Has(key) || !value.Get(key).IsNumber()) return std::nullopt;
    const double number = value.Get(key).GetNumberAsDouble();
    if (!(number >= 0 && number < 1e15)) return std::nullopt;
    return static_cast<uint64_t>(number);
}

class Unpacking {
public:
    Unpacking(tinygltf::Model& model, const Limits& limits, const std::function<void(const std::string&)>& warn)
        : model_(model), limits_(limits), warn_(warn) {}

    void unpack_view(size_t number) {
        const auto found = model_.bufferViews[number].extensions.find(meshopt_name);
        if (found == model_.bufferViews[number].extensions.end()) return;
        const std::string name = "buffer view " + std::to_string(number);
        const tinygltf::Value extension = found->second;
        const auto buffer = number_of(extension, "buffer"), length = number_of(extension, "byteLength"),
                   stride = number_of(extension, "byteStride"), count = number_of(extension, "count");
        if (!buffer || !length || !stride || !count) throw GltfFault{name, "does not say how it is compressed"};
        if (*buffer >= model_.buffers.size()) throw GltfFault{name, "refers to a buffer that is not there"};
        const auto& bytes = model_.buffers[*buffer].data;
        const uint64_t offset = number_of(extension, "byteOffset").value_or(0);
        if (offset > bytes.size() || *length > bytes.size() - offset)
            throw GltfFault{name, "reaches past the end of its buffer; the file is cut or its header is wrong"};
        auto unpacked = decode_meshopt(std::span(bytes).subspan(offset, *length),
                                       {*count, *stride, text_of(extension, "mode"), text_of(extension, "filter")},
                                       limits_.unpacked_bytes - std::min(limits_.unpacked_bytes, unpacked_));
        if (!unpacked) throw GltfFault{name, unpacked.error().message};
        unpacked_ += unpacked->size();
        tinygltf::BufferView& view = model_.bufferViews[number];
        view.buffer = add_buffer(std::move(*unpacked));
        view.byteOffset = 0;
        view.byteLength = model_.buffers.back().data.size();
    }

    void unpack_primitive(tinygltf::Primitive& primitive, const std::string& name) {
        const auto found = primitive.extensions.find(draco_name);
        if (found == primitive.extensions.end()) return;
        const tinygltf::Value extension = found->second;
        const auto view = number_of(extension, "bufferView");
        if (!view || !extension.Has("attributes") || !extension.Get("attributes").IsObject())
            throw GltfFault{name, "does not say where Draco has it"};
        const auto bytes = bytes_of_view(model_, static_cast<int>(std::min<uint64_t>(*view, 1u << 30)), name);
        std::vector<std::string> keys;
        const DracoPromise promise = promise_of(primitive, extension.Get("attributes"), name, keys);
        const Result<DracoAccessors>& decoded = decoded_as(*view, bytes, promise, primitive, keys, name);
        if (decoded) {
            primitive.indices = decoded->indices;
            for (size_t i = 0; i < keys.size(); ++i) primitive.attributes[keys[i]] = decoded->attributes[i];
        } else if (decoded.error().fault == Fault::format && has_plain(primitive, keys, *view)) {
            warn_(name + ": " + decoded.error().message + "; what is beside it uncompressed is taken");
        } else {
            throw GltfFault{name, decoded.error().message, decoded.error().fault};
        }
    }

private:
    // Accessors of what Draco compressed. The file's own stay as they are: primitives may share them.
    struct DracoAccessors {
        int indices = -1;
        std::vector<int> attributes;
    };
    // What a view is decoded as, by all that the result depends on: primitives that say the same share it.
    using DracoKey = std::pair<uint64_t, DracoPromise>;

    // What a view holds, decoded the first time that it is asked for. keys: of the promise's attributes.
    const Result<DracoAccessors>& decoded_as(uint64_t view, std::span<const unsigned char> bytes,
                                             const DracoPromise& promise, const tinygltf::Primitive& primitive,
                                             const std::vector<std::string>& keys, const std::string& name) {
        const auto known = decoded_.find({view, promise});
        if (known != decoded_.end()) return known->second;
        if (++ways_[view] > most_ways)
            throw GltfFault{name, "buffer view " + std::to_string(view) + " is to be decoded in more than " +
                                      std::to_string(most_ways) + " ways; primitives that share it must agree"};
        Result<DracoAccessors> made = DracoAccessors{};
        if (auto mesh = decode_draco(bytes, promise); mesh) {
            made->indices = add_accessor(primitive.indices, mesh->indices, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT);
            for (size_t i = 0; i < keys.size(); ++i)
                made->attributes.push_back(
                    add_accessor(primitive.attributes.at(keys[i]), mesh->values[i], TINYGLTF_COMPONENT_TYPE_FLOAT));
        } else {
            made = tl::unexpected(mesh.error());
        }
        return decoded_.emplace(DracoKey{view, promise}, std::move(made)).first->second;
    }

    const tinygltf::Accessor& accessor(int number, const std::string& name) {
        if (number < 0 || static_cast<size_t>(number) >= model_.accessors.size())
            throw GltfFault{name, "refers to an accessor that is not there"};
        return model_.accessors[static_cast<size_t>(number)];
    }

    DracoPromise promise_of(const tinygltf::Primitive& primitive, const tinygltf::Value& attributes,
                            const std::string& name, std::vector<std::string>& keys) {
        DracoPromise promise;
        promise.indices = accessor(primitive.indices, name + " indices").count;
        for (const std::string& key : attributes.Keys()) {
            const auto id = number_of(attributes, key.c_str());
            const auto there = primitive.attributes.find(key);
            if (!id || *id > 0xffffffffu || there == primitive.attributes.end())
                throw GltfFault{name, "compresses an attribute '" + key.substr(0, 40) + "' that it does not have"};
            const tinygltf::Accessor& of = accessor(there->second, name + " " + key.substr(0, 40));
            const int components = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(of.type));
            if (components < 1 || components > 4)
                throw GltfFault{name + " " + key.substr(0, 40), "has an unknown type"};
            if (!keys.empty() && of.count != promise.vertices)
                throw GltfFault{name, "has attributes of different numbers of vertices"};
            promise.vertices = of.count;
            promise.attributes.push_back(
                {static_cast<uint32_t>(*id), static_cast<uint32_t>(components), of.normalized});
            keys.push_back(key);
        }
        for (const auto& [what, number, limit] : {std::tuple("vertices", promise.vertices, limits_.vertices),
                                                  std::tuple("triangles", promise.indices / 3, limits_.triangles)}) {
            if (number > limit) throw GltfFault{name, over_limit(what, number, limit)};
        }
        return promise;
    }

    // view: of the compressed mesh, which accessors have that have none of their own. keys: of what it holds.
    bool has_plain(const tinygltf::Primitive& primitive, const std::vector<std::string>& keys, uint64_t view) const {
        const auto plain = [&](int number) {
            return model_.accessors[static_cast<size_t>(number)].bufferView != static_cast<int>(view);
        };
        return plain(primitive.indices) &&
               std::ranges::all_of(keys, [&](const auto& key) { return plain(primitive.attributes.at(key)); });
    }

    int add_buffer(std::vector<unsigned char> bytes) {
        tinygltf::Buffer buffer;
        buffer.data = std::move(bytes);
        model_.buffers.push_back(std::move(buffer));
        return static_cast<int>(model_.buffers.size()) - 1;
    }

    // One that is as accessor `as` says, but of these values. Returns its number.
    template <class Number>
    int add_accessor(int as, const std::vector<Number>& values, int component_type) {
        std::vector<unsigned char> bytes(values.size() * sizeof(Number));
        if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
        tinygltf::BufferView view;
        view.byteLength = bytes.size();
        view.buffer = add_buffer(std::move(bytes));
        model_.bufferViews.push_back(view);
        tinygltf::Accessor made = model_.accessors[static_cast<size_t>(as)];
        made.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
        made.byteOffset = 0;
        made.componentType = component_type;
        made.normalized = false;
        made.sparse.isSparse = false;
        model_.accessors.push_back(std::move(made));
        return static_cast<int>(model_.accessors.size()) - 1;
    }

    // Ways in which a view is decoded: what is decoded of a file stays within its bytes. Files of encoders have one.
    static constexpr int most_ways = 16;

    tinygltf::Model& model_;
    const Limits& limits_;
    const std::function<void(const std::string&)>& warn_;
    uint64_t unpacked_ = 0;  // bytes of all views
    std::map<DracoKey, Result<DracoAccessors>> decoded_;
    std::map<uint64_t, int> ways_;  // of each view that is decoded
};

}  // namespace

namespace {

// A member, or null where there is none or the value is no object.
const Json* member(const Json& of, const char* key) {
    const auto found = of.is_object() ? of.find(key) : of.end();
    return of.is_object() && found != of.end() ? &*found : nullptr;
}
const Json* extension_of(const Json& of, const char* name) {
    const Json* extensions = member(of, "extensions");
    return extensions != nullptr ? member(*extensions, name) : nullptr;
}

// The numbers of buffers of which bytes are read: views have them as they are, or compressed.
std::set<uint64_t> buffers_read(const Json& document) {
    std::set<uint64_t> read;
    const Json* views = member(document, "bufferViews");
    if (views == nullptr || !views->is_array()) return read;
    for (const Json& view : *views) {
        const Json* packed = extension_of(view, meshopt_name);
        const Json* buffer = member(packed != nullptr ? *packed : view, "buffer");
        if (buffer != nullptr && buffer->is_number_unsigned()) read.insert(buffer->get<uint64_t>());
    }
    return read;
}

bool put_buffers(Json& document) {
    bool changed = false;
    const auto buffers = document.find("buffers");
    if (buffers == document.end() || !buffers->is_array()) return false;
    const std::set<uint64_t> read = buffers_read(document);
    for (size_t i = 0; i < buffers->size(); ++i) {
        Json& buffer = (*buffers)[i];
        const Json* own = extension_of(buffer, meshopt_name);
        const Json* fallback = own != nullptr ? member(*own, "fallback") : nullptr;
        if (fallback == nullptr || *fallback != true || (buffer.contains("uri") && read.contains(i))) continue;
        buffer["uri"] = "data:application/octet-stream;base64,AA==";
        buffer["byteLength"] = 1;
        changed = true;
    }
    return changed;
}

bool put_view(Json& document, const Json* number, const Json& view) {
    const auto accessors = document.find("accessors");
    if (number == nullptr || !number->is_number_unsigned() || accessors == document.end() || !accessors->is_array() ||
        number->get<uint64_t>() >= accessors->size())
        return false;
    Json& accessor = (*accessors)[number->get<size_t>()];
    if (!accessor.is_object() || accessor.contains("bufferView")) return false;
    accessor["bufferView"] = view;
    return true;
}

bool put_views(Json& document) {
    bool changed = false;
    const Json meshes = document.value("meshes", Json::array());
    for (const Json& mesh : meshes) {
        const Json* primitives = member(mesh, "primitives");
        if (primitives == nullptr || !primitives->is_array()) continue;
        for (const Json& primitive : *primitives) {
            const Json* own = extension_of(primitive, draco_name);
            const Json* view = own != nullptr ? member(*own, "bufferView") : nullptr;
            if (view == nullptr) continue;
            changed = put_view(document, member(primitive, "indices"), *view) || changed;
            const Json *packed = member(*own, "attributes"), *attributes = member(primitive, "attributes");
            if (packed == nullptr || attributes == nullptr || !packed->is_object()) continue;
            for (const auto& [key, id] : packed->items())
                changed = put_view(document, member(*attributes, key.c_str()), *view) || changed;
        }
    }
    return changed;
}

}  // namespace

std::string with_stand_ins(std::string_view text) {
    if (text.find(meshopt_name) == text.npos && text.find(draco_name) == text.npos) return {};
    Json document = Json::parse(text, nullptr, false);
    if (document.is_discarded() || !document.is_object()) return {};
    const bool buffers = put_buffers(document), views = put_views(document);
    return buffers || views ? text_of(document) : std::string();
}

void unpack_gltf(tinygltf::Model& model, const std::set<int>& meshes, const Limits& limits,
                 const std::function<void(const std::string&)>& warn) {
    Unpacking unpacking(model, limits, warn);
    for (size_t v = 0; v < model.bufferViews.size(); ++v) unpacking.unpack_view(v);
    for (const int m : meshes) {
        auto& primitives = model.meshes[static_cast<size_t>(m)].primitives;
        for (size_t p = 0; p < primitives.size(); ++p)
            unpacking.unpack_primitive(primitives[p], "mesh " + std::to_string(m) + " primitive " + std::to_string(p));
    }
}

}  // namespace lodestone
