// Data-parallel loops whose result does not depend on the number of threads: work is cut into chunks by the caller's
// grain alone, and every chunk writes only what belongs to it.
#pragma once

#include <cstddef>
#include <functional>

namespace lodestone {

// Sets how many threads parallel loops use from now on; 0 means one per hardware thread. Call it at start-up.
void set_thread_count(unsigned count);
unsigned thread_count();

// Calls body(begin, end) for consecutive chunks of [0, count) of `grain` items (the last may be shorter); chunks run in
// any order on any thread. grain > 0. Nested calls run on the calling thread. body must not throw.
void parallel_for(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body);

}  // namespace lodestone
