// Options of the program as text, for those who have no command line.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

// The words of a command line, or one text that is divided as a shell would. What they set is what was added to the
// command. Fault::usage.
Result<void> parse_options(CLI::App& command, const std::vector<std::string>& words);
Result<void> parse_options(CLI::App& command, const std::string& text);

}  // namespace lodestone
