// Random meshes as atlases: a bake gives an atlas whose samples are glued, or says in one line what it cannot do; what
// is written is read as it was.
#include "fuzz/atlas_file.h"
#include "fuzz/random_mesh.h"
#include "fuzz/watch.h"
#include "mesh/repair.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/bake/bake.h"
#include "vgi/extract/extract.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

// What a triangle counts beside its own bytes and those of the atlas: 2 MiB of memory, and 0.03 s (0.16 s with
// sanitizers). In a soup nearly every triangle becomes a chart of its own, and every round makes it anew: that takes
// 0.02 s (0.1 s).
constexpr size_t triangle_bytes = size_t{32} << 10;

void check_round_trip(const vgi::Atlas& atlas) {
    const auto read = vgi::open_atlas(in_a_file(atlas));
    require_good(read, "an atlas is read");
    require(read->positions == atlas.positions && read->sample_errors == atlas.sample_errors &&
                read->sample_radii == atlas.sample_radii && read->sides == atlas.sides &&
                read->bounds == atlas.bounds && read->uvs == atlas.uvs && read->colours == atlas.colours &&
                read->materials == atlas.materials && read->leaves == atlas.leaves &&
                read->leaf_parts == atlas.leaf_parts && read->unsampled_levels == atlas.unsampled_levels &&
                read->unsampled_attribute_levels == atlas.unsampled_attribute_levels,
            "an atlas is read as it was written");
}

// Where glued samples are equal they stay so, materials stay, and the rest is there.
void check_lossy(vgi::Atlas atlas, uint8_t quality) {
    atlas.attributes.texture_quality = quality;
    atlas.attributes.dense_quality = static_cast<uint8_t>((quality + 1) / 2);
    atlas.dense.assign(atlas.charts(), 1);
    const auto read = vgi::open_atlas(in_a_file(atlas));
    require_good(read, "a lossy atlas is read");
    require(read->materials == atlas.materials && read->normals.size() == atlas.normals.size(),
            "a lossy atlas has its materials");
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t n = atlas.attribute_cells_of(c);
        for (uint32_t s = 0; s < 4; ++s) {
            const vgi::GluedSide& glued = atlas.sides[4 * c + s];
            if (glued.chart == ~0u) continue;
            std::vector<std::array<size_t, 2>> pairs;
            bool equal = true;
            for (uint32_t k = 0; k <= n; ++k) {
                const auto [x, y] = vgi::on_side(s, k, n);
                const auto [u, v] = vgi::on_side(glued.side, n - k, n);
                pairs.push_back({atlas.attribute_texel(c, x, y), atlas.attribute_texel(glued.chart, u, v)});
                equal = equal && atlas.normals[pairs.back()[0]] == atlas.normals[pairs.back()[1]];
            }
            for (const auto& [here, there] : pairs)
                require(!equal || read->normals[here] == read->normals[there], "what is glued is decoded alike");
        }
    }
}

vgi::AtlasOptions random_options(FuzzedDataProvider& from) {
    vgi::AtlasOptions options;
    options.clusters.clusters = from.ConsumeIntegralInRange<uint32_t>(1, 12);
    options.cells = 2u << from.ConsumeIntegralInRange<int>(0, 4);
    options.attribute_ratio = 1u << from.ConsumeIntegralInRange<int>(0, 1);
    options.most_rounds = from.ConsumeIntegralInRange<uint32_t>(1, 3);
    options.error_samples = 200;
    options.leaves = from.ConsumeBool();
    return options;
}

// Returns the bytes of the atlas; 0 where there is none.
size_t check_atlas(TriMesh mesh, const vgi::AtlasOptions& options, FuzzedDataProvider& from) {
    if (!repair(mesh)) return 0;
    vgi::AtlasReport report;
    const auto atlas = vgi::make_atlas(mesh, options, report);
    if (!atlas) {
        check_error(atlas.error());
        return 0;
    }
    require_good(atlas->validate(), "an atlas is valid");
    for (uint32_t level = 0; level < atlas->levels(); ++level)
        require_good(extract_samples(*atlas, level).validate(), "a level is a valid mesh");
    if (options.leaves) {
        require_good(vgi::validate_leaves(*atlas), "leaves fit together");
        require_good(vgi::extract_leaves(*atlas).validate(), "leaves are a valid mesh");
    }
    check_round_trip(*atlas);
    check_lossy(*atlas, from.ConsumeIntegralInRange<uint8_t>(1, 100));
    return bytes_of(*atlas);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    FuzzedDataProvider from(data, size);
    const vgi::AtlasOptions options = random_options(from);
    TriMesh mesh = random_mesh(from);
    const size_t bytes = size + bytes_of(mesh) + mesh.triangle_count() * triangle_bytes;
    const Watch watch;
    watch.check(bytes + check_atlas(std::move(mesh), options, from));
    return 0;
}
