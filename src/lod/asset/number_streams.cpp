#include "lod/asset/number_streams.h"

#include <algorithm>
#include <cstring>

#include "base/files/entropy_coder.h"

namespace lodestone {

namespace {

constexpr uint32_t long_bytes = 4;  // behind a byte of 255

void put_size(uint64_t size, std::vector<std::byte>& into) {
    for (; size >= 0x80; size >>= 7) into.push_back(static_cast<std::byte>(size | 0x80));
    into.push_back(static_cast<std::byte>(size));
}

// Takes a size off the front; nothing where there is none.
std::optional<uint64_t> take_size(std::span<const std::byte>& from) {
    uint64_t size = 0;
    for (uint32_t shift = 0; shift < 42 && !from.empty(); shift += 7) {
        const auto part = std::to_integer<uint64_t>(from.front());
        from = from.subspan(1);
        size |= (part & 0x7f) << shift;
        if (part < 0x80) return size;
    }
    return std::nullopt;
}

}  // namespace

void NumberWriter::number(size_t stream, uint32_t value) {
    if (value < 255) {
        byte(stream, static_cast<uint8_t>(value));
        return;
    }
    byte(stream, 255);
    for (uint32_t i = 0; i < long_bytes; ++i) byte(stream, static_cast<uint8_t>(value >> (8 * i)));
}

void NumberWriter::bits(size_t bit_stream, uint32_t value, uint32_t count) {
    Bits& b = bits_[bit_stream];
    b.held |= (uint64_t{value} & ((uint64_t{1} << count) - 1)) << b.count;
    for (b.count += count; b.count >= 8; b.count -= 8, b.held >>= 8) b.bytes.push_back(static_cast<std::byte>(b.held));
}

std::vector<std::byte> NumberWriter::packed() const {
    std::vector<std::byte> all;
    for (const auto& stream : streams_) {
        put_size(stream.size(), all);
        for (size_t first = 0; first < stream.size(); first += most_encoded_numbers)
            encode_numbers(std::span(stream).subspan(first, std::min(most_encoded_numbers, stream.size() - first)),
                           all);
    }
    for (const Bits& b : bits_) {
        put_size(b.bytes.size() + (b.count > 0 ? 1 : 0), all);
        all.insert(all.end(), b.bytes.begin(), b.bytes.end());
        if (b.count > 0) all.push_back(static_cast<std::byte>(b.held));
    }
    return all;
}

std::optional<NumberReader> NumberReader::unpack(std::span<const std::byte> packed, size_t streams, size_t bit_streams,
                                                 uint64_t most, std::vector<uint8_t> room) {
    NumberReader reader;
    reader.numbers_ = std::move(room);
    reader.numbers_.clear();
    reader.streams_.resize(streams);
    for (Stream& stream : reader.streams_) {
        const size_t before = packed.size();
        const auto size = take_size(packed);
        if (!size || *size > most) return std::nullopt;
        // Whatever is stated, a part of a stream takes two bytes.
        if ((*size + most_encoded_numbers - 1) / most_encoded_numbers * 2 > packed.size()) return std::nullopt;
        stream.next = reader.numbers_.size();
        stream.end = stream.next + *size;
        reader.numbers_.resize(stream.end);
        for (size_t at = stream.next; at < stream.end; at += most_encoded_numbers) {
            const auto rest = decode_numbers(
                packed, std::span(reader.numbers_).subspan(at, std::min(most_encoded_numbers, stream.end - at)));
            if (!rest) return std::nullopt;
            packed = *rest;
        }
        reader.packed_bytes_.push_back(before - packed.size());
    }
    for (size_t i = 0; i < bit_streams; ++i) {
        const size_t before = packed.size();
        const auto size = take_size(packed);
        if (!size || *size > packed.size()) return std::nullopt;
        reader.bits_.push_back({packed.first(*size), 0, 0});
        packed = packed.subspan(*size);
        reader.packed_bytes_.push_back(before - packed.size());
    }
    if (!packed.empty()) return std::nullopt;
    return reader;
}

uint32_t NumberReader::long_number(size_t stream) {
    uint32_t value = 0;
    for (uint32_t i = 0; i < long_bytes; ++i) value |= uint32_t{byte(stream)} << (8 * i);
    return value;
}

void NumberReader::refill(Bits& b, uint32_t count) {
    for (; b.count < count && !b.rest.empty(); b.count += 8, b.rest = b.rest.subspan(1))
        b.held |= std::to_integer<uint64_t>(b.rest.front()) << b.count;
    if (b.count >= count) return;
    b.count = count;  // zeros
    broken_ = true;
}

bool NumberReader::finished() const {
    return !broken_ && std::ranges::all_of(streams_, [](const Stream& s) { return s.next == s.end; }) &&
           std::ranges::all_of(bits_, [](const Bits& b) { return b.rest.empty() && b.count < 8 && b.held == 0; });
}

}  // namespace lodestone
