// Wall time, CPU time and peak memory of this process.
#pragma once

#include <chrono>
#include <cstdint>

namespace lodestone {

double process_cpu_seconds();  // user + system, all threads
uint64_t peak_rss_bytes();     // highest resident set so far

// Seconds since construction: wall() and cpu() of the whole process.
class Stopwatch {
public:
    Stopwatch() : wall_start_(std::chrono::steady_clock::now()), cpu_start_(process_cpu_seconds()) {}
    double wall() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start_).count();
    }
    double cpu() const { return process_cpu_seconds() - cpu_start_; }

private:
    std::chrono::steady_clock::time_point wall_start_;
    double cpu_start_;
};

}  // namespace lodestone
