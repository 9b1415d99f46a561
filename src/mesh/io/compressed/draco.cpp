#include "mesh/io/compressed/draco.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <memory>
#include <string>

#include "base/process/confined.h"

namespace lodestone {

namespace {

constexpr uint64_t bytes_per_element = 512;  // of a vertex or a triangle, while it is decoded
constexpr double elements_per_second = 1e5;  // at least
constexpr uint64_t most_per_byte = 4096;     // elements of a byte that are believed

// Indices, then values.
struct Shared {
    uint32_t* indices = nullptr;
    float* values = nullptr;
};

Shared shared_of(std::span<std::byte> memory, const DracoPromise& promise) {
    auto* indices = reinterpret_cast<uint32_t*>(memory.data());
    return {indices, reinterpret_cast<float*>(indices + promise.indices)};
}

uint64_t values_of(const DracoPromise& promise) {
    uint64_t components = 0;
    for (const auto& attribute : promise.attributes) components += attribute.components;
    return components * promise.vertices;
}

// Returns what is wrong, or nothing.
std::string decode_into(std::span<const unsigned char> bytes, const DracoPromise& promise, const Shared& shared) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return std::string("Draco: ") + decoded.status().error_msg();
    const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
    if (mesh->num_points() != promise.vertices || uint64_t{mesh->num_faces()} * 3 != promise.indices)
        return "Draco holds " + std::to_string(mesh->num_points()) + " vertices and " +
               std::to_string(mesh->num_faces()) + " triangles; the accessors say " + std::to_string(promise.vertices) +
               " and " + std::to_string(promise.indices / 3);
    uint32_t* index = shared.indices;
    for (uint32_t f = 0; f < mesh->num_faces(); ++f) {
        for (const draco::PointIndex& point : mesh->face(draco::FaceIndex(f))) *index++ = point.value();
    }
    float* value = shared.values;
    for (const auto& wanted : promise.attributes) {
        const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(wanted.id);
        if (attribute == nullptr) return "Draco has no attribute " + std::to_string(wanted.id);
        double scale = 1;
        if (wanted.normalised && !attribute->normalized()) {
            const int bits = 8 * draco::DataTypeLength(attribute->data_type());
            const bool is_signed =
                attribute->data_type() == draco::DT_INT8 || attribute->data_type() == draco::DT_INT16;
            if (draco::IsDataTypeIntegral(attribute->data_type()))
                scale = 1 / static_cast<double>((uint64_t{1} << (is_signed ? bits - 1 : bits)) - 1);
        }
        for (uint32_t p = 0; p < promise.vertices; ++p, value += wanted.components) {
            const auto at = attribute->mapped_index(draco::PointIndex(p));
            if (!attribute->ConvertValue(at, static_cast<int8_t>(wanted.components), value))
                return "Draco has an attribute of another kind than the accessor";
            for (uint32_t k = 0; k < wanted.components; ++k)
                value[k] = static_cast<float>(static_cast<double>(value[k]) * scale);
        }
    }
    return {};
}

// bytes: of the compressed mesh, which cannot make any number of triangles.
ConfinedWork work_of(const DracoPromise& promise, uint64_t bytes, const DracoLimits& limits) {
    const uint64_t elements = std::min(promise.vertices + promise.indices / 3, most_per_byte * bytes);
    ConfinedWork work;
    work.library = "Draco";
    work.result_bytes = 4 * (promise.indices + values_of(promise));
    work.memory_bytes = limits.memory_bytes + bytes_per_element * elements;
    work.seconds = limits.seconds + static_cast<double>(elements) / elements_per_second;
    return work;
}

// Of what the decoder left, which may be anything.
Result<DracoMesh> mesh_of(const Shared& shared, const DracoPromise& promise) {
    DracoMesh mesh;
    mesh.indices.assign(shared.indices, shared.indices + promise.indices);
    if (std::ranges::any_of(mesh.indices, [&](uint32_t i) { return i >= promise.vertices; }))
        return fail(Fault::format, "Draco refers to a vertex that is not there");
    const float* from = shared.values;
    for (const auto& attribute : promise.attributes) {
        const uint64_t count = attribute.components * promise.vertices;
        mesh.values.emplace_back(from, from + count);
        from += count;
    }
    return mesh;
}

}  // namespace

Result<DracoMesh> decode_draco(std::span<const unsigned char> bytes, const DracoPromise& promise,
                               const DracoLimits& limits) {
    const auto decoded = run_confined(work_of(promise, bytes.size(), limits), [&](std::span<std::byte> memory) {
        return decode_into(bytes, promise, shared_of(memory, promise));
    });
    if (!decoded) return tl::unexpected(decoded.error());
    return mesh_of(shared_of((*decoded)->bytes(), promise), promise);
}

Result<DracoMesh> decode_draco_here(std::span<const unsigned char> bytes, const DracoPromise& promise) {
    std::vector<std::byte> memory(4 * (promise.indices + values_of(promise)));
    const Shared shared = shared_of(memory, promise);
    if (const std::string wrong = decode_into(bytes, promise, shared); !wrong.empty())
        return fail(Fault::format, wrong);
    return mesh_of(shared, promise);
}

}  // namespace lodestone
