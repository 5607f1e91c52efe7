// tokens.cpp: reads the text of a scripted effect token by token; whatever is not a token of the
// language is refused.
#include "physics/scripted/tokens.h"

#include <algorithm>
#include <charconv>

#include "base/error.h"
#include "physics/scripted/program.h"

namespace limax::scripted {

namespace {

constexpr std::size_t longest_text = 65536;  // bytes

[[noreturn]] void refuse_at(const std::string& place, int line, const std::string& problem) {
    fail(LIMAX_INVALID_ARGUMENT, format("%s, line %d: %s", place.c_str(), line, problem.c_str()));
}

}  // namespace

bool is_name(const std::string& text) {
    return !text.empty() && starts_word(text[0]) &&
           std::all_of(text.begin(), text.end(),
                       [](char c) { return starts_word(c) || is_digit(c); });
}

token_reader::token_reader(const std::string& place, const std::string& text)
    : place_(place), text_(text) {
    if (text.size() > longest_text)
        fail(LIMAX_INVALID_ARGUMENT, format("%s is %zu bytes long; at most %zu are possible",
                                            place.c_str(), text.size(), longest_text));
}

void token_reader::refuse(const std::string& problem) const {
    refuse_at(place_, now_.line, problem);
}

void token_reader::refuse_read(const std::string& problem) const {
    refuse_at(place_, line_read_, problem);
}

// A ';' is missed where a statement ends, which is before the line of the next.
void token_reader::refuse_missing(const char* sign) const {
    refuse_read(format("expected '%s', got %s", sign, here().c_str()));
}

bool token_reader::before(char sign) const {
    const std::size_t next = text_.find_first_not_of(" \t\r\n", next_);
    return next != std::string::npos && text_[next] == sign;
}

void token_reader::advance() {
    line_read_ = now_.line;
    // blanks and comments
    for (;; ++next_) {
        if (next_ < text_.size() && text_[next_] == '/' && next_ + 1 < text_.size() &&
            text_[next_ + 1] == '/')
            while (next_ < text_.size() && text_[next_] != '\n') ++next_;
        if (next_ >= text_.size()) break;
        if (text_[next_] == '\n')
            ++line_;
        else if (text_[next_] != ' ' && text_[next_] != '\t' && text_[next_] != '\r')
            break;
    }
    now_ = {};
    now_.line = line_;
    if (next_ >= text_.size()) return;
    const char first = text_[next_];
    std::size_t last = next_;
    if (starts_word(first)) {
        while (last < text_.size() && (starts_word(text_[last]) || is_digit(text_[last]))) ++last;
        now_.kind = token::word;
    } else if (is_digit(first) ||
               (first == '.' && next_ + 1 < text_.size() && is_digit(text_[next_ + 1]))) {
        const char* begin = text_.data() + next_;
        const auto [stop, problem] =
            std::from_chars(begin, text_.data() + text_.size(), now_.number_value);
        last = std::size_t(stop - text_.data());
        now_.kind = token::number;
        if (problem != std::errc() || (last < text_.size() && starts_word(text_[last])))
            refuse(format("a number that cannot be read, at '%.12s'", begin));
    } else {
        static const char* const signs[] = {"<=", ">=", "==", "!=", "&&", "||", "+=", "+",
                                            "-",  "*",  "/",  "(",  ")",  ",",  ";",  ".",
                                            "=",  "<",  ">",  "!",  "?",  ":",  "[",  "]"};
        for (const char* sign : signs)
            if (last == next_ &&
                text_.compare(next_, std::char_traits<char>::length(sign), sign) == 0)
                last = next_ + std::char_traits<char>::length(sign);
        if (last == next_)
            refuse(
                first > ' ' && first < 127
                    ? format("'%c' is not a character of this language", first)
                    : format("byte %d is not a character of this language", int(uint8_t(first))));
        now_.kind = token::sign;
    }
    now_.text = text_.substr(next_, last - next_);
    next_ = last;
}

}  // namespace limax::scripted
