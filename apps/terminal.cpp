#include "apps/terminal.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>

#include "base/text.h"

namespace lodestone {

namespace {

Verbosity g_verbosity = Verbosity::normal;
std::atomic<bool> g_stop{false};
bool g_line_open = false;
std::string g_last_stage;

void on_signal(int) { g_stop = true; }

void show(const std::string& stage, double fraction) {
    if (g_verbosity == Verbosity::quiet) return;
    if (isatty(STDERR_FILENO) != 0) {
        std::fprintf(stderr, "\r\033[K%s %3.0f%%", printable(stage).c_str(), fraction * 100);
        std::fflush(stderr);
        g_line_open = true;
    } else if (g_verbosity == Verbosity::verbose && stage != g_last_stage) {
        std::fprintf(stderr, "%s\n", printable(stage).c_str());
    }
    g_last_stage = stage;
}

}  // namespace

void set_verbosity(Verbosity verbosity) { g_verbosity = verbosity; }
Verbosity verbosity() { return g_verbosity; }

void end_progress() {
    if (!g_line_open) return;
    std::fputs("\r\033[K", stderr);
    g_line_open = false;
}

Progress terminal_progress() {
    Progress progress;
    progress.report = show;
    progress.warn = [](const std::string& line) {
        if (g_verbosity == Verbosity::quiet) return;
        end_progress();
        std::fprintf(stderr, "lodestone: warning: %s\n", printable(line).c_str());
    };
    progress.stop = &g_stop;
    return progress;
}

void note(const std::string& line) {
    if (g_verbosity != Verbosity::verbose) return;
    end_progress();
    std::fprintf(stderr, "lodestone: %s\n", printable(line).c_str());
}

void announce(const std::string& line) {
    if (g_verbosity == Verbosity::quiet) return;
    end_progress();
    std::fprintf(stderr, "lodestone: %s\n", printable(line).c_str());
}

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

int report_error(const Error& error) {
    end_progress();
    std::fprintf(stderr, "lodestone: %s\n", printable(error.message).c_str());
    return static_cast<int>(error.fault);
}

}  // namespace lodestone
