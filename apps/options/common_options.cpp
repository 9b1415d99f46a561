#include "apps/options/common_options.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>

#include "base/files/file.h"
#include "mesh/io/image_file.h"

namespace lodestone {

Result<std::pair<uint32_t, uint32_t>> parse_size(const std::string& text) {
    const size_t x = text.find('x');
    uint32_t width = 0, height = 0;
    const char* begin = text.data();
    const char* end = begin + text.size();
    const bool good = x != std::string::npos && std::from_chars(begin, begin + x, width).ptr == begin + x &&
                      std::from_chars(begin + x + 1, end, height).ptr == end && width >= 1 && height >= 1 &&
                      width <= 16384 && height <= 16384;
    if (!good) return fail(Fault::usage, "--size " + text + ": must be WIDTHxHEIGHT in pixels, each 1 to 16384");
    return std::pair{width, height};
}

Result<std::vector<std::string>> parse_list(const std::string& option, const std::string& text) {
    std::vector<std::string> words;
    size_t begin = 0;
    while (begin <= text.size()) {
        const size_t comma = std::min(text.find(',', begin), text.size());
        if (comma == begin)
            return fail(Fault::usage, option + " " + text + ": has an empty word; separate words by single commas");
        words.push_back(text.substr(begin, comma - begin));
        begin = comma + 1;
    }
    return words;
}

void add_outside_option(CLI::App& command, bool& allow_outside) {
    command.add_flag("--allow-outside", allow_outside,
                     "Also read files that the mesh or scene names outside its own folder, by an absolute path, by .. "
                     "or through a symbolic link");
}

void add_prefix_option(CLI::App& command, bool& prefix) {
    command.add_flag("--prefix", prefix,
                     "Open an asset whose end is missing: the levels of its progressive mesh that are there");
}

void add_encoding_option(CLI::App& command, std::string& encoding) {
    command
        .add_option("--encoding", encoding,
                    "Of vertices and triangles in a .glb: plain (floats), quantised (KHR_mesh_quantization) or meshopt "
                    "(quantised and EXT_meshopt_compression)")
        ->check(CLI::IsMember({"plain", "quantised", "meshopt"}))
        ->capture_default_str();
}

Result<WriteOptions> write_options_of(const std::string& encoding, const std::string& out) {
    if (auto good = check_write(out); !good) return tl::unexpected(good.error());
    WriteOptions options;
    if (encoding == "quantised") options.encoding = WriteOptions::Encoding::quantised;
    if (encoding == "meshopt") options.encoding = WriteOptions::Encoding::meshopt;
    if (options.encoding != WriteOptions::Encoding::plain && std::filesystem::path(out).extension() != ".glb")
        return fail(Fault::usage, "--encoding " + encoding + ": is for .glb; " + out + " is another format");
    return options;
}

Result<void> TextureFormat::put(WriteOptions& write, uint32_t texels) const {
    if (name == "webp" && texels > most_webp_side)
        return fail(Fault::usage, "--texture-format webp: WebP holds " + std::to_string(most_webp_side) +
                                      " texels a side; --resolution asks for " + std::to_string(texels));
    if (name == "jpeg") write.textures = WriteOptions::Textures::jpeg;
    if (name == "webp") write.textures = WriteOptions::Textures::webp;
    write.quality = name == "webp" ? webp_quality : jpeg_quality;
    return {};
}

std::string TextureFormat::lost(std::span<const Image> images) const {
    return name == "jpeg" && std::ranges::any_of(images, has_alpha)
               ? "JPEG holds no alpha; --texture-format png and webp do"
               : "";
}

void add_texture_options(CLI::App& command, TextureFormat& format) {
    command.add_option("--texture-format", format.name, "Of baked textures: png, jpeg or webp")
        ->check(CLI::IsMember({"png", "jpeg", "webp"}))
        ->capture_default_str();
    command.add_option("--jpeg-quality", format.jpeg_quality, "Of JPEG textures")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    command.add_option("--webp-quality", format.webp_quality, "Of WebP textures; 100 loses nothing")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
}

std::string examples(const std::string& lines) {
    std::string text = "Examples:\n  ";
    for (const char c : lines) text += c == '\n' ? std::string("\n  ") : std::string(1, c);
    return text;
}

void print_line(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fputc('\n', stdout);
}

Result<void> write_json(const std::string& path, const std::string& text) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(text + "\n"); !done) return done;
    return file->commit();
}

}  // namespace lodestone
