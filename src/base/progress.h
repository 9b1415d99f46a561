// How long work tells how far it is and learns that it should stop.
#pragma once

#include <atomic>
#include <functional>
#include <string>

namespace lodestone {

// Given to long work by the program; every member may be left empty. Calls come from the thread that started the work.
struct Progress {
    // stage: a few words; fraction: of this stage, 0 .. 1.
    std::function<void(const std::string& stage, double fraction)> report;
    // A fact the user should know though the work goes on; one line, no trailing newline.
    std::function<void(const std::string& line)> warn;
    // Set by Ctrl-C; work checks it between steps and returns Fault::interrupted.
    const std::atomic<bool>* stop = nullptr;

    // Calls `report`, where there is one.
    void at(const std::string& stage, double fraction) const {
        if (report) report(stage, fraction);
    }
    // Calls `warn`, where there is one.
    void warning(const std::string& line) const {
        if (warn) warn(line);
    }
    // Whether the work should end now.
    bool stopped() const { return stop != nullptr && stop->load(std::memory_order_relaxed); }
};

}  // namespace lodestone
