// tokens.h: the text of a scripted effect as numbers, words and signs, each with its line.
#pragma once

#include <cstddef>
#include <string>

namespace limax::scripted {

struct token {
    enum { end, number, word, sign } kind = end;
    std::string text;
    double number_value = 0;
    int line = 1;
};

// Letters and _, with which a name begins.
inline bool starts_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Goes through a text token by token. `place` names it in messages; it and the text outlive this.
class token_reader {
public:
    token_reader(const std::string& place, const std::string& text);

protected:
    // Refuses the text because of the token here, with its line.
    [[noreturn]] void refuse(const std::string& problem) const;
    // Refuses it for what was read before this place, whose line may be an earlier one.
    [[noreturn]] void refuse_read(const std::string& problem) const;
    // The token here, for messages.
    std::string here() const {
        return now_.kind == token::end ? "the end of the text" : "'" + now_.text + "'";
    }

    void advance();
    // Whether the token after this one begins with a sign.
    bool before(char sign) const;
    bool at(const char* sign) const { return now_.kind == token::sign && now_.text == sign; }
    bool take(const char* sign) {
        if (!at(sign)) return false;
        advance();
        return true;
    }
    void need(const char* sign) {
        if (!take(sign)) refuse_missing(sign);
    }

    token now_;

private:
    [[noreturn]] void refuse_missing(const char* sign) const;

    const std::string& place_;
    const std::string& text_;
    std::size_t next_ = 0;
    int line_ = 1;
    int line_read_ = 1;  // of the last token before now_
};

}  // namespace limax::scripted
