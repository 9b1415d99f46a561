#include "apps/drawing/grids.h"

#include <map>
#include <memory>

#include "volume/vdb/vdb_file.h"

namespace lodestone {

Result<void> read_grids(SceneVolumes& volumes) {
    std::map<std::pair<std::filesystem::path, std::string>, std::shared_ptr<const volume::DensityGrid>> known;
    for (const SceneGrid& named : volumes.grids) {
        auto& grid = known[{named.file, named.name}];
        if (!grid) {
            auto read = volume::read_vdb(named.file, named.name);
            if (!read) return tl::unexpected(read.error());
            grid = std::make_shared<const volume::DensityGrid>(std::move(*read));
        }
        for (size_t e = 0; e < named.count; ++e) volumes.emitters[named.first + e].grid = grid;
    }
    volumes.grids.clear();
    return {};
}

}  // namespace lodestone
