#include "base/files/output_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

namespace lodestone {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> cannot(const fs::path& path, const char* what, const std::error_code& error) {
    return fail(Fault::machine, path.string() + ": " + what + ": " + error.message());
}

// All that was written to the file system that the folder lies in.
void flush(const fs::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::syncfs(descriptor);
    ::close(descriptor);
}

}  // namespace

Result<OutputFolder> OutputFolder::create(const fs::path& path,
                                          const std::function<bool(const std::string& name)>& ours) {
    std::error_code error;
    OutputFolder folder;
    folder.path_ = path.has_filename() ? path : path.parent_path();
    if (folder.path_.filename() == "." || folder.path_.filename() == ".." || folder.path_.filename().empty())
        return fail(Fault::usage, path.string() + ": is no name for a new folder");
    if (fs::exists(folder.path_, error)) {
        if (!fs::is_directory(folder.path_, error))
            return fail(Fault::usage, path.string() + ": is a file; name a folder");
        for (const auto& entry : fs::directory_iterator(folder.path_, error)) {
            const std::string name = entry.path().filename().string();
            if (!ours(name))
                return fail(Fault::usage, path.string() + ": holds " + name +
                                              ", which would be lost; name another folder or move it away");
        }
        if (error) return cannot(path, "cannot be read", error);
    }
    folder.part_ = folder.path_.parent_path() / ("." + folder.path_.filename().string() + ".part");
    fs::create_directories(fs::absolute(folder.part_).parent_path(), error);
    fs::remove_all(folder.part_, error);
    if (!fs::create_directory(folder.part_, error)) return cannot(path, "cannot be made", error);
    return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : path_(std::move(other.path_)), part_(std::exchange(other.part_, {})) {}

OutputFolder::~OutputFolder() {
    std::error_code error;
    if (!part_.empty()) fs::remove_all(part_, error);
}

Result<void> OutputFolder::commit() {
    flush(part_);
    std::error_code error;
    fs::rename(part_, path_, error);  // over nothing, or an empty folder
    if (error && fs::exists(path_)) {
        // Both change places in one step; what was there is removed by the destructor.
        if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE) == 0) return {};
        error = std::error_code(errno, std::generic_category());
    }
    if (error) return cannot(path_, "cannot be put in its place", error);
    part_.clear();
    return {};
}

}  // namespace lodestone
