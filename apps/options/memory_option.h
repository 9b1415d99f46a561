// What keeps a command to so much memory.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace lodestone {

struct MemoryOption {
    uint64_t mib = 0;  // 0: whatever it takes
    std::string tmp;   // folder for what waits in files; empty: the system's
    std::filesystem::path folder() const;
};

// Adds --memory; `option` must outlive the command.
void add_memory_option(CLI::App& command, MemoryOption& option);
// Adds --tmp. what: the files that go there, as help calls them.
void add_tmp_option(CLI::App& command, MemoryOption& option, const std::string& what);

// Keeps the program to it from now on, where it is given. who: "baking takes", for the error. Fault::usage where it is
// less than the program itself and small blocks take, Fault::machine where the folder holds no files.
Result<void> limit_memory(const MemoryOption& option, const std::string& who);

}  // namespace lodestone
