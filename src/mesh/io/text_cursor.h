// Reads words and numbers from text, line by line; knows the line it is on.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"

namespace lodestone {

class TextCursor {
public:
    // comment: a character that hides the rest of its line, 0 for none. continuation: a backslash at the end of a line
    // joins it to the next.
    explicit TextCursor(std::string_view text, char comment = 0, bool continuation = false)
        : at_(text.data()), end_(at_ + text.size()), comment_(comment), continuation_(continuation) {}

    uint64_t line() const { return line_; }
    bool at_end() const { return at_ == end_; }
    const char* position() const { return at_; }
    size_t left() const { return static_cast<size_t>(end_ - at_); }

    // The next word on this line; empty at its end.
    std::string_view word() {
        skip_blanks();
        const char* begin = at_;
        while (at_ != end_ && !is_blank(*at_) && *at_ != '\n' && (comment_ == 0 || *at_ != comment_) && !joins_line())
            ++at_;
        return {begin, static_cast<size_t>(at_ - begin)};
    }
    // The next word on this line or any line after it; empty at the end of the text.
    std::string_view word_anywhere() {
        for (;;) {
            const std::string_view found = word();
            if (!found.empty() || at_end()) return found;
            next_line();
        }
    }
    // What is left of this line up to where it is joined to the next, without blanks around it.
    std::string_view rest() {
        skip_blanks();
        const char* begin = at_;
        while (at_ != end_ && *at_ != '\n' && !joins_line()) ++at_;
        const char* last = at_;
        while (last != begin && is_blank(last[-1])) --last;
        return {begin, static_cast<size_t>(last - begin)};
    }
    void next_line() {
        while (at_ != end_ && *at_ != '\n') {
            if (joins_line())
                ++line_, at_ = after_join();
            else if (comment_ != 0 && *at_ == comment_)
                skip_comment();
            else
                ++at_;
        }
        if (at_ != end_) {
            ++at_;
            ++line_;
        }
    }

    // False where the next word (on this line) is not a number; `value` is then unchanged. Words like "nan" are numbers
    // here and the caller's to refuse.
    bool number(float& value) { return parse(word(), value); }
    bool number(int64_t& value) { return parse(word(), value); }

    static bool parse(std::string_view text, float& value) {
        double wide = 0;  // so that 1e-50 reads as 0 and 1e50 as infinity, not as errors
        if (!text.empty() && text[0] == '+') text.remove_prefix(1);
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), wide);
        if (text.empty() || end != text.data() + text.size()) return false;
        if (error == std::errc::result_out_of_range) {
            value = 0;
            const size_t exponent = text.find_first_of("eE");
            if (exponent == std::string_view::npos || text[exponent + 1] != '-') value = INFINITY;
            return true;
        }
        value = static_cast<float>(wide);
        return error == std::errc{};
    }
    static bool parse(std::string_view text, int64_t& value) {
        if (!text.empty() && text[0] == '+') text.remove_prefix(1);
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        return !text.empty() && error == std::errc{} && end == text.data() + text.size();
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
    bool joins_line() const { return continuation_ && *at_ == '\\' && after_join() != nullptr; }
    const char* after_join() const {
        const char* p = at_ + 1;
        if (p != end_ && *p == '\r') ++p;
        return p != end_ && *p == '\n' ? p + 1 : nullptr;
    }
    // A comment ends with its line: no backslash joins it to the next.
    void skip_comment() {
        while (at_ != end_ && *at_ != '\n') ++at_;
    }
    void skip_blanks() {
        while (at_ != end_) {
            if (is_blank(*at_)) {
                ++at_;
            } else if (joins_line()) {
                at_ = after_join();
                ++line_;
            } else if (comment_ != 0 && *at_ == comment_) {
                skip_comment();
            } else {
                return;
            }
        }
    }

    const char* at_;
    const char* end_;
    char comment_;
    bool continuation_;
    uint64_t line_ = 1;
};

}  // namespace lodestone
