#include "fuzz/mutators.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t most);

namespace lodestone::fuzz {

namespace {

bool plainly(unsigned seed) { return seed % 16 == 0; }

// A string mutated in place, to at most `most` bytes.
std::string mutated(std::string text, size_t most) {
    const size_t size = std::min(text.size(), most);
    text.resize(std::max<size_t>(most, 1));
    text.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(text.data()), size, text.size()));
    return text;
}

size_t put(const std::string& content, uint8_t* data, size_t most) {
    const size_t size = std::min(content.size(), most);
    std::memcpy(data, content.data(), size);
    return size;
}

std::string little(uint32_t value) { return std::string(reinterpret_cast<const char*>(&value), 4); }

std::string inflated(const uint8_t* data, size_t size, size_t most) {
    z_stream stream{};
    std::string out(most, 0);
    if (inflateInit2(&stream, 15 + 32) != Z_OK) return "";
    stream.next_in = const_cast<Bytef*>(data);
    stream.avail_in = static_cast<uInt>(size);
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    inflate(&stream, Z_SYNC_FLUSH);
    out.resize(out.size() - stream.avail_out);
    inflateEnd(&stream);
    return out;
}

// gzip, or zlib's own frame.
std::string deflated(const std::string& content, bool gzip) {
    z_stream stream{};
    if (deflateInit2(&stream, 1, Z_DEFLATED, gzip ? 15 + 16 : 15, 8, Z_DEFAULT_STRATEGY) != Z_OK) return "";
    std::string out(deflateBound(&stream, static_cast<uLong>(content.size())), 0);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
    stream.avail_in = static_cast<uInt>(content.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(out.size() - stream.avail_out);
    deflateEnd(&stream);
    return out;
}

uint32_t big_at(const uint8_t* at) {
    return uint32_t{at[0]} << 24 | uint32_t{at[1]} << 16 | uint32_t{at[2]} << 8 | uint32_t{at[3]};
}
std::string big(uint32_t value) {
    return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
            static_cast<char>(value)};
}

}  // namespace

size_t mutate_glb(uint8_t* data, size_t size, size_t most, unsigned seed) {
    uint32_t json_bytes = 0;
    if (size >= 20) std::memcpy(&json_bytes, data + 12, 4);
    if (plainly(seed) || size < 28 || std::memcmp(data, "glTF", 4) != 0 || json_bytes > size - 20)
        return LLVMFuzzerMutate(data, size, most);
    std::string json(reinterpret_cast<char*>(data) + 20, json_bytes);
    const size_t binary_at = std::min<size_t>(20 + json_bytes + 8, size);
    std::string binary(reinterpret_cast<char*>(data) + binary_at, size - binary_at);
    const size_t room = most > 64 ? most - 64 : 0;
    if (seed % 3 == 1)
        binary = mutated(binary, room > json.size() ? room - json.size() : 0);
    else
        json = mutated(json, room > binary.size() ? room - binary.size() : 0);
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, 0);
    const std::string chunks = little(static_cast<uint32_t>(json.size())) + "JSON" + json +
                               little(static_cast<uint32_t>(binary.size())) + std::string("BIN\0", 4) + binary;
    return put("glTF" + little(2) + little(static_cast<uint32_t>(12 + chunks.size())) + chunks, data, most);
}

size_t mutate_png(uint8_t* data, size_t size, size_t most, unsigned seed) {
    if (plainly(seed) || size < 8 || std::memcmp(data, "\x89PNG\r\n\x1a\n", 8) != 0)
        return LLVMFuzzerMutate(data, size, most);
    struct Chunk {
        std::string name, content;
    };
    std::vector<Chunk> chunks;
    for (size_t at = 8; at + 12 <= size;) {
        const size_t bytes = std::min<size_t>(big_at(data + at), size - at - 12);
        const char* begin = reinterpret_cast<const char*>(data) + at + 4;
        chunks.push_back({std::string(begin, 4), std::string(begin + 4, bytes)});
        at += 12 + bytes;
    }
    if (chunks.empty()) return LLVMFuzzerMutate(data, size, most);
    Chunk& chosen = chunks[seed / 16 % chunks.size()];
    const size_t room = most > size + 64 ? most - size - 64 + chosen.content.size() : chosen.content.size();
    if (chosen.name == "IDAT" && seed % 2 == 0) {
        const auto* packed = reinterpret_cast<const uint8_t*>(chosen.content.data());
        chosen.content = deflated(mutated(inflated(packed, chosen.content.size(), 1 << 20), 1 << 16), false);
    } else {
        chosen.content = mutated(chosen.content, room);
    }
    std::string png("\x89PNG\r\n\x1a\n");
    for (const Chunk& chunk : chunks) {
        const std::string body = chunk.name + chunk.content;
        const auto checksum = static_cast<uint32_t>(
            crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
        png += big(static_cast<uint32_t>(chunk.content.size())) + body + big(checksum);
    }
    return put(png, data, most);
}

size_t mutate_gzip(uint8_t* data, size_t size, size_t most, unsigned seed) {
    if (plainly(seed)) return LLVMFuzzerMutate(data, size, most);
    const std::string inside = inflated(data, size, 1 << 16);
    return put(deflated(mutated(inside, std::max<size_t>(inside.size() * 2, 64)), true), data, most);
}

void damage(std::span<std::byte> bytes, std::span<const uint8_t> by) {
    for (size_t i = 0; i + 3 <= by.size() && !bytes.empty(); i += 3)
        bytes[(by[i] | by[i + 1] << 8) % bytes.size()] = static_cast<std::byte>(by[i + 2]);
}

}  // namespace lodestone::fuzz
