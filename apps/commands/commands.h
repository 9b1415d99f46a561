// The subcommands of the program. Each adds itself to the command line and, when chosen, leaves in `run` what to do.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "base/result.h"

namespace lodestone {

// Returns the exit code, or the error that ends the program.
using Run = std::function<Result<int>()>;

void add_bake(CLI::App& app, Run& run);
void add_library(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);
void add_verify(CLI::App& app, Run& run);
void add_acmr(CLI::App& app, Run& run);
void add_extract(CLI::App& app, Run& run);
void add_tile(CLI::App& app, Run& run);
void add_unwrap(CLI::App& app, Run& run);
void add_generate(CLI::App& app, Run& run);
void add_render(CLI::App& app, Run& run);
void add_bench(CLI::App& app, Run& run);
void add_tune(CLI::App& app, Run& run);
void add_view(CLI::App& app, Run& run);
void add_probe(CLI::App& app, Run& run);

}  // namespace lodestone
