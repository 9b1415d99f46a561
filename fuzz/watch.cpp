#include "fuzz/watch.h"

#include <sanitizer/allocator_interface.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <string>

#include "fuzz/promise.h"

namespace lodestone::fuzz {

namespace {

// Live and most bytes of all allocations.
std::atomic<int64_t> g_bytes{0}, g_most{0};

void on_malloc(const volatile void* block, size_t size) {
    if (block == nullptr) return;
    const int64_t now = g_bytes += static_cast<int64_t>(size);
    for (int64_t most = g_most; now > most && !g_most.compare_exchange_weak(most, now);) {}
}
void on_free(const volatile void* block) {
    if (block != nullptr)
        g_bytes -= static_cast<int64_t>(__sanitizer_get_allocated_size(const_cast<const void*>(block)));
}

double cpu_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Watch::Watch() {
    static const bool hooked = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free) != 0;
    if (!hooked) broken("the sanitizer tells of allocations");
    begin_ = g_bytes;
    g_most = begin_;
    seconds_ = cpu_seconds();
}

void Watch::check(size_t bytes) const {
    constexpr size_t least_counted = size_t{1} << 20, most_times = 64;
    constexpr double sanitizer_factor = 5, least_seconds = 0.2, seconds_per_byte = 1e-6;
    const auto used = static_cast<size_t>(g_most - begin_);
    if (used > most_times * std::max(bytes, least_counted))
        broken("memory: " + std::to_string(used) + " bytes of " + std::to_string(bytes));
    const double seconds = cpu_seconds() - seconds_;
    if (seconds > sanitizer_factor * (least_seconds + seconds_per_byte * static_cast<double>(bytes)))
        broken("time: " + std::to_string(seconds) + " s for " + std::to_string(bytes) + " bytes");
}

size_t bytes_of(const TriMesh& mesh) {
    size_t bytes = mesh.positions.size() * sizeof(glm::vec3) + mesh.wedge_vertex.size() * 4 +
                   mesh.triangles.size() * sizeof(Triangle);
    for_attributes([&](const auto& values) { bytes += values.size() * sizeof values[0]; }, mesh);
    for (const Image& image : mesh.images) bytes += image.texels.size() * 4;
    return bytes;
}

}  // namespace lodestone::fuzz
