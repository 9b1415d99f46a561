#include <unordered_map>
#include <utility>

#include "base/check.h"
#include "vgi/asset/leaves/leaf_triangles.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {

namespace {

// The source as a mesh. Points are numbered by where they are on the leaves' lattice, on which all samples lie, too.
class SourceExtraction {
public:
    SourceExtraction(const Atlas& atlas, const ChartPlaces* places) : atlas_(atlas), places_(places), borders_(atlas) {}

    ExtractedMesh run() {
        mesh_.material_table = atlas_.material_table;
        mesh_.images = atlas_.images;
        for (uint32_t c = 0; c < atlas_.charts(); ++c) {
            for_leaf_squares(atlas_, c, [&](const Atlas::Tile& square, uint32_t leaf) {
                square_ = square;
                if (atlas_.has_leaf(leaf)) {
                    add_leaf(leaf);
                } else {
                    add_samples();
                }
            });
        }
        return {std::move(mesh_), std::move(is_sample_)};
    }

private:
    // Of a part's vertex, or of a sample of the square: the wedge it is drawn as.
    void add_leaf(uint32_t leaf) {
        const LeafBorder border = borders_.of(atlas_, square_);
        const auto cells = static_cast<int32_t>(tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page());
        for (uint32_t p = atlas_.first_part(leaf); p < atlas_.leaves[leaf].parts_end; ++p) {
            const LeafPart part = decoded_leaf(atlas_, p);
            for_drawn_triangles(
                part, border, cells,
                [&](uint32_t v) {
                    const LeafVertex& vertex = part.vertices[v];
                    const glm::dvec2 place = glm::dvec2(vertex.place[0], vertex.place[1]) / double{leaf_places};
                    return wedge(vertex.position, {attributes_at(atlas_, square_.chart, vertex), uv_of(place), false});
                },
                [&](GridPoint at) { return sample(at); },
                [&](uint32_t a, uint32_t b, uint32_t c) { add_triangle(a, b, c); });
        }
    }

    void add_samples() {
        const auto cells = static_cast<int32_t>(tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page());
        for (int32_t y = 0; y < cells; ++y) {
            for (int32_t x = 0; x < cells; ++x) {
                const uint32_t a = sample({x, y}), b = sample({x + 1, y}), c = sample({x + 1, y + 1}),
                               d = sample({x, y + 1});
                const bool rising = rising_diagonal(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
                for (const auto& t : cell_triangles(rising, a, b, c, d)) add_triangle(t[0], t[1], t[2]);
            }
        }
    }

    void add_triangle(uint32_t a, uint32_t b, uint32_t c) {
        const uint32_t i = mesh_.wedge_vertex[a], j = mesh_.wedge_vertex[b], k = mesh_.wedge_vertex[c];
        if (i != j && j != k && k != i) mesh_.triangles.push_back({a, b, c});
    }

    uint32_t sample(GridPoint at) {
        const uint32_t cells = tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page(),
                       x = square_.x * cells + static_cast<uint32_t>(at.x),
                       y = square_.y * cells + static_cast<uint32_t>(at.y),
                       ratio = atlas_.attribute_ratio_of(square_.chart);
        const auto& p = atlas_.positions[atlas_.texel(square_.chart, x, y)];
        const size_t texel = atlas_.attribute_texel(square_.chart, x * ratio, y * ratio);
        TexelAttributes attributes;
        attributes.normal = atlas_.normals[texel];
        if (!atlas_.uvs.empty()) attributes.uv = atlas_.uvs[texel];
        if (!atlas_.colours.empty()) attributes.colour = atlas_.colours[texel];
        if (!atlas_.materials.empty()) attributes.material = atlas_.materials[texel];
        return wedge({uint32_t{p[0]} << atlas_.leaf_shift, uint32_t{p[1]} << atlas_.leaf_shift,
                      uint32_t{p[2]} << atlas_.leaf_shift},
                     {attributes, uv_of(glm::dvec2(x, y) / static_cast<double>(atlas_.cells_of(square_.chart))),
                      places_ != nullptr});
    }

    // Of a place of the chart at hand, 0 .. 1 each way.
    glm::vec2 uv_of(const glm::dvec2& place) const {
        return places_ != nullptr ? places_->uv(square_.chart, place) : glm::vec2(0);
    }

    // All that one wedge has.
    struct Look {
        TexelAttributes attributes;
        glm::vec2 uv{0};      // of ChartPlaces
        bool sample = false;  // one that textures are for
        bool operator==(const Look&) const = default;
    };

    uint32_t wedge(const std::array<uint32_t, 3>& position, Look look) {
        // Textures have it.
        if (places_ != nullptr) look.attributes.colour = glm::u8vec4(255);
        const uint64_t key =
            uint64_t{position[0]} << (2 * leaf_bits) | uint64_t{position[1]} << leaf_bits | position[2];
        const auto [at, fresh] = vertices_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
        if (fresh) {
            mesh_.positions.emplace_back(atlas_.leaf_point(position));
            wedges_of_.emplace_back(~0u);
        }
        uint32_t* last = &wedges_of_[at->second];
        while (*last != ~0u) {
            if (looks_[*last] == look) return *last;
            last = &next_wedge_[*last];
        }
        *last = static_cast<uint32_t>(mesh_.wedge_vertex.size());
        const uint32_t number = *last;
        add_wedge(at->second, look);
        return number;
    }
    void add_wedge(uint32_t vertex, const Look& look) {
        const TexelAttributes& attributes = look.attributes;
        next_wedge_.push_back(~0u);
        looks_.push_back(look);
        is_sample_.push_back(look.sample);
        mesh_.wedge_vertex.push_back(vertex);
        mesh_.normals.push_back(unpack_octahedral(attributes.normal));
        if (places_ != nullptr)
            mesh_.uvs.push_back(look.uv);
        else if (atlas_.attributes.uvs)
            mesh_.uvs.push_back(atlas_.uv_low + atlas_.uv_step * glm::vec2(attributes.uv[0], attributes.uv[1]));
        if (places_ == nullptr && atlas_.attributes.colours) mesh_.colours.push_back(attributes.colour);
        if (atlas_.attributes.materials) mesh_.materials.push_back(attributes.material);
    }

    const Atlas& atlas_;
    const ChartPlaces* places_;  // may be null
    const LeafBorders borders_;
    Atlas::Tile square_{};  // at hand
    std::unordered_map<uint64_t, uint32_t> vertices_;
    std::vector<uint32_t> wedges_of_, next_wedge_;  // per vertex its first wedge, per wedge the next of its vertex
    std::vector<Look> looks_;                       // per wedge
    std::vector<bool> is_sample_;                   // per wedge
    TriMesh mesh_;
};

}  // namespace

ExtractedMesh extract_source(const Atlas& atlas, const ChartPlaces* places) {
    LODE_CHECK(!atlas.leaves.empty());
    return SourceExtraction(atlas, places).run();
}

TriMesh extract_leaves(const Atlas& atlas) { return extract_source(atlas, nullptr).mesh; }

}  // namespace lodestone::vgi
