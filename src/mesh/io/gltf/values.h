// What an accessor of a glTF file says, checked against what its buffers hold.
#pragma once

#include <tiny_gltf.h>

#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

// What is wrong with a glTF file, and where. Caught where the reading began.
struct GltfFault {
    std::string place, what;
    Fault fault = Fault::format;  // whose it is
};

// The bytes of a buffer view. Throws GltfFault where it, or its buffer, is not there, or it reaches past the buffer's
// end.
std::span<const unsigned char> bytes_of_view(const tinygltf::Model& model, int view, const std::string& name);

// The numbers of an accessor: `width` of them per element, as they are meant (normalised ones scaled, sparse ones put
// in place). Throws GltfFault, whose place is the accessor's name.
class GltfValues {
public:
    struct Accessor {
        int number = -1;             // in the model; -1: there is none, which is a fault
        std::string name;            // for errors
        uint64_t most_elements = 0;  // more are refused
    };
    GltfValues(const tinygltf::Model& model, const Accessor& accessor, int width);

    size_t size() const { return count_; }
    double operator()(size_t i, size_t k) const { return values_[i * static_cast<size_t>(width_) + k]; }

private:
    struct Elements;
    template <class Put>
    void load(const tinygltf::Model& model, const Elements& from, const Put& put);
    void load_dense(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element_bytes);
    void load_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor, size_t element_bytes);
    size_t component_size(int type) const;

    int width_;
    std::string name_;
    size_t count_ = 0;
    double scale_ = 1;
    std::vector<double> values_;
};

// An accessor that is used as whole numbers. Throws GltfFault where its components are others.
void check_index_type(int component_type, const std::string& name);

}  // namespace lodestone
