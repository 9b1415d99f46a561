// What a driver ends with where a promise is broken.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

#include "base/result.h"

namespace lodestone::fuzz {

// Says which, and ends the program.
[[noreturn]] inline void broken(const std::string& promise) {
    std::fprintf(stderr, "broken promise: %s\n", promise.c_str());
    std::abort();
}
// The same unless `good` holds.
inline void require(bool good, const char* promise) {
    if (!good) broken(promise);
}
// The same of a result; its error is told.
template <class T>
void require_good(const Result<T>& result, const char* promise) {
    if (!result) broken(std::string(promise) + ": " + result.error().message);
}

// An error is one line, which is not empty.
inline void check_error(const Error& error) {
    if (error.message.empty()) broken("an error has a message");
    if (error.message.find('\n') != std::string::npos) broken("an error is one line: " + error.message);
}

}  // namespace lodestone::fuzz
