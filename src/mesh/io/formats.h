// The rooms of the reader: one function per format. What they share: a file's bytes, where a fault is, and cutting
// polygons.
#pragma once

#include <cmath>
#include <filesystem>
#include <span>
#include <string>

#include "base/files/file.h"
#include "mesh/io/read.h"

namespace lodestone {

struct SourceFile {
    std::filesystem::path path;  // for files it refers to
    FileBytes content;           // gunzipped
    Limits limits;
    bool allow_outside = false;  // as ReadOptions
    bool only_names = false;     // only what files it refers to is wanted: none of them is decoded

    std::string_view text() const {
        return {reinterpret_cast<const char*>(content.bytes.data()), content.bytes.size()};
    }
    size_t size() const { return content.bytes.size(); }
    // "path: place: what"; what says what is wrong and what to do. An empty place is left out.
    tl::unexpected<Error> wrong(const std::string& place, const std::string& what, Fault fault = Fault::format) const {
        return fail(fault, path.string() + ": " + (place.empty() ? "" : place + ": ") + what);
    }
    tl::unexpected<Error> wrong_line(uint64_t line, const std::string& what) const {
        return wrong("line " + std::to_string(line), what);
    }
    // Where `number` things are more than the limit.
    Result<void> within(const std::string& what, uint64_t number, uint64_t limit) const {
        if (number <= limit) return {};
        return wrong("", over_limit(what, number, limit));
    }
    // A file it names, and a note of it in the report. max_bytes: unpacked. Errors as read_file's and path_named_by's,
    // without a path before them.
    Result<FileBytes> side_file(const std::string& name, uint64_t max_bytes, ReadReport& report) const;
    // Adds a warning, once.
    void warn(ReadReport& report, const std::string& line) const;
    // Decodes a texture; one of which a part is missing is a warning.
    Result<Image> decode_texture(std::span<const std::byte> bytes, const std::string& name, ReadReport& report) const;
    // Adds a texture to the mesh, unless there is none or it brings more texels than the limit. Returns its number.
    Result<int32_t> add_image(Result<Image> image, TriMesh& mesh) const;
};

// Null where faces have texture coordinates of their own: such a file is read whole.
Result<std::unique_ptr<MeshStream>> open_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<TriMesh> read_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<std::unique_ptr<MeshStream>> open_stl(const SourceFile& file, ReadReport& report);
Result<TriMesh> read_obj(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<TriMesh> read_off(const SourceFile& file, ReadReport& report);
Result<TriMesh> read_gltf(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<TriMesh> read_png_heights(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<TriMesh> read_geotiff(const SourceFile& file, const ReadOptions& options, ReadReport& report);

// Adds a polygon's fan from its first corner: right for convex polygons, as scanners and modellers export them.
inline void add_fan(std::vector<Triangle>& triangles, const std::vector<uint32_t>& corners, ReadReport& report) {
    if (corners.size() > 3) ++report.polygons;
    for (size_t k = 2; k < corners.size(); ++k) triangles.push_back({corners[0], corners[k - 1], corners[k]});
}

// The hash of a file and of those it refers to.
Hash128 hash_of_source(const SourceFile& file, const ReadReport& report);

// Fills report.side_files without reading more than that takes.
Result<void> name_files_of_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<void> name_files_of_obj(const SourceFile& file, const ReadOptions& options, ReadReport& report);
Result<void> name_files_of_gltf(const SourceFile& file, const ReadOptions& options, ReadReport& report);

// A texture the mesh refers to; a missing or unreadable one is a warning and -1.
int32_t load_texture(const SourceFile& file, const std::string& name, TriMesh& mesh, ReadReport& report);

inline bool finite(const glm::vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

}  // namespace lodestone
