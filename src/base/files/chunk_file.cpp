#include "base/files/chunk_file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "base/check.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

constexpr std::array<char, 8> file_magic = {'L', 'O', 'D', 'E', 'S', 'T', 'N', '\n'};
constexpr uint32_t endian_mark = 0x01020304;

struct Header {
    std::array<char, 8> magic;
    uint32_t endian;
    uint32_t version;
    uint64_t file_bytes;
    uint64_t chunk_count;
    Hash128 entries_hash;  // of all entries in turn
    Hash128 source_hash;
    Hash128 options_hash;
    Hash128 header_hash;  // of all that stands before it
};
static_assert(sizeof(Header) == 96 && std::is_trivially_copyable_v<Header>);

// Stands before every chunk, so that the beginning of a file tells of itself.
struct Entry {
    std::array<char, chunk_name_bytes> name;
    uint64_t bytes;
    Hash128 hash;
    uint32_t reserved;
    uint32_t sum;  // of all that stands before it
};
static_assert(sizeof(Entry) == 72 && std::is_trivially_copyable_v<Entry>);

constexpr uint64_t aligned(uint64_t offset) {
    return (offset + chunk_alignment - 1) / chunk_alignment * chunk_alignment;
}
constexpr size_t verified_at_once = size_t{1} << 20;  // bytes

Hash128 hash_of_header(const Header& header) {
    return hash_bytes(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, header_hash)));
}

uint32_t sum_of_entry(const Entry& entry) {
    return checksum(std::as_bytes(std::span(&entry, 1)).first(offsetof(Entry, sum)));
}

}  // namespace

tl::unexpected<Error> ChunkFile::damaged(std::string_view place, std::string_view what) const {
    return fail(Fault::format,
                path_.string() + ": " + std::string(place) + ": " + std::string(what) + "; bake the asset again");
}

tl::unexpected<Error> ChunkFile::wrong_size(std::string_view name, uint64_t bytes, size_t element) const {
    return damaged("chunk '" + std::string(name) + "'", std::to_string(bytes) + " bytes are no whole number of " +
                                                            std::to_string(element) + "-byte records");
}

tl::unexpected<Error> ChunkFile::missing(std::string_view name) const {
    return damaged("chunk '" + std::string(name) + "'", "missing");
}

Result<ChunkFile> ChunkFile::open(const fs::path& path, Extent extent) {
    auto input = InputFile::open(path);
    if (!input) return tl::unexpected(input.error());
    return open(std::move(*input), path, extent);
}

Result<ChunkFile> ChunkFile::open(std::shared_ptr<const InputFile> input, const fs::path& path, Extent extent) {
    ChunkFile file;
    file.path_ = path;
    file.contents_ = std::make_shared<Contents>();
    file.contents_->file = std::move(input);
    const InputFile& from = *file.contents_->file;
    const uint64_t size = from.size();
    Header header{};
    const auto raw = std::as_writable_bytes(std::span(&header, 1));
    if (auto read = from.read(0, raw.first(std::min<uint64_t>(size, raw.size()))); !read)
        return tl::unexpected(read.error());
    if (size < sizeof header.magic || header.magic != file_magic) {
        return fail(Fault::format,
                    path.string() + ": header: not a Lodestone asset; give a .lode file made by `lodestone bake`");
    }
    if (size < sizeof header) return file.damaged("header", "the file is cut short");
    if (header.endian != endian_mark) { return file.damaged("header", "written on a machine with another byte order"); }
    if (header.version > chunk_file_version) {
        return fail(Fault::format, path.string() + ": header: format version " + std::to_string(header.version) +
                                       " is newer than this program's " + std::to_string(chunk_file_version) +
                                       "; use a newer lodestone or bake the asset again");
    }
    if (header.version < chunk_file_version) {
        return file.damaged("header", "format version " + std::to_string(header.version) + " is no longer read");
    }
    if (header.header_hash != hash_of_header(header)) return file.damaged("header", "damaged");
    if (header.file_bytes != size && (extent == Extent::whole || size > header.file_bytes)) {
        return file.damaged("end of file", std::to_string(size) + " bytes where " + std::to_string(header.file_bytes) +
                                               " were written");
    }
    file.provenance_ = {header.source_hash, header.options_hash};
    file.whole_bytes_ = header.file_bytes;
    if (auto read = file.read_entries(header.chunk_count, header.entries_hash); !read)
        return tl::unexpected(read.error());
    return file;
}

Result<void> ChunkFile::read_entries(uint64_t count, const Hash128& hash) {
    uint64_t offset = sizeof(Header);
    HashStream all;
    for (uint64_t i = 0; i < count; ++i) {
        const std::string place = "entry of chunk " + std::to_string(i);
        if (offset > whole_bytes_ || sizeof(Entry) > whole_bytes_ - offset)
            return damaged(place, "lies outside the file");
        if (offset + sizeof(Entry) > file_bytes()) break;  // of a prefix
        Entry entry{};
        const auto raw = std::as_writable_bytes(std::span(&entry, 1));
        if (auto read = contents_->file->read(offset, raw); !read) return read;
        if (entry.sum != sum_of_entry(entry)) return damaged(place, "damaged");
        all.add(raw);
        offset += sizeof(Entry);
        entry.name.back() = 0;
        // Names reach errors and the terminal.
        if (!std::ranges::all_of(std::string_view(entry.name.data()), [](char c) { return c > ' ' && c <= '~'; }))
            return damaged(place, "its name has characters that no chunk's name has");
        if (entry.bytes > whole_bytes_ - offset)
            return damaged("chunk '" + std::string(entry.name.data()) + "'", "lies outside the file");
        contents_->chunks.push_back({entry.name.data(), offset, entry.bytes, entry.hash});
        offset += entry.bytes;
    }
    contents_->loaded = std::vector<Loaded>(contents_->chunks.size());
    if (is_prefix()) return {};
    if (offset != whole_bytes_ || all.digest() != hash) return damaged("entries of chunks", "damaged");
    return {};
}

bool ChunkFile::contains(std::string_view name) const {
    const ChunkInfo* info = find(name);
    return info != nullptr && bytes_there(name) == info->bytes;
}

uint64_t ChunkFile::bytes_there(std::string_view name) const {
    const ChunkInfo* info = find(name);
    if (info == nullptr || info->offset > file_bytes()) return 0;
    return std::min(info->bytes, file_bytes() - info->offset);
}

const ChunkInfo* ChunkFile::find(std::string_view name) const {
    const auto& all = contents_->chunks;
    const auto found = std::ranges::find(all, name, &ChunkInfo::name);
    return found == all.end() ? nullptr : &*found;
}

void ChunkFile::load(const ChunkInfo& info, Loaded& into) const {
    if (bytes_there(info.name) < info.bytes) {
        into.error = damaged("chunk '" + info.name + "'", "cut short").value();
        return;
    }
    // Left as it comes; a vector would be written twice.
    auto memory = std::unique_ptr<std::byte[]>(new std::byte[info.bytes + chunk_alignment]);
    const auto address = reinterpret_cast<uintptr_t>(memory.get());
    const std::span bytes(memory.get() + (aligned(address) - address), info.bytes);
    if (auto read = contents_->file->read(info.offset, bytes); !read) {
        into.error = read.error();
    } else if (hash_bytes(bytes) != info.hash) {
        into.error = damaged("chunk '" + info.name + "'", "damaged").value();
    } else {
        into.memory = std::move(memory);
        into.bytes = bytes;
    }
}

Result<std::span<const std::byte>> ChunkFile::bytes(std::string_view name) const {
    const ChunkInfo* info = find(name);
    if (info == nullptr) return missing(name);
    Loaded& loaded = contents_->loaded[static_cast<size_t>(info - contents_->chunks.data())];
    std::call_once(loaded.once, [&] { load(*info, loaded); });
    if (loaded.error) return tl::unexpected(*loaded.error);
    return loaded.bytes;
}

Result<void> ChunkFile::read_part(std::string_view name, uint64_t offset, std::span<std::byte> into) const {
    const ChunkInfo* info = find(name);
    if (info == nullptr) return missing(name);
    if (offset > info->bytes || into.size() > info->bytes - offset)
        return damaged("chunk '" + info->name + "'",
                       "has no bytes " + std::to_string(offset) + " to " + std::to_string(offset + into.size()));
    return contents_->file->read(info->offset + offset, into);
}

Result<std::string_view> ChunkFile::text(std::string_view name) const {
    auto raw = bytes(name);
    if (!raw) return tl::unexpected(raw.error());
    return std::string_view(reinterpret_cast<const char*>(raw->data()), raw->size());
}

Result<void> ChunkFile::verify() const {
    std::vector<std::byte> piece(verified_at_once);
    for (const ChunkInfo& info : contents_->chunks) {
        HashStream hash;
        for (uint64_t done = 0; done < info.bytes;) {
            const auto part = std::span(piece).first(std::min<uint64_t>(piece.size(), info.bytes - done));
            if (auto read = contents_->file->read(info.offset + done, part); !read) return read;
            hash.add(part);
            done += part.size();
        }
        if (hash.digest() != info.hash) return damaged("chunk '" + info.name + "'", "damaged");
    }
    return {};
}

Result<ChunkWriter> ChunkWriter::create(const fs::path& path, const Provenance& provenance) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    ChunkWriter writer(std::move(*file));
    writer.provenance_ = provenance;
    const Header empty{};
    if (auto done = writer.file_.write(std::as_bytes(std::span(&empty, 1))); !done) return tl::unexpected(done.error());
    return writer;
}

Result<void> ChunkWriter::add(std::string_view name, std::span<const std::byte> bytes) {
    LODE_CHECK(!name.empty() && name.size() < chunk_name_bytes, name);
    LODE_CHECK(std::none_of(chunks_.begin(), chunks_.end(), [&](const ChunkInfo& c) { return c.name == name; }), name);
    Entry entry{};
    std::copy(name.begin(), name.end(), entry.name.begin());
    entry.bytes = bytes.size();
    entry.hash = hash_bytes(bytes);
    entry.sum = sum_of_entry(entry);
    const auto raw = std::as_bytes(std::span(&entry, 1));
    entries_.insert(entries_.end(), raw.begin(), raw.end());
    chunks_.push_back({std::string(name), file_.size() + sizeof(Entry), bytes.size(), entry.hash});
    if (auto done = file_.write(raw); !done) return done;
    return file_.write(bytes);
}

bool ChunkWriter::contains(std::string_view name) const {
    return std::any_of(chunks_.begin(), chunks_.end(), [&](const ChunkInfo& chunk) { return chunk.name == name; });
}

Result<uint64_t> ChunkWriter::commit() {
    Header header{};
    header.magic = file_magic;
    header.endian = endian_mark;
    header.version = chunk_file_version;
    header.file_bytes = file_.size();
    header.chunk_count = chunks_.size();
    header.entries_hash = hash_bytes(entries_);
    header.source_hash = provenance_.source;
    header.options_hash = provenance_.options;
    header.header_hash = hash_of_header(header);
    if (auto done = file_.write_at(0, std::as_bytes(std::span(&header, 1))); !done) return tl::unexpected(done.error());
    if (auto done = file_.commit(); !done) return tl::unexpected(done.error());
    return header.file_bytes;
}

}  // namespace lodestone
