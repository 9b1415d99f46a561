// Invariants. LODE_CHECK stays in release builds: it prints the condition, the place and the values given after it,
// then aborts. It is for faults of the program, never for bad input.
#pragma once

#include <sstream>
#include <string>

namespace lodestone {

[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& values);

template <class... Values>
std::string join_values(const Values&... values) {
    std::ostringstream out;
    [[maybe_unused]] const char* separator = "";
    ((out << separator << values, separator = ", "), ...);
    return out.str();
}

}  // namespace lodestone

#define LODE_CHECK(condition, ...)                                                                            \
    do {                                                                                                      \
        if (!(condition)) [[unlikely]] {                                                                      \
            ::lodestone::check_failed(__FILE__, __LINE__, #condition, ::lodestone::join_values(__VA_ARGS__)); \
        }                                                                                                     \
    } while (false)
