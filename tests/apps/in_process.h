// Subcommands run without a process, for tests that run thousands of them.
#pragma once

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include <string>
#include <utility>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/terminal.h"

namespace lodestone {

struct Ran {
    int code = 0;
    std::string message;  // of the error that ended it; empty where it printed what it found
};

// What main() does, but for exceptions, which are left to the test. What is printed is dropped.
inline Ran run_in_process(std::vector<std::string> arguments) {
    set_verbosity(Verbosity::quiet);
    CLI::App app("lodestone", "lodestone");
    app.require_subcommand(1);
    Run run;
    add_info(app, run);
    add_verify(app, run);
    add_extract(app, run);
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
    testing::internal::CaptureStdout();
    const Result<int> code = run();
    testing::internal::GetCapturedStdout();
    return code ? Ran{*code, {}} : Ran{static_cast<int>(code.error().fault), code.error().message};
}

}  // namespace lodestone
