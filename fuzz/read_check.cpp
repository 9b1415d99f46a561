#include "fuzz/read_check.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fuzz/promise.h"
#include "fuzz/watch.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"

namespace lodestone::fuzz {

namespace {

namespace fs = std::filesystem;

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

// What a mesh is made from is the same, told with reading it and without.
void check_source(const fs::path& path, const ReadOptions& options, const Hash128& source) {
    const auto hash = hash_of_source(path, options);
    require_good(hash, "a mesh that can be read has a hash");
    require(*hash == source, "the hash of a source is the same with reading it");
}

// By pieces a mesh has the same triangles, and is refused where it is whole, unless it has none.
void check_stream(const fs::path& path, const ReadOptions& options, bool good, uint64_t triangles) {
    const Watch watch;
    uint64_t met = 0;
    const auto read_pieces = [&]() -> Result<void> {
        auto stream = open_mesh_stream(path, options);
        if (!stream) return tl::unexpected(stream.error());
        MeshBatch batch;
        for (;;) {
            auto more = (*stream)->next(batch, 100);
            if (!more) return tl::unexpected(more.error());
            if (!*more) return {};
            met += batch.triangles.size();
        }
    };
    const auto done = read_pieces();
    if (!done) check_error(done.error());
    require(done.has_value() == good || (done && met == 0), "a mesh is read by pieces where it is read whole");
    require(!good || met == triangles, "pieces have all triangles");
    watch.check(fs::file_size(path) + met * sizeof(Triangle));
}

void check_nodes(const fs::path& path, const ReadOptions& options) {
    const auto placed = read_gltf_nodes(path, options);
    if (!placed) {
        check_error(placed.error());
    } else if (!placed->empty()) {
        ReadOptions one = options;
        one.gltf_mesh = static_cast<int>(placed->front().mesh);
        if (const auto mesh = read_mesh(path, one)) require_good(mesh->validate(), "a mesh by itself is valid");
    }
}

}  // namespace

Limits small_limits() {
    Limits limits;
    limits.vertices = limits.triangles = 1 << 20;
    limits.image_side = limits.height_side = 512;
    limits.unpacked_bytes = limits.library_bytes = 1 << 22;
    return limits;
}

void check_mesh(const std::vector<File>& files, ReadOptions options) {
    size_t bytes = 0;
    for (const File& file : files) {
        std::ofstream(folder() / file.name, std::ios::binary) << file.content;
        bytes += file.content.size();
    }
    options.limits = small_limits();
    options.hash_source = true;
    const fs::path path = folder() / files.front().name;
    ReadReport report;
    uint64_t triangles = 0;
    bool good = false;
    const Watch watch;
    {
        const auto mesh = read_mesh(path, options, &report);
        good = mesh.has_value();
        if (good) {
            if (auto valid = mesh->validate(); !valid) broken("a mesh is valid: " + valid.error().message);
            if (mesh->positions.size() > options.limits.vertices) broken("limits hold");
            bytes = std::max(bytes, bytes_of(*mesh));
            triangles = mesh->triangle_count();
        } else {
            check_error(mesh.error());
        }
    }
    for (const std::string& line : report.warnings) {
        if (line.find('\n') != std::string::npos) broken("a warning is one line: " + line);
    }
    watch.check(bytes);
    if (good) check_source(path, options, report.source);
    if (report.format == MeshFormat::ply || report.format == MeshFormat::stl)
        check_stream(path, options, good, triangles);
    if (report.format == MeshFormat::gltf) check_nodes(path, options);
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
