#include "mesh/textures/filling.h"

#include <algorithm>
#include <utility>

#include "base/threads.h"

namespace lodestone {

namespace {

class Filling {
public:
    Filling(Image& image, std::vector<uint8_t>& covered, const glm::u8vec4& nothing)
        : image_(image), covered_(covered), nothing_(nothing) {}

    void spread(int passes) {
        const auto width = static_cast<ptrdiff_t>(image_.width), height = static_cast<ptrdiff_t>(image_.height);
        for (int pass = 0; pass < passes; ++pass) {
            std::vector<std::vector<std::pair<size_t, glm::u8vec4>>> found(image_.height);
            parallel_for(image_.height, 16, [&](size_t begin, size_t end) {
                for (size_t row = begin; row < end; ++row) {
                    const auto y = static_cast<ptrdiff_t>(row);
                    for (ptrdiff_t x = 0; x < width; ++x) {
                        if (covered_[row * image_.width + static_cast<size_t>(x)] != 0) continue;
                        glm::uvec4 sum(0);
                        unsigned count = 0;
                        for (ptrdiff_t v = std::max<ptrdiff_t>(y - 1, 0); v <= std::min(y + 1, height - 1); ++v) {
                            for (ptrdiff_t u = std::max<ptrdiff_t>(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
                                const auto at = static_cast<size_t>(v * width + u);
                                if (covered_[at] == 0) continue;
                                sum += glm::uvec4(image_.texels[at]);
                                ++count;
                            }
                        }
                        if (count > 0)
                            found[row].emplace_back(row * image_.width + static_cast<size_t>(x),
                                                    glm::u8vec4((sum + count / 2) / count));
                    }
                }
            });
            for (const auto& row : found) {
                for (const auto& [at, colour] : row) {
                    image_.texels[at] = colour;
                    covered_[at] = 1;
                }
            }
        }
    }

    void fill_rest() { fill_level(image_, covered_); }

private:
    void fill_level(Image& image, const std::vector<uint8_t>& covered) const {
        if (std::ranges::find(covered, 0) == covered.end()) return;
        if (image.width == 1 && image.height == 1) {
            image.texels[0] = nothing_;
            return;
        }
        Image half{(image.width + 1) / 2, (image.height + 1) / 2, {}};
        half.texels.resize(size_t{half.width} * half.height);
        std::vector<uint8_t> half_covered(half.texels.size(), 0);
        for (uint32_t y = 0; y < half.height; ++y) {
            for (uint32_t x = 0; x < half.width; ++x) {
                glm::uvec4 sum(0);
                unsigned count = 0;
                for (uint32_t v = y * 2; v < std::min(y * 2 + 2, image.height); ++v) {
                    for (uint32_t u = x * 2; u < std::min(x * 2 + 2, image.width); ++u) {
                        if (covered[size_t{v} * image.width + u] == 0) continue;
                        sum += glm::uvec4(image.texels[size_t{v} * image.width + u]);
                        ++count;
                    }
                }
                if (count == 0) continue;
                half.texels[size_t{y} * half.width + x] = glm::u8vec4((sum + count / 2) / count);
                half_covered[size_t{y} * half.width + x] = 1;
            }
        }
        fill_level(half, half_covered);
        for (uint32_t y = 0; y < image.height; ++y) {
            for (uint32_t x = 0; x < image.width; ++x) {
                const size_t at = size_t{y} * image.width + x;
                if (covered[at] == 0) image.texels[at] = half.texels[size_t{y / 2} * half.width + x / 2];
            }
        }
    }

    Image& image_;
    std::vector<uint8_t>& covered_;
    const glm::u8vec4 nothing_;
};

}  // namespace

void fill_around(Image& image, std::vector<uint8_t>& covered, const glm::u8vec4& nothing) {
    constexpr int spread_passes = 4;
    Filling filling(image, covered, nothing);
    filling.spread(spread_passes);
    filling.fill_rest();
}

}  // namespace lodestone
