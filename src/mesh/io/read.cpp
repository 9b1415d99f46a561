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

struct OpenedSource {
    SourceFile file;
    MeshFormat format;
};

Result<OpenedSource> open_source(const fs::path& path, const ReadOptions& options, ReadReport& report) {
    auto content = read_file(path, options.limits.unpacked_bytes);
    if (!content) return tl::unexpected(content.error());
    SourceFile file{path, std::move(*content), options.limits, options.allow_outside, false};
    if (file.size() == 0) return file.wrong("", "is empty");
    const auto format = format_of(file);
    if (!format) {
        return file.wrong("", "is of no known format; PLY, OBJ, STL, OFF, glTF, 16-bit PNG and GeoTIFF are read");
    }
    report.format = *format;
    return OpenedSource{std::move(file), *format};
}

Result<TriMesh> read_whole(const SourceFile& file, MeshFormat format, const ReadOptions& options, ReadReport& report) {
    const auto collected = [](Result<std::unique_ptr<MeshStream>> stream) -> Result<TriMesh> {
        if (!stream) return tl::unexpected(stream.error());
        return collect(**stream);
    };
    switch (format) {
        case MeshFormat::ply:
            return read_ply(file, options, report);
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
    Result<bool> next(MeshBatch& batch, size_t max_items) override {
        auto more = stream->next(batch, max_items);
        if (auto whole = source.content.intact(); !whole) return tl::unexpected(whole.error());
        if (!more) return more;
        triangles += batch.triangles.size();
        if (auto done = source.within("triangles", triangles, source.limits.triangles); !done)
            return tl::unexpected(done.error());
        return more;
    }
    const std::vector<Material>& material_table() const override { return stream->material_table(); }
    const std::vector<Image>& images() const override { return stream->images(); }

    ReadReport report;
    SourceFile source;
    uint64_t triangles = 0;  // handed out
    TriMesh mesh;
    std::unique_ptr<MeshStream> stream;
};

// What readers leave to the door: what holds for every format.
Result<void> check_read(const SourceFile& file, const ReadOptions& options, TriMesh& mesh, ReadReport& report) {
    for (Material& material : mesh.material_table) material.name = as_utf8(material.name);
    for (std::string& line : report.warnings) line = as_utf8(line);
    if (mesh.triangles.empty()) return file.wrong("", "has no triangles; there is nothing to read");
    const Limits& limits = options.limits;
    for (const auto& [what, number, limit] :
         {std::tuple("vertices", uint64_t{mesh.positions.size()}, limits.vertices),
          std::tuple("wedges", uint64_t{mesh.wedge_vertex.size()}, limits.vertices),
          std::tuple("triangles", uint64_t{mesh.triangles.size()}, limits.triangles)}) {
        if (auto done = file.within(what, number, limit); !done) return done;
    }
    if (auto valid = mesh.validate(); !valid) return file.wrong("", valid.error().message);
    return {};
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

void SourceFile::warn(ReadReport& report, const std::string& line) const {
    if (report.warnings.size() > limits.warnings || std::ranges::count(report.warnings, line) > 0) return;
    report.warnings.push_back(report.warnings.size() < limits.warnings ? line : "there is more to warn of");
}

Result<Image> SourceFile::decode_texture(std::span<const std::byte> bytes, const std::string& name,
                                         ReadReport& report) const {
    std::string damage;
    auto image = decode_image(bytes, name, limits.image_side, &damage);
    if (!damage.empty()) warn(report, "texture '" + name + "' is damaged (" + damage + "); what it lacks is grey");
    return image;
}

Result<int32_t> SourceFile::add_image(Result<Image> image, TriMesh& mesh) const {
    if (!image) return tl::unexpected(image.error());
    uint64_t texels = image->texels.size();
    for (const Image& other : mesh.images) texels += other.texels.size();
    if (texels > limits.texels)
        return fail(Fault::format, "with it the mesh " + over_limit("texels", texels, limits.texels));
    mesh.images.push_back(std::move(*image));
    return static_cast<int32_t>(mesh.images.size()) - 1;
}

Result<FileBytes> SourceFile::side_file(const std::string& name, uint64_t max_bytes, ReadReport& report) const {
    const auto without_place = [](const fs::path& place, const Error& error) {
        const std::string begin = place.string() + ": ";
        const bool has = error.message.compare(0, begin.size(), begin) == 0;
        return fail(error.fault, has ? error.message.substr(begin.size()) : error.message);
    };
    const auto read = [&]() -> Result<FileBytes> {
        auto named = path_named_by(path, name, allow_outside);
        if (!named) return without_place(path, named.error());
        auto bytes = read_file(*named, max_bytes);
        return bytes ? std::move(bytes) : without_place(*named, bytes.error());
    };
    const auto [known, fresh] = report.side_files.try_emplace(name);
    if (report.side_files.size() > limits.side_files) {
        report.side_files.erase(known);
        return fail(Fault::format, over_limit("files that it names", limits.side_files + 1, limits.side_files));
    }
    auto stored = read();
    if (fresh && stored) known->second = hash_bytes(stored->file->bytes());
    if (!stored && stored.error().fault == Fault::machine)
        report.machine_fault = Error{Fault::machine, path.string() + ": '" + name + "': " + stored.error().message};
    return stored;
}

Hash128 hash_of_source(const SourceFile& file, const ReadReport& report) {
    const Hash128 own = hash_bytes(file.content.file->bytes());
    if (report.side_files.empty()) return own;
    std::string text = own.hex();
    for (const auto& [name, content] : report.side_files)
        text += "\n" + std::to_string(name.size()) + " " + name + " " + (content ? content->hex() : "is not there");
    return hash_of(std::span<const char>(text));
}

Result<Hash128> hash_of_source(const fs::path& path, const ReadOptions& options, ReadReport* told) {
    ReadReport own;
    ReadReport& report = told != nullptr ? *told : own;
    auto source = open_source(path, options, report);
    if (!source) return tl::unexpected(source.error());
    source->file.only_names = true;
    Result<void> named;
    if (source->format == MeshFormat::ply) named = name_files_of_ply(source->file, options, report);
    if (source->format == MeshFormat::obj) named = name_files_of_obj(source->file, options, report);
    if (source->format == MeshFormat::gltf) named = name_files_of_gltf(source->file, options, report);
    const Hash128 hash = hash_of_source(source->file, report);
    if (auto whole = source->file.content.intact(); !whole) return tl::unexpected(whole.error());
    if (report.machine_fault) return tl::unexpected(*report.machine_fault);
    if (!named) return tl::unexpected(named.error());
    return hash;
}

int32_t load_texture(const SourceFile& file, const std::string& name, TriMesh& mesh, ReadReport& report) {
    std::string portable = name;
    std::replace(portable.begin(), portable.end(), '\\', '/');
    const auto load = [&]() -> Result<int32_t> {
        auto bytes = file.side_file(portable, file.limits.unpacked_bytes, report);
        if (!bytes) return tl::unexpected(bytes.error());
        if (file.only_names) return -1;
        auto image = file.decode_texture(bytes->bytes, name, report);
        if (auto whole = bytes->intact(); !whole) return tl::unexpected(whole.error());
        return file.add_image(std::move(image), mesh);
    };
    const auto number = load();
    if (number) return *number;
    file.warn(report, "texture '" + name + "' cannot be read (" + number.error().message +
                          "); its material keeps its plain colour");
    return -1;
}

Result<TriMesh> read_mesh(const fs::path& path, const ReadOptions& options, ReadReport* report) {
    ReadReport own;
    ReadReport& into = report != nullptr ? *report : own;
    auto source = open_source(path, options, into);
    if (!source) return tl::unexpected(source.error());
    const SourceFile& file = source->file;
    auto mesh = read_whole(file, source->format, options, into);
    if (mesh && options.hash_source) into.source = hash_of_source(file, into);
    // What is wrong may be so because the file was not whole.
    if (auto whole = file.content.intact(); !whole) return tl::unexpected(whole.error());
    if (into.machine_fault) return tl::unexpected(*into.machine_fault);
    if (!mesh) return mesh;
    if (auto done = check_read(file, options, *mesh, into); !done) return tl::unexpected(done.error());
    return mesh;
}

Result<std::unique_ptr<MeshStream>> open_mesh_stream(const fs::path& path, const ReadOptions& options,
                                                     ReadReport* report) {
    auto held = std::make_unique<HeldStream>();
    ReadReport& into = report != nullptr ? *report : held->report;
    auto source = open_source(path, options, into);
    if (!source) return tl::unexpected(source.error());
    held->source = source->file;
    if (source->format == MeshFormat::ply || source->format == MeshFormat::stl) {
        auto stream =
            source->format == MeshFormat::ply ? open_ply(source->file, options, into) : open_stl(source->file, into);
        if (!stream) return stream;
        held->stream = std::move(*stream);
    }
    if (held->stream == nullptr) {
        auto mesh = read_mesh(path, options, &into);
        if (!mesh) return tl::unexpected(mesh.error());
        held->mesh = std::move(*mesh);
        held->stream = stream_of(held->mesh);
    }
    return held;
}

}  // namespace lodestone
