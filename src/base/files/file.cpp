#include "base/files/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include "base/files/mapping_guard.h"
#include "base/spill.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

std::string reason() { return std::strerror(errno); }

// Who is to blame for a file that cannot be opened: whoever named it where it is not there, not to be read or no file;
// the machine or the server it lies on for everything else (EIO, ESTALE, EMFILE, ENOMEM, ...), which may pass.
Fault fault_of_opening(int error) {
    switch (error) {
        case ENOENT:
        case EACCES:
        case EPERM:
        case ENOTDIR:
        case EISDIR:
        case ELOOP:
        case ENAMETOOLONG:
        case ENXIO:
        case ENODEV:
        case EINVAL:
            return Fault::format;
        default:
            return Fault::machine;
    }
}

constexpr size_t output_buffer_bytes = size_t{1} << 20;
constexpr const char* part_mark = ".part";  // in the names of outputs that are not whole yet
constexpr time_t least_abandoned_seconds = 10;

Result<FileBytes> gunzip(const fs::path& path, std::span<const std::byte> packed, uint64_t max_bytes) {
    auto unpacked = std::make_shared<std::vector<std::byte>>();
    z_stream stream{};
    if (inflateInit2(&stream, 15 + 16) != Z_OK) return fail(Fault::machine, "zlib cannot start");
    struct End {
        z_stream* stream;
        ~End() { inflateEnd(stream); }
    } end{&stream};
    size_t read = 0;
    std::vector<std::byte> block(size_t{1} << 20);
    for (;;) {
        if (stream.avail_in == 0 && read < packed.size()) {
            const size_t piece = std::min<size_t>(packed.size() - read, size_t{1} << 30);
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data() + read));
            stream.avail_in = static_cast<uInt>(piece);
            read += piece;
        }
        stream.next_out = reinterpret_cast<Bytef*>(block.data());
        stream.avail_out = static_cast<uInt>(block.size());
        const int code = inflate(&stream, Z_NO_FLUSH);
        if (code != Z_OK && code != Z_STREAM_END) {
            const char* what = code == Z_BUF_ERROR ? "ends too early" : "is damaged";
            return fail(Fault::format, path.string() + ": the gzip stream " + what + "; fetch or pack the file again");
        }
        unpacked->insert(unpacked->end(), block.begin(), block.end() - stream.avail_out);
        if (unpacked->size() > max_bytes) {
            return fail(Fault::format,
                        path.string() + ": unpacks to more than the limit of " + std::to_string(max_bytes) + " bytes");
        }
        if (code == Z_STREAM_END) {
            if (stream.avail_in == 0 && read == packed.size()) break;
            // Another member may follow (gzip files can be joined); trailing zero padding is allowed.
            if (*stream.next_in == 0) break;
            if (inflateReset(&stream) != Z_OK) return fail(Fault::machine, "zlib cannot go on");
        }
    }
    return FileBytes{std::span<const std::byte>(*unpacked), unpacked, nullptr};
}

}  // namespace

namespace {

Result<struct stat> status_of(int descriptor, const fs::path& path) {
    struct stat status {};
    if (fstat(descriptor, &status) != 0) return fail(Fault::machine, path.string() + ": cannot be opened: " + reason());
    if (!S_ISREG(status.st_mode)) return fail(Fault::format, path.string() + ": is not a regular file");
    return status;
}

// The descriptor of a regular file, for reading; the caller closes it.
Result<int> open_regular(const fs::path& path) {
    // Pipes, which are no regular files, would wait for who writes them.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) return fail(fault_of_opening(errno), path.string() + ": cannot be opened: " + reason());
    const auto status = status_of(descriptor, path);
    if (status) return descriptor;
    ::close(descriptor);
    return tl::unexpected(status.error());
}

}  // namespace

Result<MappedFile::State> MappedFile::state_of(int descriptor, const fs::path& path) {
    const auto status = status_of(descriptor, path);
    if (!status) return tl::unexpected(status.error());
    return State{static_cast<uint64_t>(status->st_size), status->st_mtim.tv_sec, status->st_mtim.tv_nsec};
}

Result<std::shared_ptr<const MappedFile>> MappedFile::open(const fs::path& path) {
    std::shared_ptr<MappedFile> file(new MappedFile);
    file->path_ = path;
    const auto descriptor = open_regular(path);
    if (!descriptor) return tl::unexpected(descriptor.error());
    file->descriptor_ = *descriptor;
    const auto state = state_of(file->descriptor_, path);
    if (!state) return tl::unexpected(state.error());
    file->opened_ = *state;
    const auto size = static_cast<size_t>(state->bytes);
    if (size == 0) return file;
    void* address = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file->descriptor_, 0);
    if (address == MAP_FAILED) return fail(Fault::machine, path.string() + ": cannot be mapped: " + reason());
    file->bytes_ = {static_cast<const std::byte*>(address), size};
    spill_mapping(address, size);
    file->guard_ = guard_mapping(address, size);
    if (file->guard_ < 0) return fail(Fault::machine, path.string() + ": cannot be mapped: too many files are");
    return file;
}

Result<void> MappedFile::intact() const {
    if (!guard_failed(guard_)) {
        const auto now = state_of(descriptor_, path_);
        if (now && *now == opened_) return {};
        return fail(Fault::format, path_.string() + ": was changed while it was read; try again when it is whole");
    }
    const auto now = state_of(descriptor_, path_);
    const bool cut = now && now->bytes < opened_.bytes;
    return fail(cut ? Fault::format : Fault::machine,
                path_.string() + (cut ? ": was cut short while it was read; try again when it is whole"
                                      : ": cannot be read: the disk reports an error"));
}

MappedFile::~MappedFile() {
    if (!bytes_.empty()) {
        end_guard(guard_);
        end_spill_mapping(bytes_.data());
        munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
    }
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<std::shared_ptr<const InputFile>> InputFile::open(const fs::path& path) {
    const auto descriptor = open_regular(path);
    if (!descriptor) return tl::unexpected(descriptor.error());
    const auto status = status_of(*descriptor, path);
    if (!status) return tl::unexpected(status.error());
    return std::shared_ptr<const InputFile>(new InputFile(path, *descriptor, static_cast<uint64_t>(status->st_size)));
}

std::shared_ptr<const InputFile> InputFile::of_memory(fs::path name, std::vector<std::byte> bytes) {
    const std::shared_ptr<InputFile> file(new InputFile(std::move(name), -1, bytes.size()));
    file->memory_ = std::move(bytes);
    return file;
}

InputFile::~InputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<void> InputFile::read(uint64_t offset, std::span<std::byte> into) const {
    if (descriptor_ < 0) {
        if (offset > size_ || into.size() > size_ - offset)
            return fail(Fault::format, path_.string() + ": ends before what is read of it");
        std::copy_n(memory_.begin() + static_cast<ptrdiff_t>(offset), into.size(), into.begin());
        return {};
    }
    while (!into.empty()) {
        const ssize_t n = ::pread(descriptor_, into.data(), into.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return fail(Fault::machine, path_.string() + ": cannot be read: " + reason());
        if (n == 0) return fail(Fault::format, path_.string() + ": was cut short while it was open");
        offset += static_cast<uint64_t>(n);
        into = into.subspan(static_cast<size_t>(n));
    }
    return {};
}

Result<FileBytes> read_file(const fs::path& path, uint64_t max_bytes) {
    auto mapped = MappedFile::open(path);
    if (!mapped) return tl::unexpected(mapped.error());
    const auto bytes = (*mapped)->bytes();
    const bool gzip = bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
    if (!gzip) return FileBytes{bytes, *mapped, *mapped};
    auto unpacked = gunzip(path, bytes, max_bytes);
    if (auto whole = (*mapped)->intact(); !whole) return tl::unexpected(whole.error());
    if (unpacked) unpacked->file = *mapped;
    return unpacked;
}

Result<fs::path> path_named_by(const fs::path& file, const std::string& name, bool allow_outside) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    const fs::path path = folder / name;
    if (allow_outside) return path;
    const auto leaves = [](const fs::path& relative) { return relative.empty() || *relative.begin() == ".."; };
    const auto outside = [&](const char* how) {
        return fail(Fault::format, file.string() + ": names '" + name + "', which lies outside its folder" + how +
                                       "; move it there, or allow it by --allow-outside");
    };
    if (fs::path(name).is_absolute() || name.find('\0') != std::string::npos) return outside("");
    if (leaves(fs::path(name).lexically_normal())) return outside("");
    std::error_code error;
    const fs::path real_folder = fs::canonical(folder, error);
    if (error) return path;  // nothing can be read from there
    const fs::path real = fs::weakly_canonical(path, error);
    if (error || leaves(real.lexically_relative(real_folder))) return outside(" by a symbolic link");
    return path;
}

Result<OutputFile> OutputFile::create(const fs::path& path) {
    OutputFile file;
    file.path_ = path;
    std::string pattern = path.string() + part_mark + "-XXXXXX";
    // Without a name until it is whole, so that nothing is left where the program is killed; where the file system
    // cannot do that, under a name of its own.
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    file.descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file.descriptor_ >= 0) {
        file.nameless_ = true;
    } else {
        file.descriptor_ = mkostemp(pattern.data(), O_CLOEXEC);
        if (file.descriptor_ < 0) return fail(Fault::machine, path.string() + ": cannot be written: " + reason());
        file.temporary_ = pattern;
    }
    // Tells abandoned_part() that somebody still writes. Where files cannot be locked, their age has to tell.
    ::flock(file.descriptor_, LOCK_EX | LOCK_NB);
    return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      nameless_(other.nameless_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      buffer_(std::move(other.buffer_)) {}

OutputFile::~OutputFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    if (!nameless_) ::unlink(temporary_.c_str());
}

bool abandoned_part(const fs::path& path) {
    const std::string name = path.filename().string();
    const size_t mark = name.rfind(part_mark);
    if (mark == std::string::npos || name.find('.', mark + 1) != std::string::npos) return false;
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    if (descriptor < 0) return false;
    struct stat status {};
    const bool old = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
                     std::time(nullptr) - status.st_mtime >= least_abandoned_seconds;
    const bool free = old && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
    ::close(descriptor);
    return free;
}

// A nameless file gets a name beside its path, from where it can be renamed over what is there.
bool OutputFile::name() {
    if (!nameless_) return true;
    const std::string self = "/proc/self/fd/" + std::to_string(descriptor_);
    for (unsigned i = 0; i < 100; ++i) {
        temporary_ = path_.string() + part_mark + std::to_string(getpid()) + "-" + std::to_string(i);
        if (linkat(AT_FDCWD, self.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) == 0) {
            nameless_ = false;
            return true;
        }
        if (errno != EEXIST) return false;
    }
    return false;
}

Result<void> OutputFile::flush() {
    size_t done = 0;
    while (done < buffer_.size()) {
        const ssize_t n = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return fail(Fault::machine, path_.string() + ": cannot be written: " + reason());
        done += static_cast<size_t>(n);
    }
    buffer_.clear();
    return {};
}

Result<void> OutputFile::write(std::span<const std::byte> bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    size_ += bytes.size();
    return buffer_.size() >= output_buffer_bytes ? flush() : Result<void>{};
}

Result<void> OutputFile::write_at(uint64_t offset, std::span<const std::byte> bytes) {
    if (auto done = flush(); !done) return done;
    size_t written = 0;
    while (written < bytes.size()) {
        const ssize_t n =
            ::pwrite(descriptor_, bytes.data() + written, bytes.size() - written, static_cast<off_t>(offset + written));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return fail(Fault::machine, path_.string() + ": cannot be written: " + reason());
        written += static_cast<size_t>(n);
    }
    return {};
}

Result<void> OutputFile::commit() {
    if (auto done = flush(); !done) return done;
    // mkostemp makes files private to the user; outputs take the permissions any new file would have.
    const mode_t mask = umask(0);
    umask(mask);
    const bool good = fchmod(descriptor_, 0666 & ~mask) == 0 && fsync(descriptor_) == 0 && name() &&
                      ::rename(temporary_.c_str(), path_.c_str()) == 0;
    if (!good) return fail(Fault::machine, path_.string() + ": cannot be written: " + reason());
    ::close(std::exchange(descriptor_, -1));
    return {};
}

}  // namespace lodestone
