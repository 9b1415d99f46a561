#include "base/files/checkpoint_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

namespace lodestone {

namespace fs = std::filesystem;

namespace {

bool same_file(int descriptor, const fs::path& path) {
    struct stat open {
    }, named{};
    return fstat(descriptor, &open) == 0 && ::stat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
           open.st_ino == named.st_ino;
}

// What a folder is called while it is being removed, and by whom.
const char* const going = "-gone";

// What others were removing when they were killed. Who still does finds nothing left to do.
void sweep_after(const fs::path& folder) {
    const std::string name = folder.filename().string() + going;
    std::error_code error;
    std::vector<fs::path> left;
    for (const auto& entry : fs::directory_iterator(folder.parent_path(), error)) {
        if (entry.path().filename().string().starts_with(name)) left.push_back(entry.path());
    }
    for (const fs::path& path : left) fs::remove_all(path, error);
}

}  // namespace

// False where the folder was taken away meanwhile by whoever had it before.
Result<bool> CheckpointFolder::lock() {
    const auto cannot = [&](const std::string& why) {
        return fail(Fault::machine, path_.string() + ": " + why + "; name another folder with --tmp");
    };
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) return cannot("cannot be made: " + error.message());
    const fs::path file = path_ / "lock";
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0 && errno == ENOENT) return false;
    if (descriptor < 0) return cannot(std::string("cannot be locked: ") + std::strerror(errno));
    lock_ = std::shared_ptr<const int>(new int(descriptor), [](const int* held) {
        ::close(*held);
        delete held;
    });
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return same_file(descriptor, file);
    if (errno == EWOULDBLOCK) return cannot("is in use by another bake of the same; wait until it has ended");
    return cannot(std::string("cannot be locked: ") + std::strerror(errno));
}

Result<CheckpointFolder> CheckpointFolder::open(const fs::path& parent, const Hash128& key) {
    CheckpointFolder folder(parent / ("lodestone-" + key.hex().substr(0, 16)), key);
    for (;;) {
        const auto locked = folder.lock();
        if (!locked) return tl::unexpected(locked.error());
        if (!*locked) continue;
        sweep_after(folder.path_);
        return folder;
    }
}

bool CheckpointFolder::begun() const {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_, error)) {
        if (entry.path().extension() == ".stage") return true;
    }
    return false;
}

std::optional<ChunkFile> CheckpointFolder::find(const std::string& stage) const {
    auto file = ChunkFile::open(file_of(stage));
    if (!file || !(file->provenance().source == key_) || !file->verify()) return std::nullopt;
    return std::move(*file);
}

Result<void> CheckpointFolder::keep(const std::string& stage,
                                    const std::function<Result<void>(ChunkWriter&)>& write) const {
    auto writer = ChunkWriter::create(file_of(stage), {key_, key_});
    if (!writer) return tl::unexpected(writer.error());
    if (auto done = write(*writer); !done) return done;
    if (auto done = writer->commit(); !done) return tl::unexpected(done.error());
    return {};
}

void CheckpointFolder::remove() const {
    if (!same_file(*lock_, path_ / "lock")) return;  // a copy of this has removed it, and others may have made it anew
    // Under another name first: who opens it from now on makes it anew.
    std::error_code error;
    const fs::path gone = path_.string() + going + std::to_string(getpid());
    fs::rename(path_, gone, error);
    if (!error) fs::remove_all(gone, error);
}

}  // namespace lodestone
