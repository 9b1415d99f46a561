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

// A read-only mapping of a file; the bytes stay valid as long as the object lives.
class MappedFile {
public:
    static Result<std::shared_ptr<const MappedFile>> open(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    std::span<const std::byte> bytes() const { return bytes_; }

private:
    MappedFile() = default;
    std::span<const std::byte> bytes_;
};

// A file that is read in pieces, each copied. What a mapping answers with SIGBUS, a disk that fails or a file that was
// cut short meanwhile, is an error here; and what was copied stays what it was checked to be. Threads may share it.
class InputFile {
public:
    // Fault::format where it cannot be opened or is no regular file.
    static Result<std::shared_ptr<const InputFile>> open(const std::filesystem::path& path);
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
    int descriptor_;
    uint64_t size_;
};

// The file's bytes; gunzipped when they begin with gzip's magic. Bytes are mapped where nothing had to be unpacked.
// A gzip stream that is cut or damaged is Fault::format; a file that cannot be opened is Fault::format with the reason.
// max_bytes bounds what a gzip stream may unpack to.
struct FileBytes {
    std::span<const std::byte> bytes;
    std::shared_ptr<const void> owner;  // keeps `bytes` alive
};
Result<FileBytes> read_file(const std::filesystem::path& path, uint64_t max_bytes = uint64_t{1} << 36);

// An output file that appears whole or not at all: written beside `path` as a temporary, flushed and renamed by
// commit(). Without commit() the temporary is removed by the destructor.
class OutputFile {
public:
    static Result<OutputFile> create(const std::filesystem::path& path);
    OutputFile(OutputFile&&) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();
    Result<void> write(std::span<const std::byte> bytes);
    Result<void> write(const std::string& text) { return write(std::as_bytes(std::span(text.data(), text.size()))); }
    // Overwrites bytes already written; offset + bytes.size() must lie within what was written.
    Result<void> write_at(uint64_t offset, std::span<const std::byte> bytes);
    uint64_t size() const { return size_; }
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

}  // namespace lodestone
