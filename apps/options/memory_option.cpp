#include "apps/options/memory_option.h"

#include "base/spill.h"

namespace lodestone {

namespace {

constexpr uint64_t least_memory_mib = 192;  // the program itself, and what small blocks take

}  // namespace

std::filesystem::path MemoryOption::folder() const {
    std::error_code no_folder;
    return tmp.empty() ? std::filesystem::temp_directory_path(no_folder) : std::filesystem::path(tmp);
}

void add_memory_option(CLI::App& command, MemoryOption& option) {
    command
        .add_option("--memory", option.mib,
                    "Memory to keep to, in MiB, about, at least 192; the rest waits in unnamed files in --tmp")
        ->check(CLI::Range(1, 1 << 30));
}

void add_tmp_option(CLI::App& command, MemoryOption& option, const std::string& what) {
    command.add_option("--tmp", option.tmp, "Folder for the files of " + what + " unless given")
        ->check(CLI::ExistingDirectory);
}

Result<void> limit_memory(const MemoryOption& option, const std::string& who) {
    if (option.mib == 0) return {};
    if (option.mib < least_memory_mib) {
        return fail(Fault::usage, "--memory " + std::to_string(option.mib) + ": " + who + " at least " +
                                      std::to_string(least_memory_mib) + " MiB");
    }
    return begin_spilling({option.folder(), option.mib << 20});
}

}  // namespace lodestone
