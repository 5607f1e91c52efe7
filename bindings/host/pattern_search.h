// pattern_search.h: a pattern of Lua 5.1 looked for in a text, by backtracking, with a clock that
// may stop it. Includes Lua and the standard library only.
#pragma once

#include <cctype>
#include <lua.hpp>
#include <stdexcept>
#include <string_view>

#include "pattern.h"

namespace limax::host {

inline bool in_class(unsigned char letter, unsigned char name) {
    bool is = false;
    switch (std::tolower(name)) {
        case 'a': is = std::isalpha(letter) != 0; break;
        case 'c': is = std::iscntrl(letter) != 0; break;
        case 'd': is = std::isdigit(letter) != 0; break;
        case 'g': is = std::isgraph(letter) != 0; break;
        case 'l': is = std::islower(letter) != 0; break;
        case 'p': is = std::ispunct(letter) != 0; break;
        case 's': is = std::isspace(letter) != 0; break;
        case 'u': is = std::isupper(letter) != 0; break;
        case 'w': is = std::isalnum(letter) != 0; break;
        case 'x': is = std::isxdigit(letter) != 0; break;
        case 'z': is = letter == 0; break;
        default: return name == letter;
    }
    return std::isupper(name) != 0 ? !is : is;
}

// One text, one pattern; places are offsets. Throws at what is no pattern.
class pattern_search {
public:
    static constexpr std::size_t nowhere = std::string_view::npos;

    // `clock` is called every few thousand steps; it raises to stop the search.
    pattern_search(lua_State* L, pattern_clock clock, std::string_view text, std::string_view form)
        : L_(L), text_(text), form_(form), clock_(clock) {}

    // Where the match that begins at `at` ends; `nowhere` if there is none.
    std::size_t from(std::size_t at, std::size_t form_at) {
        captures_ = 0;
        depth_ = 0;
        return match(at, form_at);
    }

    // Pushes the captures, or the whole match where the pattern has none. Returns how many.
    int push_captures(std::size_t begin, std::size_t end, bool whole) const {
        if (captures_ == 0 && whole) {
            lua_pushlstring(L_, text_.data() + begin, end - begin);
            return 1;
        }
        luaL_checkstack(L_, captures_, "too many captures");
        for (int i = 0; i < captures_; ++i) push_capture(i);
        return captures_;
    }

    void push_capture(int i) const {
        if (i >= captures_) fail("invalid capture index");
        const capture& one = list_[i];
        if (one.state == kind::open) fail("unfinished capture");
        if (one.state == kind::place)
            lua_pushinteger(L_, static_cast<lua_Integer>(one.begin + 1));
        else
            lua_pushlstring(L_, text_.data() + one.begin, one.length);
    }

    int captures() const { return captures_; }

private:
    static constexpr unsigned steps_between =
        4096;                                 // tens of microseconds between looks at the clock
    static constexpr int most_captures = 32;  // as in the standard library
    static constexpr int deepest = 200;       // nested choices; each takes a frame of the C stack

    enum class kind { open, place, text };
    struct capture {
        std::size_t begin;
        std::size_t length;
        kind state;
    };

    [[noreturn]] static void fail(const char* text) { throw std::runtime_error(text); }

    void step() {
        if (++steps_ % steps_between == 0) clock_(L_);
    }

    // The end of the class, set or letter that begins at `p`.
    std::size_t item_end(std::size_t p) const {
        const char first = form_[p++];
        if (first == '%') {
            if (p >= form_.size()) fail("malformed pattern (ends with '%')");
            return p + 1;
        }
        if (first != '[') return p;
        if (p < form_.size() && form_[p] == '^') ++p;
        for (bool begins = true;; begins = false) {
            if (p >= form_.size()) fail("malformed pattern (missing ']')");
            const char letter = form_[p++];
            if (letter == ']' && !begins) return p;
            if (letter == '%') ++p;
        }
    }

    // Is the letter in the set between the offsets of '[' and ']'?
    bool in_set(unsigned char letter, std::size_t p, std::size_t last) const {
        ++p;
        const bool inverted = form_[p] == '^';
        if (inverted) ++p;
        bool is = false;
        while (p < last) {
            const auto one = static_cast<unsigned char>(form_[p]);
            if (one == '%') {
                is = is || in_class(letter, static_cast<unsigned char>(form_[p + 1]));
                p += 2;
            } else if (p + 2 < last && form_[p + 1] == '-') {
                is = is || (one <= letter && letter <= static_cast<unsigned char>(form_[p + 2]));
                p += 3;
            } else {
                is = is || one == letter;
                ++p;
            }
        }
        return is != inverted;
    }

    bool one(std::size_t at, std::size_t p, std::size_t end) const {
        if (at >= text_.size()) return false;
        const auto letter = static_cast<unsigned char>(text_[at]);
        switch (form_[p]) {
            case '.': return true;
            case '%': return in_class(letter, static_cast<unsigned char>(form_[p + 1]));
            case '[': return in_set(letter, p, end - 1);
            default: return static_cast<unsigned char>(form_[p]) == letter;
        }
    }

    std::size_t match(std::size_t at, std::size_t p) {
        if (++depth_ > deepest) fail("pattern too complex");
        const std::size_t end = follow(at, p);
        --depth_;
        return end;
    }

    std::size_t follow(std::size_t at, std::size_t p) {
        for (;;) {
            step();
            if (p == form_.size()) return at;
            const char letter = form_[p];
            const char next = p + 1 < form_.size() ? form_[p + 1] : '\0';
            if (letter == '(') return open(at, p, next == ')');
            if (letter == ')') return close(at, p);
            if (letter == '$' && p + 1 == form_.size()) return at == text_.size() ? at : nowhere;
            if (letter == '%' && next == 'b') {
                at = balanced(at, p + 2);
                p += 4;
            } else if (letter == '%' && next == 'f') {
                p += 2;
                if (p >= form_.size() || form_[p] != '[') fail("missing '[' after '%f' in pattern");
                const std::size_t end = item_end(p);
                if (!frontier(at, p, end)) return nowhere;
                p = end;
            } else if (letter == '%' && std::isdigit(static_cast<unsigned char>(next)) != 0) {
                at = again(at, next);
                p += 2;
            } else {
                const std::size_t end = item_end(p);
                const char sign = end < form_.size() ? form_[end] : '\0';
                if (sign == '*') return longest(at, p, end, 0);
                if (sign == '+') return longest(at, p, end, 1);
                if (sign == '-') return shortest(at, p, end);
                if (sign == '?') {
                    if (one(at, p, end)) {
                        const std::size_t found = match(at + 1, end + 1);
                        if (found != nowhere) return found;
                    }
                    p = end + 1;
                } else {
                    at = one(at, p, end) ? at + 1 : nowhere;
                    p = end;
                }
            }
            if (at == nowhere) return nowhere;
        }
    }

    std::size_t open(std::size_t at, std::size_t p, bool place) {
        if (captures_ == most_captures) fail("too many captures");
        list_[captures_++] = {at, 0, place ? kind::place : kind::open};
        const std::size_t end = match(at, p + (place ? 2 : 1));
        if (end == nowhere) --captures_;
        return end;
    }

    std::size_t close(std::size_t at, std::size_t p) {
        int i = captures_ - 1;
        while (i >= 0 && list_[i].state != kind::open) --i;
        if (i < 0) fail("invalid pattern capture");
        list_[i].length = at - list_[i].begin;
        list_[i].state = kind::text;
        const std::size_t end = match(at, p + 1);
        if (end == nowhere) list_[i].state = kind::open;
        return end;
    }

    std::size_t balanced(std::size_t at, std::size_t p) {
        if (p + 1 >= form_.size()) fail("unbalanced pattern");
        if (at >= text_.size() || text_[at] != form_[p]) return nowhere;
        int level = 0;
        for (; at < text_.size(); ++at) {
            step();
            if (text_[at] == form_[p + 1] && level > 0) {
                if (--level == 0) return at + 1;
            } else if (text_[at] == form_[p]) {
                ++level;
            }
        }
        return nowhere;
    }

    bool frontier(std::size_t at, std::size_t p, std::size_t end) const {
        const auto letter_at = [this](std::size_t place) {
            return place < text_.size() ? static_cast<unsigned char>(text_[place])
                                        : static_cast<unsigned char>('\0');
        };
        const unsigned char before = at == 0 ? '\0' : letter_at(at - 1);
        return !in_set(before, p, end - 1) && in_set(letter_at(at), p, end - 1);
    }

    // A capture's text once more.
    std::size_t again(std::size_t at, char digit) {
        const int i = digit - '1';
        if (i < 0 || i >= captures_ || list_[i].state != kind::text) fail("invalid capture index");
        const capture& before = list_[i];
        if (text_.size() - at < before.length) return nowhere;
        for (std::size_t k = 0; k < before.length; ++k) {
            step();
            if (text_[before.begin + k] != text_[at + k]) return nowhere;
        }
        return at + before.length;
    }

    std::size_t longest(std::size_t at, std::size_t p, std::size_t end, std::size_t least) {
        std::size_t count = 0;
        while (one(at + count, p, end)) {
            step();
            ++count;
        }
        for (; count >= least; --count) {
            const std::size_t found = match(at + count, end + 1);
            if (found != nowhere || count == 0) return found;
        }
        return nowhere;
    }

    std::size_t shortest(std::size_t at, std::size_t p, std::size_t end) {
        for (;; ++at) {
            const std::size_t found = match(at, end + 1);
            if (found != nowhere) return found;
            if (!one(at, p, end)) return nowhere;
        }
    }

    lua_State* L_;
    std::string_view text_;
    std::string_view form_;
    pattern_clock clock_;
    unsigned steps_ = 0;
    int depth_ = 0;
    int captures_ = 0;
    capture list_[most_captures]{};
};

}  // namespace limax::host
