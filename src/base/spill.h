// Large blocks of memory that are files: what is not in use can leave memory, so a program can hold more than it may
// keep resident. Who allocates by operator new need not know; the program that wants it replaces that operator
// (apps/spilled_new.cpp).
//
// A block is a mapping of a nameless file, shared, so its pages are the file's: dropping them from the process loses
// nothing, and the system writes them out when it needs their memory. A thread watches what is resident and drops
// blocks in turn before it passes what is allowed. The first blocks, up to a quarter of what is allowed, are memory
// like any other, and released blocks wait to be given out again: what needs little memory is not slowed down.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "base/result.h"

namespace lodestone {

struct SpillOptions {
    std::filesystem::path folder;     // on a disk with room for everything
    uint64_t resident_bytes = 0;      // that the process is kept to, about
    size_t least = size_t{32} << 10;  // bytes of a block; smaller ones are left where they are
};

// From now on, until the process ends. Fault::machine where the folder cannot hold files. Once.
Result<void> begin_spilling(const SpillOptions& options);

bool spilling() noexcept;  // whether it has begun

struct SpillStatistics {
    uint64_t blocks = 0, bytes = 0, most_bytes = 0;  // now, now, and at most so far
    uint64_t dropped = 0;                            // times that blocks were dropped from memory
    uint64_t looks = 0;                              // times that the watching thread has looked at what is resident
    bool full = false;                               // the folder had no room for a block
};
SpillStatistics spill_statistics();

// A mapping of a file that is only read is dropped like those blocks, from when it is made until it is unmapped.
void spill_mapping(const void* begin, size_t bytes) noexcept;
void end_spill_mapping(const void* begin) noexcept;

// For operator new. Null where spilling has not begun or the block is too small; std::bad_alloc where there is no room.
void* spill_allocate(size_t bytes);
// For operator delete: false where the block is not one of these.
bool spill_release(void* block) noexcept;

}  // namespace lodestone
