// Faults from outside, at moments that are spread over the time that something takes. LODESTONE_FAULTS sets how many
// moments are tried (8 unless set).
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <set>
#include <string>
#include <thread>

#include "apps/program.h"

namespace lodestone {

using Clock = std::chrono::steady_clock;

inline int moments() {
    const char* given = std::getenv("LODESTONE_FAULTS");
    return given != nullptr ? std::atoi(given) : 8;
}

class FaultTest : public ProgramTest {
protected:
    // A shell line in the test's folder, as a process of its own.
    pid_t start(const std::string& line) const {
        const pid_t child = fork();
        if (child == 0) {
            if (chdir(folder_.c_str()) != 0) _exit(99);
            if (freopen("/dev/null", "w", stdout) == nullptr || freopen("/dev/null", "w", stderr) == nullptr) _exit(99);
            execl("/bin/sh", "sh", "-c", line.c_str(), static_cast<char*>(nullptr));
            _exit(98);
        }
        return child;
    }
    static int exit_code(pid_t child) {
        int status = 0;
        waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    std::set<std::string> files() const {
        std::set<std::string> found;
        for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
            const std::string name = fs::relative(entry.path(), folder_).string();
            // A driver's own writes fail in silence.
            const bool is_of_driver = name.starts_with("cache/") && !name.starts_with("cache/lodestone");
            if (entry.is_regular_file() && !is_of_driver && name != "out.txt" && name != "err.txt") found.insert(name);
        }
        return found;
    }
    // Runs it once to its end for the time that it takes, then kills it at moments spread over that time.
    void kill_at_moments(const std::string& arguments, const std::function<void()>& after) {
        const auto begin = Clock::now();
        succeeds(arguments);
        const auto whole = Clock::now() - begin;
        for (int k = 0; k < moments(); ++k) {
            after();
            const pid_t child = start("exec " LODESTONE_PROGRAM " " + arguments);
            std::this_thread::sleep_for(whole * (2 * k + 1) / (2 * moments()));
            kill(child, SIGKILL);
            int status = 0;
            waitpid(child, &status, 0);
        }
        after();
    }
};

}  // namespace lodestone
