#include "light/panorama.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "base/files/file.h"

namespace lodestone {

namespace {

constexpr const char* what_to_do = "; save it as a Radiance .hdr (RGBE) of an equirectangular picture";
constexpr size_t longest_line = 4096;                            // of a header; those of programs are shorter
constexpr float brightest_texel = 1e18f;                         // so that sums stay numbers
constexpr uint32_t shortest_packed = 8, longest_packed = 32767;  // rows in run lengths by component

// A file's bytes from front to back.
class Bytes {
public:
    explicit Bytes(std::span<const std::byte> bytes) : bytes_(bytes) {}
    size_t left() const { return bytes_.size() - at_; }
    uint8_t take() { return static_cast<uint8_t>(bytes_[at_++]); }
    uint8_t peek(size_t after) const { return static_cast<uint8_t>(bytes_[at_ + after]); }
    // Without its end; nothing where the file has no further whole line.
    std::optional<std::string> line() {
        std::string line;
        while (left() > 0 && line.size() < longest_line) {
            const char c = static_cast<char>(take());
            if (c == '\n') return line;
            line += c;
        }
        return std::nullopt;
    }

private:
    std::span<const std::byte> bytes_;
    size_t at_ = 0;
};

std::optional<float> number_of(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    float value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
    return value;
}

// A file that is being decoded.
class Decoder {
public:
    Decoder(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    Result<Panorama> decode() {
        if (auto done = read_header(); !done) return tl::unexpected(done.error());
        if (auto done = read_size(); !done) return tl::unexpected(done.error());
        for (uint32_t y = 0; y < made_.height; ++y) {
            const bool packed = is_packed();
            if (packed ? take_packed() : take_flat()) continue;
            return bad("row " + std::to_string(y + 1) + " of " + std::to_string(made_.height) +
                       (bytes_.left() == 0 ? " is cut short; fetch the file anew"
                                           : " has run lengths beyond its end; fetch the file anew"));
        }
        return std::move(made_);
    }

private:
    tl::unexpected<Error> bad(const std::string& what) const { return fail(Fault::format, name_ + ": " + what); }

    Result<void> read_header() {
        const auto magic = bytes_.line();
        if (!magic || !magic->starts_with("#?")) return bad(std::string("is no Radiance picture") + what_to_do);
        for (;;) {
            const auto line = bytes_.line();
            if (!line) return bad("its header does not end; fetch the file anew");
            if (line->empty()) return {};
            if (line->starts_with("FORMAT=") && *line != "FORMAT=32-bit_rle_rgbe")
                return bad("has the format '" + line->substr(7, 40) + "', not 32-bit_rle_rgbe" + what_to_do);
            if (!line->starts_with("EXPOSURE=")) continue;
            const auto exposure = number_of(std::string_view(*line).substr(9));
            if (!exposure || *exposure <= 0)
                return bad("has the exposure '" + line->substr(9, 40) + "'; it must be a number above 0");
            made_.scale /= *exposure;
            if (!std::isfinite(made_.scale) || made_.scale <= 0)
                return bad("has exposures that together are beyond what floats hold; take them out of the header");
        }
    }

    Result<void> read_size() {
        const auto line = bytes_.line();
        unsigned width = 0, height = 0;
        int end = 0;
        if (!line || std::sscanf(line->c_str(), "-Y %9u +X %9u%n", &height, &width, &end) != 2 ||
            static_cast<size_t>(end) != line->size()) {
            return bad(std::string("has no size of the kind '-Y HEIGHT +X WIDTH' after its header") + what_to_do);
        }
        const std::string size = std::to_string(width) + " x " + std::to_string(height) + " texels";
        if (width == 0 || width != 2 * height)
            return bad("has " + size + "; surroundings are twice as wide as high" + what_to_do);
        if (width > most_panorama_width)
            return bad("has " + size + "; the limit is " + std::to_string(most_panorama_width) +
                       " across; scale it down");
        made_.width = width;
        made_.height = height;
        return {};
    }

    // Whether the next row is in run lengths by component.
    bool is_packed() const {
        return made_.width >= shortest_packed && made_.width <= longest_packed && bytes_.left() >= 4 &&
               bytes_.peek(0) == 2 && bytes_.peek(1) == 2 &&
               (uint32_t{bytes_.peek(2)} << 8 | bytes_.peek(3)) == made_.width;
    }

    // Rows are made one by one, as they are found to be there.
    glm::u8vec4* new_row() {
        made_.texels.resize(made_.texels.size() + made_.width);
        return made_.texels.data() + made_.texels.size() - made_.width;
    }

    bool take_packed() {
        for (int k = 0; k < 4; ++k) bytes_.take();
        if (bytes_.left() < 8) return false;
        glm::u8vec4* row = new_row();
        for (int c = 0; c < 4; ++c) {
            for (uint32_t x = 0; x < made_.width;) {
                if (bytes_.left() < 2) return false;
                const uint8_t code = bytes_.take();
                const bool run = code > 128;
                const uint32_t count = run ? code - 128u : code;
                if (count == 0 || count > made_.width - x || (!run && bytes_.left() < count)) return false;
                const uint8_t value = run ? bytes_.take() : uint8_t{0};
                for (uint32_t i = 0; i < count; ++i) row[x++][c] = run ? value : bytes_.take();
            }
        }
        return true;
    }

    // Texel by texel; one of three mantissas of 1 repeats the one before, and several in a row tell a longer run.
    bool take_flat() {
        if (bytes_.left() < 4) return false;
        glm::u8vec4* row = new_row();
        uint32_t shift = 0;
        for (uint32_t x = 0; x < made_.width;) {
            if (bytes_.left() < 4) return false;
            glm::u8vec4 texel;
            for (int c = 0; c < 4; ++c) texel[c] = bytes_.take();
            if (texel.x != 1 || texel.y != 1 || texel.z != 1) {
                row[x++] = texel;
                shift = 0;
                continue;
            }
            if (x == 0 || shift > 16) return false;
            const uint32_t count = uint32_t{texel.w} << shift;
            if (count > made_.width - x) return false;
            std::fill_n(row + x, count, row[x - 1]);
            x += count;
            shift += 8;
        }
        return true;
    }

    Bytes bytes_;
    const std::string& name_;
    Panorama made_;
};

}  // namespace

glm::vec3 Panorama::at(uint32_t x, uint32_t y) const {
    const glm::u8vec4 t = texels[size_t{y} * width + x];
    if (t.w == 0) return glm::vec3(0);
    return glm::min((glm::vec3(t) + 0.5f) * (std::ldexp(1.0f, t.w - 136) * scale), brightest_texel);
}

glm::vec3 Panorama::towards(const glm::vec3& d) const {
    constexpr float pi = std::numbers::pi_v<float>;
    const float across = (std::atan2(d.x, -d.z) / (2 * pi) + 0.5f) * static_cast<float>(width) - 0.5f;
    const float down = std::acos(std::clamp(d.y, -1.0f, 1.0f)) / pi * static_cast<float>(height) - 0.5f;
    const float left = std::floor(across), top = std::floor(down);
    const auto column = [&](int64_t x) { return static_cast<uint32_t>((x + width) % width); };
    const auto row = [&](int64_t y) { return static_cast<uint32_t>(std::clamp<int64_t>(y, 0, height - 1)); };
    const auto x = static_cast<int64_t>(left), y = static_cast<int64_t>(top);
    const auto between = [&](uint32_t r) { return glm::mix(at(column(x), r), at(column(x + 1), r), across - left); };
    return glm::mix(between(row(y)), between(row(y + 1)), down - top);
}

uint32_t Panorama::points_for(uint32_t cube_side) const {
    return std::max(2u, (width / 4 + cube_side - 1) / cube_side);
}

Result<Panorama> decode_panorama(std::span<const std::byte> bytes, const std::string& name) {
    return Decoder(bytes, name).decode();
}

Result<Panorama> read_panorama(const std::filesystem::path& path) {
    const auto file = read_file(path);
    if (!file) return tl::unexpected(file.error());
    auto made = decode_panorama(file->bytes, path.string());
    if (auto whole = file->intact(); !whole) return tl::unexpected(whole.error());
    return made;
}

}  // namespace lodestone
