// The asset file: named chunks of bytes, each with its own hash. docs/file-format.md gives the layout. The file knows
// nothing of what the chunks mean. Chunks are copied into memory and not mapped, so that what was checked cannot change
// any more, whatever becomes of the file.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/files/file.h"
#include "base/hash.h"
#include "base/result.h"

namespace lodestone {

// Raised whenever what chunks hold is read in another way: neither then reads the other's files, and cached assets are
// baked anew.
inline constexpr uint32_t chunk_file_version = 16;
inline constexpr size_t chunk_alignment = 64;   // of every chunk's first byte in memory, in bytes
inline constexpr size_t chunk_name_bytes = 40;  // longest name, terminating zero included

// What a file was made from, so that a stale one can be told.
struct Provenance {
    Hash128 source;   // content of the source mesh file, as stored on disk
    Hash128 options;  // everything else the result depends on, the revision of the program among it
};

// What the file tells of a chunk, right before it.
struct ChunkInfo {
    std::string name;     // unique in the file, shorter than chunk_name_bytes
    uint64_t offset = 0;  // from the start of the file
    uint64_t bytes = 0;   // its size
    Hash128 hash;         // of these bytes
};

// How much of a file has to be there.
enum class Extent {
    whole,   // a file that is cut short is refused
    prefix,  // its beginning is enough: what is behind the end is not there
};

// An asset file, open for reading. Copies share it and what has been read of it.
class ChunkFile {
public:
    // Checks the header and what it tells of the chunks; they themselves are read and checked when first asked for.
    // Every error names the file, the place, what is wrong and what to do; Fault::format, or Fault::machine where
    // reading fails.
    static Result<ChunkFile> open(const std::filesystem::path& path, Extent extent = Extent::whole);
    // The same of a file that is open or in memory. path: for messages.
    static Result<ChunkFile> open(std::shared_ptr<const InputFile> input, const std::filesystem::path& path,
                                  Extent extent = Extent::whole);

    const std::filesystem::path& path() const { return path_; }                 // as given to open()
    const Provenance& provenance() const { return provenance_; }                // what the file was made from
    const std::vector<ChunkInfo>& chunks() const { return contents_->chunks; }  // by rising offset
    uint64_t file_bytes() const { return contents_->file->size(); }             // that are there
    uint64_t whole_bytes() const { return whole_bytes_; }                       // of the file when it was written
    bool is_prefix() const { return file_bytes() < whole_bytes_; }              // whether its end is missing
    bool contains(std::string_view name) const;                                 // whether there is such a chunk, whole
    uint64_t bytes_there(std::string_view name) const;                          // of a chunk that may be cut; 0 of none

    // The chunk's bytes, valid as long as this object or a copy of it lives; the first is aligned to chunk_alignment.
    // Fault::format where it is missing or damaged, Fault::machine where reading fails. Threads may ask for the same
    // chunk, of one object or of copies.
    Result<std::span<const std::byte>> bytes(std::string_view name) const;
    // Copies a part of a chunk without looking at its hash: for chunks larger than memory, whose parts have hashes of
    // their own.
    Result<void> read_part(std::string_view name, uint64_t offset, std::span<std::byte> into) const;
    // As bytes(), as text.
    Result<std::string_view> text(std::string_view name) const;

    // The chunk as an array of T; its size must be a multiple of T's.
    template <class T>
    Result<std::span<const T>> array(std::string_view name) const {
        static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= chunk_alignment);
        auto raw = bytes(name);
        if (!raw) return tl::unexpected(raw.error());
        if (raw->size() % sizeof(T) != 0) return wrong_size(name, raw->size(), sizeof(T));
        return std::span<const T>(reinterpret_cast<const T*>(raw->data()), raw->size() / sizeof(T));
    }

    // Reads every chunk anew, in pieces, and checks its hash. Fault::format names the first that is damaged.
    Result<void> verify() const;

private:
    // A chunk that was asked for: its bytes, or why there are none.
    struct Loaded {
        std::once_flag once;
        std::unique_ptr<std::byte[]> memory;
        std::span<const std::byte> bytes;
        std::optional<Error> error;
    };
    // What copies share.
    struct Contents {
        std::shared_ptr<const InputFile> file;
        std::vector<ChunkInfo> chunks;
        std::vector<Loaded> loaded;  // as chunks
    };

    ChunkFile() = default;
    Result<void> read_entries(uint64_t count, const Hash128& hash);
    void load(const ChunkInfo& info, Loaded& into) const;
    const ChunkInfo* find(std::string_view name) const;
    tl::unexpected<Error> missing(std::string_view name) const;
    tl::unexpected<Error> wrong_size(std::string_view name, uint64_t bytes, size_t element) const;
    tl::unexpected<Error> damaged(std::string_view place, std::string_view what) const;

    std::filesystem::path path_;
    Provenance provenance_;
    uint64_t whole_bytes_ = 0;
    std::shared_ptr<Contents> contents_;
};

// Writes a chunk file that appears whole or not at all. Chunks appear in the order they are added; the same chunks give
// the same bytes. Names are unique and shorter than chunk_name_bytes.
class ChunkWriter {
public:
    // Begins a file that will stand at `path`. Fault::machine where the folder cannot be written to.
    static Result<ChunkWriter> create(const std::filesystem::path& path, const Provenance& provenance);
    // Writes a chunk. Fault::machine where the disk cannot take it; a name that is too long or not new is a failed
    // check. No file is read that has names with other characters than '!' to '~'.
    Result<void> add(std::string_view name, std::span<const std::byte> bytes);
    // Adds the values as they lie in memory.
    template <class T>
    Result<void> add_array(std::string_view name, std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        return add(name, std::as_bytes(values));
    }
    // Adds the text, without a terminating zero.
    Result<void> add_text(std::string_view name, std::string_view text) {
        return add(name, std::as_bytes(std::span(text.data(), text.size())));
    }
    uint64_t bytes() const { return file_.size(); }  // written so far
    bool contains(std::string_view name) const;      // added so far
    // Writes the header, renames. Returns the file's size in bytes. Nothing may be added afterwards.
    Result<uint64_t> commit();

private:
    explicit ChunkWriter(OutputFile file) : file_(std::move(file)) {}
    OutputFile file_;
    Provenance provenance_;
    std::vector<ChunkInfo> chunks_;
    std::vector<std::byte> entries_;  // as they stand before the chunks
};

}  // namespace lodestone
