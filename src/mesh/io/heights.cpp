// 16-bit PNG (libpng) and GeoTIFF (libtiff; OGC GeoTIFF 1.1) height maps.
#include "mesh/io/heights.h"

#include <png.h>
#include <tiffio.h>

#include <charconv>
#include <csetjmp>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <limits>

#include "base/text.h"
#include "mesh/io/formats.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

constexpr float hole = std::numeric_limits<float>::quiet_NaN();
// The voids of the Shuttle Radar Topography Mission.
bool srtm_void(float value) { return value == -32768.0f || value == -32767.0f; }

Result<TriMesh> finished(const SourceFile& file, HeightMap& map, const ReadOptions& options, ReadReport& report) {
    size_t holes = 0;
    if (const auto guess = options.void_height ? std::nullopt : guess_voids(map)) {
        char digits[32];  // the fewest that read back as the same float
        const std::string height(digits, std::to_chars(digits, digits + sizeof digits, guess->height).ptr);
        report.warnings.push_back(std::to_string(guess->samples) + " samples are " + height +
                                  ", far from what is around them; if they hold no data, `--void-height " + height +
                                  "` makes them holes, and `--fill-voids` fills these");
    }
    for (float& sample : map.samples) {
        if (options.void_height && sample == *options.void_height) sample = hole;
        sample *= options.height_scale;
        holes += std::isfinite(sample) ? 0 : 1;
    }
    if (options.fill_voids && holes > 0) {
        const size_t filled = fill_voids(map);
        report.warnings.push_back(std::to_string(filled) + " samples held no data; they were filled from around");
        holes -= filled;
    }
    if (options.pixel_size > 0) map.spacing_x = map.spacing_y = static_cast<double>(options.pixel_size);
    if (holes > 0)
        report.warnings.push_back(std::to_string(holes) +
                                  " samples hold no data; they are holes (`--fill-voids` fills them)");
    TriMesh mesh = terrain_of(map);
    if (mesh.triangles.empty())
        return file.wrong("", "has no three neighbouring samples with data; there is nothing to read");
    return mesh;
}

struct PngInput {
    std::span<const std::byte> bytes;
    uint32_t most_side = 0;
    size_t at = 0;
    char message[160] = "";
};

// Plain data only: libpng leaves it by longjmp.
bool read_png_samples(PngInput& input, uint32_t& width, uint32_t& height, int& depth, int& colour_type,
                      std::vector<uint8_t>& rows) {
    const auto on_error = [](png_structp png, png_const_charp message) {
        std::snprintf(static_cast<PngInput*>(png_get_error_ptr(png))->message, sizeof(PngInput::message), "%s",
                      message);
        png_longjmp(png, 1);
    };
    const auto on_read = [](png_structp png, png_bytep to, size_t count) {
        auto* from = static_cast<PngInput*>(png_get_io_ptr(png));
        if (from->bytes.size() - from->at < count) png_error(png, "the file is cut");
        std::memcpy(to, from->bytes.data() + from->at, count);
        from->at += count;
    };
    png_structp png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, &input, on_error, [](png_structp, png_const_charp) {});
    png_infop info = png_create_info_struct(png);
    if (setjmp(png_jmpbuf(png)) != 0) {
        png_destroy_read_struct(&png, &info, nullptr);
        return false;
    }
    png_set_read_fn(png, &input, on_read);
    png_read_info(png, info);
    width = png_get_image_width(png, info);
    height = png_get_image_height(png, info);
    depth = png_get_bit_depth(png, info);
    colour_type = png_get_color_type(png, info);
    if (width > input.most_side || height > input.most_side) {
        std::snprintf(input.message, sizeof input.message, "it is %ux%u samples; the limit is %u a side", width, height,
                      input.most_side);
        png_longjmp(png, 1);
    }
    if (!png_may_be_whole(input.bytes)) png_error(png, "the file is cut");
    if (colour_type == PNG_COLOR_TYPE_GRAY && depth == 16) {
        const int passes = png_set_interlace_handling(png);
        const size_t row_bytes = png_get_rowbytes(png, info);
        rows.resize(row_bytes * height);
        for (int pass = 0; pass < passes; ++pass) {
            for (uint32_t y = 0; y < height; ++y) png_read_row(png, rows.data() + y * row_bytes, nullptr);
        }
    }
    png_destroy_read_struct(&png, &info, nullptr);
    return true;
}

struct TiffInput {
    std::span<const std::byte> bytes;
    uint64_t at = 0;
    std::string message;
};

int on_tiff_error(thandle_t handle, const char* module, const char* format, va_list arguments) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    auto* input = static_cast<TiffInput*>(handle);
    if (input != nullptr && input->message.empty())
        input->message = one_line(std::string(module != nullptr ? module : "") + ": " + text);
    return 1;
}
thread_local TiffInput* g_tiff = nullptr;
void on_tiff_error_plain(const char* module, const char* format, va_list arguments) {
    on_tiff_error(g_tiff, module, format, arguments);
}

TIFF* open_tiff(TiffInput& input) {
    // Debian 12's libtiff 4.5 has per-file handlers only for newer calls; the global ones are set once.
    static const bool handlers = [] {
        TIFFSetErrorHandler(on_tiff_error_plain);
        TIFFSetWarningHandler(nullptr);
        return true;
    }();
    static_cast<void>(handlers);
    g_tiff = &input;
    return TIFFClientOpen(
        "heights", "rm", &input,
        [](thandle_t h, void* to, tmsize_t count) -> tmsize_t {
            auto* in = static_cast<TiffInput*>(h);
            const auto length = std::min<uint64_t>(static_cast<uint64_t>(count),
                                                   in->at < in->bytes.size() ? in->bytes.size() - in->at : 0);
            std::memcpy(to, in->bytes.data() + in->at, length);
            in->at += length;
            return static_cast<tmsize_t>(length);
        },
        [](thandle_t, void*, tmsize_t) -> tmsize_t { return 0; },
        [](thandle_t h, toff_t offset, int whence) -> toff_t {
            auto* in = static_cast<TiffInput*>(h);
            in->at = offset + (whence == SEEK_CUR ? in->at : whence == SEEK_END ? in->bytes.size() : 0);
            return in->at;
        },
        [](thandle_t) { return 0; }, [](thandle_t h) -> toff_t { return static_cast<TiffInput*>(h)->bytes.size(); },
        nullptr, nullptr);
}

// GeoTIFF's tags, which libtiff does not know by itself.
constexpr ttag_t tag_pixel_scale = 33550, tag_tie_points = 33922, tag_geo_keys = 34735, tag_no_data = 42113;
void add_geo_tags(TIFF* tiff) {
    static char scale_name[] = "ModelPixelScaleTag", tie_name[] = "ModelTiepointTag",
                keys_name[] = "GeoKeyDirectoryTag", no_data_name[] = "GDAL_NODATA";
    static const TIFFFieldInfo fields[] = {{tag_pixel_scale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, scale_name},
                                           {tag_tie_points, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, tie_name},
                                           {tag_geo_keys, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, keys_name},
                                           {tag_no_data, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, no_data_name}};
    TIFFMergeFieldInfo(tiff, fields, 4);
}

float sample_value(const uint8_t* at, uint16_t bits, uint16_t format) {
    const auto as = [&]<class T>(T value) {
        std::memcpy(&value, at, sizeof value);
        return static_cast<float>(value);
    };
    if (format == SAMPLEFORMAT_IEEEFP) return bits == 64 ? as(double{}) : as(float{});
    if (format == SAMPLEFORMAT_INT) return bits == 8 ? as(int8_t{}) : bits == 16 ? as(int16_t{}) : as(int32_t{});
    return bits == 8 ? as(uint8_t{}) : bits == 16 ? as(uint16_t{}) : as(uint32_t{});
}

// Metres a sample spans, from the file's own georeference. Degrees become metres at the map's middle latitude (a sphere
// of 6371 km, within 0.6% of the ellipsoid).
void read_spacing(TIFF* tiff, HeightMap& map) {
    uint16_t count = 0;
    double* scale = nullptr;
    if (TIFFGetField(tiff, tag_pixel_scale, &count, &scale) != 1 || count < 2 || !(scale[0] > 0) || !(scale[1] > 0))
        return;
    map.spacing_x = scale[0];
    map.spacing_y = scale[1];
    uint16_t* keys = nullptr;
    bool degrees = false;
    if (TIFFGetField(tiff, tag_geo_keys, &count, &keys) == 1) {
        for (uint16_t k = 4; k + 3 < count; k = static_cast<uint16_t>(k + 4))
            degrees = degrees || (keys[k] == 1024 && keys[k + 3] == 2);
    }
    if (!degrees) return;
    double* tie = nullptr;
    double latitude = 0;
    if (TIFFGetField(tiff, tag_tie_points, &count, &tie) == 1 && count >= 6)
        latitude = tie[4] - (map.height / 2.0 - tie[1]) * scale[1];
    constexpr double radians = 3.14159265358979323846 / 180, metres_per_degree = 6371000.0 * radians;
    map.spacing_x *= metres_per_degree * std::cos(latitude * radians);
    map.spacing_y *= metres_per_degree;
}

}  // namespace

TriMesh terrain_of(const HeightMap& map) {
    TriMesh mesh;
    std::vector<uint32_t> vertex(map.samples.size(), ~0u);
    const auto there = [&](uint32_t x, uint32_t y) { return std::isfinite(map.samples[size_t{y} * map.width + x]); };
    const auto corner = [&](uint32_t x, uint32_t y) {
        uint32_t& v = vertex[size_t{y} * map.width + x];
        if (v == ~0u) {
            v = static_cast<uint32_t>(mesh.positions.size());
            mesh.positions.emplace_back(static_cast<float>((x - (map.width - 1) / 2.0) * map.spacing_x),
                                        map.samples[size_t{y} * map.width + x],
                                        static_cast<float>((y - (map.height - 1) / 2.0) * map.spacing_y));
            mesh.uvs.emplace_back(static_cast<float>(x) / static_cast<float>(std::max(map.width - 1, 1u)),
                                  static_cast<float>(y) / static_cast<float>(std::max(map.height - 1, 1u)));
        }
        return v;
    };
    for (uint32_t y = 0; y + 1 < map.height; ++y) {
        for (uint32_t x = 0; x + 1 < map.width; ++x) {
            const bool nw = there(x, y), ne = there(x + 1, y), sw = there(x, y + 1), se = there(x + 1, y + 1);
            const int corners = nw + ne + sw + se;
            if (corners < 3) continue;
            const auto add = [&](std::array<uint32_t, 2> a, std::array<uint32_t, 2> b, std::array<uint32_t, 2> c) {
                mesh.triangles.push_back({corner(a[0], a[1]), corner(b[0], b[1]), corner(c[0], c[1])});
            };
            const std::array<uint32_t, 2> pnw{x, y}, pne{x + 1, y}, psw{x, y + 1}, pse{x + 1, y + 1};
            if (corners == 4) {
                add(pnw, psw, pse);
                add(pnw, pse, pne);
            } else if (!nw) {
                add(pne, psw, pse);
            } else if (!ne) {
                add(pnw, psw, pse);
            } else if (!sw) {
                add(pnw, pse, pne);
            } else {
                add(pnw, psw, pne);
            }
        }
    }
    mesh.set_identity_wedges();
    return mesh;
}

Result<TriMesh> read_png_heights(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    PngInput input{file.content.bytes, file.limits.height_side};
    HeightMap map;
    int depth = 0, colour_type = 0;
    std::vector<uint8_t> rows;
    if (!read_png_samples(input, map.width, map.height, depth, colour_type, rows))
        return file.wrong("", std::string("cannot be decoded: ") + input.message);
    if (rows.empty())
        return file.wrong("", "is no height map: it must be a grey PNG of 16 bits, and has " + std::to_string(depth) +
                                  " bits of colour type " + std::to_string(colour_type));
    for (size_t i = 0; i + 1 < rows.size(); i += 2) {
        const auto bits = static_cast<uint16_t>(rows[i] << 8 | rows[i + 1]);
        // A signed raster's voids, stored as they are or shifted to unsigned, are holes.
        map.samples.push_back(bits == 0x8000 || bits == 0x8001 ? hole : static_cast<float>(bits));
    }
    return finished(file, map, options, report);
}

namespace {

struct TiffSample {
    uint16_t bits = 0, format = SAMPLEFORMAT_UINT, count = 1;  // count: per pixel
    size_t bytes() const { return bits / 8u; }
    bool is_height() const {
        const bool real = format == SAMPLEFORMAT_IEEEFP && (bits == 32 || bits == 64);
        const bool integer =
            (format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_INT) && (bits == 8 || bits == 16 || bits == 32);
        return count == 1 && (real || integer);
    }
};

// Bytes that no way of packing makes of one; of any tile; and of one that is larger than four of its pictures.
constexpr size_t most_unpacked = 4096, most_tile = size_t{1} << 30, most_small_tile = size_t{1} << 24;

// Samples by tiles; what is wrong, or nothing. file_bytes: of the whole file.
std::string read_tiles(TIFF* tiff, size_t file_bytes, const TiffSample& sample, HeightMap& map) {
    uint32_t tile_width = 0, tile_height = 0;
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_height);
    const auto tile_bytes = static_cast<size_t>(TIFFTileSize(tiff));
    const size_t picture_bytes = size_t{map.width} * map.height * sample.bytes();
    if (tile_width == 0 || tile_height == 0 || tile_bytes < size_t{tile_width} * tile_height * sample.bytes() ||
        tile_bytes / most_unpacked > file_bytes ||
        tile_bytes > std::clamp(4 * picture_bytes, most_small_tile, most_tile))
        return "has tiles of a wrong size";
    std::vector<uint8_t> tile(tile_bytes);
    for (uint32_t y0 = 0; y0 < map.height; y0 += tile_height) {
        // As it is read: a header may promise any size.
        map.samples.resize(size_t{std::min(y0 + tile_height, map.height)} * map.width, hole);
        for (uint32_t x0 = 0; x0 < map.width; x0 += tile_width) {
            if (TIFFReadTile(tiff, tile.data(), x0, y0, 0, 0) < 0) return "a tile cannot be decoded";
            for (uint32_t y = y0; y < std::min(y0 + tile_height, map.height); ++y) {
                for (uint32_t x = x0; x < std::min(x0 + tile_width, map.width); ++x) {
                    const uint8_t* at = &tile[(size_t{y - y0} * tile_width + x - x0) * sample.bytes()];
                    map.samples[size_t{y} * map.width + x] = sample_value(at, sample.bits, sample.format);
                }
            }
        }
    }
    return "";
}

// Samples row by row; what is wrong, or nothing.
std::string read_rows(TIFF* tiff, const TiffSample& sample, HeightMap& map) {
    std::vector<uint8_t> line(
        std::max<size_t>(static_cast<size_t>(TIFFScanlineSize(tiff)), map.width * sample.bytes()));
    for (uint32_t y = 0; y < map.height; ++y) {
        if (TIFFReadScanline(tiff, line.data(), y, 0) < 0) return "row " + std::to_string(y) + " cannot be decoded";
        map.samples.resize(map.samples.size() + map.width, hole);
        for (uint32_t x = 0; x < map.width; ++x)
            map.samples[size_t{y} * map.width + x] =
                sample_value(&line[x * sample.bytes()], sample.bits, sample.format);
    }
    return "";
}

// What the file marks as no data, and what elevation models commonly do.
void make_holes(TIFF* tiff, HeightMap& map) {
    float no_data = hole;
    uint16_t length = 0;
    char* text = nullptr;
    if (TIFFGetField(tiff, tag_no_data, &length, &text) == 1 && text != nullptr) {
        const std::string_view word(text, strnlen(text, length));
        std::from_chars(word.data(), word.data() + word.size(), no_data);
    }
    for (float& sample : map.samples) {
        if (sample == no_data || srtm_void(sample)) sample = hole;
    }
}

}  // namespace

Result<TriMesh> read_geotiff(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    TiffInput input{file.content.bytes, 0, {}};
    TIFF* tiff = open_tiff(input);
    const auto wrong = [&](const std::string& what) {
        return file.wrong("", input.message.empty() ? what : what + " (" + input.message + ")");
    };
    if (tiff == nullptr) return wrong("is no TIFF that can be read");
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> closer(tiff, TIFFClose);
    add_geo_tags(tiff);
    TIFFSetDirectory(tiff, 0);
    HeightMap map;
    TiffSample sample;
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &map.width);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &map.height);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &sample.bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &sample.format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &sample.count);
    if (!sample.is_height())
        return wrong("is no height map: it must have one sample of 8, 16 or 32 bits or a float per pixel");
    const uint32_t most_side = file.limits.height_side;
    if (map.width < 2 || map.height < 2 || map.width > most_side || map.height > most_side) {
        return wrong("is " + std::to_string(map.width) + "x" + std::to_string(map.height) +
                     " samples; the limit is 2 to " + std::to_string(most_side) + " a side");
    }
    const std::string fault = TIFFIsTiled(tiff) != 0 ? read_tiles(tiff, file.content.bytes.size(), sample, map)
                                                     : read_rows(tiff, sample, map);
    if (!fault.empty()) return wrong(fault);
    read_spacing(tiff, map);
    make_holes(tiff, map);
    return finished(file, map, options, report);
}

}  // namespace lodestone
