#include "mesh/io/compressed/meshopt.h"

#include <meshoptimizer.h>

namespace lodestone {

namespace {

// What is wrong with it, or nothing. What is right here the decoders take whatever the bytes are.
std::string fault_of(const MeshoptView& view, uint64_t most_bytes) {
    const uint64_t stride = view.stride;
    if (view.mode == "ATTRIBUTES") {
        if (stride == 0 || stride > 256 || stride % 4 != 0) return "has a stride that is no multiple of 4 up to 256";
    } else if (view.mode == "TRIANGLES" || view.mode == "INDICES") {
        if (stride != 2 && stride != 4) return "has indices that are neither of 2 nor of 4 bytes";
        if (view.mode == "TRIANGLES" && view.count % 3 != 0) return "has triangles with a corner missing";
    } else {
        return "has the mode '" + view.mode.substr(0, 40) + "', which is not known";
    }
    if (view.count > most_bytes / stride)
        return "unpacks to " + std::to_string(view.count) + " elements of " + std::to_string(stride) +
               " bytes; the limit is " + std::to_string(most_bytes) + " bytes";
    if (view.filter.empty() || view.filter == "NONE") return {};
    if (view.mode != "ATTRIBUTES") return "has a filter, which indices cannot have";
    if (view.filter == "OCTAHEDRAL") return stride == 4 || stride == 8 ? "" : "has a filter for strides of 4 and 8";
    if (view.filter == "QUATERNION") return stride == 8 ? "" : "has a filter for strides of 8";
    if (view.filter == "EXPONENTIAL") return {};
    return "has the filter '" + view.filter.substr(0, 40) + "', which is not known";
}

int decode(std::span<const unsigned char> bytes, const MeshoptView& view, std::vector<unsigned char>& into) {
    if (view.mode == "ATTRIBUTES")
        return meshopt_decodeVertexBuffer(into.data(), view.count, view.stride, bytes.data(), bytes.size());
    if (view.mode == "TRIANGLES")
        return meshopt_decodeIndexBuffer(into.data(), view.count, view.stride, bytes.data(), bytes.size());
    return meshopt_decodeIndexSequence(into.data(), view.count, view.stride, bytes.data(), bytes.size());
}

}  // namespace

Result<std::vector<unsigned char>> decode_meshopt(std::span<const unsigned char> bytes, const MeshoptView& view,
                                                  uint64_t most_bytes) {
    if (const std::string wrong = fault_of(view, most_bytes); !wrong.empty()) return fail(Fault::format, wrong);
    // A stream says what it is in its first byte, whose low half is the version of the codec.
    const unsigned char kind = view.mode == "ATTRIBUTES" ? 0xa0 : view.mode == "TRIANGLES" ? 0xe0 : 0xd0;
    if (bytes.empty() || (bytes[0] & 0xf0) != kind) return fail(Fault::format, "does not hold what its mode says");
    const unsigned char newest = view.mode == "ATTRIBUTES" ? 0 : 1;
    if ((bytes[0] & 0x0f) > newest)
        return fail(Fault::format,
                    "is of a newer version of the codec than is read; compress it with an older gltfpack");
    if (!meshopt_may_hold(bytes.size(), view.count * view.stride))
        return fail(Fault::format, "promises more than its bytes can hold; the file is damaged");
    std::vector<unsigned char> unpacked(view.count * view.stride);
    if (view.count == 0) return unpacked;
    if (decode(bytes, view, unpacked) != 0) return fail(Fault::format, "cannot be unpacked; the file is damaged");
    if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(unpacked.data(), view.count, view.stride);
    if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(unpacked.data(), view.count, view.stride);
    if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(unpacked.data(), view.count, view.stride);
    return unpacked;
}

}  // namespace lodestone
