// Random meshes as atlases: a bake gives an atlas whose samples are glued, or says in one line what it cannot do; what
// is written is read as it was.
#include "fuzz/atlas_file.h"
#include "fuzz/random_mesh.h"
#include "mesh/repair.h"
#include "vgi/asset/leaves.h"
#include "vgi/bake/bake.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

void check_round_trip(const vgi::Atlas& atlas) {
    const auto read = vgi::open_atlas(in_a_file(atlas));
    require_good(read, "an atlas is read");
    require(read->positions == atlas.positions && read->sample_errors == atlas.sample_errors &&
                read->sample_radii == atlas.sample_radii && read->sides == atlas.sides &&
                read->bounds == atlas.bounds && read->uvs == atlas.uvs && read->colours == atlas.colours &&
                read->materials == atlas.materials && read->leaves == atlas.leaves &&
                read->leaf_parts == atlas.leaf_parts,
            "an atlas is read as it was written");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    FuzzedDataProvider from(data, size);
    vgi::AtlasOptions options;
    options.clusters.clusters = from.ConsumeIntegralInRange<uint32_t>(1, 12);
    options.cells = 2u << from.ConsumeIntegralInRange<int>(0, 4);
    options.attribute_ratio = 1u << from.ConsumeIntegralInRange<int>(0, 1);
    options.most_rounds = from.ConsumeIntegralInRange<uint32_t>(1, 3);
    options.error_samples = 200;
    options.leaves = from.ConsumeBool();
    TriMesh mesh = random_mesh(from);
    if (!repair(mesh)) return 0;
    vgi::AtlasReport report;
    const auto atlas = vgi::make_atlas(mesh, options, report);
    if (!atlas) {
        require(atlas.error().message.find('\n') == std::string::npos, "an error is one line");
        return 0;
    }
    require_good(atlas->validate(), "an atlas is valid");
    for (uint32_t level = 0; level < atlas->levels(); ++level)
        require_good(atlas->extract(level).validate(), "a level is a valid mesh");
    if (options.leaves) {
        require_good(vgi::validate_leaves(*atlas), "leaves fit together");
        require_good(vgi::extract_leaves(*atlas).validate(), "leaves are a valid mesh");
    }
    check_round_trip(*atlas);
    return 0;
}
