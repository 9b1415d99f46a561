#include "mesh/io/gltf/values.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

namespace lodestone {

namespace {

// What brings a normalised number to -1 .. 1.
double scale_of(int type) {
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

double number_at(const unsigned char* from, int type) {
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

// Bytes of everything the document brings along.
uint64_t bytes_of(const tinygltf::Model& model) {
    uint64_t bytes = 0;
    for (const tinygltf::Buffer& buffer : model.buffers) bytes += buffer.data.size();
    return bytes;
}

}  // namespace

std::span<const unsigned char> bytes_of_view(const tinygltf::Model& model, int number, const std::string& name) {
    if (number < 0 || static_cast<size_t>(number) >= model.bufferViews.size())
        throw GltfFault{name, "refers to a buffer view that is not there"};
    const tinygltf::BufferView& view = model.bufferViews[static_cast<size_t>(number)];
    if (view.buffer < 0 || static_cast<size_t>(view.buffer) >= model.buffers.size())
        throw GltfFault{name, "refers to a buffer that is not there"};
    const auto& bytes = model.buffers[static_cast<size_t>(view.buffer)].data;
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset)
        throw GltfFault{name, "reaches past the end of its buffer; the file is cut or its header is wrong"};
    return std::span(bytes).subspan(view.byteOffset, view.byteLength);
}

struct GltfValues::Elements {
    int view;
    size_t offset;  // bytes from the view's begin
    int type;       // of a component, TINYGLTF_COMPONENT_TYPE_...
    int stride;     // bytes; 0 or less where elements follow each other without gaps
    size_t bytes;   // of an element
    size_t count;
    int width;  // numbers wanted of each
};

GltfValues::GltfValues(const tinygltf::Model& model, const Accessor& of, int width) : width_(width), name_(of.name) {
    if (of.number < 0 || static_cast<size_t>(of.number) >= model.accessors.size())
        throw GltfFault{name_, "refers to an accessor that is not there"};
    const tinygltf::Accessor& accessor = model.accessors[static_cast<size_t>(of.number)];
    count_ = accessor.count;
    const int components = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type));
    if (components < width)
        throw GltfFault{name_, "has " + std::to_string(components) + " numbers per element; " + std::to_string(width) +
                                   " are needed"};
    if (count_ > of.most_elements)
        throw GltfFault{
            name_, "has " + std::to_string(count_) + " elements; the limit is " + std::to_string(of.most_elements)};
    scale_ = accessor.normalized ? scale_of(accessor.componentType) : 1;
    const size_t element_bytes = component_size(accessor.componentType) * static_cast<size_t>(components);
    if (accessor.bufferView >= 0) load_dense(model, accessor, element_bytes);
    if (accessor.sparse.isSparse) load_sparse(model, accessor, element_bytes);
    if (accessor.bufferView < 0 && !accessor.sparse.isSparse)
        throw GltfFault{name_, "has no data; its compression is not read"};
    if (accessor.normalized) {
        for (double& v : values_) v = std::max(v, -1.0);
    }
}

size_t GltfValues::component_size(int type) const {
    const int32_t size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(type));
    if (size <= 0) throw GltfFault{name_, "has an unknown component type"};
    return static_cast<size_t>(size);
}

// put(i, k, number) for the numbers of every element.
template <class Put>
void GltfValues::load(const tinygltf::Model& model, const Elements& from, const Put& put) {
    const std::span<const unsigned char> bytes = bytes_of_view(model, from.view, name_);
    const size_t step = from.stride > 0 ? static_cast<size_t>(from.stride) : from.bytes;
    const bool fits = from.count == 0 || (from.offset <= bytes.size() && from.bytes <= bytes.size() - from.offset &&
                                          (from.count - 1) <= (bytes.size() - from.offset - from.bytes) / step);
    if (!fits) throw GltfFault{name_, "reaches past the end of its buffer; the file is cut or its header is wrong"};
    if (values_.empty()) values_.assign(count_ * static_cast<size_t>(width_), 0);
    const unsigned char* base = bytes.data() + from.offset;
    const size_t size = component_size(from.type);
    for (size_t i = 0; i < from.count; ++i) {
        for (size_t k = 0; k < static_cast<size_t>(from.width); ++k)
            put(i, k, number_at(base + i * step + k * size, from.type));
    }
}

void GltfValues::load_dense(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element_bytes) {
    bytes_of_view(model, accessor.bufferView, name_);
    const int stride = accessor.ByteStride(model.bufferViews[static_cast<size_t>(accessor.bufferView)]);
    load(model,
         {accessor.bufferView, accessor.byteOffset, accessor.componentType, stride, element_bytes, count_, width_},
         [&](size_t i, size_t k, double value) { values_[i * static_cast<size_t>(width_) + k] = value * scale_; });
}

void GltfValues::load_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element_bytes) {
    // Without a view of its own an accessor is zeros, of which any number would fit in no bytes. A document that means
    // them refers to them, by other attributes or indices, and each takes a byte at least.
    if (accessor.bufferView < 0 && count_ > bytes_of(model)) {
        throw GltfFault{name_, "asks for " + std::to_string(count_) +
                                   " elements that are not stored; the limit is the " +
                                   std::to_string(bytes_of(model)) + " bytes of the file's buffers"};
    }
    if (values_.empty()) values_.assign(count_ * static_cast<size_t>(width_), 0);
    const auto& indices = accessor.sparse.indices;
    const auto& values = accessor.sparse.values;
    const auto count = static_cast<size_t>(std::max(accessor.sparse.count, 0));
    if (count > count_) throw GltfFault{name_, "has more sparse elements than elements"};
    check_index_type(indices.componentType, name_);
    std::vector<size_t> places(count);
    load(model,
         {indices.bufferView, static_cast<size_t>(indices.byteOffset), indices.componentType, 0,
          component_size(indices.componentType), count, 1},
         [&](size_t i, size_t, double value) {
             places[i] = static_cast<size_t>(value);
             if (places[i] >= count_) throw GltfFault{name_, "has a sparse index out of range"};
         });
    load(model,
         {values.bufferView, static_cast<size_t>(values.byteOffset), accessor.componentType, 0, element_bytes, count,
          width_},
         [&](size_t i, size_t k, double value) {
             values_[places[i] * static_cast<size_t>(width_) + k] = value * scale_;
         });
}

void check_index_type(int component_type, const std::string& name) {
    if (component_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
        component_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        component_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        throw GltfFault{name, "has indices that are no whole numbers"};
}

}  // namespace lodestone
