// The options of `unwrap` that say what becomes of the mesh.
#pragma once

#include <CLI/CLI.hpp>

#include "apps/scene/unwrap.h"

namespace lodestone {

// Adds them to a command; `choices` must outlive it. Help lists them in the order in which they are added.
void add_unwrap_options(CLI::App& command, UnwrapChoices& choices);

}  // namespace lodestone
