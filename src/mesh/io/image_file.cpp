#include "mesh/io/image_file.h"

#include <cstdio>
// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>
// jerror.h needs jpeglib.h before it.
#include <jerror.h>
#include <png.h>
#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "base/files/file.h"

namespace lodestone {

namespace {

tl::unexpected<Error> wrong(const std::string& name, const std::string& what) {
    return fail(Fault::format, name + ": " + what + "; give a PNG, JPEG or WebP image");
}

std::string wrong_size(uint64_t width, uint64_t height, uint32_t most_side) {
    return "is " + std::to_string(width) + "x" + std::to_string(height) + " texels; the limit is 1 to " +
           std::to_string(most_side) + " a side";
}

// The PNG without what says what its numbers stand for (gAMA and others): they are taken as they are.
std::vector<std::byte> without_colour_space(std::span<const std::byte> png) {
    constexpr size_t signature = 8, around = 12;  // length, type and sum of a chunk
    constexpr std::array<std::string_view, 4> dropped = {"gAMA", "cHRM", "iCCP", "sRGB"};
    std::vector<std::byte> kept(png.begin(), png.begin() + static_cast<ptrdiff_t>(std::min(png.size(), signature)));
    for (size_t at = signature; at < png.size();) {
        const auto rest = png.subspan(at);
        size_t bytes = rest.size();  // what is no chunk stays as it is
        std::string_view type;
        if (bytes >= around) {
            uint32_t length = 0;
            for (size_t k = 0; k < 4; ++k) length = length << 8 | std::to_integer<uint32_t>(rest[k]);
            bytes = std::min<size_t>(bytes, size_t{length} + around);
            type = {reinterpret_cast<const char*>(rest.data()) + 4, 4};
        }
        if (std::ranges::find(dropped, type) == dropped.end())
            kept.insert(kept.end(), rest.begin(), rest.begin() + static_cast<ptrdiff_t>(bytes));
        at += bytes;
    }
    return kept;
}

Result<Image> decode_png(std::span<const std::byte> file, const std::string& name, uint32_t most_side) {
    const std::vector<std::byte> bytes = without_colour_space(file);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0)
        return wrong(name, std::string("PNG: ") + png.message);
    const bool fits = png.width > 0 && png.height > 0 && png.width <= most_side && png.height <= most_side;
    if (!fits || !png_may_be_whole(bytes)) {
        png_image_free(&png);
        return wrong(name, fits ? "PNG: the file is cut" : wrong_size(png.width, png.height, most_side));
    }
    png.format = PNG_FORMAT_RGBA;
    png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // numbers of 16 bits are no others than those of 8
    Image image{png.width, png.height, {}};
    image.texels.resize(size_t{png.width} * png.height);
    if (png_image_finish_read(&png, nullptr, image.texels.data(), 0, nullptr) == 0)
        return wrong(name, std::string("PNG: ") + png.message);
    return image;
}

bool is_webp(std::span<const std::byte> bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
           std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

constexpr int webp_lossy = 1;  // WebPBitstreamFeatures::format

// Whether so many bytes may be a lossy WebP of that size: how a square of 16 texels is predicted takes 1.6 bits at
// least, by the probabilities of VP8 (RFC 6386, section 11.2). Lossless WebP has no such bound: what is of one colour
// takes no bits.
bool webp_may_hold(size_t bytes, uint64_t width, uint64_t height) {
    return (width + 15) / 16 * ((height + 15) / 16) / 8 <= bytes;
}

Result<Image> decode_webp(std::span<const std::byte> bytes, const std::string& name, uint32_t most_side) {
    const auto* first = reinterpret_cast<const uint8_t*>(bytes.data());
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(first, bytes.size(), &features) != VP8_STATUS_OK)
        return wrong(name, "WebP: the header cannot be read");
    if (features.has_animation != 0) return wrong(name, "WebP: is animated");
    const auto width = static_cast<uint32_t>(std::max(features.width, 0)),
               height = static_cast<uint32_t>(std::max(features.height, 0));
    if (width == 0 || height == 0 || width > most_side || height > most_side)
        return wrong(name, wrong_size(width, height, most_side));
    if (features.format == webp_lossy && !webp_may_hold(bytes.size(), width, height))
        return wrong(name, "WebP: promises more than its bytes can hold; the file is cut or damaged");
    Image image{width, height, {}};
    image.texels.resize(size_t{width} * height);
    const size_t size = image.texels.size() * 4;
    if (WebPDecodeRGBAInto(first, bytes.size(), reinterpret_cast<uint8_t*>(image.texels.data()), size,
                           static_cast<int>(width * 4)) == nullptr)
        return wrong(name, "WebP: the file is cut or damaged");
    return image;
}

struct JpegError {
    jpeg_error_mgr base;
    std::jmp_buf jump;
    char message[JMSG_LENGTH_MAX];
    char damage[JMSG_LENGTH_MAX];  // the first thing that was wrong and did not end the decoding; empty for none
    jpeg_progress_mgr progress;
    uint32_t most_side;
};

void on_jpeg_error(j_common_ptr info) {
    auto* error = reinterpret_cast<JpegError*>(info->err);
    error->base.format_message(info, error->message);
    std::longjmp(error->jump, 1);
}
void on_jpeg_message(j_common_ptr) {}
// level: below 0 for what is wrong, above for what is told of the file.
void on_jpeg_warning(j_common_ptr info, int level) {
    if (level >= 0) return;
    auto* error = reinterpret_cast<JpegError*>(info->err);
    const int code = error->base.msg_code;
    const bool harmless = code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR || code == JWRN_TOO_MUCH_DATA;
    if (!harmless && error->base.num_warnings++ == 0) error->base.format_message(info, error->damage);
}

// Every scan of a progressive JPEG goes over the whole image, and takes a few bytes of the file at least. Encoders
// write about ten.
constexpr int most_jpeg_scans = 100;

void on_jpeg_progress(j_common_ptr info) {
    if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= most_jpeg_scans) return;
    auto* error = reinterpret_cast<JpegError*>(info->err);
    std::snprintf(error->message, sizeof error->message, "has more than %d scans; save it anew", most_jpeg_scans);
    std::longjmp(error->jump, 1);
}

void set_jpeg_error(jpeg_decompress_struct& info, JpegError& error) {
    info.err = jpeg_std_error(&error.base);
    error.base.error_exit = on_jpeg_error;
    error.base.output_message = on_jpeg_message;
    error.base.emit_message = on_jpeg_warning;
}

// Returns whether the image can be decoded as far as its header tells, else why not in error.message.
bool check_jpeg_header(const jpeg_decompress_struct& info, size_t bytes, JpegError& error) {
    if (info.image_width == 0 || info.image_height == 0 || info.image_width > error.most_side ||
        info.image_height > error.most_side) {
        std::snprintf(error.message, sizeof error.message, "is %ux%u texels; the limit is 1 to %u a side",
                      info.image_width, info.image_height, error.most_side);
        return false;
    }
    // The first scan of a component, progressive or not, has a Huffman code for each of its blocks: a bit at least.
    // Arithmetic coding, which hardly anything writes, may take less for what is all of one colour.
    uint64_t blocks = 0;
    for (int c = 0; c < info.num_components; ++c)
        blocks += uint64_t{info.comp_info[c].width_in_blocks} * info.comp_info[c].height_in_blocks;
    if (blocks / 8 <= bytes) return true;
    std::snprintf(error.message, sizeof error.message,
                  "promises %ux%u texels, more than its bytes can hold; the file is cut or damaged", info.image_width,
                  info.image_height);
    return false;
}

// Everything with a destructor lives in the caller, outside the reach of longjmp.
bool decode_jpeg_into(std::span<const std::byte> bytes, Image& image, std::vector<uint8_t>& row, JpegError& error) {
    jpeg_decompress_struct info{};
    set_jpeg_error(info, error);
    if (setjmp(error.jump) != 0) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    jpeg_create_decompress(&info);
    jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    jpeg_read_header(&info, TRUE);
    if (!check_jpeg_header(info, bytes.size(), error)) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    error.progress.progress_monitor = on_jpeg_progress;
    info.progress = &error.progress;
    info.out_color_space = JCS_RGB;
    jpeg_start_decompress(&info);
    image.width = info.output_width;
    image.height = info.output_height;
    image.texels.resize(size_t{image.width} * image.height);
    row.resize(size_t{image.width} * 3);
    while (info.output_scanline < info.output_height) {
        const size_t y = info.output_scanline;
        JSAMPROW pointer = row.data();
        jpeg_read_scanlines(&info, &pointer, 1);
        for (size_t x = 0; x < image.width; ++x)
            image.texels[y * image.width + x] = {row[x * 3], row[x * 3 + 1], row[x * 3 + 2], 255};
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    return true;
}

struct PngError {
    std::jmp_buf jump;
    std::array<char, 200> message{};
};

void on_png_error(png_structp png, png_const_charp message) {
    auto& error = *static_cast<PngError*>(png_get_error_ptr(png));
    std::snprintf(error.message.data(), error.message.size(), "%s", message);
    std::longjmp(error.jump, 1);
}
void on_png_warning(png_structp, png_const_charp) {}
void on_png_bytes(png_structp png, png_bytep from, size_t count) {
    auto& bytes = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
    const auto* first = reinterpret_cast<const std::byte*>(from);
    bool fits = true;
    try {
        bytes.insert(bytes.end(), first, first + count);
    } catch (const std::exception&) { fits = false; }
    if (!fits) png_error(png, "out of memory");  // leaps, which nothing may from within a catch
}

// Without alpha where it is not told: a quarter fewer bytes to deflate. Level 3 of zlib takes 0.4 of the time of its
// usual 6, and 2% more bytes. bytes, and row with room for a row without alpha, are the caller's: nothing here has to
// be freed where libpng leaps out.
bool encode_png_into(const Image& image, bool alpha, std::vector<uint8_t>& row, std::vector<std::byte>& bytes,
                     PngError& error) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &error, on_png_error, on_png_warning);
    png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
    if (info == nullptr) {
        png_destroy_write_struct(&png, nullptr);
        std::snprintf(error.message.data(), error.message.size(), "out of memory");
        return false;
    }
    if (setjmp(error.jump) != 0) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_set_write_fn(png, &bytes, on_png_bytes, nullptr);
    png_set_compression_level(png, 3);
    png_set_IHDR(png, info, image.width, image.height, 8, alpha ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (size_t y = 0; y < image.height; ++y) {
        const glm::u8vec4* const texels = &image.texels[y * image.width];
        for (size_t x = 0; x < image.width && !alpha; ++x) std::memcpy(&row[3 * x], &texels[x], 3);
        png_write_row(png, alpha ? reinterpret_cast<png_const_bytep>(texels) : row.data());
    }
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

// packed and its size are the caller's too, and freed by it.
bool encode_jpeg_into(const Image& image, int quality, std::vector<uint8_t>& row, unsigned char** packed,
                      unsigned long* size, JpegError& error) {
    jpeg_compress_struct info{};
    info.err = jpeg_std_error(&error.base);
    error.base.error_exit = on_jpeg_error;
    error.base.output_message = on_jpeg_message;
    if (setjmp(error.jump) != 0) {
        jpeg_destroy_compress(&info);
        return false;
    }
    jpeg_create_compress(&info);
    jpeg_mem_dest(&info, packed, size);
    info.image_width = image.width;
    info.image_height = image.height;
    info.input_components = 3;
    info.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, quality, TRUE);
    jpeg_start_compress(&info, TRUE);
    row.resize(size_t{image.width} * 3);
    while (info.next_scanline < info.image_height) {
        for (size_t x = 0; x < image.width; ++x) {
            const auto& texel = image.texels[size_t{info.next_scanline} * image.width + x];
            for (int k = 0; k < 3; ++k) row[x * 3 + static_cast<size_t>(k)] = texel[k];
        }
        JSAMPROW pointer = row.data();
        jpeg_write_scanlines(&info, &pointer, 1);
    }
    jpeg_finish_compress(&info);
    jpeg_destroy_compress(&info);
    return true;
}

}  // namespace

bool png_may_be_whole(std::span<const std::byte> png) {
    // Signature, length and name of the first chunk, width, height, bits of a channel, kind of colour.
    if (png.size() < 26) return false;
    const auto byte = [&](size_t i) { return std::to_integer<uint64_t>(png[i]); };
    const auto number = [&](size_t i) { return byte(i) << 24 | byte(i + 1) << 16 | byte(i + 2) << 8 | byte(i + 3); };
    static constexpr std::array<uint64_t, 8> channels = {1, 0, 3, 1, 2, 0, 4, 0};
    const uint64_t bits = number(16) * byte(24) * channels[byte(25) & 7];
    constexpr uint64_t most_packed = 1032;  // bytes from one, by deflate: 258 from two bits
    return (bits / 8) * number(20) <= png.size() * most_packed;
}

Result<Image> decode_image(std::span<const std::byte> bytes, const std::string& name, uint32_t most_side,
                           std::string* damage) {
    if (bytes.size() >= 8 && png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) == 0)
        return decode_png(bytes, name, most_side);
    if (bytes.size() >= 3 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8} &&
        bytes[2] == std::byte{0xff}) {
        Image image;
        std::vector<uint8_t> row;
        JpegError error{};
        error.most_side = most_side;
        if (!decode_jpeg_into(bytes, image, row, error)) return wrong(name, std::string("JPEG: ") + error.message);
        if (damage != nullptr && error.damage[0] != 0) *damage = std::string("JPEG: ") + error.damage;
        return image;
    }
    if (is_webp(bytes)) return decode_webp(bytes, name, most_side);
    static constexpr unsigned char ktx2[] = {0xab, 'K', 'T', 'X', ' ', '2', '0', 0xbb};
    if (bytes.size() >= sizeof ktx2 && std::memcmp(bytes.data(), ktx2, sizeof ktx2) == 0)
        return wrong(name, "is KTX2 (KHR_texture_basisu), which is not read");
    return wrong(name, "is neither PNG, JPEG nor WebP");
}

Result<Image> read_image(const std::filesystem::path& path) {
    auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    auto image = decode_image(bytes->bytes, path.string());
    if (auto whole = bytes->intact(); !whole) return tl::unexpected(whole.error());
    return image;
}

bool has_alpha(const Image& image) {
    return std::ranges::any_of(image.texels, [](const glm::u8vec4& texel) { return texel.w != 255; });
}

Result<std::vector<std::byte>> encode_png(const Image& image) {
    if (image.texels.empty()) return fail(Fault::machine, "PNG: there are no texels");
    std::vector<std::byte> bytes;
    std::vector<uint8_t> row(size_t{image.width} * 3);
    PngError error;
    if (!encode_png_into(image, has_alpha(image), row, bytes, error))
        return fail(Fault::machine, std::string("PNG: ") + error.message.data());
    return bytes;
}

Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality) {
    std::vector<uint8_t> row;
    unsigned char* packed = nullptr;
    unsigned long size = 0;
    JpegError error{};
    const bool done = encode_jpeg_into(image, quality, row, &packed, &size, error);
    const auto* first = reinterpret_cast<const std::byte*>(packed);
    std::vector<std::byte> bytes = done ? std::vector<std::byte>(first, first + size) : std::vector<std::byte>{};
    std::free(packed);
    if (!done) return fail(Fault::machine, std::string("JPEG: ") + error.message);
    return bytes;
}

Result<std::vector<std::byte>> encode_webp(const Image& image, int quality) {
    static_assert(most_webp_side == WEBP_MAX_DIMENSION);
    if (image.width > most_webp_side || image.height > most_webp_side)
        return fail(Fault::usage, "WebP: a texture of " + std::to_string(image.width) + "x" +
                                      std::to_string(image.height) + " texels is larger than " +
                                      std::to_string(most_webp_side) + " a side; write PNG");
    WebPConfig config;
    WebPPicture picture;
    if (WebPConfigInit(&config) == 0 || WebPPictureInit(&picture) == 0)
        return fail(Fault::machine, "WebP: the library is of another version than its headers");
    config.quality = static_cast<float>(quality);
    config.lossless = quality == 100 ? 1 : 0;
    config.exact = config.lossless;                 // colours where alpha is 0 stay
    if (config.lossless != 0) config.quality = 75;  // of which lossless makes effort
    picture.use_argb = config.lossless;
    picture.width = static_cast<int>(image.width);
    picture.height = static_cast<int>(image.height);
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    const auto* texels = reinterpret_cast<const uint8_t*>(image.texels.data());
    const bool done = WebPPictureImportRGBA(&picture, texels, static_cast<int>(image.width * 4)) != 0 &&
                      WebPEncode(&config, &picture) != 0;
    const auto* first = reinterpret_cast<const std::byte*>(writer.mem);
    std::vector<std::byte> bytes = done ? std::vector<std::byte>(first, first + writer.size) : std::vector<std::byte>{};
    const int error = picture.error_code;
    WebPMemoryWriterClear(&writer);
    WebPPictureFree(&picture);
    if (!done) return fail(Fault::machine, "WebP: the encoder failed (" + std::to_string(error) + ")");
    return bytes;
}

Result<void> write_png(const Image& image, const std::filesystem::path& path) {
    auto bytes = encode_png(image);
    if (!bytes) return fail_at(path.string(), bytes.error());
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(*bytes); !done) return done;
    return file->commit();
}

}  // namespace lodestone
