// Files: read whole (through gzip or not), written whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

// A read-only mapping of a file; the bytes stay valid as long as the object lives. Where the file is cut short, or the
// disk cannot read it, while it is mapped, bytes read as zeros, and intact() says so.
class MappedFile {
public:
    // Fault::format where there is no such regular file or it may not be read, Fault::machine where the disk, the
    // server or the system cannot open or map it.
    static Result<std::shared_ptr<const MappedFile>> open(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    std::span<const std::byte> bytes() const { return bytes_; }  // empty for an empty file
    // Fault::format where what was read of bytes() so far may not be what the file held when it was opened: it has been
    // written to or cut since, or a part of it cannot be read.
    Result<void> intact() const;

private:
    MappedFile() = default;
    // What tells one state of a file from another.
    struct State {
        uint64_t bytes = 0;
        int64_t seconds = 0, nanoseconds = 0;  // of the last change
        bool operator==(const State&) const = default;
    };
    static Result<State> state_of(int descriptor, const std::filesystem::path& path);
    std::filesystem::path path_;
    std::span<const std::byte> bytes_;
    int descriptor_ = -1, guard_ = -1;
    State opened_;
};

// A file that is read in pieces, each copied. What a mapping answers with SIGBUS, a disk that fails or a file that was
// cut short meanwhile, is an error here; and what was copied stays what it was checked to be. Threads may share it.
class InputFile {
public:
    // Errors as MappedFile::open.
    static Result<std::shared_ptr<const InputFile>> open(const std::filesystem::path& path);
    // A file that is in memory and nowhere else. name: for messages.
    static std::shared_ptr<const InputFile> of_memory(std::filesystem::path name, std::vector<std::byte> bytes);
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;
    uint64_t size() const { return size_; }  // bytes, when it was opened
    // Fills `into` from `offset` on. Fault::format where the file ends before, Fault::machine where reading fails.
    Result<void> read(uint64_t offset, std::span<std::byte> into) const;

private:
    InputFile(std::filesystem::path path, int descriptor, uint64_t size)
        : path_(std::move(path)), descriptor_(descriptor), size_(size) {}
    std::filesystem::path path_;
    int descriptor_;  // -1 where it is in memory
    uint64_t size_;
    std::vector<std::byte> memory_;
};

// A whole file in memory. Copies share it.
struct FileBytes {
    std::span<const std::byte> bytes;        // valid as long as `owner` lives
    std::shared_ptr<const void> owner;       // keeps `bytes` alive
    std::shared_ptr<const MappedFile> file;  // as it is stored
    // As MappedFile::intact.
    Result<void> intact() const { return file != nullptr ? file->intact() : Result<void>{}; }
};
// The file's bytes; gunzipped when they begin with gzip's magic. Bytes are mapped where nothing had to be unpacked. A
// gzip stream that is cut or damaged is Fault::format; a file that cannot be opened is as MappedFile::open says.
// max_bytes bounds what a gzip stream may unpack to; more is Fault::format.
Result<FileBytes> read_file(const std::filesystem::path& path, uint64_t max_bytes = uint64_t{1} << 36);

// The path that `file` means by `name`, relative to the folder it lies in. Fault::format where that leaves the folder,
// by an absolute path, by "..", or through a symbolic link, unless allow_outside. There need be no such file.
Result<std::filesystem::path> path_named_by(const std::filesystem::path& file, const std::string& name,
                                            bool allow_outside = false);

// An output file that appears whole or not at all: written beside `path` as a temporary, flushed and renamed by
// commit(). Without commit() the temporary is removed by the destructor.
class OutputFile {
public:
    // Fault::machine where the folder cannot be written to.
    static Result<OutputFile> create(const std::filesystem::path& path);
    OutputFile(OutputFile&&) noexcept;  // the other then writes and removes nothing
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();
    // Appends bytes, through a buffer of 1 MiB. Fault::machine where the disk cannot take them.
    Result<void> write(std::span<const std::byte> bytes);
    // Appends a text.
    Result<void> write(const std::string& text) { return write(std::as_bytes(std::span(text.data(), text.size()))); }
    // Overwrites bytes already written; offset + bytes.size() must lie within what was written.
    Result<void> write_at(uint64_t offset, std::span<const std::byte> bytes);
    uint64_t size() const { return size_; }  // bytes appended so far
    // Flushes to the disk and renames to `path`, over what is there. Fault::machine where that fails. Nothing may be
    // written afterwards.
    Result<void> commit();

private:
    OutputFile() = default;
    Result<void> flush();
    bool name();
    std::filesystem::path path_, temporary_;
    bool nameless_ = false;  // there is no temporary_ yet
    int descriptor_ = -1;
    uint64_t size_ = 0;
    std::vector<std::byte> buffer_;
};

// Whether this is what a killed program has left of an OutputFile, on a file system that knows no files without names:
// its name says so, nobody has it locked, and nobody has written to it for ten seconds.
bool abandoned_part(const std::filesystem::path& path);

}  // namespace lodestone
