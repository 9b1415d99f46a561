// Data-parallel loops whose result does not depend on the number of threads: work is cut into chunks by the caller's
// grain alone, and every chunk writes only what belongs to it. The threads are made once and wait between loops.
#pragma once

#include <cstddef>
#include <functional>

namespace lodestone {

// Sets how many threads parallel loops use from now on; 0 means one per hardware thread. Call it at start-up.
void set_thread_count(unsigned count);
unsigned thread_count();  // how many threads a loop uses, at least 1

// Calls body(begin, end) for consecutive chunks of [0, count) of `grain` items (the last may be shorter). Chunks begin
// in their order, on any thread, the caller's included. grain > 0. Calls within a call of several chunks run
// on the calling thread. Any number of threads may call at once.
// Where a body throws, no further chunk begins, and the exception reaches the caller when all that have begun have
// ended. If several throw, the exception of the first chunk of them does, for any number of threads.
void parallel_for(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body);

}  // namespace lodestone
