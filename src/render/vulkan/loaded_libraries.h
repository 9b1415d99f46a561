// Drivers stay loaded. Some can be loaded only so often by a program: NVIDIA's is not found any more after some sixteen
// instances that came and went.
#pragma once

#include <set>
#include <string>

namespace lodestone {

class LoadedLibraries {
public:
    LoadedLibraries();  // those that are loaded now
    // Keeps those that were loaded since until the program ends.
    void keep_new() const;

private:
    std::set<std::string> names_;
};

}  // namespace lodestone
