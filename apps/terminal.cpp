#include "apps/terminal.h"

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>

#include "base/clock.h"
#include "base/text.h"

namespace lodestone {

namespace {

Verbosity g_verbosity = Verbosity::normal;
std::atomic<bool> g_stop{false};
bool g_line_open = false;
std::string g_last_stage;
double g_last_fraction = 0;
std::optional<Stopwatch> g_in_stage;

void on_signal(int) { g_stop = true; }

void show(const std::string& stage, double fraction) {
    if (g_verbosity == Verbosity::quiet) return;
    if (stage != g_last_stage || fraction < g_last_fraction || !g_in_stage) g_in_stage.emplace();
    g_last_fraction = fraction;
    if (isatty(STDERR_FILENO) != 0) {
        std::fprintf(stderr, "\r\033[K%s %3.0f%%%s", printable(stage).c_str(), fraction * 100,
                     time_left(g_in_stage->wall(), fraction).c_str());
        std::fflush(stderr);
        g_line_open = true;
    } else if (g_verbosity == Verbosity::verbose && stage != g_last_stage) {
        std::fprintf(stderr, "%s\n", printable(stage).c_str());
    }
    g_last_stage = stage;
}

}  // namespace

std::string time_left(double seconds, double fraction) {
    if (seconds < 2 || fraction < 0.01 || fraction >= 1) return "";
    const double left = seconds / fraction * (1 - fraction);
    const bool minutes = left >= 100;
    return ", " + std::to_string(std::llround(std::ceil(minutes ? left / 60 : left))) + (minutes ? " min" : " s") +
           " left";
}

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
