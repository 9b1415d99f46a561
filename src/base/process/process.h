// What processes know of themselves, and how one begins that another started.
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "base/result.h"

namespace lodestone {

// Where the file of the program lies that this process runs. Fault::machine where /proc does not tell.
Result<std::filesystem::path> this_program();

// First thing in a process that `parent` started: it is killed when that ends, at once if it has, and no signal is
// blocked. Allowed between fork and exec.
void begin_as_child_of(pid_t parent);

}  // namespace lodestone
