#include "base/text.h"

#include <algorithm>

namespace lodestone {

std::string as_utf8(const std::string& text) {
    std::string out;
    for (size_t i = 0; i < text.size();) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const size_t length = lead < 0x80                   ? 1
                              : lead >= 0xc2 && lead < 0xe0 ? 2
                              : lead >= 0xe0 && lead < 0xf0 ? 3
                              : lead >= 0xf0 && lead < 0xf5 ? 4
                                                            : 0;
        bool good = length > 0 && i + length <= text.size();
        for (size_t k = 1; good && k < length; ++k) good = (static_cast<unsigned char>(text[i + k]) & 0xc0) == 0x80;
        if (good && length == 3)
            good = !(lead == 0xe0 && static_cast<unsigned char>(text[i + 1]) < 0xa0) &&
                   !(lead == 0xed && static_cast<unsigned char>(text[i + 1]) >= 0xa0);
        if (good && length == 4)
            good = !(lead == 0xf0 && static_cast<unsigned char>(text[i + 1]) < 0x90) &&
                   !(lead == 0xf4 && static_cast<unsigned char>(text[i + 1]) >= 0x90);
        if (good) {
            out.append(text, i, length);
            i += length;
        } else {
            out += static_cast<char>(0xc0 | lead >> 6);
            out += static_cast<char>(0x80 | (lead & 0x3f));
            ++i;
        }
    }
    return out;
}

std::string printable(const std::string& text) {
    const std::string utf8 = as_utf8(text);
    std::string out;
    const auto escape = [&](size_t from, size_t length) {
        static constexpr char digits[] = "0123456789abcdef";
        for (size_t i = from; i < from + length; ++i) {
            const auto byte = static_cast<unsigned char>(utf8[i]);
            out += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
        }
    };
    const auto byte_at = [&](size_t i) { return i < utf8.size() ? static_cast<unsigned char>(utf8[i]) : 0u; };
    for (size_t i = 0; i < utf8.size();) {
        const unsigned lead = byte_at(i), second = byte_at(i + 1), third = byte_at(i + 2);
        const size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
        // U+0080 .. U+009f control, too; U+200e, U+200f, U+2028 .. U+202e and U+2066 .. U+2069 turn or end lines.
        const bool control = lead < 0x20 || lead == 0x7f || (lead == 0xc2 && second < 0xa0);
        const bool turns =
            lead == 0xe2 &&
            ((second == 0x80 && ((third >= 0xa8 && third <= 0xae) || (third >= 0x8e && third <= 0x8f))) ||
             (second == 0x81 && third >= 0xa6 && third <= 0xa9));
        if (control || turns)
            escape(i, length);
        else
            out.append(utf8, i, length);
        i += length;
    }
    return out;
}

std::string one_line(std::string text) {
    constexpr size_t most_bytes = 400;
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r' || text.back() == ' ')) text.pop_back();
    std::ranges::replace_if(
        text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text.substr(0, most_bytes);
}

}  // namespace lodestone
