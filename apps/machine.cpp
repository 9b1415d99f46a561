#include "apps/machine.h"

#include <fstream>

namespace lodestone {

std::string cpu_name() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        if (line.rfind("model name", 0) != 0) continue;
        const size_t colon = line.find(": ");
        if (colon != std::string::npos) return line.substr(colon + 2);
    }
    return "unknown";
}

uint64_t available_memory() {
    std::ifstream in("/proc/meminfo");
    std::string word;
    for (uint64_t kib = 0; in >> word;) {
        if (word == "MemAvailable:" && in >> kib) return kib << 10;
    }
    return uint64_t{2} << 30;
}

std::string source_commit() { return LODESTONE_COMMIT; }

}  // namespace lodestone
