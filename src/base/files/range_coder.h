// A range coder of bits whose probabilities are learnt as they are coded: what is coded again and again costs little,
// far below a bit. For numbers of which there are too few, and too many kinds, for tables of codes (entropy_coder.h).
//
//   Martin, "Range encoding: an algorithm for removing redundancy from a digitised message", 1979; carries as in LZMA.
//
// Integers alone: the same bytes and the same numbers on every machine.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

// How likely a bit is 0, by those before it. It learns fast at first: the nth bit counts 1 / (n + 1.5), in the end
// 1/62.
class BitModel {
public:
    // Of 32768, 32 .. 32736.
    uint32_t zero() const { return (zero_ >> 1) < least ? least : (zero_ >> 1) > most ? most : zero_ >> 1; }
    void learn(bool bit) {
        const int32_t off = (bit ? 0 : 65535) - zero_;
        zero_ = static_cast<uint16_t>(zero_ + (int64_t{off} * rates[seen_] >> 16));
        if (seen_ + size_t{1} < rates.size()) ++seen_;
    }

private:
    static constexpr uint32_t least = 32, most = 32736;
    static constexpr std::array<uint32_t, 61> rates = [] {
        std::array<uint32_t, 61> made{};
        for (uint32_t seen = 0; seen < made.size(); ++seen) made[seen] = (1u << 17) / (2 * seen + 3);
        return made;
    }();
    uint16_t zero_ = 32768;
    uint8_t seen_ = 0;
};

// What both ends of the coder do alike.
class CodingRange {
protected:
    // Of the range, the part that stands for 0.
    uint32_t split_by(const BitModel& model) const { return (range_ >> 15) * model.zero(); }
    void narrow(bool value, uint32_t split) { range_ = value ? range_ - split : split; }
    // Calls next() for every byte that is settled.
    template <class Next>
    void settle(Next&& next) {
        for (; range_ < 1u << 24; range_ <<= 8) next();
    }
    uint32_t range_ = 0xffffffffu;
};

inline constexpr uint32_t most_even_bits = 16;

class RangeEncoder : CodingRange {
public:
    // What decodes is the same sequence of calls of RangeDecoder with the same models.
    void bit(BitModel& model, bool& value) {
        const uint32_t split = split_by(model);
        if (value) low_ += split;
        narrow(value, split);
        model.learn(value);
        settle([this] { shift(); });
    }
    // A bit that is as likely 0 as 1.
    void even_bit(bool& value) {
        range_ >>= 1;
        if (value) low_ += range_;
        settle([this] { shift(); });
    }
    // So many such bits, 0 .. most_even_bits, the highest first.
    void even_bits(uint32_t count, uint32_t& value) {
        range_ >>= count;
        low_ += uint64_t{range_} * value;
        settle([this] { shift(); });
    }
    // Appends all that was coded. It is the last call.
    void finish(std::vector<std::byte>& bytes) {
        for (int i = 0; i < 5; ++i) shift();
        // The first byte is always 0.
        bytes.insert(bytes.end(), bytes_.begin() + 1, bytes_.end());
    }

private:
    void shift() {
        if (low_ < 0xff000000u || low_ > 0xffffffffu) {
            const auto carry = static_cast<uint8_t>(low_ >> 32);
            bytes_.push_back(static_cast<std::byte>(held_ + carry));
            for (; held_count_ > 0; --held_count_) bytes_.push_back(static_cast<std::byte>(0xff + carry));
            held_ = static_cast<uint8_t>(low_ >> 24);
        } else {
            ++held_count_;
        }
        low_ = (low_ & 0x00ffffffu) << 8;
    }

    uint64_t low_ = 0;
    uint8_t held_ = 0;
    size_t held_count_ = 0;  // bytes of 0xff behind the one that is held: a carry may still change them
    std::vector<std::byte> bytes_;
};

// Whatever the bytes are, it gives bits; whether they were what an encoder left is told in the end.
class RangeDecoder : CodingRange {
public:
    explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
        for (int i = 0; i < 4; ++i) shift();
    }
    void bit(BitModel& model, bool& value) {
        const uint32_t split = split_by(model);
        value = code_ >= split;
        if (value) code_ -= split;
        narrow(value, split);
        model.learn(value);
        settle([this] { shift(); });
    }
    void even_bit(bool& value) {
        range_ >>= 1;
        value = code_ >= range_;
        if (value) code_ -= range_;
        settle([this] { shift(); });
    }
    void even_bits(uint32_t count, uint32_t& value) {
        range_ >>= count;
        value = std::min(code_ / range_, (1u << count) - 1);
        code_ -= value * range_;
        settle([this] { shift(); });
    }
    // Whether as many bytes were there as were read.
    bool at_end() const { return at_ == bytes_.size(); }

private:
    void shift() {
        const size_t i = at_++;
        code_ = code_ << 8 | (i < bytes_.size() ? std::to_integer<uint32_t>(bytes_[i]) : 0);
    }

    std::span<const std::byte> bytes_;
    size_t at_ = 0;
    uint32_t code_ = 0;
};

}  // namespace lodestone
