// Work on bytes that may be hostile, in a process of its own under limits of memory and time, so that whatever they
// make a library do ends that process alone. The process is a copy of the one that asks, or a program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

struct ConfinedWork {
    std::string library;        // whose decoder it is, for messages
    uint64_t result_bytes = 0;  // of the memory that both processes see; zeros, and taken only as it is written
    uint64_t memory_bytes = 0;  // that it may map besides what is mapped already; with sanitizers there is no limit
    double seconds = 0;         // of processor time, > 0
};

// What the work has left. Whatever wrote it may be under the control of a file: check all of it.
class ConfinedResult {
public:
    ConfinedResult(const ConfinedWork& work, int file);  // in a file of that size; -1: none
    ~ConfinedResult();
    ConfinedResult(const ConfinedResult&) = delete;
    ConfinedResult& operator=(const ConfinedResult&) = delete;
    std::span<std::byte> bytes() const;  // ConfinedWork::result_bytes, aligned to 16 bytes

private:
    friend struct Confined;
    struct Head;
    uint64_t bytes_;
    Head* at_ = nullptr;  // where it is mapped; nullptr where there is no memory
};

// Calls run(the result's bytes) in a copy of this process, which ends with it; that returns what is wrong, or nothing.
// Exceptions of it are told as what is wrong. Fault::format with what is wrong, or where it crashed, took too long or
// too much memory; Fault::machine where no process can be started; Fault::interrupted where it was.
// A copy has one thread, and locks as they were: for a library that takes none but those of the heap. Any other needs
// a program of its own.
Result<std::shared_ptr<const ConfinedResult>> run_confined(const ConfinedWork& work,
                                                           const std::function<std::string(std::span<std::byte>)>& run);

// The same by a program of its own, whose main is confined_main, with those arguments. Fault::machine where it cannot
// be started or loaded, too.
Result<std::shared_ptr<const ConfinedResult>> run_confined(const ConfinedWork& work,
                                                           const std::filesystem::path& program,
                                                           const std::vector<std::string>& arguments);

// What such a program does: finds the memory by descriptor 3, limits itself, and calls run(arguments, the result's
// bytes). It returns where it was not started so, with the exit status.
int confined_main(int argc, char** argv,
                  const std::function<std::string(std::span<char* const> arguments, std::span<std::byte>)>& run);

}  // namespace lodestone
