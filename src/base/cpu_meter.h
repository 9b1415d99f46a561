// CPU time of the threads that Lodestone starts, by thread clocks: what a frame costs beside the thread that plans it.
// Threads of drivers are not ours and not counted.
#pragma once

namespace lodestone {

// Counts the thread that makes it, for as long as it lives. One at the top of every thread we start.
class CountedThread {
public:
    CountedThread();
    ~CountedThread();
    CountedThread(const CountedThread&) = delete;
    CountedThread& operator=(const CountedThread&) = delete;
};

double thread_cpu_ms();           // of the calling thread, since it began
double started_threads_cpu_ms();  // of all counted threads so far, those that have ended included

}  // namespace lodestone
