#include "base/text.h"

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

}  // namespace lodestone
