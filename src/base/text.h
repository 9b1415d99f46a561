// Text from outside.
#pragma once

#include <string>

namespace lodestone {

// Names in older files, and of files, are in whatever encoding their author used: bytes that are no UTF-8 are taken as
// Latin-1.
std::string as_utf8(const std::string& text);

}  // namespace lodestone
