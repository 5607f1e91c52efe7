// guard.h: turns C++ exceptions into Lua errors; helpers for arguments and results. Every function
// that Lua calls is `guarded<body>`. Includes Lua and the standard library only.
#pragma once

#include <cstdio>
#include <exception>
#include <lua.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace limax::host {

// Longest message of an exception, bytes; a longer one is cut.
constexpr std::size_t longest_message = 8192;

// A failure that a Lua function returns as nil, a message and its kind, instead of raising it.
struct failure : std::runtime_error {
    explicit failure(const std::string& message, const char* its_kind = nullptr)
        : std::runtime_error(message), kind(its_kind) {}
    const char* kind;  // a literal, by which scripts recognise it; null: none
};

// A lua_CFunction whose C++ exceptions become Lua errors at the caller's line; a `failure` becomes
// nil, its message and kind. Lua errors pass through: LuaJIT unwinds them as foreign exceptions,
// which run destructors and which `catch (...)` would catch.
template <lua_CFunction body>
int guarded(lua_State* L) {
    char message[longest_message];
    try {
        return body(L);
    } catch (const failure& problem) {
        lua_pushnil(L);
        lua_pushstring(L, problem.what());
        lua_pushstring(L, problem.kind);
        return 3;
    } catch (const std::exception& problem) {
        std::snprintf(message, sizeof message, "%s", problem.what());
    }
    // not in the catch block: the jump would leak the exception
    return luaL_error(L, "%s", message);
}

// Adds `guarded<body>` as field `name` to the table on top of the stack.
template <lua_CFunction body>
void add_function(lua_State* L, const char* name) {
    lua_pushcfunction(L, guarded<body>);
    lua_setfield(L, -2, name);
}

// Pushes a bool, a number or a text; returns 1, the number of results.
template <class T>
int push(lua_State* L, const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
        lua_pushboolean(L, value);
    } else if constexpr (std::is_arithmetic_v<T>) {
        lua_pushnumber(L, static_cast<lua_Number>(value));
    } else {
        const std::string_view text = value;
        lua_pushlstring(L, text.data(), text.size());
    }
    return 1;
}

// Sets a field of the table on top of the stack.
template <class T>
void set(lua_State* L, const char* field, const T& value) {
    push(L, value);
    lua_setfield(L, -2, field);
}

// The text of the string at `index`, which the stack keeps alive.
inline std::string_view text_at(lua_State* L, int index) {
    std::size_t length = 0;
    const char* const text = lua_tolstring(L, index, &length);
    return {text, length};
}

// A string argument; the stack keeps it alive.
inline std::string_view text_argument(lua_State* L, int index) {
    luaL_checkstring(L, index);
    return text_at(L, index);
}

// A whole number of bytes or rows.
inline std::size_t size_argument(lua_State* L, int index, lua_Number least) {
    const lua_Number value = luaL_checknumber(L, index);
    luaL_argcheck(L, value >= least && value <= 9007199254740992.0, index, "a size");
    return static_cast<std::size_t>(value);
}

// A string argument for the system, without zero bytes.
inline const char* path_argument(lua_State* L, int index) {
    const std::string_view path = text_argument(L, index);
    luaL_argcheck(L, !path.empty(), index, "a path must not be empty");
    luaL_argcheck(L, path.find('\0') == path.npos, index, "a path must not contain a zero byte");
    return path.data();
}

}  // namespace limax::host
