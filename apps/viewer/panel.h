// The interactive demo's panel and its keys.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/viewer/viewer.h"

namespace lodestone {

struct ViewKey {
    Key key;
    std::string name;  // as --keys and the help call it
    std::string what;
    std::function<Result<void>(Viewer&)> act;
};
// Every key but those that move the camera.
const std::vector<ViewKey>& view_keys();

// Describes the panel to the overlay.
void describe_panel(Viewer& viewer);

}  // namespace lodestone
