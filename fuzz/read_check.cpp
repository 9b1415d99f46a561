#include "fuzz/read_check.h"

#include <sanitizer/allocator_interface.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "fuzz/promise.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"

namespace lodestone::fuzz {

namespace {

namespace fs = std::filesystem;

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

// Watches memory and time of what is done while it lives.
class Watch {
public:
    Watch() {
        static const bool hooked = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free) != 0;
        if (!hooked) broken("the sanitizer tells of allocations");
        begin_ = g_bytes;
        g_most = begin_;
        seconds_ = cpu_seconds();
    }
    // 64 times the larger of what was given and what it became, and a second and one for each megabyte of it.
    // Sanitizers take about five times the time.
    void check(size_t bytes) const {
        const size_t counted = std::max(bytes, size_t{1} << 20);
        const auto used = static_cast<size_t>(g_most - begin_);
        if (used > 64 * counted) broken("memory: " + std::to_string(used) + " bytes of " + std::to_string(bytes));
        const double seconds = cpu_seconds() - seconds_;
        if (seconds > 1 + 5e-6 * static_cast<double>(bytes))
            broken("time: " + std::to_string(seconds) + " s for " + std::to_string(bytes) + " bytes");
    }

private:
    int64_t begin_;
    double seconds_;
};

const fs::path& folder() {
    static const fs::path made = [] {
        const fs::path memory = fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
        const fs::path path = memory / ("lodestone_fuzz_" + std::to_string(getpid()));
        fs::create_directories(path);
        std::atexit([] { fs::remove_all(folder()); });
        return path;
    }();
    return made;
}

void check_error(const Error& error) {
    if (error.message.empty()) broken("an error has a message");
    if (error.message.find('\n') != std::string::npos) broken("an error is one line: " + error.message);
}

size_t bytes_of(const TriMesh& mesh) {
    size_t bytes = mesh.positions.size() * sizeof(glm::vec3) + mesh.wedge_vertex.size() * 4 +
                   mesh.triangles.size() * sizeof(Triangle) + mesh.normals.size() * sizeof(glm::vec3) +
                   mesh.uvs.size() * sizeof(glm::vec2) + mesh.colours.size() * 4 + mesh.materials.size() * 2;
    for (const Image& image : mesh.images) bytes += image.texels.size() * 4;
    return bytes;
}

}  // namespace

Limits small_limits() {
    Limits limits;
    limits.vertices = limits.triangles = 1 << 20;
    limits.image_side = limits.height_side = 512;
    limits.unpacked_bytes = limits.library_bytes = 1 << 22;
    return limits;
}

void check_mesh(const std::vector<File>& files) {
    size_t bytes = 0;
    for (const File& file : files) {
        std::ofstream(folder() / file.name, std::ios::binary) << file.content;
        bytes += file.content.size();
    }
    ReadOptions options;
    options.limits = small_limits();
    const fs::path path = folder() / files.front().name;
    ReadReport report;
    const Watch watch;
    {
        const auto mesh = read_mesh(path, options, &report);
        if (mesh) {
            if (auto valid = mesh->validate(); !valid) broken("a mesh is valid: " + valid.error().message);
            if (mesh->positions.size() > options.limits.vertices) broken("limits hold");
            bytes = std::max(bytes, bytes_of(*mesh));
        } else {
            check_error(mesh.error());
        }
    }
    for (const std::string& line : report.warnings) {
        if (line.find('\n') != std::string::npos) broken("a warning is one line: " + line);
    }
    watch.check(bytes);
    for (const File& file : files) fs::remove(folder() / file.name);
}

void check_image(const uint8_t* data, size_t size) {
    const Watch watch;
    size_t bytes = size;
    {
        const uint32_t most_side = small_limits().image_side;
        const auto image = decode_image(std::as_bytes(std::span(data, size)), "image", most_side);
        if (image) {
            if (image->width == 0 || image->height == 0 || image->width > most_side || image->height > most_side ||
                image->texels.size() != size_t{image->width} * image->height)
                broken("an image is as large as it says");
            bytes = std::max(bytes, image->texels.size() * 4);
        } else {
            check_error(image.error());
        }
    }
    watch.check(bytes);
}

}  // namespace lodestone::fuzz
