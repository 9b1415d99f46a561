// Numbers of several kinds written into streams of their own, each packed by the coder of base/files/entropy_coder.h,
// and bits that nothing can compress, by kind, beside them. Writer and reader have the same members, so that one
// function, templated on either, says how something is coded in both directions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace lodestone {

// Takes numbers in; what it packs, a NumberReader of as many streams gives back.
class NumberWriter {
public:
    static constexpr bool reading = false;
    NumberWriter(size_t streams, size_t bit_streams) : streams_(streams), bits_(bit_streams) {}

    // A number below 256.
    void byte(size_t stream, uint8_t value) { streams_[stream].push_back(value); }
    // Any number; those below 255 take a byte.
    void number(size_t stream, uint32_t value);
    // The lowest `count` bits, 0 .. 32, as they are.
    void bits(size_t bit_stream, uint32_t value, uint32_t count);

    // Everything so far. Deterministic.
    std::vector<std::byte> packed() const;

private:
    struct Bits {
        std::vector<std::byte> bytes;
        uint64_t held = 0;   // bits that are no whole byte yet
        uint32_t count = 0;  // of them, below 8
    };
    std::vector<std::vector<uint8_t>> streams_;
    std::vector<Bits> bits_;
};

// Gives numbers back in the order in which they were written, stream by stream.
class NumberReader {
public:
    static constexpr bool reading = true;
    // most: numbers that a stream can have; a stream that states more is broken, and nothing is allocated for it.
    // packed must outlive the reader. room: memory to use, of a reader before.
    static std::optional<NumberReader> unpack(std::span<const std::byte> packed, size_t streams, size_t bit_streams,
                                              uint64_t most, std::vector<uint8_t> room = {});
    std::vector<uint8_t> take_room() { return std::move(numbers_); }

    // Past the end everything is 0, and the reader is broken.
    uint8_t byte(size_t stream) {
        Stream& s = streams_[stream];
        if (s.next == s.end) return past_end();
        return numbers_[s.next++];
    }
    // What a number past the end is.
    uint8_t past_end() {
        broken_ = true;
        return 0;
    }
    // What is left of a stream, to be read elsewhere; took() says how much was.
    std::span<const uint8_t> rest(size_t stream) const {
        return std::span(numbers_).subspan(streams_[stream].next, streams_[stream].end - streams_[stream].next);
    }
    void took(size_t stream, size_t count) { streams_[stream].next += count; }
    uint32_t number(size_t stream) {
        const uint8_t first = byte(stream);
        return first < 255 ? first : long_number(stream);
    }
    uint32_t bits(size_t bit_stream, uint32_t count) {
        Bits& b = bits_[bit_stream];
        if (b.rest.size() >= 8) {
            // As much as fits, whether it is needed or not: nobody could guess. What does not fit as a whole byte is
            // the same when it comes again.
            uint64_t more = 0;
            std::memcpy(&more, b.rest.data(), 8);
            b.held |= more << b.count;
            b.rest = b.rest.subspan((63 - b.count) / 8);
            b.count |= 56;
        } else if (b.count < count) {
            refill(b, count);
        }
        const auto value = static_cast<uint32_t>(b.held & ((uint64_t{1} << count) - 1));
        b.held >>= count;
        b.count -= count;
        return value;
    }
    // Bits that bits() gives once it has given `skip` more; 0 near the end. count: at most 32.
    uint32_t peek(size_t bit_stream, uint32_t skip, uint32_t count) const {
        const Bits& b = bits_[bit_stream];
        const int64_t from = int64_t{skip} - b.count, byte = from >> 3;  // counted from the rest
        if (byte + 8 > static_cast<int64_t>(b.rest.size())) return 0;
        uint64_t word = 0;
        std::memcpy(&word, b.rest.data() + byte, 8);
        return static_cast<uint32_t>(word >> (from & 7) & ((uint64_t{1} << count) - 1));
    }

    bool broken() const { return broken_; }
    // Whether everything was read, and nothing past the end.
    bool finished() const;
    // Bytes that a stream takes packed; bit streams are numbered after the others.
    size_t packed_bytes(size_t stream) const { return packed_bytes_[stream]; }

private:
    struct Stream {
        size_t next = 0, end = 0;  // into numbers_
    };
    struct Bits {
        std::span<const std::byte> rest;
        uint64_t held = 0;   // bits to come; those behind the first `count` are in `rest`, too, or 0
        uint32_t count = 0;  // 0 .. 63
    };
    uint32_t long_number(size_t stream);
    void refill(Bits& b, uint32_t count);

    std::vector<uint8_t> numbers_;
    std::vector<Stream> streams_;
    std::vector<Bits> bits_;
    std::vector<size_t> packed_bytes_;
    bool broken_ = false;
};

}  // namespace lodestone
