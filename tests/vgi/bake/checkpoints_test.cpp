#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>

#include "fixtures/meshes.h"
#include "vgi/bake/bake.h"

namespace lodestone::vgi {
namespace {

namespace fs = std::filesystem;

AtlasOptions options_of_a_small_atlas() {
    AtlasOptions options;
    options.clusters.clusters = 6;
    options.cells = 16;
    options.error_samples = 500;
    return options;
}

// One work folder serves a retry with other options: what was kept with the first ones is not taken for its own.
TEST(Checkpoints, AreNotTakenForThoseOfOtherOptions) {
    const fs::path parent = fs::temp_directory_path() / ("lodestone_checkpoints_" + std::to_string(getpid()));
    fs::create_directories(parent);
    const TriMesh mesh = fixtures::repaired(Shape::vase, 2000);
    const auto work = CheckpointFolder::open(parent, {});
    ASSERT_TRUE(work);
    const std::pair<const char*, std::function<void(AtlasOptions&)>> changes[] = {
        {"none", [](AtlasOptions&) {}},
        {"none, again", [](AtlasOptions&) {}},
        {"cells", [](AtlasOptions& o) { o.cells = 32; }},
        {"clusters", [](AtlasOptions& o) { o.clusters.clusters = 12; }},
        {"compactness", [](AtlasOptions& o) { o.clusters.weights.compactness = 8; }},
        {"recentre_passes", [](AtlasOptions& o) { o.recentre_passes = 0; }},
        {"most_solves", [](AtlasOptions& o) { o.parameterise.most_solves = 0; }},
        {"attribute_ratio", [](AtlasOptions& o) { o.attribute_ratio = 2; }},
        {"rounding_share", [](AtlasOptions& o) { o.rounding_share = 5; }},
        {"worst_stretch and most_rounds",
         [](AtlasOptions& o) {
             o.worst_stretch = 1.1;
             o.most_rounds = 2;
         }},
        {"error_samples", [](AtlasOptions& o) { o.error_samples = 5000; }},
    };
    for (const auto& [name, change] : changes) {
        SCOPED_TRACE(name);
        AtlasOptions options = options_of_a_small_atlas();
        change(options);
        AtlasReport fresh_report, report;
        const auto fresh = make_atlas(mesh, options, fresh_report);
        const auto made = make_atlas(mesh, options, report, {}, &*work);
        ASSERT_TRUE(fresh);
        ASSERT_TRUE(made);
        EXPECT_EQ(made->cells, fresh->cells);
        EXPECT_EQ(made->step, fresh->step);
        EXPECT_TRUE(made->cluster == fresh->cluster);
        EXPECT_TRUE(made->positions == fresh->positions);
        EXPECT_TRUE(made->normals == fresh->normals);
        EXPECT_TRUE(made->errors == fresh->errors);
        EXPECT_EQ(report.rounds, fresh_report.rounds);
        EXPECT_EQ(report.rms_error, fresh_report.rms_error);
    }
    fs::remove_all(parent);
}

}  // namespace
}  // namespace lodestone::vgi
