#include "base/files/mapping_guard.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>

namespace lodestone {

namespace {

constexpr size_t most_guards = 4096;
// What is replaced at once: few faults where much is gone, and little is lost where one page cannot be read.
constexpr uintptr_t replaced_bytes = uintptr_t{1} << 20;

// Read by a signal handler, so neither locked nor allocated. `bytes` is set last and cleared first: 0 where free.
struct Guarded {
    std::atomic<bool> taken{false}, failed{false};
    std::atomic<uintptr_t> begin{0};
    std::atomic<size_t> bytes{0};
};
static_assert(std::atomic<uintptr_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

std::array<Guarded, most_guards> g_guards;
struct sigaction g_before {};
uintptr_t g_page_bytes = 4096;

// Puts zeros where the file has none; false where the place is in no guarded mapping.
bool put_zeros(uintptr_t place) {
    for (Guarded& guarded : g_guards) {
        const size_t bytes = guarded.bytes.load(std::memory_order_acquire);
        const uintptr_t begin = guarded.begin.load(std::memory_order_relaxed);
        if (bytes == 0 || place < begin || place - begin >= bytes) continue;
        const uintptr_t first = place / g_page_bytes * g_page_bytes;
        const uintptr_t block_end = (place / replaced_bytes + 1) * replaced_bytes;
        const uintptr_t end = block_end < begin + bytes ? block_end : begin + bytes;
        guarded.failed.store(true, std::memory_order_relaxed);
        return mmap(reinterpret_cast<void*>(first), end - first, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1,
                    0) != MAP_FAILED;
    }
    return false;
}

void on_bus_error(int signal, siginfo_t* info, void* context) {
    if (info->si_code > 0 && put_zeros(reinterpret_cast<uintptr_t>(info->si_addr))) return;
    if ((g_before.sa_flags & SA_SIGINFO) != 0 && g_before.sa_sigaction != nullptr) {
        g_before.sa_sigaction(signal, info, context);
    } else if (g_before.sa_handler != SIG_DFL && g_before.sa_handler != SIG_IGN) {
        g_before.sa_handler(signal);
    } else {
        // The same again, without a handler, ends the program as it would have.
        std::signal(signal, SIG_DFL);
        if (info->si_code <= 0) raise(signal);
    }
}

bool install() {
    g_page_bytes = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
    struct sigaction action {};
    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigemptyset(&action.sa_mask);
    return sigaction(SIGBUS, &action, &g_before) == 0;
}

}  // namespace

int guard_mapping(const void* begin, size_t bytes) noexcept {
    static const bool installed = install();
    if (!installed) return -1;
    for (size_t i = 0; i < most_guards; ++i) {
        Guarded& guarded = g_guards[i];
        if (guarded.taken.exchange(true)) continue;
        guarded.failed = false;
        guarded.begin = reinterpret_cast<uintptr_t>(begin);
        guarded.bytes.store(bytes, std::memory_order_release);
        return static_cast<int>(i);
    }
    return -1;
}

bool guard_failed(int guard) noexcept { return guard >= 0 && g_guards[static_cast<size_t>(guard)].failed; }

void end_guard(int guard) noexcept {
    if (guard < 0) return;
    Guarded& guarded = g_guards[static_cast<size_t>(guard)];
    guarded.bytes.store(0, std::memory_order_release);
    guarded.taken = false;
}

}  // namespace lodestone
