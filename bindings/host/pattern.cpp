// pattern.cpp: the patterns of Lua 5.1 for a state whose time is limited. The standard library's
// search runs in C, where no hook looks: `("a"):rep(99):find(("a-"):rep(30) .. "b")` would hold a
// process for years. This one looks at the clock on its way and bounds what gsub makes.
#include "pattern.h"

#include <cctype>
#include <string>
#include <string_view>

#include "guard.h"
#include "pattern_search.h"

namespace limax::host {
namespace {

constexpr std::size_t longest_result = std::size_t{16} << 20;  // bytes that gsub may make

const char clock_key = 0;  // its address is the registry key of the clock

pattern_clock clock_of(lua_State* L) {
    lua_pushlightuserdata(L, const_cast<char*>(&clock_key));
    lua_rawget(L, LUA_REGISTRYINDEX);
    const auto clock = *static_cast<pattern_clock*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return clock;
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
        if (at == pattern_search::nowhere) {
            lua_pushnil(L);
            return 1;
        }
        lua_pushinteger(L, static_cast<lua_Integer>(at + 1));
        lua_pushinteger(L, static_cast<lua_Integer>(at + form.size()));
        return 2;
    }
    const bool anchored = !form.empty() && form.front() == '^';
    pattern_search hunt(L, clock_of(L), text, form);
    for (std::size_t at = start; at <= text.size(); ++at) {
        const std::size_t end = hunt.from(at, anchored ? 1 : 0);
        if (end != pattern_search::nowhere) {
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
    pattern_search hunt(L, clock_of(L), text, form);
    auto at = static_cast<std::size_t>(lua_tointeger(L, lua_upvalueindex(3)));
    for (; at <= text.size(); ++at) {
        const std::size_t end = hunt.from(at, 0);
        if (end == pattern_search::nowhere) continue;
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
void replace(lua_State* L, const pattern_search& hunt, std::string_view text, std::size_t at,
             std::size_t end, std::string& made) {
    const std::string_view whole = text.substr(at, end - at);
    const int type = lua_type(L, 3);
    if (type == LUA_TSTRING || type == LUA_TNUMBER) {
        const std::string_view form = text_argument(L, 3);
        for (std::size_t i = 0; i < form.size(); ++i) {
            const bool escaped = form[i] == '%' && i + 1 < form.size();
            if (escaped) ++i;
            const char letter = form[i];
            if (!escaped || std::isdigit(static_cast<unsigned char>(letter)) == 0) {
                append(L, made, form.substr(i, 1));
            } else if (letter == '0' || (letter == '1' && hunt.captures() == 0)) {
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
    pattern_search hunt(L, clock_of(L), text, form);
    std::string made;
    std::size_t at = 0;
    int count = 0;
    while (count < most) {
        const std::size_t end = hunt.from(at, anchored ? 1 : 0);
        if (end != pattern_search::nowhere) {
            ++count;
            replace(L, hunt, text, at, end, made);
        }
        if (end != pattern_search::nowhere && end > at)
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
