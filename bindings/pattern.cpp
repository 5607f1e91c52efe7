// pattern.cpp: the patterns of Lua 5.1 for a state whose time is limited. The standard library's
// search runs in C, where no hook looks: `("a"):rep(99):find(("a-"):rep(30) .. "b")` would hold a
// process for years. This one looks at the clock on its way and bounds what gsub makes.
#include "pattern.h"

#include <cctype>
#include <cstring>
#include <string>
#include <string_view>

#include "guard.h"

namespace limax::host {
namespace {

constexpr std::size_t nowhere = std::string_view::npos;
constexpr unsigned steps_between = 4096;  // tens of microseconds between looks at the clock
constexpr int most_captures = 32;         // as in the standard library
constexpr int deepest = 200;              // nested choices; each takes a frame of the C stack
constexpr std::size_t longest_result = std::size_t{16} << 20;  // bytes that gsub may make

const char clock_key = 0;  // its address is the registry key of the clock

pattern_clock clock_of(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&clock_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
    const auto clock = *static_cast<pattern_clock*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return clock;
}

bool in_class(unsigned char letter, unsigned char name) {
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

// One text, one pattern; places are offsets.
class search {
public:
    search(lua_State* L, std::string_view text, std::string_view form)
        : L_(L), text_(text), form_(form), clock_(clock_of(L)) {}

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
        if (i >= captures_) luaL_error(L_, "invalid capture index");
        const capture& one = list_[i];
        if (one.state == kind::open) luaL_error(L_, "unfinished capture");
        if (one.state == kind::place)
            lua_pushinteger(L_, static_cast<lua_Integer>(one.begin + 1));
        else
            lua_pushlstring(L_, text_.data() + one.begin, one.length);
    }

    int captures() const { return captures_; }

private:
    enum class kind { open, place, text };
    struct capture {
        std::size_t begin;
        std::size_t length;
        kind state;
    };

    void step() {
        if (++steps_ % steps_between == 0) clock_(L_);
    }

    // The end of the class, set or letter that begins at `p`.
    std::size_t item_end(std::size_t p) const {
        const char first = form_[p++];
        if (first == '%') {
            if (p >= form_.size()) luaL_error(L_, "malformed pattern (ends with '%%')");
            return p + 1;
        }
        if (first != '[') return p;
        if (p < form_.size() && form_[p] == '^') ++p;
        for (bool begins = true;; begins = false) {
            if (p >= form_.size()) luaL_error(L_, "malformed pattern (missing ']')");
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
        if (++depth_ > deepest) luaL_error(L_, "pattern too complex");
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
                if (p >= form_.size() || form_[p] != '[')
                    luaL_error(L_, "missing '[' after '%%f' in pattern");
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
        if (captures_ == most_captures) luaL_error(L_, "too many captures");
        list_[captures_++] = {at, 0, place ? kind::place : kind::open};
        const std::size_t end = match(at, p + (place ? 2 : 1));
        if (end == nowhere) --captures_;
        return end;
    }

    std::size_t close(std::size_t at, std::size_t p) {
        int i = captures_ - 1;
        while (i >= 0 && list_[i].state != kind::open) --i;
        if (i < 0) luaL_error(L_, "invalid pattern capture");
        list_[i].length = at - list_[i].begin;
        list_[i].state = kind::text;
        const std::size_t end = match(at, p + 1);
        if (end == nowhere) list_[i].state = kind::open;
        return end;
    }

    std::size_t balanced(std::size_t at, std::size_t p) {
        if (p + 1 >= form_.size()) luaL_error(L_, "unbalanced pattern");
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
        if (i < 0 || i >= captures_ || list_[i].state != kind::text)
            luaL_error(L_, "invalid capture index");
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

std::string_view text_argument(lua_State* L, int index) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, index, &length);
    return {text, length};
}

// The offset that an optional argument names, counted from the end where it is negative.
std::size_t start_argument(lua_State* L, int index, std::size_t length) {
    const double given = luaL_optnumber(L, index, 1);
    const auto size = static_cast<double>(length);
    const double at = given < 0 ? size + given : given - 1;
    return at > 0 ? static_cast<std::size_t>(at < size ? at : size) : 0;
}

bool is_plain(std::string_view form) {
    return form.find_first_of("^$*+?.([%-") == std::string_view::npos;
}

int search_for(lua_State* L, bool finds) {
    const std::string_view text = text_argument(L, 1);
    const std::string_view form = text_argument(L, 2);
    const std::size_t start = start_argument(L, 3, text.size());
    if (finds && (lua_toboolean(L, 4) != 0 || is_plain(form))) {
        const std::size_t at = text.find(form, start);
        if (at == nowhere) {
            lua_pushnil(L);
            return 1;
        }
        lua_pushinteger(L, static_cast<lua_Integer>(at + 1));
        lua_pushinteger(L, static_cast<lua_Integer>(at + form.size()));
        return 2;
    }
    const bool anchored = !form.empty() && form.front() == '^';
    search hunt(L, text, form);
    for (std::size_t at = start; at <= text.size(); ++at) {
        const std::size_t end = hunt.from(at, anchored ? 1 : 0);
        if (end != nowhere) {
            if (!finds) return hunt.push_captures(at, end, true);
            lua_pushinteger(L, static_cast<lua_Integer>(at + 1));
            lua_pushinteger(L, static_cast<lua_Integer>(end));
            return 2 + hunt.push_captures(at, end, false);
        }
        if (anchored) break;
    }
    lua_pushnil(L);
    return 1;
}

// string.find(text, pattern [, start [, plain]])
int find(lua_State* L) { return search_for(L, true); }

// string.match(text, pattern [, start])
int match(lua_State* L) { return search_for(L, false); }

// The next match of gmatch; its upvalues are text, pattern and offset.
int next_match(lua_State* L) {
    const std::string_view text = text_argument(L, lua_upvalueindex(1));
    const std::string_view form = text_argument(L, lua_upvalueindex(2));
    search hunt(L, text, form);
    auto at = static_cast<std::size_t>(lua_tointeger(L, lua_upvalueindex(3)));
    for (; at <= text.size(); ++at) {
        const std::size_t end = hunt.from(at, 0);
        if (end == nowhere) continue;
        lua_pushinteger(L, static_cast<lua_Integer>(end == at ? end + 1 : end));
        lua_replace(L, lua_upvalueindex(3));
        return hunt.push_captures(at, end, true);
    }
    return 0;
}

// string.gmatch(text, pattern)
int all_matches(lua_State* L) {
    text_argument(L, 1);
    text_argument(L, 2);
    lua_settop(L, 2);
    lua_pushinteger(L, 0);
    lua_pushcclosure(L, guarded<next_match>, 3);
    return 1;
}

void append(lua_State* L, std::string& made, std::string_view piece) {
    if (made.size() + piece.size() > longest_result)
        luaL_error(L, "string.gsub: the result would be longer than 16 MiB");
    made.append(piece);
}

// Appends the text on top of the stack and takes it off.
void append_top(lua_State* L, std::string& made) {
    std::size_t length = 0;
    const char* const piece = lua_tolstring(L, -1, &length);
    append(L, made, {piece, length});
    lua_pop(L, 1);
}

// Appends what takes the place of a match: argument 3 is a text, a table or a function.
void replace(lua_State* L, const search& hunt, std::string_view text, std::size_t at,
             std::size_t end, std::string& made) {
    const std::string_view whole = text.substr(at, end - at);
    const int type = lua_type(L, 3);
    if (type == LUA_TSTRING || type == LUA_TNUMBER) {
        const std::string_view form = text_argument(L, 3);
        for (std::size_t i = 0; i < form.size(); ++i) {
            const bool escaped = form[i] == '%' && i + 1 < form.size();
            if (!escaped) {
                append(L, made, form.substr(i, 1));
            } else if (const char letter = form[++i]; letter == '0') {
                append(L, made, whole);
            } else if (std::isdigit(static_cast<unsigned char>(letter)) == 0) {
                append(L, made, form.substr(i, 1));
            } else if (letter == '1' && hunt.captures() == 0) {
                append(L, made, whole);
            } else {
                hunt.push_capture(letter - '1');
                append_top(L, made);
            }
        }
        return;
    }
    if (type == LUA_TFUNCTION) {
        lua_pushvalue(L, 3);
        lua_call(L, hunt.push_captures(at, end, true), 1);
    } else {
        if (hunt.captures() == 0)
            lua_pushlstring(L, whole.data(), whole.size());
        else
            hunt.push_capture(0);
        lua_gettable(L, 3);
    }
    if (lua_toboolean(L, -1) == 0) {
        lua_pop(L, 1);
        append(L, made, whole);
    } else if (lua_isstring(L, -1) != 0) {
        append_top(L, made);
    } else {
        luaL_error(L, "invalid replacement value (a %s)", luaL_typename(L, -1));
    }
}

// string.gsub(text, pattern, replacement [, most])
int substitute(lua_State* L) {
    const std::string_view text = text_argument(L, 1);
    std::string_view form = text_argument(L, 2);
    const int type = lua_type(L, 3);
    luaL_argcheck(
        L,
        type == LUA_TNUMBER || type == LUA_TSTRING || type == LUA_TTABLE || type == LUA_TFUNCTION,
        3, "string/function/table expected");
    const double most = luaL_optnumber(L, 4, static_cast<double>(text.size() + 1));
    const bool anchored = !form.empty() && form.front() == '^';
    search hunt(L, text, form);
    std::string made;
    std::size_t at = 0;
    int count = 0;
    while (count < most) {
        const std::size_t end = hunt.from(at, anchored ? 1 : 0);
        if (end != nowhere) {
            ++count;
            replace(L, hunt, text, at, end, made);
        }
        if (end != nowhere && end > at)
            at = end;
        else if (at < text.size())
            append(L, made, text.substr(at++, 1));
        else
            break;
        if (anchored) break;
    }
    if (at < text.size()) append(L, made, text.substr(at));
    lua_pushlstring(L, made.data(), made.size());
    lua_pushinteger(L, count);
    return 2;
}

}  // namespace

void open_patterns(lua_State* L, pattern_clock clock) {
    lua_pushlightuserdata(L, const_cast<char*>(&clock_key));
    *static_cast<pattern_clock*>(lua_newuserdata(L, sizeof clock)) = clock;
    lua_rawset(L, LUA_REGISTRYINDEX);
    add_function<find>(L, "find");
    add_function<match>(L, "match");
    add_function<all_matches>(L, "gmatch");
    add_function<substitute>(L, "gsub");
}

}  // namespace limax::host
