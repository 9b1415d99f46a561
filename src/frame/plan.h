// A frame as a value: what a backend wants done, in order. It can be compared, hashed, dumped, replayed and checked
// without a GPU.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/hash.h"

namespace lodestone {

// Commands run in the order of their stages, and within a stage in the order they are listed.
enum class Stage : uint8_t {
    update,     // uploads, copies and changes of size
    shadow,     // draws of shadow views
    depth,      // draws of cameras that decide what is seen
    effect,     // dispatches between the two; depths and shadow map can be read
    colour,     // draws that light what is seen
    composite,  // what is laid over it, dispatches and readbacks
};
inline constexpr int stage_count = 6;  // values of Stage
const char* name_of(Stage stage);      // as in Stage

// Bytes shared with the backend; never changed once a plan holds them.
class Blob {
public:
    Blob() = default;
    explicit Blob(std::vector<std::byte> bytes);  // takes them over
    // Bytes owned by something else, kept alive by `owner` (a mapped asset, say).
    Blob(std::shared_ptr<const void> owner, const std::byte* data, size_t size);
    // A copy of the values as they lie in memory.
    template <class T>
    static Blob copy_of(const T* values, size_t count) {
        const auto* bytes = reinterpret_cast<const std::byte*>(values);
        return Blob(std::vector<std::byte>(bytes, bytes + count * sizeof(T)));
    }
    const std::byte* data() const { return data_; }  // valid as long as a copy of this lives
    size_t size() const { return size_; }            // bytes
    bool operator==(const Blob& other) const;        // by content

private:
    std::shared_ptr<const void> owner_;
    const std::byte* data_ = nullptr;
    size_t size_ = 0;
};

// Buffer and pipeline numbers are positions in the recipe. Byte offsets and counts are multiples of 4.

// Bytes from the backend to a buffer; stage update only.
struct Upload {
    uint32_t buffer = 0;  // into Recipe::buffers
    uint64_t offset = 0;  // bytes into the buffer
    Blob blob;            // what is written
    bool operator==(const Upload&) const = default;
};

// Bytes from buffer to buffer; stage update only. The two ranges do not overlap.
struct Copy {
    uint32_t source = 0, destination = 0;  // into Recipe::buffers
    // Offsets into the two buffers, and how much; bytes.
    uint64_t source_offset = 0, destination_offset = 0, bytes = 0;
    bool operator==(const Copy&) const = default;
};

// 32-bit words for the pipeline's shaders, after the renderer's own (shaders/shared/draw_constants.h).
using Words = std::array<uint32_t, 8>;

inline constexpr uint32_t no_buffer = ~0u;  // in place of a buffer number where there is none
// Gives a buffer another size, up to BufferSpec::most_bytes; stage update only. Frames under way go on reading the
// memory it had, which is freed once they have left the GPU.
struct Resize {
    uint32_t buffer = 0;  // into Recipe::buffers
    uint64_t bytes = 0;   // from now on; > 0, a multiple of the buffer's stride
    uint64_t kept = 0;    // the first bytes, which stay as they are; no more than either size. Of the rest nothing does
    bool operator==(const Resize&) const = default;
};

// Runs a compute pipeline.
struct Dispatch {
    uint32_t pipeline = 0;  // into Recipe::pipelines
    // Work groups in x, y and z, 0 .. 65535; ignored where `arguments` is given.
    std::array<uint32_t, 3> groups{1, 1, 1};
    uint32_t view = 0;  // into FrameInput::views
    Words words{};      // for its shader
    // Buffer that holds the numbers of groups (VkDispatchIndirectCommand: three words, 0 .. 65535 each), if given. They
    // are read before the pipeline runs, so it may write the buffer itself.
    uint32_t arguments = no_buffer;
    uint64_t offset = 0;  // bytes to these words
    bool operator==(const Dispatch&) const = default;
};
inline constexpr uint32_t most_groups = 65535;  // of a dispatch, in each direction: what every device takes

// Draws triangles, or patches, in one view.
struct Draw {
    uint32_t pipeline = 0;               // into Recipe::pipelines
    uint32_t view = 0;                   // into FrameInput::views
    uint32_t vertex_buffer = no_buffer;  // needed iff the pipeline has a vertex layout
    uint32_t index_buffer = no_buffer;   // no_buffer: not indexed
    uint64_t vertex_offset = 0;          // bytes to vertex 0
    uint64_t index_offset = 0;           // bytes to the first index
    uint32_t first_vertex = 0;           // where not indexed
    uint32_t count = 0;                  // indices, or vertices where not indexed; 0 draws nothing
    uint32_t first_id = 0;               // Plan::instance_ids[first_id .. first_id + instances)
    uint32_t instances = 1;              // how many; 0 draws nothing
    Words words{};                       // for its shaders
    bool operator==(const Draw&) const = default;
};

// As Draw, with count, instances and the rest read from a buffer (VkDrawIndexedIndirectCommand or
// VkDrawIndirectCommand).
struct DrawIndirect {
    Draw draw;                          // count, first_vertex, first_id and instances are taken from the buffer
    uint32_t arguments = 0;             // buffer
    uint64_t offset = 0;                // bytes to the first argument record
    uint32_t draws = 1;                 // records at most
    uint32_t stride = 20;               // bytes from record to record
    uint32_t count_buffer = no_buffer;  // holds the number of records, if given
    uint64_t count_offset = 0;          // bytes to that number
    bool operator==(const DrawIndirect&) const = default;
};

// The bytes come back in FrameInput::readbacks once the frame has completed.
struct Readback {
    uint32_t buffer = 0;             // into Recipe::buffers
    uint64_t offset = 0, bytes = 0;  // which part of it, bytes
    uint32_t tag = 0;                // the backend's own
    bool operator==(const Readback&) const = default;
};

// One thing to be done.
struct Command {
    Stage stage = Stage::update;  // when
    // What; buffer and pipeline numbers are positions in the recipe.
    std::variant<Upload, Copy, Resize, Dispatch, Draw, DrawIndirect, Readback> what;
    bool operator==(const Command&) const = default;
};
// What a command draws by, whether its counts are known or on the device; null where it draws nothing.
inline const Draw* drawn_by(const Command& command) {
    const auto* indirect = std::get_if<DrawIndirect>(&command.what);
    return indirect != nullptr ? &indirect->draw : std::get_if<Draw>(&command.what);
}

// Bytes a backend wants read in the background; they come back as an Arrival with the same id.
struct PageRequest {
    uint64_t id = 0;                 // the backend's own; not in use by another request
    uint32_t asset = 0;              // into the assets given to open()
    std::string chunk;               // of the asset file
    uint64_t offset = 0, bytes = 0;  // which part of the chunk, bytes
    float priority = 0;              // larger is read sooner
    bool operator==(const PageRequest&) const = default;
};

// What a backend says of its plan.
struct PlanStats {
    uint64_t triangles = 0;         // in camera views, all instances; degenerate slots left out
    uint64_t uploaded_bytes = 0;    // by this plan
    uint64_t resident_bytes = 0;    // of all buffers of the recipe, with what frames under way read of their past sizes
    uint64_t index_bytes = 0;       // of those, index buffers
    uint32_t instances_drawn = 0;   // in views[0]
    uint32_t instances_culled = 0;  // not drawn in views[0]
    std::vector<std::pair<std::string, double>> more;  // the backend's own figures, by name
    bool operator==(const PlanStats&) const = default;
};

// What is to be done for one frame.
struct Plan {
    uint64_t generation = 0;             // of the recipe the numbers refer to
    std::vector<Command> commands;       // in any order of stages
    std::vector<uint32_t> instance_ids;  // numbers into FrameInput::instances that draws refer to
    std::vector<PageRequest> requests;   // to be read in the background; those of earlier plans still hold
    std::vector<std::string> warnings;   // for the user: what goes wrong without stopping anything, each said once
    PlanStats stats;                     // for reports; nothing depends on them
    bool operator==(const Plan&) const = default;
};

// Equal plans have equal hashes, also across runs and machines of one byte order.
Hash128 hash_of_plan(const Plan& plan);
// One line per command, for eyes and diffs.
std::string dump(const Plan& plan);

}  // namespace lodestone
