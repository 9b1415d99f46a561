// JSON, by the one name it has here. Who includes it links nlohmann_json.
#pragma once

#include <nlohmann/json.hpp>

namespace lodestone {

using Json = nlohmann::json;

}  // namespace lodestone
