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

Result<ChunkFile> ChunkFile::open(const fs::path& path) {
    auto mapped = MappedFile::open(path);
    if (!mapped) return tl::unexpected(mapped.error());
    ChunkFile file;
    file.path_ = path;
    file.mapped_ = *mapped;
    const auto bytes = file.mapped_->bytes();
    Header header{};
    if (bytes.size() < sizeof header.magic || std::memcmp(bytes.data(), file_magic.data(), file_magic.size()) != 0) {
        return fail(Fault::format,
                    path.string() + ": header: not a Lodestone asset; give a .lode file made by `lodestone bake`");
    }
    if (bytes.size() < sizeof header) return file.damaged("header", "the file is cut short");
    std::memcpy(&header, bytes.data(), sizeof header);
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
    if (header.file_bytes != bytes.size()) {
        return file.damaged("end of file", std::to_string(bytes.size()) + " bytes where " +
                                               std::to_string(header.file_bytes) + " were written");
    }
    // The header is as written, so what follows can only fail for a damaged table.
    const uint64_t table_bytes = header.chunk_count * sizeof(TableEntry);
    if (header.chunk_count > bytes.size() / sizeof(TableEntry) || header.table_offset > bytes.size() ||
        table_bytes > bytes.size() - header.table_offset) {
        return file.damaged("table of contents", "lies outside the file");
    }
    const auto table = bytes.subspan(header.table_offset, table_bytes);
    if (hash_bytes(table) != header.table_hash) return file.damaged("table of contents", "damaged");
    file.provenance_ = {header.source_hash, header.options_hash};
    for (uint64_t i = 0; i < header.chunk_count; ++i) {
        TableEntry entry{};
        std::memcpy(&entry, table.data() + i * sizeof entry, sizeof entry);
        entry.name.back() = 0;
        ChunkInfo info{entry.name.data(), entry.offset, entry.bytes, entry.hash};
        if (info.offset % chunk_alignment != 0 || info.offset > bytes.size() ||
            info.bytes > bytes.size() - info.offset) {
            return file.damaged("chunk '" + info.name + "'", "lies outside the file");
        }
        file.chunks_.push_back(std::move(info));
    }
    file.checked_ = std::make_shared<std::vector<bool>>(file.chunks_.size(), false);
    return file;
}

const ChunkInfo* ChunkFile::find(std::string_view name) const {
    const auto found = std::find_if(chunks_.begin(), chunks_.end(), [&](const ChunkInfo& c) { return c.name == name; });
    return found == chunks_.end() ? nullptr : &*found;
}

Result<std::span<const std::byte>> ChunkFile::unchecked_bytes(std::string_view name) const {
    const ChunkInfo* info = find(name);
    if (info == nullptr) return damaged("chunk '" + std::string(name) + "'", "missing");
    return mapped_->bytes().subspan(info->offset, info->bytes);
}

Result<std::span<const std::byte>> ChunkFile::bytes(std::string_view name) const {
    const auto data = unchecked_bytes(name);
    if (!data) return data;
    const ChunkInfo* info = find(name);
    const auto index = static_cast<size_t>(info - chunks_.data());
    if (!(*checked_)[index]) {
        if (hash_bytes(*data) != info->hash) return damaged("chunk '" + info->name + "'", "damaged");
        (*checked_)[index] = true;
    }
    return data;
}

Result<std::string_view> ChunkFile::text(std::string_view name) const {
    auto raw = bytes(name);
    if (!raw) return tl::unexpected(raw.error());
    return std::string_view(reinterpret_cast<const char*>(raw->data()), raw->size());
}

Result<void> ChunkFile::verify() const {
    for (const ChunkInfo& info : chunks_) {
        if (auto data = bytes(info.name); !data) return tl::unexpected(data.error());
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
