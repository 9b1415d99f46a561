// A bake in a process of its own.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

// How a process ended.
struct Ended {
    int code = 0;  // its exit code, or 128 + the signal that ended it
    double seconds = 0, cpu_seconds = 0;
    uint64_t peak_rss_bytes = 0;
    std::string out, err;  // what it wrote
};

// A process that was started and is waited for. It is killed where the program that started it ends, however that ends.
class Child {
public:
    // Fault::machine where the system cannot start it.
    static Result<Child> start(const std::filesystem::path& program, const std::vector<std::string>& words);
    Child(Child&& other) noexcept;
    Child& operator=(Child&& other) noexcept;
    ~Child();  // kills it
    // Nothing while it runs.
    std::optional<Ended> ended();
    void signal(int number) const;

private:
    Child() = default;
    void swap(Child& other) noexcept;
    pid_t pid_ = -1;
    int out_ = -1, err_ = -1;
    std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

}  // namespace lodestone
