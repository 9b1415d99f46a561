// Work on bytes that may be hostile, in a process of its own under limits of memory and time, so that whatever they
// make a library do ends that process alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

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
    explicit ConfinedResult(uint64_t bytes);
    ~ConfinedResult();
    ConfinedResult(const ConfinedResult&) = delete;
    ConfinedResult& operator=(const ConfinedResult&) = delete;
    bool mapped() const { return at_ != nullptr; }
    std::span<std::byte> bytes() const;  // ConfinedWork::result_bytes, aligned to 16 bytes

private:
    friend Result<std::shared_ptr<const ConfinedResult>> run_confined(
        const ConfinedWork& work, const std::function<std::string(std::span<std::byte>)>& run);
    struct Head;
    uint64_t bytes_;
    Head* at_ = nullptr;
};

// Calls run(the result's bytes) in another process, which ends with it; that returns what is wrong, or nothing.
// Exceptions of it are told as what is wrong. Fault::format with what is wrong, or where it crashed, took too long or
// too much memory; Fault::machine where no process can be started.
Result<std::shared_ptr<const ConfinedResult>> run_confined(const ConfinedWork& work,
                                                           const std::function<std::string(std::span<std::byte>)>& run);

}  // namespace lodestone
