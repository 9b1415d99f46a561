// Where OpenVDB is not there.
#ifndef LODESTONE_WITH_OPENVDB
#include "volume/vdb/vdb_file.h"

namespace lodestone::volume {

bool reads_vdb() { return false; }

Result<DensityGrid> read_vdb(const std::filesystem::path& path, const std::string&, const GridLimits&) {
    return fail(Fault::format, path.string() +
                                   ": the program was built without OpenVDB and reads no .vdb files; "
                                   "install libopenvdb-dev and build it again");
}

}  // namespace lodestone::volume
#endif
