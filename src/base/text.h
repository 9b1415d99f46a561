// Text from outside.
#pragma once

#include <string>

namespace lodestone {

// Names in older files, and of files, are in whatever encoding their author used: bytes that are no UTF-8 are taken as
// Latin-1.
std::string as_utf8(const std::string& text);

// For a terminal: what would move its cursor, colour it or end the line is written as an escape: "\x1b" for a control
// character, and for marks that turn the direction of text. Bytes that are no UTF-8 are taken as Latin-1. The rest
// stays as it is.
std::string printable(const std::string& text);

// What a library says, for the end of an error's line: without line ends, of 400 bytes at most.
std::string one_line(std::string text);

}  // namespace lodestone
