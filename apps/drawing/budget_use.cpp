#include "apps/drawing/budget_use.h"

#include <algorithm>
#include <cstdio>

namespace lodestone {

void BudgetUse::add(const BudgetUse& frame) {
    triangles = std::max(triangles, frame.triangles);
    upload_bytes = std::max(upload_bytes, frame.upload_bytes);
    resident_bytes = std::max(resident_bytes, frame.resident_bytes);
}

BudgetUse use_of(const PlanStats& stats) { return {stats.triangles, stats.uploaded_bytes, stats.resident_bytes}; }

std::vector<std::string> beyond(const Budget& budget, const BudgetUse& use, const std::string& backend) {
    std::vector<std::string> lines;
    const auto in_mib = [](uint64_t bytes) {
        char text[32];
        std::snprintf(text, sizeof text, "%.2f MiB", static_cast<double>(bytes) / (1 << 20));
        return std::string(text);
    };
    if (use.triangles > budget.max_triangles && budget.forced_level < 0) {
        lines.push_back(backend + ": " + std::to_string(use.triangles) +
                        " triangles are the fewest it can draw here, " + std::to_string(budget.max_triangles) +
                        " were allowed");
    }
    if (use.upload_bytes > budget.upload_bytes) {
        lines.push_back(backend + ": a frame uploads " + in_mib(use.upload_bytes) + " at least, " +
                        in_mib(budget.upload_bytes) + " were allowed");
    }
    if (use.resident_bytes > budget.resident_bytes) {
        lines.push_back(backend + ": buffers take " + in_mib(use.resident_bytes) + " at least, " +
                        in_mib(budget.resident_bytes) + " were allowed");
    }
    return lines;
}

}  // namespace lodestone
