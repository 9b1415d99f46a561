#include "base/files/chunk_file.h"

#include <algorithm>
#include <array>
#include <cstring>

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
    uint64_t table_offset;
    uint64_t chunk_count;
    Hash128 table_hash;
    Hash128 source_hash;
    Hash128 options_hash;
    uint64_t reserved;
    Hash128 header_hash;  // of all that stands before it
};
static_assert(sizeof(Header) == 112 && std::is_trivially_copyable_v<Header>);

struct TableEntry {
    std::array<char, chunk_name_bytes> name;
    uint64_t offset;
    uint64_t bytes;
    Hash128 hash;
};
static_assert(sizeof(TableEntry) == 72 && std::is_trivially_copyable_v<TableEntry>);

constexpr uint64_t aligned(uint64_t offset) {
    return (offset + chunk_alignment - 1) / chunk_alignment * chunk_alignment;
}
constexpr size_t verified_at_once = size_t{1} << 20;  // bytes
constexpr uint64_t first_chunk_offset = aligned(sizeof(Header));

Hash128 hash_of_header(const Header& header) {
    return hash_bytes(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, header_hash)));
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

Result<ChunkFile> ChunkFile::open(const fs::path& path) {
    auto input = InputFile::open(path);
    if (!input) return tl::unexpected(input.error());
    ChunkFile file;
    file.path_ = path;
    file.contents_ = std::make_shared<Contents>();
    file.contents_->file = *input;
    const uint64_t size = (*input)->size();
    Header header{};
    const auto raw = std::as_writable_bytes(std::span(&header, 1));
    if (auto read = (*input)->read(0, raw.first(std::min<uint64_t>(size, raw.size()))); !read)
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
    if (header.file_bytes != size) {
        return file.damaged("end of file", std::to_string(size) + " bytes where " + std::to_string(header.file_bytes) +
                                               " were written");
    }
    file.provenance_ = {header.source_hash, header.options_hash};
    if (auto read = file.read_table(header.table_offset, header.chunk_count, header.table_hash); !read)
        return tl::unexpected(read.error());
    return file;
}

Result<void> ChunkFile::read_table(uint64_t offset, uint64_t count, const Hash128& hash) {
    const uint64_t size = file_bytes();
    if (count > size / sizeof(TableEntry) || offset > size || count * sizeof(TableEntry) > size - offset)
        return damaged("table of contents", "lies outside the file");
    std::vector<TableEntry> table(count);
    const auto raw = std::as_writable_bytes(std::span(table));
    if (auto read = contents_->file->read(offset, raw); !read) return read;
    if (hash_bytes(raw) != hash) return damaged("table of contents", "damaged");
    uint64_t end = 0;
    for (TableEntry& entry : table) {
        entry.name.back() = 0;
        ChunkInfo info{entry.name.data(), entry.offset, entry.bytes, entry.hash};
        const std::string place = "chunk '" + info.name + "'";
        if (info.offset % chunk_alignment != 0 || info.offset > size || info.bytes > size - info.offset)
            return damaged(place, "lies outside the file");
        if (info.offset < end) return damaged(place, "lies within another one");
        end = info.offset + info.bytes;
        contents_->chunks.push_back(std::move(info));
    }
    contents_->loaded = std::vector<Loaded>(count);
    return {};
}

const ChunkInfo* ChunkFile::find(std::string_view name) const {
    const auto& all = contents_->chunks;
    const auto found = std::ranges::find(all, name, &ChunkInfo::name);
    return found == all.end() ? nullptr : &*found;
}

void ChunkFile::load(const ChunkInfo& info, Loaded& into) const {
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
    if (auto done = writer.align(); !done) return tl::unexpected(done.error());
    return writer;
}

Result<void> ChunkWriter::align() {
    static constexpr std::array<std::byte, chunk_alignment> zeros{};
    const uint64_t size = file_.size();
    return file_.write(std::span(zeros).first(aligned(size) - size));
}

Result<void> ChunkWriter::add(std::string_view name, std::span<const std::byte> bytes) {
    LODE_CHECK(!name.empty() && name.size() < chunk_name_bytes, name);
    LODE_CHECK(std::none_of(chunks_.begin(), chunks_.end(), [&](const ChunkInfo& c) { return c.name == name; }), name);
    chunks_.push_back({std::string(name), file_.size(), bytes.size(), hash_bytes(bytes)});
    if (auto done = file_.write(bytes); !done) return done;
    return align();
}

bool ChunkWriter::contains(std::string_view name) const {
    return std::any_of(chunks_.begin(), chunks_.end(), [&](const ChunkInfo& chunk) { return chunk.name == name; });
}

Result<uint64_t> ChunkWriter::commit() {
    std::vector<TableEntry> table;
    for (const ChunkInfo& info : chunks_) {
        TableEntry entry{};
        std::copy(info.name.begin(), info.name.end(), entry.name.begin());
        entry.offset = info.offset;
        entry.bytes = info.bytes;
        entry.hash = info.hash;
        table.push_back(entry);
    }
    const auto table_bytes = std::as_bytes(std::span(table));
    Header header{};
    header.magic = file_magic;
    header.endian = endian_mark;
    header.version = chunk_file_version;
    header.table_offset = file_.size();
    header.file_bytes = file_.size() + table_bytes.size();
    header.chunk_count = table.size();
    header.table_hash = hash_bytes(table_bytes);
    header.source_hash = provenance_.source;
    header.options_hash = provenance_.options;
    header.header_hash = hash_of_header(header);
    static_assert(first_chunk_offset >= sizeof(Header));
    if (auto done = file_.write(table_bytes); !done) return tl::unexpected(done.error());
    if (auto done = file_.write_at(0, std::as_bytes(std::span(&header, 1))); !done) return tl::unexpected(done.error());
    if (auto done = file_.commit(); !done) return tl::unexpected(done.error());
    return header.file_bytes;
}

}  // namespace lodestone
