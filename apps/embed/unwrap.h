// New texture coordinates for a mesh that is in memory.
#pragma once

#include <string>
#include <vector>

#include "apps/scene/unwrap.h"

namespace lodestone {

// The options of `lodestone unwrap` that say what becomes of the mesh, as words of its command line. Fault::usage as
// there.
Result<UnwrapChoices> unwrap_choices_of(const std::vector<std::string>& words);
// The same of one text, divided as a shell would.
Result<UnwrapChoices> unwrap_choices_of_text(const std::string& text);

// The mesh is repaired first. Errors as those of repair() and vgi::unwrap; Fault::interrupted.
Result<UnwrapDone> unwrap(TriMesh mesh, const UnwrapChoices& choices, const Progress& progress = {});

}  // namespace lodestone
