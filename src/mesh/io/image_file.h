// PNG and JPEG images.
#pragma once

#include <filesystem>
#include <span>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Decodes PNG (any kind, to 8 bits) or JPEG, told by content. `name` is only for messages. Images past 16384 texels a
// side are refused.
Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& name);
Result<Image> read_image(const std::filesystem::path& path);

// 8-bit RGBA PNG, the same bytes for the same texels.
Result<std::vector<std::byte>> encode_png(const Image& image);
// Baseline JPEG without alpha; quality 1 .. 100.
Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality);
Result<void> write_png(const Image& image, const std::filesystem::path& path);

}  // namespace lodestone
