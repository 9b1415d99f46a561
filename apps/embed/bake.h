// Assets of a mesh that is in memory.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/asset.h"
#include "apps/scene/bake.h"
#include "base/json.h"
#include "base/progress.h"
#include "base/result.h"

namespace lodestone {

// The options of `lodestone bake` that say what the asset becomes, as words of its command line. Fault::usage as there.
Result<BakeOptions> bake_options_of(const std::vector<std::string>& words);
// The same of one text, divided as a shell would.
Result<BakeOptions> bake_options_of_text(const std::string& text);

// A mesh with the name of where it is from.
struct NamedMesh {
    TriMesh mesh;
    std::string name;  // for people
};

// What was baked.
struct BakedAsset {
    Json report;                 // the bake report of docs/cli.md
    std::optional<Asset> asset;  // where it was asked for
};
// Writes the asset to a file that appears whole or not at all, or to one without a name in the folder for temporary
// files where there is no path; it is open then, and gone when it is closed. opened: it is opened from a path, too.
Result<BakedAsset> bake_mesh(const NamedMesh& mesh, const BakeOptions& options,
                             const std::optional<std::filesystem::path>& path, bool opened, const Progress& progress);

}  // namespace lodestone
