// Writing to what others have held.
#pragma once

#include <atomic>
#include <memory>

namespace lodestone {

// To be called once use_count() of `held` is 1, before it is written: what others have read of it, they read before
// they let go.
template <class T>
void synchronise_with_former_holders(const std::shared_ptr<T>& held) {
#if defined(__SANITIZE_THREAD__)
    // The thread sanitizer knows no fences, but that one more who lets go reads the count which the others wrote.
    std::shared_ptr<T>(held).reset();
#else
    static_cast<void>(held);
    std::atomic_thread_fence(std::memory_order_acquire);
#endif
}

}  // namespace lodestone
