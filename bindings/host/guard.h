// guard.h: turns C++ exceptions into Lua errors; helpers for arguments and fields. Every function
// that Lua calls is `guarded<body>`. Includes Lua and the standard library only.
#pragma once

#include <cstdio>
#include <exception>
#include <lua.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

namespace limax::host {

// Longest message of an exception, bytes; a longer one is cut.
constexpr std::size_t longest_message = 4096;

// A lua_CFunction whose C++ exceptions become Lua errors at the caller's line. Lua errors pass
// through: LuaJIT unwinds them as foreign exceptions, which run destructors and which `catch (...)`
// would catch.
template <lua_CFunction body>
int guarded(lua_State* L) {
    char message[longest_message];
    try {
        return body(L);
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

// Pushes nil and a message; returns their count.
inline int push_failure(lua_State* L, const std::string& message) {
    lua_pushnil(L);
    lua_pushlstring(L, message.data(), message.size());
    return 2;
}

// A string argument; the stack keeps it alive.
inline std::string_view text_argument(lua_State* L, int index) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, index, &length);
    return {text, length};
}

// Sets a field of the table on top of the stack.
inline void set_text(lua_State* L, const char* field, std::string_view text) {
    lua_pushlstring(L, text.data(), text.size());
    lua_setfield(L, -2, field);
}

// A string argument for the system, without zero bytes.
inline const char* path_argument(lua_State* L, int index) {
    std::size_t length = 0;
    const char* path = luaL_checklstring(L, index, &length);
    luaL_argcheck(L, length > 0, index, "a path must not be empty");
    luaL_argcheck(L, std::string::traits_type::length(path) == length, index,
                  "a path must not contain a zero byte");
    return path;
}

}  // namespace limax::host
