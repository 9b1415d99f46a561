// A folder that appears whole or not at all.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"

namespace lodestone {

// Filled beside `path` under another name and renamed by commit(). Without commit() what was written is removed by the
// destructor; of a program that is killed the folder ".NAME.part" stays, which the next one of that name empties.
class OutputFolder {
public:
    // A folder that is there is replaced if it holds nothing but what `ours` tells (the name of an entry, without
    // folders): Fault::usage names what else there is. Fault::machine where it cannot be written.
    static Result<OutputFolder> create(const std::filesystem::path& path,
                                       const std::function<bool(const std::string& name)>& ours);
    OutputFolder(OutputFolder&& other) noexcept;  // the other then removes nothing
    OutputFolder& operator=(OutputFolder&&) = delete;
    ~OutputFolder();
    // Where to write.
    const std::filesystem::path& path() const { return part_; }
    // Fault::machine where it cannot be put in its place.
    Result<void> commit();

private:
    OutputFolder() = default;
    std::filesystem::path path_, part_;
};

}  // namespace lodestone
