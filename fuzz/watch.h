// How much memory and time an input may take.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/tri_mesh.h"

namespace lodestone::fuzz {

// Watches allocations and processor time of the whole program, all threads together, while it lives. One at a time.
class Watch {
public:
    Watch();
    // Ends the program if more was taken since construction than `bytes` may take. bytes: the larger of what was given
    // and what it states or became.
    //   memory: live at once, 64 times as many bytes; what is below 1 MiB counts as 1 MiB.
    //   time: 0.2 s, and 1 s for every million bytes; five times as much, as sanitizers take.
    void check(size_t bytes) const;

private:
    int64_t begin_;
    double seconds_;
};

// What the arrays and images of a mesh take.
size_t bytes_of(const TriMesh& mesh);

}  // namespace lodestone::fuzz
