// What the program says while it works: progress and warnings on stderr, results on stdout, and how it ends. Names from
// files are shown by printable() (base/text.h), so that none moves the cursor or begins a line.
#pragma once

#include <string>

#include "base/progress.h"
#include "base/result.h"

namespace lodestone {

enum class Verbosity { quiet, normal, verbose };

// Set once by main() before any command runs.
void set_verbosity(Verbosity verbosity);
Verbosity verbosity();

// Progress to stderr when it is a terminal (or always, a line per stage, when verbose); warnings to stderr unless
// quiet; stops on Ctrl-C.
Progress terminal_progress();

// What a progress line says of the time that a stage will still take, from the seconds it took so far and how far it is
// (0 .. 1): ", 12 s left"; nothing while that tells little.
std::string time_left(double seconds, double fraction);

// Clears a progress line left on the terminal.
void end_progress();

// A fact of interest, to stderr, when verbose.
void note(const std::string& line);
// A line on stderr unless --quiet.
void announce(const std::string& line);

// Makes Ctrl-C and SIGTERM set the flag that Progress::stopped() reads.
void catch_interrupts();

// One line on stderr; returns the exit code.
int report_error(const Error& error);

}  // namespace lodestone
