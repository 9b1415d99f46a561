#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "base/structures/disjoint_sets.h"
#include "vgi/asset/sample_depths.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {

namespace {

// One level of an atlas as a mesh. Samples of all charts are numbered in turn.
class SampleExtraction {
public:
    // Samples are numbered in 32 bits (Limits::samples).
    SampleExtraction(const Atlas& atlas, uint32_t level, const ChartPlaces* places)
        : atlas_(atlas), depths_(atlas), level_(level), places_(places), first_(1, 0) {
        for (uint32_t c = 0; c < atlas.charts(); ++c)
            first_.push_back(first_[c] + (cells_at(c) + 1) * (cells_at(c) + 1));
    }

    TriMesh run() {
        mesh_.material_table = atlas_.material_table;
        mesh_.images = atlas_.images;
        vertex_.assign(first_.back(), ~0u);
        wedge_.resize(vertex_.size());
        DisjointSets glued = glued_samples();
        for (uint32_t c = 0; c < atlas_.charts(); ++c) add_wedges(c, glued);
        mesh_.triangles.reserve(atlas_.triangles_at(level_));
        for (uint32_t c = 0; c < atlas_.charts(); ++c) add_triangles(c);
        return std::move(mesh_);
    }

private:
    // Finest levels of a chart's own that are not extracted.
    uint32_t own_level(uint32_t chart) const {
        return std::max<uint32_t>(atlas_.own_level(chart, level_), atlas_.unsampled_levels[chart]);
    }
    uint32_t cells_at(uint32_t chart) const { return atlas_.cells_of(chart) >> own_level(chart); }
    uint32_t sample(uint32_t chart, uint32_t x, uint32_t y) const {
        return first_[chart] + y * (cells_at(chart) + 1) + x;
    }
    // Step k of so many.
    uint32_t side_sample(uint32_t chart, uint32_t side, uint32_t k, uint32_t steps) const {
        const uint32_t n = cells_at(chart);
        const auto [x, y] = on_side(side, k * (n / steps), n);
        return sample(chart, x, y);
    }

    // Samples of glued sides are one vertex.
    DisjointSets glued_samples() const {
        DisjointSets glued(first_.back());
        for (uint32_t c = 0; c < atlas_.charts(); ++c) {
            for (uint32_t s = 0; s < 4; ++s) {
                const GluedSide& other = atlas_.sides[size_t{c} * 4 + s];
                if (other.chart == ~0u) continue;
                const uint32_t n = std::min(cells_at(c), cells_at(other.chart));
                for (uint32_t k = 0; k <= n; ++k)
                    glued.join(side_sample(c, s, k, n), side_sample(other.chart, other.side, n - k, n));
            }
        }
        return glued;
    }

    void add_wedges(uint32_t c, DisjointSets& glued) {
        const uint32_t n = cells_at(c), stride = atlas_.cells_of(c) / n,
                       attribute_stride = atlas_.attribute_cells_of(c) / n;
        const std::vector<bool> absent = absent_samples(atlas_, depths_, c);
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x) {
                if (absent[size_t{y} * stride * (atlas_.cells_of(c) + 1) + x * stride]) continue;
                const uint32_t i = sample(c, x, y), root = glued.find(i);
                if (vertex_[root] == ~0u) {
                    vertex_[root] = static_cast<uint32_t>(mesh_.positions.size());
                    mesh_.positions.push_back(atlas_.position(atlas_.texel(c, x * stride, y * stride)));
                }
                vertex_[i] = vertex_[root];
                const glm::vec2 uv =
                    places_ != nullptr ? places_->uv(c, glm::dvec2(x, y) / static_cast<double>(n)) : glm::vec2(0);
                add_wedge(i, atlas_.attribute_texel(c, x * attribute_stride, y * attribute_stride), uv,
                          x == 0 || y == 0 || x == n || y == n);
            }
        }
    }

    // Samples of a border with the same attributes are one wedge.
    void add_wedge(uint32_t i, size_t texel, const glm::vec2& uv, bool border) {
        const auto next = static_cast<uint32_t>(mesh_.wedge_vertex.size());
        wedge_[i] = next;
        if (border) {
            const Attributes key{atlas_.normals[texel],
                                 atlas_.uvs.empty() ? std::array<uint16_t, 2>{} : atlas_.uvs[texel],
                                 atlas_.colours.empty() ? 0u : std::bit_cast<uint32_t>(atlas_.colours[texel]),
                                 atlas_.materials.empty() ? uint16_t{0} : atlas_.materials[texel],
                                 {uv.x, uv.y}};
            const auto [at, fresh] = on_border_.try_emplace({vertex_[i], key}, next);
            wedge_[i] = at->second;
            if (!fresh) return;
        }
        mesh_.wedge_vertex.push_back(vertex_[i]);
        mesh_.normals.push_back(atlas_.normal(texel));
        if (places_ != nullptr) {
            mesh_.uvs.push_back(uv);
        } else if (!atlas_.uvs.empty()) {
            const auto& own = atlas_.uvs[texel];
            mesh_.uvs.push_back(atlas_.uv_low + atlas_.uv_step * glm::vec2(own[0], own[1]));
        }
        if (places_ == nullptr && !atlas_.colours.empty()) mesh_.colours.push_back(atlas_.colours[texel]);
        if (!atlas_.materials.empty()) mesh_.materials.push_back(atlas_.materials[texel]);
    }

    void add_triangles(uint32_t c) {
        const uint32_t n = cells_at(c);
        if (!depths_.is_even(atlas_, c)) {
            const auto wedge = [&](GridPoint p) {
                return wedge_[sample(c, static_cast<uint32_t>(p.x) >> own_level(c),
                                     static_cast<uint32_t>(p.y) >> own_level(c))];
            };
            for_level_triangles(atlas_, depths_, c, own_level(c), [&](GridPoint p, GridPoint q, GridPoint r) {
                mesh_.triangles.push_back({wedge(p), wedge(q), wedge(r)});
            });
            return;
        }
        for (uint32_t y = 0; y < n; ++y) {
            for (uint32_t x = 0; x < n; ++x) {
                const auto halves =
                    cell_triangles(rising_diagonal(x, y), wedge_[sample(c, x, y)], wedge_[sample(c, x + 1, y)],
                                   wedge_[sample(c, x + 1, y + 1)], wedge_[sample(c, x, y + 1)]);
                mesh_.triangles.insert(mesh_.triangles.end(), halves.begin(), halves.end());
            }
        }
    }

    using Attributes =
        std::tuple<std::array<int8_t, 2>, std::array<uint16_t, 2>, uint32_t, uint16_t, std::array<float, 2>>;
    const Atlas& atlas_;
    const SampleDepths depths_;
    const uint32_t level_;
    const ChartPlaces* places_;                                      // may be null
    std::vector<uint32_t> first_;                                    // sample of each chart, and the end
    std::vector<uint32_t> vertex_, wedge_;                           // per sample; ~0 for none yet
    std::map<std::pair<uint32_t, Attributes>, uint32_t> on_border_;  // wedges by vertex and attributes
    TriMesh mesh_;
};

}  // namespace

TriMesh extract_samples(const Atlas& atlas, uint32_t level, const ChartPlaces* places) {
    LODE_CHECK(level < atlas.levels(), level, atlas.levels());
    return SampleExtraction(atlas, level, places).run();
}

}  // namespace lodestone::vgi
