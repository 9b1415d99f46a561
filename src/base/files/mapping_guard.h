// Mappings of files whose bytes may go away. A file that is cut short, or a disk that cannot read, makes the system
// send SIGBUS to whoever touches the mapping there. A guarded mapping reads as zeros instead, and is marked.
//
// The first guard installs a handler of SIGBUS for the process. Faults elsewhere go to the handler that was there
// before.
#pragma once

#include <cstddef>

namespace lodestone {

// Guards begin .. begin + bytes, whole pages of a private mapping, until end_guard(). Returns the guard's number, or -1
// where too many mappings (4096) are guarded.
int guard_mapping(const void* begin, size_t bytes) noexcept;
// Something of the mapping could not be read, and is zeros now.
bool guard_failed(int guard) noexcept;
// Before the mapping is undone.
void end_guard(int guard) noexcept;

}  // namespace lodestone
