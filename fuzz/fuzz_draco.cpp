// What the process that decodes Draco does (mesh/io/compressed/draco.h), in the driver's own, under a limit of memory
// as that process has one. An input is what a file promises: vertices and triangles, two bytes each, the number of
// attributes, a byte for each; then the compressed mesh.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <span>

#include <sanitizer/allocator_interface.h>

#include "fuzz/promise.h"
#include "mesh/io/compressed/draco.h"

namespace {

// Of what is allocated by operator new: Draco has all its memory by it.
constexpr size_t no_limit = ~size_t{0};
size_t g_limit = no_limit, g_taken = 0;

void* try_take(size_t bytes) noexcept {
    if (bytes > g_limit || g_taken > g_limit - bytes) return nullptr;
    void* block = std::malloc(bytes > 0 ? bytes : 1);
    if (block != nullptr) g_taken += __sanitizer_get_allocated_size(block);
    return block;
}
void* take(size_t bytes) {
    void* block = try_take(bytes);
    if (block == nullptr) throw std::bad_alloc();
    return block;
}
void give_back(void* block) noexcept {
    if (block == nullptr) return;
    g_taken -= __sanitizer_get_allocated_size(block);
    std::free(block);
}

// While it lives, no more than so many bytes besides what there is.
struct Limited {
    explicit Limited(size_t bytes) { g_limit = g_taken + bytes; }
    ~Limited() { g_limit = no_limit; }
    Limited(const Limited&) = delete;
    Limited& operator=(const Limited&) = delete;
};

}  // namespace

void* operator new(size_t bytes) { return take(bytes); }
void* operator new[](size_t bytes) { return take(bytes); }
void* operator new(size_t bytes, const std::nothrow_t&) noexcept { return try_take(bytes); }
void* operator new[](size_t bytes, const std::nothrow_t&) noexcept { return try_take(bytes); }
void operator delete(void* block) noexcept { give_back(block); }
void operator delete[](void* block) noexcept { give_back(block); }
void operator delete(void* block, size_t) noexcept { give_back(block); }
void operator delete[](void* block, size_t) noexcept { give_back(block); }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace lodestone;
    if (size < 5) return 0;
    DracoPromise promise;
    promise.vertices = static_cast<uint64_t>(data[0] | data[1] << 8);
    promise.indices = 3 * static_cast<uint64_t>(data[2] | data[3] << 8);
    const size_t attributes = std::min<size_t>(data[4] & 7, size - 5);
    for (size_t i = 0; i < attributes; ++i) {
        const uint8_t of = data[5 + i];
        promise.attributes.push_back({of & 15u, 1 + (of >> 4 & 3u), (of & 64) != 0});
    }
    constexpr size_t most_bytes = size_t{64} << 20;
    try {
        const Limited limited(most_bytes);
        const auto mesh = decode_draco_here(std::span(data, size).subspan(5 + attributes), promise);
        if (!mesh) {
            fuzz::check_error(mesh.error());
            return 0;
        }
        fuzz::require(mesh->indices.size() == promise.indices, "as many indices as the file says");
        fuzz::require(std::ranges::all_of(mesh->indices, [&](uint32_t i) { return i < promise.vertices; }),
                      "indices are of vertices that are there");
        fuzz::require(mesh->values.size() == attributes, "as many attributes as are asked for");
        for (size_t i = 0; i < attributes; ++i)
            fuzz::require(mesh->values[i].size() == promise.attributes[i].components * promise.vertices,
                          "as many values as the file says");
    } catch (const std::bad_alloc&) {}  // is told as what is wrong with the file
    return 0;
}
