// What frames took of what a budget allows them.
#pragma once

#include <string>
#include <vector>

#include "frame/frame_source.h"

namespace lodestone {

// The most that any frame took.
struct BudgetUse {
    uint64_t triangles = 0, upload_bytes = 0, resident_bytes = 0;
    void add(const BudgetUse& frame);
};

BudgetUse use_of(const PlanStats& stats);

// A sentence for each limit that was not kept: what was asked of the backend, and what it reached.
std::vector<std::string> beyond(const Budget& budget, const BudgetUse& use, const std::string& backend);

}  // namespace lodestone
