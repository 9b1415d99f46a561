// The program's operator new: large blocks go to files once spilling has begun (base/spill.h). Sanitizers bring
// operators of their own, and then everything stays in memory.
#include <cstdlib>
#include <new>

#include "base/sanitized.h"
#include "base/spill.h"

#if !LODE_SANITIZED

void* operator new(std::size_t bytes) {
    if (void* block = lodestone::spill_allocate(bytes)) return block;
    if (void* block = std::malloc(bytes > 0 ? bytes : 1)) return block;
    throw std::bad_alloc();
}
void operator delete(void* block) noexcept {
    if (!lodestone::spill_release(block)) std::free(block);
}
void operator delete(void* block, std::size_t) noexcept { operator delete(block); }

#endif
