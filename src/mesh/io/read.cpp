#include "mesh/io/read.h"

#include <algorithm>
#include <optional>

#include "base/text.h"
#include "mesh/io/formats.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

std::string lower_extension(fs::path path) {
    auto lower = [](std::string s) {
        std::transform(s.begin(), s.end(), s.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        return s;
    };
    if (lower(path.extension().string()) == ".gz") path = path.stem();
    return lower(path.extension().string());
}

// By content where it tells, by extension where it does not.
std::optional<MeshFormat> format_of(const SourceFile& file) {
    const std::string_view text = file.text();
    const auto begins = [&](std::string_view magic) { return text.substr(0, magic.size()) == magic; };
    if (begins("ply\n") || begins("ply\r")) return MeshFormat::ply;
    if (begins("glTF")) return MeshFormat::gltf;
    if (begins("\x89PNG")) return MeshFormat::png_heights;
    if (begins(std::string_view("II*\0", 4)) || begins(std::string_view("MM\0*", 4)) ||
        begins(std::string_view("II+\0", 4)) || begins(std::string_view("MM\0+", 4)))
        return MeshFormat::geotiff;
    static constexpr std::pair<const char*, MeshFormat> extensions[] = {
        {".ply", MeshFormat::ply},         {".obj", MeshFormat::obj},     {".stl", MeshFormat::stl},
        {".off", MeshFormat::off},         {".gltf", MeshFormat::gltf},   {".glb", MeshFormat::gltf},
        {".png", MeshFormat::png_heights}, {".tif", MeshFormat::geotiff}, {".tiff", MeshFormat::geotiff}};
    const std::string extension = lower_extension(file.path);
    for (const auto& [known, format] : extensions) {
        if (extension == known) return format;
    }
    const size_t first = text.find_first_not_of(" \t\r\n");
    if (first != std::string_view::npos && text[first] == '{') return MeshFormat::gltf;
    if (text.substr(0, 5) == "solid") return MeshFormat::stl;
    if (const size_t off = text.substr(0, 8).find("OFF"); off != std::string_view::npos) return MeshFormat::off;
    return std::nullopt;
}

Result<SourceFile> open_source(const fs::path& path) {
    auto content = read_file(path);
    if (!content) return tl::unexpected(content.error());
    SourceFile file{path, std::move(*content)};
    if (file.size() == 0) return file.wrong("", "is empty");
    return file;
}

Result<TriMesh> read_whole(const SourceFile& file, MeshFormat format, const ReadOptions& options, ReadReport& report) {
    const auto collected = [](Result<std::unique_ptr<MeshStream>> stream) -> Result<TriMesh> {
        if (!stream) return tl::unexpected(stream.error());
        return collect(**stream);
    };
    switch (format) {
        case MeshFormat::ply:
            return collected(open_ply(file, report));
        case MeshFormat::stl:
            return collected(open_stl(file, report));
        case MeshFormat::obj:
            return read_obj(file, options, report);
        case MeshFormat::off:
            return read_off(file, report);
        case MeshFormat::gltf:
            return read_gltf(file, options, report);
        case MeshFormat::png_heights:
            return read_png_heights(file, options, report);
        case MeshFormat::geotiff:
            return read_geotiff(file, options, report);
    }
    return file.wrong("", "is of no known format");
}

// A stream with what it refers to: its report where the caller gave none, or the whole mesh it hands out.
class HeldStream final : public MeshStream {
public:
    HeldStream() = default;
    Size size() const override { return stream->size(); }
    Result<bool> next(MeshBatch& batch, size_t max_items) override { return stream->next(batch, max_items); }
    const std::vector<Material>& material_table() const override { return stream->material_table(); }
    const std::vector<Image>& images() const override { return stream->images(); }

    ReadReport report;
    TriMesh mesh;
    std::unique_ptr<MeshStream> stream;
};

tl::unexpected<Error> unknown_format(const SourceFile& file) {
    return file.wrong("", "is of no known format; PLY, OBJ, STL, OFF, glTF, 16-bit PNG and GeoTIFF are read");
}

}  // namespace

const char* name_of(MeshFormat format) {
    switch (format) {
        case MeshFormat::ply:
            return "PLY";
        case MeshFormat::obj:
            return "OBJ";
        case MeshFormat::stl:
            return "STL";
        case MeshFormat::off:
            return "OFF";
        case MeshFormat::gltf:
            return "glTF";
        case MeshFormat::png_heights:
            return "PNG height map";
        case MeshFormat::geotiff:
            return "GeoTIFF height map";
    }
    return "?";
}

int32_t load_texture(const SourceFile& file, const std::string& name, TriMesh& mesh, ReadReport& report) {
    std::string portable = name;
    std::replace(portable.begin(), portable.end(), '\\', '/');
    auto image = read_image(file.path.parent_path() / portable);
    if (!image) {
        report.warnings.push_back("texture '" + name + "' cannot be read; its material keeps its plain colour");
        return -1;
    }
    mesh.images.push_back(std::move(*image));
    return static_cast<int32_t>(mesh.images.size()) - 1;
}

Result<TriMesh> read_mesh(const fs::path& path, const ReadOptions& options, ReadReport* report) {
    auto file = open_source(path);
    if (!file) return tl::unexpected(file.error());
    const auto format = format_of(*file);
    if (!format) return unknown_format(*file);
    ReadReport own;
    ReadReport& into = report != nullptr ? *report : own;
    into.format = *format;
    auto mesh = read_whole(*file, *format, options, into);
    if (!mesh) return mesh;
    for (Material& material : mesh->material_table) material.name = as_utf8(material.name);
    if (mesh->triangles.empty()) return file->wrong("", "has no triangles; there is nothing to read");
    if (auto valid = mesh->validate(); !valid) return file->wrong("", valid.error().message);
    return mesh;
}

Result<std::unique_ptr<MeshStream>> open_mesh_stream(const fs::path& path, const ReadOptions& options,
                                                     ReadReport* report) {
    auto file = open_source(path);
    if (!file) return tl::unexpected(file.error());
    const auto format = format_of(*file);
    if (!format) return unknown_format(*file);
    auto held = std::make_unique<HeldStream>();
    ReadReport& into = report != nullptr ? *report : held->report;
    into.format = *format;
    if (*format == MeshFormat::ply || *format == MeshFormat::stl) {
        auto stream = *format == MeshFormat::ply ? open_ply(*file, into) : open_stl(*file, into);
        if (!stream) return stream;
        held->stream = std::move(*stream);
    } else {
        auto mesh = read_whole(*file, *format, options, into);
        if (!mesh) return tl::unexpected(mesh.error());
        held->mesh = std::move(*mesh);
        held->stream = stream_of(held->mesh);
    }
    return held;
}

}  // namespace lodestone
