// Density grids from OpenVDB's files. What OpenVDB itself does runs in a process of its own, so whatever a file makes
// it do ends that process alone.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "volume/grids/density_grid.h"

namespace lodestone::volume {

// Whether the program was built with OpenVDB. Without it no file is read.
bool reads_vdb();

// The grid of that name. name: "" for `density`, or where there is none of that name the first of floats, by name.
// Values are as OpenVDB gives them, be they active or not; they are densities, so 0 outside and nowhere below. Errors
// are one line that begins with the path: Fault::format where the file is no regular file, not there, larger than the
// limits, damaged, or has no such grid; where the grid is not of floats, a level set, empty, has values below 0 or that
// are no numbers, is not 0 outside, is not mapped by an affine map, or is larger than the limits; and where the program
// was built without OpenVDB. Fault::machine where it cannot be opened, or lodestone-vdb-reader, which lies beside the
// program or where it is installed, is not there or cannot be started.
Result<DensityGrid> read_vdb(const std::filesystem::path& path, const std::string& name = "",
                             const GridLimits& limits = {});

}  // namespace lodestone::volume
