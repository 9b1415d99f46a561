#include "base/threads.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/cpu_meter.h"

namespace lodestone {

namespace {
std::atomic<unsigned> g_thread_count{0};
thread_local bool t_inside_loop = false;
}  // namespace

void set_thread_count(unsigned count) { g_thread_count = count; }

unsigned thread_count() {
    const unsigned count = g_thread_count;
    return count > 0 ? count : std::max(1u, std::thread::hardware_concurrency());
}

void parallel_for(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
    LODE_CHECK(grain > 0);
    const size_t chunks = (count + grain - 1) / grain;
    std::atomic<size_t> next{0};
    const auto work = [&] {
        const bool outer = std::exchange(t_inside_loop, true);
        for (size_t chunk = next++; chunk < chunks; chunk = next++) {
            body(chunk * grain, std::min(count, (chunk + 1) * grain));
        }
        t_inside_loop = outer;
    };
    const size_t workers = t_inside_loop ? 1 : std::min<size_t>(thread_count(), chunks);
    std::vector<std::jthread> others;
    for (size_t i = 1; i < workers; ++i) {
        others.emplace_back([&] {
            const CountedThread counted;
            work();
        });
    }
    work();
}

}  // namespace lodestone
