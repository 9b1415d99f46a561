// The one name of JSON in the program.
#pragma once

#include <nlohmann/json.hpp>

namespace lodestone {

using Json = nlohmann::json;

}  // namespace lodestone
