// PNG, JPEG and WebP images.
#pragma once

#include <filesystem>
#include <span>

#include "base/result.h"
#include "mesh/limits.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Decodes PNG (any kind, to 8 bits), JPEG or WebP (one picture), told by content. Numbers are taken as they are,
// whatever the file says of gamma or colour space. `name` is only for messages. Images of more than most_side texels
// along a side are refused, likewise what promises more texels than so many bytes can hold.
// damage: takes why texels may be missing, where they are and the rest is worth having: JPEG, which is grey there.
// Null: not told.
Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& name,
                           uint32_t most_side = Limits{}.image_side, std::string* damage = nullptr);
// Whether a PNG has as many bytes as what its header promises takes at least: asked before room is made for it.
bool png_may_be_whole(std::span<const std::byte> png);
// Whether anything of it is seen through.
bool has_alpha(const Image& image);
Result<Image> read_image(const std::filesystem::path& path);

// 8-bit RGBA PNG, the same bytes for the same texels.
Result<std::vector<std::byte>> encode_png(const Image& image);
// Baseline JPEG without alpha; quality 1 .. 100.
Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality);
inline constexpr uint32_t most_webp_side = 16383;  // texels
// WebP with alpha; quality 1 .. 100, of which 100 is lossless, also where nothing is seen. Fault::usage where a side is
// longer than WebP has it.
Result<std::vector<std::byte>> encode_webp(const Image& image, int quality);
Result<void> write_png(const Image& image, const std::filesystem::path& path);

}  // namespace lodestone
