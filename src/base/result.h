// Errors as values. A function that can fail because of its input, the machine or the user returns Result<T>;
// a function that can only fail because its caller is wrong uses LODE_CHECK (check.h).
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

// Everything of the library. The technique `vgi` has a namespace of its own in it.
namespace lodestone {

// Who is to blame, and so which exit code the program ends with.
enum class Fault {
    invariant = 1,      // a structure or a comparison is not as it must be
    usage = 2,          // the command or the options are wrong
    format = 3,         // bad input or an unreadable asset
    machine = 4,        // memory, device, disk or driver cannot
    interrupted = 130,  // the user stopped the work
};

// Why a function gave no value.
struct Error {
    Fault fault = Fault::format;  // whose it is
    std::string message;          // one line, "file: place: what is wrong; what to do", no trailing newline
};

// A value, or why there is none.
template <class T>
using Result = tl::expected<T, Error>;

// An error to be returned as a Result; the message as in Error::message.
inline tl::unexpected<Error> fail(Fault fault, std::string message) {
    return tl::unexpected<Error>(Error{fault, std::move(message)});
}

// The same error with "place: " put before its message; for callers that know the file a lower room did not.
inline tl::unexpected<Error> fail_at(const std::string& place, const Error& error) {
    return tl::unexpected<Error>(Error{error.fault, place + ": " + error.message});
}

}  // namespace lodestone
