#include "vgi/unwrap/texture_bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "base/check.h"
#include "base/srgb.h"
#include "base/threads.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t band_rows = 32;                    // of an image, made at once
constexpr int fewest_samples = 2, most_samples = 32;  // along a side of a texel
constexpr float least_weight = 1.0f / 4096;           // of what lets all light through: its colour matters to nobody

const std::array<float, 256>& linear_of_bytes() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> made{};
        for (size_t i = 0; i < made.size(); ++i)
            made[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / 255));
        return made;
    }();
    return table;
}

uint8_t byte_of_linear(float value) {
    return static_cast<uint8_t>(std::lround(255 * srgb_from_linear(std::clamp(static_cast<double>(value), 0.0, 1.0))));
}

// Sums over the samples of a texel.
struct Texel {
    glm::vec3 colour{0};  // linear, times weight
    float weight = 0, alpha = 0, samples = 0;
    void add(const glm::vec4& sample, float share) {
        const float w = std::max(sample.w, least_weight) * share;
        colour += glm::vec3(sample) * w;
        weight += w;
        alpha += sample.w * share;
        samples += share;
    }
};

// Linear colour and alpha, between the four texels around; repeats.
glm::vec4 looked_up(const Image& image, const glm::dvec2& uv) {
    const auto& linear = linear_of_bytes();
    const double x = uv.x * image.width - 0.5, y = uv.y * image.height - 0.5, left = std::floor(x), top = std::floor(y);
    const auto wrapped = [](double at, uint32_t size) {
        const double rest = std::fmod(at, size);
        return static_cast<size_t>(rest < 0 ? rest + size : rest);
    };
    const size_t x0 = wrapped(left, image.width), x1 = x0 + 1 == image.width ? 0 : x0 + 1;
    const size_t y0 = wrapped(top, image.height), y1 = y0 + 1 == image.height ? 0 : y0 + 1;
    const auto fx = static_cast<float>(x - left), fy = static_cast<float>(y - top);
    const auto at = [&](size_t column, size_t row) {
        const glm::u8vec4& t = image.texels[row * image.width + column];
        return glm::vec4(linear[t.x], linear[t.y], linear[t.z], static_cast<float>(t.w) / 255);
    };
    return glm::mix(glm::mix(at(x0, y0), at(x1, y0), fx), glm::mix(at(x0, y1), at(x1, y1), fx), fy);
}

// A triangle of the unwrapped mesh: corners in texels of its square, rows from the top, and its old place.
struct OldAndNew {
    glm::dvec2 corners[3], old[3];
    const Image* image = nullptr;  // null for none
    glm::vec4 factor{1};
};

class TextureBake {
public:
    TextureBake(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares, uint32_t resolution)
        : source_(source),
          unwrapped_(unwrapped),
          resolution_(resolution),
          bands_((resolution + band_rows - 1) / band_rows) {
        in_band_.resize(size_t{squares} * bands_);
        for (uint32_t t = 0; t < unwrapped.mesh.triangle_count(); ++t) {
            double low = resolution, high = 0;
            for (const uint32_t w : unwrapped.mesh.triangles[t]) {
                low = std::min(low, static_cast<double>(unwrapped.mesh.uvs[w].y) * resolution);
                high = std::max(high, static_cast<double>(unwrapped.mesh.uvs[w].y) * resolution);
            }
            const auto last = std::min(static_cast<uint32_t>(high) / band_rows, bands_ - 1);
            for (uint32_t b = static_cast<uint32_t>(low) / band_rows; b <= last; ++b)
                in_band_[size_t{unwrapped.square[t]} * bands_ + b].push_back(t);
        }
    }

    // covered: per texel, whether a triangle gave it its colour.
    Image run(uint32_t square, std::vector<uint8_t>& covered) const {
        Image image{resolution_, resolution_, {}};
        image.texels.resize(size_t{resolution_} * resolution_);
        covered.assign(image.texels.size(), 0);
        parallel_for(bands_, 1, [&](size_t begin, size_t end) {
            std::vector<Texel> texels;
            for (size_t b = begin; b < end; ++b) {
                texels.assign(size_t{resolution_} * band_rows, {});
                for (const uint32_t t : in_band_[square * bands_ + b])
                    draw(triangle(t), static_cast<uint32_t>(b) * band_rows, texels);
                const size_t first = b * band_rows * resolution_,
                             count = std::min(texels.size(), image.texels.size() - first);
                for (size_t i = 0; i < count; ++i) {
                    if (texels[i].samples == 0) continue;
                    covered[first + i] = 1;
                    const glm::vec3 c = texels[i].colour / texels[i].weight;
                    const float alpha = texels[i].alpha / texels[i].samples;
                    image.texels[first + i] = {byte_of_linear(c.x), byte_of_linear(c.y), byte_of_linear(c.z),
                                               static_cast<uint8_t>(std::lround(255 * std::clamp(alpha, 0.0f, 1.0f)))};
                }
            }
        });
        return image;
    }

private:
    OldAndNew triangle(uint32_t t) const {
        OldAndNew made;
        const SurfaceTriangle& part = unwrapped_.parts[t];
        const CutPlaces::Corners& places = unwrapped_.places.of(part);
        const Triangle& old = source_.triangles[part.source];
        for (size_t k = 0; k < 3; ++k) {
            made.corners[k] =
                glm::dvec2(unwrapped_.mesh.uvs[unwrapped_.mesh.triangles[t][k]]) * static_cast<double>(resolution_);
            if (source_.uvs.empty()) continue;
            const glm::dvec2 place(places[k]);
            made.old[k] = glm::dvec2(source_.uvs[old[0]]) * (1 - place.x - place.y) +
                          glm::dvec2(source_.uvs[old[1]]) * place.x + glm::dvec2(source_.uvs[old[2]]) * place.y;
        }
        if (source_.material_table.empty()) return made;
        const Material& material = source_.material_table[source_.materials.empty() ? 0 : source_.materials[old[0]]];
        made.factor = material.base_colour;
        if (material.base_colour_texture.image >= 0 && !source_.uvs.empty())
            made.image = &source_.images[static_cast<size_t>(material.base_colour_texture.image)];
        return made;
    }

    // Along a side of a texel, so that there are two samples or more to a texel of the old image.
    static int samples_for(const OldAndNew& t, const glm::dvec2& by_x, const glm::dvec2& by_y) {
        if (t.image == nullptr) return fewest_samples;
        const glm::dvec2 size(t.image->width, t.image->height);
        const double longest = std::max(glm::length(by_x * size), glm::length(by_y * size));
        return static_cast<int>(std::clamp(std::ceil(2 * longest), double{fewest_samples}, double{most_samples}));
    }

    // Samples of the triangle in the band whose first row is `top`.
    void draw(const OldAndNew& t, uint32_t top, std::vector<Texel>& texels) const {
        const glm::dvec2 &a = t.corners[0], e = t.corners[1] - a, f = t.corners[2] - a;
        const double twice = e.x * f.y - e.y * f.x;
        if (twice == 0) return;
        const glm::dvec2 old_e = t.old[1] - t.old[0], old_f = t.old[2] - t.old[0];
        const glm::dvec2 by_x = (old_e * f.y - old_f * e.y) / twice, by_y = (old_f * e.x - old_e * f.x) / twice;
        const int n = samples_for(t, by_x, by_y);
        const float share = 1.0f / static_cast<float>(n * n);
        const double low = std::max(std::min({a.y, t.corners[1].y, t.corners[2].y}), static_cast<double>(top)),
                     high = std::min(std::max({a.y, t.corners[1].y, t.corners[2].y}),
                                     static_cast<double>(std::min(top + band_rows, resolution_)));
        // Rows of samples lie at (i + 1/2) / n.
        const auto first_at = [&](double at) { return static_cast<int64_t>(std::ceil(at * n - 0.5)); };
        for (int64_t row = first_at(low); row < first_at(high); ++row) {
            const double y = (static_cast<double>(row) + 0.5) / n;
            const auto [begin, end] = span_at(t, y);
            const size_t line = (static_cast<size_t>(row / n) - top) * resolution_;
            for (int64_t column = std::max<int64_t>(first_at(begin), 0); column < first_at(end); ++column) {
                const auto x = static_cast<size_t>(column / n);
                if (x >= resolution_) break;
                const glm::dvec2 off((static_cast<double>(column) + 0.5) / n - a.x, y - a.y);
                glm::vec4 colour = t.factor;
                if (t.image != nullptr) colour *= looked_up(*t.image, t.old[0] + by_x * off.x + by_y * off.y);
                texels[line + x].add(colour, share);
            }
        }
    }

    // Where a row lies in the triangle.
    static std::pair<double, double> span_at(const OldAndNew& t, double y) {
        double begin = 1e300, end = -1e300;
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec2 &p = t.corners[k], &q = t.corners[(k + 1) % 3];
            if ((p.y <= y) == (q.y <= y)) continue;
            // From the lower end, so that both triangles along an edge find the same place.
            const glm::dvec2 &from = p.y < q.y ? p : q, &to = p.y < q.y ? q : p;
            const double x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
            begin = std::min(begin, x);
            end = std::max(end, x);
        }
        return {begin, end};
    }

    const TriMesh& source_;
    const Unwrapped& unwrapped_;
    const uint32_t resolution_, bands_;
    std::vector<std::vector<uint32_t>> in_band_;  // triangles, per square and band
};

// Texels that are not covered take the mean of those around them that are; so often. Then all others that of larger and
// larger squares.
class Filling {
public:
    Filling(Image& image, std::vector<uint8_t>& covered) : image_(image), covered_(covered) {}

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
    static void fill_level(Image& image, const std::vector<uint8_t>& covered) {
        if (std::ranges::find(covered, 0) == covered.end()) return;
        if (image.width == 1 && image.height == 1) {
            image.texels[0] = {255, 255, 255, 255};
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
};

}  // namespace

std::vector<Image> bake_textures(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares,
                                 uint32_t resolution) {
    LODE_CHECK(resolution > 0);
    constexpr int spread_passes = 4;
    const TextureBake bake(source, unwrapped, squares, resolution);
    std::vector<Image> images;
    std::vector<uint8_t> covered;
    for (uint32_t s = 0; s < squares; ++s) {
        images.push_back(bake.run(s, covered));
        Filling filling(images.back(), covered);
        filling.spread(spread_passes);
        filling.fill_rest();
    }
    return images;
}

void use_textures(TriMesh& mesh, const std::vector<Image>& images, size_t materials_before) {
    const std::vector<Material> before = std::move(mesh.material_table);
    const size_t squares = images.size();
    std::vector<Material> table;
    std::vector<uint16_t> number(std::max(before.size(), squares), 0);
    for (size_t s = 0; s < squares; ++s) {
        std::array<int, 2> of_sides = {-1, -1};  // single-sided, double-sided
        for (size_t m = 0; m < materials_before; ++m) {
            const size_t old = s * materials_before + m;
            const bool both = old < before.size() && before[old].double_sided;
            int& becomes = of_sides[both ? 1 : 0];
            if (becomes < 0) {
                becomes = static_cast<int>(table.size());
                Material material;
                material.name = "texture" + std::to_string(s) + (both ? "-double-sided" : "");
                material.base_colour_texture.image = static_cast<int32_t>(s);
                material.double_sided = both;
                table.push_back(material);
            }
            number[old] = static_cast<uint16_t>(becomes);
        }
    }
    if (mesh.materials.empty()) mesh.materials.assign(mesh.wedge_count(), 0);
    for (uint16_t& m : mesh.materials) m = number[m];
    mesh.material_table = std::move(table);
    mesh.images = images;
}

}  // namespace lodestone::vgi
