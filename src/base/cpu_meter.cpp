#include "base/cpu_meter.h"

#include <pthread.h>

#include <algorithm>
#include <ctime>
#include <mutex>
#include <vector>

namespace lodestone {

namespace {

std::mutex g_mutex;
std::vector<pthread_t> g_threads;
double g_ended_ms = 0;

double clock_ms(clockid_t clock) {
    timespec time{};
    if (clock_gettime(clock, &time) != 0) return 0;
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

}  // namespace

double thread_cpu_ms() { return clock_ms(CLOCK_THREAD_CPUTIME_ID); }

CountedThread::CountedThread() {
    const std::lock_guard lock(g_mutex);
    g_threads.push_back(pthread_self());
}

CountedThread::~CountedThread() {
    const std::lock_guard lock(g_mutex);
    g_ended_ms += thread_cpu_ms();
    g_threads.erase(std::ranges::find(g_threads, pthread_self()));
}

double started_threads_cpu_ms() {
    const std::lock_guard lock(g_mutex);
    double all = g_ended_ms;
    for (const pthread_t thread : g_threads) {
        clockid_t clock{};
        if (pthread_getcpuclockid(thread, &clock) == 0) all += clock_ms(clock);
    }
    return all;
}

}  // namespace lodestone
