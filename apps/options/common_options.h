// What several subcommands have in common: options, their values, what is printed.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "mesh/io/write.h"

namespace lodestone {

// "1280x720" to two numbers of 1 .. 16384; Fault::usage otherwise.
Result<std::pair<uint32_t, uint32_t>> parse_size(const std::string& text);
// Comma-separated words; Fault::usage names `option` for an empty one.
Result<std::vector<std::string>> parse_list(const std::string& option, const std::string& text);

// --allow-outside, for the commands that read meshes or scenes.
void add_outside_option(CLI::App& command, bool& allow_outside);

// --prefix, for the commands that open assets.
void add_prefix_option(CLI::App& command, bool& prefix);

// What textures are written as, and how well.
struct TextureFormat {
    std::string name = "png";                  // or jpeg, webp
    int jpeg_quality = 92, webp_quality = 92;  // 1 .. 100

    // Puts them into the options of a writer of textures of at most so many texels a side. Fault::usage where the
    // format does not hold as many.
    Result<void> put(WriteOptions& write, uint32_t texels) const;
    // What of these images a file of that format will not hold, in one line; empty where it is nothing.
    std::string lost(std::span<const Image> images) const;
};
// --texture-format and its qualities; `format` must outlive the command.
void add_texture_options(CLI::App& command, TextureFormat& format);

// --encoding, for the commands that write GLB: plain, quantised or meshopt. Taken by write_options_of().
void add_encoding_option(CLI::App& command, std::string& encoding);
// encoding: as the option has it; other formats than .glb have only plain.
Result<WriteOptions> write_options_of(const std::string& encoding, const std::string& out);

// What --help ends with: the lines, under a heading.
std::string examples(const std::string& lines);

// Prints to stdout, with a newline.
void print_line(const std::string& text);
// A JSON document written whole or not at all.
Result<void> write_json(const std::string& path, const std::string& text);

}  // namespace lodestone
